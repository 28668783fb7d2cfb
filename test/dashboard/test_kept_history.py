# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The history as the pages read it, and the charts of it."""

import json
import math
import sqlite3
import threading
from contextlib import closing
from zoneinfo import ZoneInfo

import pytest
from histories import DAY, OTHER, SECOND, START, VALVE, refused, success

from valve_friction_ros.dashboard.charts import trend_chart
from valve_friction_ros.dashboard.history_cache import HistoryCache, KeptValves
from valve_friction_ros.dashboard.live_state import Plant, Quantity, Status, Unread, ValveView
from valve_friction_ros.dashboard.plant_rows import compared, side_of_entry, side_of_view
from valve_friction_ros.health import (
    AlarmAction,
    AlarmKind,
    AlarmRequest,
    AlarmState,
    Baseline,
    Condition,
    Level,
    StatusSignal,
)
from valve_friction_ros.history import (
    HistoryFile,
    KeptBaseline,
    alarm_events,
    copied,
    follow_alarms,
    history_mark,
    keep_usage,
    read_alarms,
    request_alarms,
)
from valve_friction_ros.history.copying import PARTS, rows_of, write_rows
from valve_friction_ros.history.database import reading, writing
from valve_friction_ros.history.rows import valve_id
from valve_friction_ros.usage import Usage, UsedDay

NOW = START + 40 * DAY
BASELINE = Baseline(150.0, 3.0)


@pytest.fixture(autouse=True)
def now(monkeypatch):
    monkeypatch.setattr("time.time_ns", lambda: NOW)


@pytest.fixture
def file(tmp_path):
    made = HistoryFile(tmp_path / "history.sqlite")
    made.set_baseline(VALVE, KeptBaseline(BASELINE, START, START))
    for day in range(30):
        made.add(success(START + day * DAY, 150.0 + day, baseline=BASELINE))
    made.add(refused(START + 31 * DAY, baseline=BASELINE))
    return made


@pytest.fixture
def kept(file):
    """The history, as read once."""
    made = HistoryCache(file.path)
    assert made.refresh()
    return made


def test_it_is_read_again_when_it_has_changed(file, kept):
    assert not kept.refresh()
    assert kept.valves == (VALVE,)
    before = kept.spark(VALVE.name)
    assert len(kept.valve(VALVE.name).entries) == 31
    file.add(success(START + 32 * DAY, 300.0, baseline=BASELINE))
    file.add(success(START + 32 * DAY, 100.0, valve=OTHER))
    assert kept.refresh()
    assert kept.spark(VALVE.name) != before
    assert len(kept.valve(VALVE.name).entries) == 32
    assert kept.spark(OTHER.name) is None  # without a baseline there is no ratio
    assert {one.name for one in kept.valves} == {VALVE.name, OTHER.name}


def test_a_valve_that_is_not_heard_shows_its_last_state_in_the_history(file, kept):
    """The refused record after it changes nothing; the first message replaces it."""
    plant = Plant(5.0)
    plant.expect(kept.last.values())
    (valve,) = plant.valves(0.0)
    assert (valve.view.tag, valve.view.identified) == (VALVE.tag, START + 29 * DAY)
    assert (valve.view.friction.value, valve.view.friction.half_width) == (179.0, 3.0)
    assert valve.view.sentence == kept.valve(VALVE.name).entries[29].diagnosis.message
    assert plant.valve(VALVE.name, 0.0).view == valve.view
    file.add(success(START + 32 * DAY, 300.0, baseline=BASELINE))
    assert kept.refresh()
    plant.expect(kept.last.values())
    (newer,) = plant.valves(0.0)
    assert newer.view.friction.value == 300.0
    assert newer.revision > valve.revision
    heard = Status(f"{VALVE.name}: friction", 0, "FV-101", "now", {})
    plant.hear(Unread(heard.name, lambda: heard), 1.0)
    plant.expect(kept.last.values())
    assert plant.valves(1.0)[0].view.sentence == "now"


def test_a_server_is_asked_and_not_waited_for(file, database, postgres, monkeypatch):
    monkeypatch.setattr("valve_friction_ros.dashboard.history_cache._SERVER_PAUSE", 0.0)

    def refreshed(condition):
        for _ in range(600):
            kept.refresh()
            if condition():
                return True
            threading.Event().wait(0.05)
        return False

    copied(file.path, database)
    kept = HistoryCache(database)
    assert not kept.refresh()
    assert refreshed(lambda: kept.valves == (VALVE,))
    before = kept.spark(VALVE.name)
    assert before is not None
    assert len(kept.valve(VALVE.name).entries) == 31
    file.add(success(START + 32 * DAY, 300.0, baseline=BASELINE))
    file.add(success(START + 32 * DAY, 100.0, valve=OTHER))
    copied(file.path, database)
    assert refreshed(lambda: OTHER in kept.valves)
    assert kept.spark(VALVE.name) != before
    assert len(kept.valve(VALVE.name).entries) == 32
    postgres.stop()
    try:
        assert refreshed(lambda: kept.problem)
        assert str(database) in kept.problem
    finally:
        postgres.start()
    assert refreshed(lambda: kept.problem is None)
    assert OTHER in kept.valves


