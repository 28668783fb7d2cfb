# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Answers of the stem to its command in the history: kept once, in order, bounded."""

import math
import sqlite3
from contextlib import closing
from dataclasses import fields, replace

import pytest
from histories import DAY, OTHER, SECOND, START, VALVE, make_version_5, success

from valve_friction_ros.history import (
    HistoryError,
    HistoryFile,
    keep_answers,
    keep_renewal,
    read_answers,
    valve_histories,
)
from valve_friction_ros.response import StepAnswer, summarised

TRAVEL = 0.02


def answer(place, dead_time=0.25, **changes):
    flags = {one.name: True for one in fields(StepAnswer) if one.type in (bool, "bool")}
    numbers = {one.name: 0.125 for one in fields(StepAnswer) if one.name not in flags}
    own = {"stamp": START + place * SECOND, "dead_time": dead_time, "at_stop": False}
    return replace(StepAnswer(**numbers, **flags), **{**own, **changes})


@pytest.fixture
def history(tmp_path):
    return HistoryFile(tmp_path / "history.sqlite")


def test_they_come_back_whole_and_in_order(history):
    ignored = answer(2, math.nan, t63=math.nan, moved=False, settled=False)
    moves = [answer(1), ignored, answer(0)]  # the clock went back
    for _ in range(2):
        keep_answers(history, VALVE, TRAVEL, moves)
    found = read_answers(history, VALVE.name)
    assert repr(found) == repr(tuple(moves))  # nan is not itself
    assert read_answers(history, OTHER.name) == ()
    assert read_answers(history, VALVE.name, 2 * TRAVEL) == ()
    keep_answers(history, VALVE, 2 * TRAVEL, [answer(9)])
    assert read_answers(history, VALVE.name) == (answer(9),)
    assert len(read_answers(history, VALVE.name, TRAVEL)) == 3


def test_they_are_bounded(history):
    keep_answers(history, VALVE, TRAVEL, [answer(place) for place in range(2100)])
    found = read_answers(history, VALVE.name)
    assert [found[0], found[-1]] == [answer(100), answer(2099)]
    keep_answers(history, VALVE, TRAVEL, [answer(DAY // SECOND + 2000)], days=1.0)
    assert len(read_answers(history, VALVE.name)) == 2099 - 2000 + 1 + 1


def test_a_stamp_of_the_future_drops_none(history):
    keep_answers(history, VALVE, TRAVEL, [answer(0)])
    keep_answers(history, VALVE, TRAVEL, [answer(0, stamp=2**62)], days=3650.0)
    assert len(read_answers(history, VALVE.name)) == 2


def test_a_new_packing_answers_anew(history):
    keep_answers(history, VALVE, TRAVEL, [answer(0)])
    keep_answers(history, OTHER, TRAVEL, [answer(0)])
    keep_renewal(history, VALVE, START)
    assert read_answers(history, VALVE.name) == ()
    assert read_answers(history, OTHER.name) == (answer(0),)


def test_a_history_shows_those_of_its_time(history):
    history.add(success())
    keep_answers(history, VALVE, TRAVEL, [answer(-10, 0.5), answer(10, 0.75)])
    (found,) = valve_histories(history, (VALVE,), START, START + DAY)
    assert found.response == summarised([answer(10, 0.75)])
    told = found.response.to_dict()
    assert (told["moves"], told["ignored"], told["dead_time"]["median"]) == (1, 0, 0.75)
    assert told["steady_error"]["number"] == 1
    assert told["largest_ignored"] == 0.0


def test_an_older_file_and_one_without_the_table(tmp_path):
    for name, make in (("old", make_version_5), ("without", _without_the_table)):
        history = HistoryFile(tmp_path / f"{name}.sqlite")
        history.prepare()
        make(history)
        assert read_answers(history, VALVE.name) == ()
        keep_renewal(history, VALVE, START)
        keep_answers(history, VALVE, TRAVEL, [answer(1)])
        assert read_answers(history, VALVE.name) == (answer(1),)


def _without_the_table(history):
    with closing(sqlite3.connect(history.path)) as connection:
        connection.execute("DROP TABLE answer")
        connection.execute("PRAGMA user_version = 6")


def test_a_row_that_holds_none_is_told(history):
    keep_answers(history, VALVE, TRAVEL, [answer(1)])
    with closing(sqlite3.connect(history.path)) as connection:
        connection.execute("UPDATE answer SET dead_time = 'soon'")
        connection.commit()
    with pytest.raises(HistoryError, match="a row holds no"):
        read_answers(history, VALVE.name)
