# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Who may operate a valve, and the files of it that are offered."""

import asyncio
import time

import pytest

from valve_friction_ros.dashboard import Answer, DashboardOptions, ServiceRequest
from valve_friction_ros.dashboard.alarm_list import Asked, HistoryOperator, request_of
from valve_friction_ros.dashboard.context import GuardedOperator, ValveFiles
from valve_friction_ros.dashboard.history_cache import HistoryCache
from valve_friction_ros.health import AlarmAction, AlarmKind, Condition, Level, StatusSignal
from valve_friction_ros.history import (
    AlarmFilter,
    History,
    HistoryFile,
    KeptValve,
    alarm_events,
    copied,
    follow_alarms,
)


class Visit:
    """A visitor, and what was called and logged."""

    def __init__(self, name, may):
        self.who, self.may, self.called, self.logged = name, may, [], []
        self.operator = GuardedOperator(self, self, self.logged.append)

    def name(self):
        return self.who

    def may_operate(self):
        return self.may

    async def call(self, node, service):
        self.called.append((node, service))
        return Answer(True, "done")

    def press(self):
        return asyncio.run(self.operator.call("/fv\x1b_101/identifier", ServiceRequest("identify")))


def test_who_may_not_operate_calls_nothing():
    visit = Visit("bo", False)
    assert visit.press() == (False, "your account may not operate: log in with one that may")
    assert visit.called == visit.logged == []
    visit.may = True
    assert visit.press().success
    visit.may = False
    assert not visit.press().success
    assert len(visit.called) == 1


def test_who_operates_is_logged():
    visit = Visit("anna", True)
    assert visit.press() == (True, "done")
    assert visit.called == [("/fv\x1b_101/identifier", ServiceRequest("identify"))]
    assert visit.logged == ["anna calls /fv\\x1b_101/identifier/identify"]


def test_without_accounts_nobody_is_logged():
    visit = Visit("", True)
    assert visit.press().success
    assert visit.logged == []


def test_an_alarm_is_answered_in_the_file_under_the_name_of_the_account(tmp_path):
    """The record has who, when and what; a valve that the file does not keep is called."""
    file, valve = HistoryFile(tmp_path / "history.sqlite"), KeptValve("/fv_1/identifier", "FV-1")
    shown = Condition(Level.ERROR, StatusSignal.FAILURE, "excess friction")
    begin = time.time_ns()
    follow_alarms(file, valve, {AlarmKind.FRICTION_HIGH: shown}, begin)
    cache, visit = HistoryCache(file.path), Visit("anna", False)
    cache.refresh()
    guarded = GuardedOperator(HistoryOperator(cache, visit), visit, visit.logged.append)
    request = request_of(Asked(AlarmAction.ACKNOWLEDGE, "bo", "on Monday"), "friction_high")

    assert not asyncio.run(guarded.call(valve.name, request)).success
    assert len(alarm_events(file, AlarmFilter())) == 1
    visit.may = True
    answer = asyncio.run(guarded.call(valve.name, request))
    assert answer == (True, "friction high: acknowledged")
    newest = alarm_events(file, AlarmFilter())[0].event
    assert (newest.action, newest.who, newest.text) == (
        AlarmAction.ACKNOWLEDGE,
        "anna",
        "on Monday",
    )
    assert begin <= newest.time <= time.time_ns()
    assert visit.logged == ["anna calls /fv_1/identifier/acknowledge"]
    assert visit.called == []
    asyncio.run(guarded.call("/fv_2/identifier", request))
    assert [node for node, _ in visit.called] == ["/fv_2/identifier"]


def test_an_alarm_on_a_server_is_answered_there_where_no_identifier_is_heard(tmp_path, database):
    file, valve = HistoryFile(tmp_path / "history.sqlite"), KeptValve("/fv_1/identifier", "FV-1")
    shown = Condition(Level.ERROR, StatusSignal.FAILURE, "excess friction")
    follow_alarms(file, valve, {AlarmKind.FRICTION_HIGH: shown}, time.time_ns())
    copied(file.path, database)
    cache, visit = HistoryCache(database), Visit("anna", True)
    cache._refresh()
    request = request_of(Asked(AlarmAction.ACKNOWLEDGE, "bo"), "friction_high")

    asyncio.run(HistoryOperator(cache, visit).call(valve.name, request))
    assert [node for node, _ in visit.called] == [valve.name]
    answer = asyncio.run(HistoryOperator(cache).call(valve.name, request))
    assert answer == (True, "friction high: acknowledged")
    newest = alarm_events(History(database), AlarmFilter())[0].event
    assert (newest.action, newest.who) == (AlarmAction.ACKNOWLEDGE, "bo")


NAMED = "fv_101_20260921T141320Z"


@pytest.fixture
def files(tmp_path):
    for kind in ("reports", "saved", "alarms"):
        (tmp_path / kind).mkdir()
    (tmp_path / "reports" / f"{NAMED}.html").write_text("<p>")
    (tmp_path / "reports" / f"fv_101_2_{NAMED[7:]}.html").write_text("another valve's")
    bag = tmp_path / "saved" / NAMED
    bag.mkdir()
    (bag / "data.mcap").write_bytes(b"12345")
    (bag / "secret.key").write_text("no part of a bag")
    alarm = tmp_path / "alarms" / f"alarm_{NAMED}_WARN"
    alarm.mkdir()
    (alarm / "report.html").write_text("<p>")
    (tmp_path / "history.sqlite").write_text("")
    return ValveFiles.of(
        DashboardOptions(
            reports=tmp_path / "reports", bags=tmp_path / "saved", alarms=tmp_path / "alarms"
        )
    )


def test_the_files_of_a_valve(files):
    offered = {(one.kind, one.path) for one in files.offered("/fv_101")}
    assert offered == {
        ("reports", f"{NAMED}.html"),
        ("bags", f"{NAMED}/data.mcap"),
        ("alarms", f"alarm_{NAMED}_WARN/report.html"),
    }
    assert all(files.found(kind, path) for kind, path in offered)
    assert files.offered("/fv_102") == []


def test_valves_whose_files_have_the_same_names_are_named():
    others = ["/a/b", "/a_b", "/a_b/", "/a/c", "/", "/a_b"]
    assert ValveFiles.sharing("/a/b", others) == ("/a_b", "/a_b/")
    assert ValveFiles.sharing("/a/c", others) == ()


@pytest.mark.parametrize(
    "path",
    [
        "../history.sqlite",
        "/etc/passwd",
        "..",
        "",
        f"{NAMED}/secret.key",
        "a\0b",
        NAMED,
        "x" * 5000,
    ],
)
def test_nothing_else_is_found(files, path):
    for kind in ("reports", "bags", "alarms", "elsewhere", ".."):
        assert files.found(kind, path) is None


def test_a_link_does_not_lead_out(files, tmp_path):
    secret = tmp_path / "secret.html"
    secret.write_text("x")
    (tmp_path / "reports" / "fv_101_20270101T000000Z.html").symlink_to(secret)
    assert files.found("reports", "fv_101_20270101T000000Z.html") is None


def test_a_name_from_outside_is_printable(files, tmp_path):
    (tmp_path / "reports" / f"{NAMED}\x1b[31m.html").write_text("")
    assert all(one.label.isprintable() for one in files.offered("/fv_101"))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"port": 0}, "port 0"),
        ({"silence": 0.0}, "silence"),
        ({"time_zone": "Mars/Olympus"}, "time_zone"),
        ({"time_zone": "../../etc/passwd"}, "time_zone"),
    ],
)
def test_impossible_options_are_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        DashboardOptions(**changes)