def test_a_row_that_is_written_before_and_arrives_after_another_is_seen(database, tmp_path):
    """Of two who write to a server, the one that has begun first may end last."""
    files = [HistoryFile(tmp_path / f"{k}.sqlite") for k in range(3)]
    for k, file in enumerate(files):
        valve = VALVE._replace(name=f"/fv_{k}/identifier")
        file.add(success(START + k * DAY, 150.0, valve=valve, baseline=BASELINE))
        file.add(success(START + k * DAY + 1, 150.0, valve=valve, baseline=BASELINE))
    copied(files[0].path, database)
    kept = HistoryCache(database)
    kept._refresh()
    with writing(database) as early:
        with reading(files[1].path) as source:
            (part, *_) = PARTS
            of_valve = part.c.valve_id == 1
            rows = [(valve_id(early, VALVE), row) for _, row in rows_of(source, part, of_valve)]
        write_rows(early, part, rows)
        copied(files[2].path, database)
        kept._refresh()
        found = {name: len(some) for name, some in kept._ratios.items()}
        assert found == {"/fv_0/identifier": 2, "/fv_2/identifier": 2}
        kept._refresh()
    kept._refresh()
    found = {name: len(some) for name, some in kept._ratios.items()}
    assert found == {"/fv_0/identifier": 2, "/fv_2/identifier": 2, VALVE.name: 2}
    revision = kept.revision
    kept._refresh()
    assert kept.revision == revision
    assert not kept._rows


def test_another_file_at_the_path_is_read_from_its_beginning(file, kept, tmp_path):
    other = HistoryFile(tmp_path / "other.sqlite")
    other.set_baseline(OTHER, KeptBaseline(BASELINE, START, START))
    for day in range(3):
        other.add(success(START + day * DAY, 150.0, baseline=BASELINE, valve=OTHER))
    for ending in ("-wal", "-shm"):
        file.path.with_name(file.path.name + ending).unlink(missing_ok=True)
    other.path.replace(file.path)
    assert kept.refresh()
    assert kept.valves == (OTHER,)
    assert kept.spark(OTHER.name) is not None
    assert kept.spark(VALVE.name) is None


def test_what_is_written_often_draws_nothing_anew(file, kept):
    mark, revision = history_mark(file), kept.revision
    keep_usage(file, VALVE, "run", [UsedDay(20_000, 0, Usage(1.0, 2, 3, (4,) * 20))])
    assert history_mark(file) == mark
    assert not kept.refresh()
    assert kept.revision == revision


def test_a_file_that_is_missing_or_broken_is_a_problem_and_heals(tmp_path, file):
    path = tmp_path / "later.sqlite"
    kept = HistoryCache(path)
    assert kept.refresh()
    assert "no such file" in kept.problem
    path.write_bytes(b"not a database, but long enough to be looked at" * 40)
    kept.refresh()
    assert "not a database" in kept.problem
    path.write_bytes(file.path.read_bytes())
    assert kept.refresh()
    assert kept.problem is None
    assert kept.spark(VALVE.name).days == 29


def test_without_a_file_nothing_is_kept():
    kept = HistoryCache(None)
    assert not kept.refresh()
    assert kept.valve(VALVE.name) is None
    assert "no history_file" in kept.problem


