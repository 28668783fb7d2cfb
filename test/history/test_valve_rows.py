# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Moves, answers and usage of valves as rows of a history."""

import math
from dataclasses import replace
from functools import partial
from pathlib import Path

import full_history
import pytest
from full_history import BUILT, service_move, usage
from histories import DAY, OTHER, SECOND, START, VALVE, change, select, success

from valve_friction_ros.evidence import FrictionChange
from valve_friction_ros.health import Level, Reference, SlidingFriction
from valve_friction_ros.history import (
    AlarmRecording,
    HistoryError,
    HistoryFile,
    alarm_recordings,
    keep_alarm_recording,
    keep_answers,
    keep_change,
    keep_moves,
    keep_reference,
    keep_renewal,
    keep_told_level,
    keep_usage,
    read_answers,
    read_change,
    read_moves,
    read_reference,
    read_told_level,
    read_usage,
    service_rows,
    valve_histories,
)
from valve_friction_ros.model import Valve
from valve_friction_ros.response import summarised
from valve_friction_ros.usage import Usage, UsedDay

TRAVEL = 0.02


answer = partial(full_history.answer, at_stop=False)


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


def test_a_history_shows_those_of_its_time(history):
    history.add(success())
    keep_answers(history, VALVE, TRAVEL, [answer(-10, 0.5), answer(10, 0.75)])
    (found,) = valve_histories(history, (VALVE,), START, START + DAY)
    assert found.response == summarised([answer(10, 0.75)])
    told = found.response.to_dict()
    assert (told["moves"], told["ignored"], told["dead_time"]["median"]) == (1, 0, 0.75)
    assert told["steady_error"]["number"] == 1
    assert told["largest_ignored"] == 0.0


def move(number, start=START):
    one = service_move(number)
    return replace(one, begin=one.begin + start - START, end=one.end + start - START)


def kept(history, built=BUILT, valve=VALVE):
    return [one.force for one in read_moves(history, valve.name, built)]


def test_what_goes_in_comes_out(history):
    moves = tuple(map(move, range(4)))
    keep_moves(history, VALVE, BUILT, moves)
    found = read_moves(history, VALVE.name, BUILT)
    assert found[1::2] == moves[1::2]
    assert [math.isnan(one.onset_force) for one in found] == [True, False, True, False]
    assert replace(found[0], onset_force=0.0) != found[1]
    assert kept(history, valve=OTHER) == []


def test_twice_is_once_and_nothing_is_nothing(history):
    for _ in range(2):
        keep_moves(history, VALVE, BUILT, list(map(move, range(3))))
    keep_moves(history, VALVE, BUILT, [])
    assert kept(history) == [500.0, 501.0, 502.0]


def test_their_number_is_bounded(history, monkeypatch):
    monkeypatch.setattr(service_rows, "MOST_MOVES", 5)
    keep_moves(history, OTHER, BUILT, [move(0)])
    for number in range(9):
        keep_moves(history, VALVE, BUILT, [move(number)])
    assert kept(history) == [504.0, 505.0, 506.0, 507.0, 508.0]
    assert kept(history, valve=OTHER) == [500.0]


def test_their_age_is_bounded(history):
    keep_moves(history, VALVE, BUILT, [move(0), move(1, START + DAY)])
    keep_moves(history, VALVE, BUILT, [move(2, START + 3 * DAY)], days=2.5)
    assert kept(history) == [501.0, 502.0]


@pytest.mark.parametrize("start", [SECOND, START + 70 * 365 * DAY])
def test_one_wrong_stamp_costs_no_kept_move(history, start):
    keep_moves(history, VALVE, BUILT, list(map(move, range(40))), days=10_000.0)
    keep_moves(history, VALVE, BUILT, [move(99, start)], days=10_000.0)
    keep_moves(history, VALVE, BUILT, [move(40)], days=10_000.0)
    assert len(kept(history)) >= 41


FIRST, LATER = (Reference(SlidingFriction(one, 9.0, 1e-3), START) for one in (300.0, 450.0))


def test_the_first_reference_stays(history):
    for one in (FIRST, LATER):
        keep_reference(history, VALVE, BUILT, one)
    assert read_reference(history, VALVE.name, BUILT) == FIRST
    assert read_reference(history, OTHER.name, BUILT) is None


def test_another_actuator_has_another_reference(history):
    larger = replace(BUILT, diaphragm_area=0.05)
    keep_reference(history, VALVE, BUILT, FIRST)
    assert read_reference(history, VALVE.name, larger) is None
    keep_reference(history, VALVE, larger, LATER)
    assert read_reference(history, VALVE.name, larger) == LATER
    assert read_reference(history, VALVE.name, replace(larger, travel=0.05)) == LATER


