# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Alarms in the history: each step a row, whatever ends in between; listed and filtered."""

import csv
import io
import signal
from concurrent.futures import ThreadPoolExecutor

import pytest
from full_history import all_of
from histories import DAY, OTHER, SECOND, START, VALVE, make_version, select
from writers import writer

from valve_friction_ros.health import (
    AlarmAction,
    AlarmError,
    AlarmKind,
    AlarmRequest,
    AlarmState,
    Condition,
    Level,
    StatusSignal,
)
from valve_friction_ros.health.alarms import TRANSITIONS
from valve_friction_ros.history import (
    AlarmFeed,
    AlarmFilter,
    History,
    HistoryFile,
    KeptValve,
    alarm_events,
    alarms_as_csv,
    copied,
    follow_alarms,
    read_alarms,
    request_alarms,
    request_many,
    tables,
)
from valve_friction_ros.history.database import writing
from valve_friction_ros.history.outbox import count_unsent, follow
from valve_friction_ros.history.rows import valve_id
from valve_friction_ros.history.tables import put

HIGH, DATA = AlarmKind.FRICTION_HIGH, AlarmKind.DATA_QUALITY
WARN = Condition(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has grown")
FAULT = Condition(Level.WARN, StatusSignal.CHECK_FUNCTION, "no sample of the stem")
ACKNOWLEDGED = AlarmRequest(AlarmAction.ACKNOWLEDGE, "A. Operator", "seen with MÜLLER")


@pytest.fixture
def history(tmp_path):
    return HistoryFile(tmp_path / "history.sqlite")


def test_what_goes_in_comes_out(history):
    assert [one.action for one in follow_alarms(history, VALVE, {HIGH: WARN}, START).events] == [
        AlarmAction.RAISE
    ]
    (event,) = request_alarms(history, VALVE, None, ACKNOWLEDGED, START + SECOND).events
    assert read_alarms(history, VALVE.name) == {HIGH: event.alarm}
    assert alarm_events(history)[0].event == event
    assert event.alarm.state is AlarmState.ACKNOWLEDGED
    assert not follow_alarms(history, VALVE, {HIGH: WARN}, START + 2 * SECOND).events
    assert read_alarms(history, OTHER.name) == {}


def test_a_refused_request_leaves_no_row(history):
    with pytest.raises(AlarmError, match="no alarm can be acknowledged now: all alarms"):
        request_alarms(history, VALVE, None, ACKNOWLEDGED, START)
    follow_alarms(history, VALVE, {HIGH: WARN}, START)
    request_alarms(history, VALVE, HIGH, ACKNOWLEDGED, START)
    with pytest.raises(AlarmError, match="friction high: acknowledged and cannot be acknowledged"):
        request_alarms(history, VALVE, HIGH, ACKNOWLEDGED, START)
    assert len(alarm_events(history)) == 2


def test_old_events_go_and_the_alarm_stays(history):
    follow_alarms(history, VALVE, {HIGH: WARN}, START)
    follow_alarms(history, VALVE, {DATA: FAULT}, START)
    follow_alarms(history, VALVE, {DATA: Condition()}, START + 99 * DAY, days=10.0)
    assert [one.event.alarm.kind for one in alarm_events(history)] == [DATA, HIGH]
    assert read_alarms(history, VALVE.name)[HIGH].state is AlarmState.UNACKNOWLEDGED


@pytest.mark.parametrize("step", range(10))
def test_a_process_killed_within_a_step_has_made_all_before_it_and_not_it(history, step):
    history.prepare()
    with writer("alarms", history.path, "A. Operator", step) as process:
        told, _ = process.communicate(timeout=300)
    assert (process.returncode, len(told.splitlines())) == (-signal.SIGKILL, step)
    events = [one.event for one in reversed(alarm_events(history))]
    assert [one.time for one in events] == [START + SECOND * k for k in range(step)]
    alarms = read_alarms(history, VALVE.name)
    assert alarms.get(HIGH) == (events[-1].alarm if events else None)
    assert select(history, "PRAGMA integrity_check") == [("ok",)]


def test_two_processes_make_one_chain_and_lose_no_step(history):
    """Both do the same to one alarm; one of them is killed in the midst of it."""
    both = [writer("alarms", history.path, name) for name in ("A", "B")]
    finished = {"A": 0, "B": 0}
    try:
        for name, process in zip("AB", both, strict=True):
            told = [process.stdout.readline() for _ in range(40)]
            finished[name] = sum(not one.startswith("valve") for one in told)
        for name, process in zip("AB", both, strict=True):
            process.kill()
            rest = process.stdout.read().split("\n")[:-1]
            finished[name] += sum(not one.startswith("valve") for one in rest)
    finally:
        for process in both:
            process.kill()
            process.wait()
            process.stdout.close()
    rows = select(history, "SELECT state_before, action, state, who FROM alarm_event ORDER BY id")
    state = AlarmState.NORMAL
    for before, action, after, _ in rows:
        assert AlarmState[before] is state
        assert TRANSITIONS[state, AlarmAction[action]] in (None, AlarmState[after])
        state = AlarmState[after]
    for name, count in finished.items():
        kept = sum(who == name for *_, who in rows)
        assert kept in (count, count + 1), "at most the one under way besides what was told"


def test_a_followed_file_of_version_8_opens_and_sends_alarms(tmp_path):
    history = make_version(8, HistoryFile(tmp_path / "history.sqlite"))
    before = all_of(history)
    assert len(history.entries()) == 6
    assert read_alarms(history, VALVE.name) == {}
    assert alarm_events(history, is_standing=True) == ()
    follow_alarms(history, VALVE, {HIGH: WARN}, START)
    assert count_unsent(history.path).waiting == 0
    follow(history.path)
    assert count_unsent(history.path).waiting == 1, "what came before it was followed"
    follow_alarms(history, VALVE, {DATA: FAULT}, START)
    follow(history.path)
    assert count_unsent(history.path).waiting == 2
    assert [one for one in all_of(history) if one not in before] != []


# Lists


def fill_many(place, valves, count):
    """Write events of valves, as `follow_alarms` does, in one transaction."""
    kinds, states, number = [*AlarmKind], [*AlarmState], len(valves)
    with writing(place) as connection:
        ids = [valve_id(connection, one) for one in valves]
        rows = []
        for k in range(count):
            state = states[k % 6] if count > number else AlarmState.UNACKNOWLEDGED
            level = int(state in (AlarmState.UNACKNOWLEDGED, AlarmState.ACKNOWLEDGED))
            rows.append(
                {
                    "valve_id": ids[k % number],
                    "uid": f"{k}",
                    "time_ns": START + k * 60 * SECOND,
                    "kind": kinds[k // number % 6].value,
                    "action": "RAISE",
                    "state_before": "NORMAL",
                    "state": state.name,
                    "level": level,
                    "status_signal": "M" if level else "",
                    "message": f"friction has grown by {k % 100} %",
                    "raised_ns": START,
                    "until_ns": START + DAY if state.is_suppressed else None,
                    "who": "A. Operator" if k % 7 == 0 else "",
                    "text": "",
                }
            )
        put(connection, tables.alarm_event, rows)


PLANT = [KeptValve(f"/area_{k % 10}/fv_{k}/identifier", f"FV-{k}") for k in range(500)]


def test_of_ten_thousand_events_those_stand_that_are_the_last_and_not_normal(history):
    fill_many(history.path, PLANT, 10_000)
    everything = alarm_events(history)
    assert len(everything) == 10_000
    last = {(one.valve, one.event.alarm.kind): one for one in reversed(everything)}
    assert {*alarm_events(history, is_standing=True)} == {
        one for one in last.values() if one.event.alarm.state is not AlarmState.NORMAL
    }


@pytest.mark.parametrize(
    ("chosen", "count"),
    [
        (AlarmFilter(), 3),
        (AlarmFilter(area="/area_2"), 1),
        (AlarmFilter(area="/area"), 0),
        (AlarmFilter(area="/area__"), 0),
        (AlarmFilter(valve=VALVE.name), 2),
        (AlarmFilter(kinds=frozenset({DATA})), 1),
        (AlarmFilter(states=frozenset({AlarmState.ACKNOWLEDGED})), 1),
        (AlarmFilter(since=START + SECOND), 1),
        (AlarmFilter(words="operator seen"), 1),
        (AlarmFilter(words="100%"), 0),
        (AlarmFilter(words="lv-7"), 1),
        (AlarmFilter(words="müller"), 1),
    ],
)
def test_a_filter_keeps_what_it_says(history, chosen, count):
    follow_alarms(history, VALVE, {HIGH: WARN}, START)
    follow_alarms(history, OTHER, {DATA: FAULT}, START)
    request_alarms(history, VALVE, HIGH, ACKNOWLEDGED, START + SECOND)
    assert len(alarm_events(history, chosen)) == count


def test_the_csv_has_a_line_for_each_event_and_no_formula(history):
    follow_alarms(history, VALVE, {HIGH: WARN._replace(message="=1+1, it says")}, START)
    shelving = AlarmRequest(AlarmAction.SHELVE, "B", "until\u2028Monday".replace("\u2028", " "), 60)
    request_alarms(history, VALVE, HIGH, shelving, START + SECOND)
    rows = [*csv.DictReader(io.StringIO(alarms_as_csv(alarm_events(history))))]
    assert [row["event"] for row in rows] == ["shelved", "raised"]
    assert rows[0]["until"] == "2026-09-21T14:14:21Z"
    assert rows[1]["message"] == "'=1+1, it says"
    assert rows[0]["area"] == "/"


@pytest.mark.parametrize(
    ("name", "area"),
    [("/plant/unit_3/fv_101/identifier", "/plant/unit_3"), ("/fv_101/identifier", "/")],
)
def test_the_area_is_what_the_namespace_lies_in(history, name, area):
    follow_alarms(history, KeptValve(name, ""), {HIGH: WARN}, START)
    assert alarm_events(history)[0].area == area


def test_a_server_has_the_same(history, database):
    follow_alarms(history, VALVE, {HIGH: WARN}, START)
    request_alarms(history, VALVE, HIGH, ACKNOWLEDGED, START + SECOND)
    copied(history.path, database)
    assert alarm_events(History(database)) == alarm_events(history)
    standing = alarm_events(History(database), is_standing=True)
    assert standing == alarm_events(history, is_standing=True)
    found = alarm_events(History(database), AlarmFilter(words="OPERATOR", area="/"))
    assert len(found) == 1


def test_alarms_on_a_server_are_answered_once_unless_a_file_keeps_them(history, database):
    """Of two who answer at once, one makes each step; a copy of what a file keeps has none."""
    asked = [(KeptValve(f"/fv_{k}/identifier", f"FV-{k}"), HIGH) for k in range(40)]
    for valve, _ in asked:
        follow_alarms(history, valve, {HIGH: WARN}, START)
    copied(history.path, database)
    server, (kept, _) = History(database), asked[0]
    with writing(database) as connection:
        put(connection, tables.keeper, [{"valve_id": valve_id(connection, kept), "file": "x@y"}])
    with ThreadPoolExecutor(2) as pool:
        both = [
            pool.submit(request_many, server, some, ACKNOWLEDGED, START + SECOND)
            for some in (asked, asked[::-1])
        ]
        assert sum(one.result() for one in both) == 39
    answered = [one for one in alarm_events(server) if one.event.who]
    assert len({one.valve for one in answered}) == len(answered) == 39
    with pytest.raises(AlarmError, match="a file keeps the alarms of /fv_0/identifier"):
        request_alarms(server, kept, HIGH, ACKNOWLEDGED, START + SECOND)
    (event,) = request_alarms(
        server, asked[1][0], None, AlarmRequest(AlarmAction.COMMENT, "B", "repacked"), START + DAY
    ).events
    assert alarm_events(server)[0].event == event
    assert read_alarms(server, kept.name)[HIGH].state is AlarmState.UNACKNOWLEDGED


def test_five_hundred_are_acknowledged_at_once_and_their_nodes_learn_it(history):
    valves = PLANT
    fill_many(history.path, valves, len(valves))
    feed = AlarmFeed(history.path)
    feed.look()
    asked = [(one, HIGH) for one in valves]
    count = request_many(history, asked, ACKNOWLEDGED, START + SECOND)
    assert count == 500
    assert request_many(history, asked, ACKNOWLEDGED, START + SECOND) == 0
    assert feed.take(valves[0].name) == {}
    feed.look()
    news = feed.take(valves[7].name)
    assert news == read_alarms(history, valves[7].name)
    assert news[HIGH].state is AlarmState.ACKNOWLEDGED
    assert feed.take(valves[7].name) == {}