def test_without_an_identifier_an_alarm_comes_back_when_its_shelving_ends(file, monkeypatch):
    high = AlarmKind.FRICTION_HIGH
    shown = Condition(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has grown")
    follow_alarms(file, VALVE, {high: shown}, NOW)
    request_alarms(file, VALVE, high, AlarmRequest(AlarmAction.SHELVE, "A", "", 60.0), NOW)
    plant = Plant(math.inf)
    kept = KeptValves(file.path, plant)
    for later, state in ((59, "shelved"), (60, "unacknowledged"), (99, "unacknowledged")):
        monkeypatch.setattr("time.time_ns", lambda later=later: NOW + later * SECOND)
        kept.refresh()
        kept.refresh()
        (heard,) = plant.valves(1e9)
        assert [one.state.value for one in heard.view.alarms] == [state]
    (newest, *_) = alarm_events(file)
    assert (newest.event.action, newest.event.time) == (AlarmAction.EXPIRE, NOW + 60 * SECOND)


def test_shelving_ends_on_time_once_the_identifier_is_silent(file, monkeypatch):
    """A running identifier may live in simulated time, so it ends its shelvings itself."""
    high, running = AlarmKind.FRICTION_HIGH, {VALVE.name}
    shown = Condition(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has grown")
    follow_alarms(file, VALVE, {high: shown}, NOW)
    request_alarms(file, VALVE, high, AlarmRequest(AlarmAction.SHELVE, "A", "", 60.0), NOW)
    kept = HistoryCache(file.path, running.__contains__)
    monkeypatch.setattr("time.time_ns", lambda: NOW + 60 * SECOND)
    kept.refresh()
    kept.refresh()
    assert read_alarms(file, VALVE.name)[high].state is AlarmState.SHELVED
    running.clear()
    kept.refresh()
    assert read_alarms(file, VALVE.name)[high].state is AlarmState.UNACKNOWLEDGED


def test_it_is_read_while_another_process_writes(file):
    with closing(sqlite3.connect(file.path, isolation_level=None)) as writer:
        writer.execute("BEGIN IMMEDIATE")
        writer.execute("UPDATE valve SET tag = 'half-way'")
        kept = HistoryCache(file.path)
        kept.refresh()
        assert kept.valves == (VALVE,)
        writer.execute("ROLLBACK")


def series(chart, name):
    return next(one for one in chart["series"] if one["name"] == name)


def test_the_chart_shows_what_the_figure_shows(kept):
    history = kept.valve(VALVE.name)
    chart = trend_chart(history, ZoneInfo("UTC"), NOW)
    json.dumps(chart, allow_nan=False)  # what goes to the browser
    points = series(chart, "identified")["data"]
    assert points[0] == [START // 1_000_000, 150.0]
    assert [y for _, y in points] == [150.0 + day for day in range(30)]
    low, high, pause = series(chart, "95 % interval")["data"][:3]
    assert (low[1], high[1], pause[1]) == (147.0, 153.0, None)
    assert {y for _, y in series(chart, "baseline")["data"]} == {150.0}
    warn = history.entries[0].limits.warn_ratio
    assert {y for _, y in series(chart, "worth maintenance")["data"]} == {150.0 * warn}
    assert len(series(chart, "refused")["data"]) == 1
    (time, level), trend = series(chart, "limit expected")["data"][0], history.trend
    assert (time, level) == (trend.crossing.time // 1_000_000, pytest.approx(trend.crossing.level))
    middle = series(chart, "trend")["data"]
    assert middle[0][1] == pytest.approx(trend.line.at(0.0), rel=1e-5)


def test_the_time_axis_is_the_clock_of_the_zone(kept):
    chart = trend_chart(kept.valve(VALVE.name), ZoneInfo("Asia/Kolkata"), NOW)
    assert series(chart, "identified")["data"][0][0] == START // 1_000_000 + 5.5 * 3600 * 1000


def test_two_identifications_side_by_side(file):
    first, *_, last = (one for one in file.entries() if not one.refusal)
    rows = {one.name: one for one in compared(side_of_entry(first), side_of_entry(last))}
    friction = rows["coulomb_friction"]
    assert friction.ratio == pytest.approx(179 / 150)
    assert friction.half_width == pytest.approx(179 / 150 * math.hypot(3 / 150, 3 / 179))
    assert friction.verdict == "differs"
    assert rows["mass"].verdict == ""  # it was given on both sides
    assert rows["static_friction"].ratio_words == "–"


def test_what_one_side_lacks_is_open():
    one = ValveView("/a/identifier", "A", parameters=(Quantity("mass", 2.0, 0.1, "kg"),))
    other = ValveView("/b/identifier", "B", parameters=(Quantity("spring_constant", 0.0, 0.1),))
    mass, spring = compared(side_of_view(one), side_of_view(other))
    assert math.isnan(mass.ratio)
    assert math.isnan(spring.ratio)
    friction = Quantity("coulomb_friction", 600.0, 900.0, "N", "not identifiable")
    open_ = ValveView("/a/identifier", "A", parameters=(friction,))
    (row,) = compared(side_of_view(open_), side_of_view(open_))
    assert (row.ratio_words, row.verdict) == ("–", "")
    same = compared(side_of_view(one), side_of_view(one))[0]
    assert (same.ratio, same.verdict) == (1.0, "no difference seen")