GROWN, DOUBLED = (
    FrictionChange(START, START + DAY, one, 0.9 * one, 1.1 * one) for one in (1.3, 2.0)
)


def test_the_last_change_stays(history):
    for valve, one in ((VALVE, GROWN), (OTHER, GROWN), (VALVE, DOUBLED)):
        keep_change(history, valve, BUILT, one)
    assert read_change(history, VALVE.name, BUILT) == DOUBLED
    assert read_change(history, OTHER.name, BUILT) == GROWN
    assert read_change(history, VALVE.name, replace(BUILT, diaphragm_area=0.05)) is None


def in_service(history, valve):
    readers = (read_moves, read_reference, read_change)
    found = [read(history, valve.name, BUILT) for read in readers]
    return [*map(repr, found), repr(read_answers(history, valve.name))]


def test_a_new_packing_begins_anew(history):
    for valve in (VALVE, OTHER):
        full_history.fill(history, valve)
    before = in_service(history, OTHER)
    keep_renewal(history, VALVE, START + DAY)
    assert in_service(history, VALVE) == ["()", "None", "None", "()"]
    assert in_service(history, OTHER) == before
    keep_moves(history, VALVE, BUILT, [move(1)])
    keep_reference(history, VALVE, BUILT, LATER)
    assert kept(history) == [501.0]
    assert read_reference(history, VALVE.name, BUILT) == LATER


def test_a_table_that_a_file_of_version_6_lacks(history):
    """A change of its development: some of its files have the table, some have not."""
    history.prepare()
    change(history, "DROP TABLE evidence_change; DROP TABLE answer; PRAGMA user_version = 6")
    assert read_change(history, VALVE.name, BUILT) is None
    assert read_answers(history, VALVE.name) == ()
    keep_renewal(history, VALVE, START)
    keep_change(history, VALVE, BUILT, GROWN)
    keep_answers(history, VALVE, TRAVEL, [answer(1)])
    assert read_change(history, VALVE.name, BUILT) == GROWN
    assert read_answers(history, VALVE.name) == (answer(1),)


@pytest.mark.parametrize("changes", [{"diaphragm_area": 0.05}, {"pressure_reference": 0.0}])
def test_forces_of_another_actuator_are_not_read(history, changes):
    keep_moves(history, VALVE, BUILT, [move(0)])
    assert kept(history, replace(BUILT, **changes)) == []
    assert kept(history, replace(BUILT, travel=0.05)) == [500.0]


def test_a_machine_without_a_diaphragm(history):
    driven = Valve()
    keep_moves(history, VALVE, driven, [move(0)])
    assert kept(history, driven) == [500.0]


TODAY = START // DAY


def test_a_day_is_kept_as_often_as_one_likes(history):
    first, later = UsedDay(TODAY, 0, usage(1.0)), UsedDay(TODAY, 0, usage(2.5, 7))
    for day in (first, first, later, later):
        keep_usage(history, VALVE, "run 1", [day])
    found = read_usage(history, VALVE.name)
    assert found.days == (later,)
    assert found.total == found.since_renewal == later.usage
    assert read_usage(history, OTHER.name).days == ()


def test_runs_of_a_day_add_up(history):
    """Also where they have counted samples of the same stamps."""
    for run in ("run 1", "run 2"):
        keep_usage(history, VALVE, run, [UsedDay(TODAY, 0, usage(1.0))])
    keep_usage(history, OTHER, "run 1", [UsedDay(TODAY, 0, usage(9.0))])
    (day,) = read_usage(history, VALVE.name).days
    assert day == UsedDay(TODAY, 0, usage(2.0, 8, 4, 2))


def test_a_renewal_parts_a_day(history):
    old = [UsedDay(TODAY - 1, 0, usage(1.0)), UsedDay(TODAY, 0, usage(2.0))]
    keep_usage(history, VALVE, "run 1", old)
    for _ in range(2):
        keep_renewal(history, VALVE, START)
    assert read_usage(history, VALVE.name).since_renewal == Usage()
    keep_usage(history, VALVE, "run 1", [UsedDay(TODAY, START, usage(0.25))])
    found = read_usage(history, VALVE.name)
    assert found.renewal == START
    assert found.since_renewal == usage(0.25)
    assert found.total == usage(3.25, 12, 6, 3)


def rows(history):
    return select(history, "SELECT day, run FROM usage ORDER BY day, run")


