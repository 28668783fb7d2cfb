# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Usage and alarm recordings in the history: kept once, in all and since the renewal."""

import sqlite3
from pathlib import Path

import pytest
from histories import DAY, OTHER, START, VALVE, make_version_5, success

from valve_friction_ros.health import Level
from valve_friction_ros.history import (
    AlarmRecording,
    HistoryError,
    HistoryFile,
    alarm_recordings,
    keep_alarm_recording,
    keep_renewal,
    keep_told_level,
    keep_usage,
    read_told_level,
    read_usage,
    tables,
    valve_histories,
)
from valve_friction_ros.usage import BINS, Usage, UsedDay

TODAY = START // DAY


def usage(distance, reversals=4, breakaways=2, hours=1):
    return Usage(distance, reversals, breakaways, (hours * 3600 * 10**9, *[0] * (BINS - 1)))


@pytest.fixture
def history(tmp_path):
    return HistoryFile(tmp_path / "history.sqlite")


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
    connection = sqlite3.connect(history.path)
    found = connection.execute("SELECT day, run FROM usage ORDER BY day, run").fetchall()
    connection.close()
    return found


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
    connection = sqlite3.connect(history.path)
    connection.executescript("UPDATE usage SET histogram_ns = '[1]' WHERE run = 'old'")
    connection.close()
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


def version(history):
    connection = sqlite3.connect(history.path)
    (number,) = connection.execute("PRAGMA user_version").fetchone()
    connection.close()
    return number


def test_a_file_of_version_5_is_read_and_extended(history):
    history.add(success())
    make_version_5(history)
    assert read_usage(history, VALVE.name).days == ()
    assert alarm_recordings(history, VALVE.name) == ()
    assert read_told_level(history, VALVE.name) is None
    assert len(valve_histories(history, (VALVE,), 0, START + 1)) == 1
    assert version(history) == 5
    keep_usage(history, VALVE, "run", [UsedDay(TODAY, 0, usage(1.0))])
    assert version(history) == tables.SCHEMA_VERSION
    assert read_usage(history, VALVE.name).total == usage(1.0)
    assert len(history.entries()) == 1


@pytest.mark.parametrize(
    ("change", "read"),
    [
        ("usage SET histogram_ns = '[1]'", read_usage),
        ("usage SET reversals = 'many'", read_usage),
        ("alarm_recording SET level = 7", alarm_recordings),
        ("told_level SET level = 7", read_told_level),
    ],
)
def test_rows_that_hold_nothing(history, change, read):
    keep_usage(history, VALVE, "run", [UsedDay(TODAY, 0, usage(1.0))])
    keep_alarm_recording(history, VALVE, AlarmRecording(START, Level.WARN, Path("/a"), "x"))
    keep_told_level(history, VALVE, Level.WARN)
    connection = sqlite3.connect(history.path)
    connection.executescript(f"PRAGMA ignore_check_constraints = ON; UPDATE {change}")
    connection.close()
    with pytest.raises(HistoryError, match="a row holds no"):
        read(history, VALVE.name)
