# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Copies of a history: complete, resumed, compared, from each version of the schema."""

import math
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from full_history import all_of, fill
from histories import OTHER, START, VALVE, make_version_5, success
from hypothesis import given, settings
from hypothesis import strategies as st

from valve_friction_ros.health import Level
from valve_friction_ros.history import (
    History,
    HistoryError,
    HistoryFile,
    copied,
    copying,
    keep_told_level,
    read_told_level,
)

HERE = Path(__file__).parent


@pytest.fixture
def history(tmp_path):
    history = HistoryFile(tmp_path / "history.sqlite")
    fill(history)
    fill(history, OTHER)
    return history


@pytest.fixture(params=["file", "server"])
def other(request, tmp_path):
    """A place for a copy."""
    if request.param == "file":
        return tmp_path / "folder" / "copy.sqlite"
    return request.getfixturevalue("database")


def is_same(parts):
    return all(one.is_same for one in parts)


def test_there_and_back_is_the_same(history, other, tmp_path):
    there = copied(history.path, other)
    assert {one.table: one.rows for one in there} == {
        "identification": 6,
        "baseline": 4,
        "packing_renewal": 2,
        "usage": 6,
        "alarm_recording": 2,
        "told_level": 2,
        "alarm_event": 4,
        "move": 8,
        "evidence_reference": 2,
        "evidence_change": 2,
        "answer": 6,
    }
    assert [one.rows for one in there] == [one.written for one in there]
    back = copied(other, tmp_path / "back.sqlite")
    assert is_same(there)
    assert is_same(back)
    assert [one.checksum for one in there] == [one.copied for one in back]
    assert (
        all_of(HistoryFile(tmp_path / "back.sqlite")) == all_of(History(other)) == all_of(history)
    )
    assert [one.written for one in copied(history.path, other)] == [0] * 11


def test_one_valve_alone(history, other):
    parts = copied(history.path, other, [OTHER.name])
    assert History(other).valves() == (OTHER,)
    assert {one.table: one.rows for one in parts}["identification"] == 3
    copied(history.path, other)
    assert all_of(History(other)) == all_of(history)


def test_rows_from_elsewhere_stay(history, other, tmp_path):
    """Two machines that keep one valve by mistake, also at the same instant, lose nothing."""
    second = HistoryFile(tmp_path / "second.sqlite")
    second.add(success(START, 222.0))
    assert is_same(copied(history.path, other))
    assert is_same(copied(second.path, other))
    assert is_same(copied(history.path, other))
    found = [one.values.get("coulomb_friction") for one in History(other).entries([VALVE.name])]
    assert sorted(filter(None, found)) == [150.0, 150.123456789, 222.0]


def test_a_row_that_changes_is_written_again(history, other):
    copied(history.path, other)
    keep_told_level(history, VALVE, Level.WARN)
    parts = copied(history.path, other)
    assert {one.table: one.written for one in parts if one.written} == {"told_level": 1}
    assert read_told_level(History(other), VALVE.name) is Level.WARN
    assert read_told_level(History(other), OTHER.name) is Level.ERROR


def test_a_row_that_was_changed_there_is_told(history, tmp_path):
    """What is kept is never changed; so a copy that differs is said to."""
    target = tmp_path / "copy.sqlite"
    copied(history.path, target)
    with closing(sqlite3.connect(target)) as connection:
        connection.execute("UPDATE parameter SET value = 1.0 WHERE value = 150.123456789")
        connection.commit()
    parts = {one.table: one for one in copied(history.path, target)}
    assert (parts["identification"].rows, parts["identification"].same) == (6, 4)
    assert [name for name, one in parts.items() if not one.is_same] == ["identification"]


def test_ends_that_cannot_be(history, tmp_path):
    with pytest.raises(HistoryError, match="both ends"):
        copied(history.path, history.path)
    with pytest.raises(HistoryError, match="there is no such file"):
        copied(tmp_path / "none.sqlite", history.path)


@pytest.mark.parametrize("version", [2, 6, 7])
def test_a_file_of_an_older_version_is_copied_and_stays_as_it_is(version, other, tmp_path):
    path = tmp_path / "old.sqlite"
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript((HERE / f"history_of_version_{version}.sql").read_text())
    content = path.read_bytes()
    old = all_of(HistoryFile(path))
    assert is_same(copied(path, other))
    assert all_of(History(other)) == old
    assert [one.written for one in copied(path, other)] == [0] * 11
    assert path.read_bytes() == content
    HistoryFile(path).add(success(START + 99))  # which changes its tables, and not its keys
    parts = copied(path, other)
    assert {one.table: one.written for one in parts if one.written} == {"identification": 1}
    assert is_same(parts)


def test_a_file_of_version_5_is_copied(history, other):
    make_version_5(history)
    old = all_of(history)
    assert is_same(copied(history.path, other))
    assert all_of(History(other)) == old


class KilledError(Exception):
    """Ends a copy between two of its transactions."""


def test_a_copy_that_ends_early_goes_on(history, other, monkeypatch):
    monkeypatch.setattr(copying, "_MANY", 7)
    for number in range(40):
        history.add(success(START + 100 + number))

    def end(count):
        if count >= 14:
            raise KilledError

    runs = 0
    while True:
        runs += 1
        assert runs < 20
        try:
            parts = copied(history.path, other, tell=end)
        except KilledError:
            continue
        break
    assert runs > 3
    assert is_same(parts)
    assert all_of(History(other)) == all_of(history)


_TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
_NUMBERS = st.floats(allow_nan=True, allow_infinity=True)


@settings(max_examples=25)
@given(st.lists(st.tuples(_TEXTS, _NUMBERS, _NUMBERS), min_size=1, max_size=4))
def test_any_value_arrives(postgres, tmp_path_factory, rows):
    from valve_friction_ros.health import Measured
    from valve_friction_ros.history import HistoryServer

    file = HistoryFile(tmp_path_factory.mktemp("any") / "history.sqlite")
    for number, (text, value, width) in enumerate(rows):
        is_number = not math.isnan(value + width)
        kept = {"lag": Measured(value, width)} if is_number else {}
        entry = success(START + number, warnings=(text,), numbers=kept)
        file.add(entry)
    server = HistoryServer(postgres.url(_any_database(postgres)))
    assert is_same(copied(file.path, server))


def _any_database(postgres, made={}):  # noqa: B006 - one for all examples
    if postgres not in made:
        made[postgres] = postgres.database()
    return made[postgres]