def test_runs_of_finished_days_become_one(history):
    """A node that restarts again and again: the sums stay, and old rows do not grow."""
    for n in range(12):
        keep_usage(history, VALVE, f"run {n}", [UsedDay(TODAY + n // 3, 0, usage(1.0))])
    assert [day for day, run in rows(history) if run == ""] == [TODAY, TODAY + 1]
    assert len(rows(history)) == 1 + 1 + 3 + 3
    days = tuple(UsedDay(TODAY + n, 0, usage(3.0, 12, 6, 3)) for n in range(4))
    assert read_usage(history, VALVE.name).days == days
    keep_renewal(history, VALVE, START)
    keep_usage(history, OTHER, "run", [UsedDay(TODAY, 0, usage(1.0))])
    keep_usage(history, VALVE, "late", [UsedDay(TODAY, 0, usage(2.0))])
    for run in ("late", "later"):
        keep_usage(history, VALVE, run, [UsedDay(TODAY + 9, START, usage(1.0))])
    found = read_usage(history, VALVE.name)
    assert found.days[0].usage == usage(5.0, 16, 8, 4)
    assert found.total == usage(16.0, 60, 30, 15)
    assert found.since_renewal == usage(2.0, 8, 4, 2)
    assert read_usage(history, OTHER.name).total == usage(1.0)


def test_the_run_that_writes_keeps_its_days(history):
    """It may write a day anew that is long over: where the file could not be written."""
    for run in ("old", "older"):
        keep_usage(history, VALVE, run, [UsedDay(TODAY, 0, usage(1.0))])
    for distance in (3.0, 4.0):
        days = [UsedDay(TODAY, 0, usage(distance)), UsedDay(TODAY + 9, 0, usage(1.0))]
        keep_usage(history, VALVE, "run", days)
    assert rows(history) == [(TODAY, ""), (TODAY, "run"), (TODAY + 9, "run")]
    assert read_usage(history, VALVE.name).days[0].usage == usage(6.0, 12, 6, 3)


def test_what_cannot_be_added_up_stays(history):
    for run in ("old", "older"):
        keep_usage(history, VALVE, run, [UsedDay(TODAY, 0, usage(1.0))])
    change(history, "UPDATE usage SET histogram_ns = '[1]' WHERE run = 'old'")
    keep_usage(history, VALVE, "run", [UsedDay(TODAY + 9, 0, usage(1.0))])
    assert rows(history) == [(TODAY, "old"), (TODAY, "older"), (TODAY + 9, "run")]


def test_it_outlives_the_identifications(history):
    keep_usage(history, VALVE, "run", [UsedDay(TODAY - 4000, 0, usage(1.0))])
    history.add(success(), days=1.0)
    assert read_usage(history, VALVE.name).total == usage(1.0)


def test_alarm_recordings(history):
    alarms = [
        AlarmRecording(START + n, Level(1 + n), Path(f"/alarms/{n}"), "excess") for n in (0, 1)
    ]
    for one in reversed((*alarms, alarms[0])):
        keep_alarm_recording(history, VALVE, one)
    assert alarm_recordings(history, VALVE.name) == tuple(alarms)
    assert alarm_recordings(history, OTHER.name) == ()
    history.add(success())
    (found,) = valve_histories(history, (VALVE,), 0, START + 1)
    assert found.alarms == (alarms[0],)
    assert alarms[0].to_dict()["level"] == "WARN"


def test_the_told_level_is_the_last(history):
    keep_told_level(history, VALVE, Level.ERROR)
    keep_told_level(history, VALVE, Level.WARN)
    assert read_told_level(history, VALVE.name) == Level.WARN
    assert read_told_level(history, OTHER.name) is None


def test_old_alarm_recordings_are_forgotten(history):
    for day, valve in ((0, VALVE), (0, OTHER), (2, VALVE), (3, VALVE)):
        one = AlarmRecording(START + day * DAY, Level.WARN, Path(f"/alarms/{day}"), "excess")
        keep_alarm_recording(history, valve, one, days=2.0)
    found = alarm_recordings(history, VALVE.name)
    assert [one.time for one in found] == [START + 2 * DAY, START + 3 * DAY]
    assert len(alarm_recordings(history, OTHER.name)) == 1


@pytest.mark.parametrize(
    ("spoilt", "read"),
    [
        ("usage SET histogram_ns = '[1]'", read_usage),
        ("usage SET reversals = 'many'", read_usage),
        ("alarm_recording SET level = 7", alarm_recordings),
        ("told_level SET level = 7", read_told_level),
        ("answer SET dead_time = 'soon'", read_answers),
        ("move SET force = 'much'", partial(read_moves, built=BUILT)),
    ],
)
def test_rows_that_hold_nothing(history, spoilt, read):
    full_history.fill(history)
    change(history, f"UPDATE {spoilt}")
    with pytest.raises(HistoryError, match="a row holds no"):
        read(history, VALVE.name)
