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
from valve_friction_ros.dashboard.context import DashboardContext, ValveFiles
from valve_friction_ros.dashboard.history_cache import HistoryCache
from valve_friction_ros.health import (
    AlarmAction,
    AlarmKind,
    AlarmRequest,
    Condition,
    Level,
    StatusSignal,
)
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
    """A visitor, known as in NiceGUI in the page's own task, and what was called and logged."""

    def __init__(self, name, may, history=None, is_live=True):
        self.who, self.may, self.called, self.logged = name, may, [], []
        services = self.serve if is_live else None
        self.context = DashboardContext(None, None, history, self, self.logged.append, services)

    def run(self, coroutine):
        async def page():
            self.task = asyncio.current_task()
            return await coroutine

        return asyncio.run(page())

    def name(self):
        return self.who if self.task is asyncio.current_task() else ""

    def may_operate(self):
        return self.may and self.task is asyncio.current_task()

    async def serve(self, node, request):
        self.called.append((node, request))
        return Answer(True, "done")

    def press(self):
        return self.run(self.context.call("/fv\x1b_101/identifier", "identify"))

    def acknowledge(self, node, text=""):
        request = AlarmRequest(AlarmAction.ACKNOWLEDGE, "bo", text)
        return self.run(self.context.answer_alarm(node, AlarmKind.FRICTION_HIGH, request))


def test_who_may_not_operate_calls_nothing():
    visit = Visit("bo", False)
    assert visit.press() == (False, "your account may only view: log in with one that may operate")
    assert visit.called == visit.logged == []
    visit.may = True
    assert visit.press().success
    visit.may = False
    assert not visit.press().success
    assert len(visit.called) == 1


@pytest.mark.parametrize(
    ("name", "logged"), [("anna", ["anna calls /fv\\x1b_101/identifier/identify"]), ("", [])]
)
def test_who_operates_with_an_account_is_logged(name, logged):
    visit = Visit(name, True)
    assert visit.press() == (True, "done")
    assert visit.called == [("/fv\x1b_101/identifier", ServiceRequest("identify"))]
    assert visit.logged == logged


@pytest.fixture
def file(tmp_path):
    """A history with one alarm."""
    made = HistoryFile(tmp_path / "history.sqlite")
    shown = Condition(Level.ERROR, StatusSignal.FAILURE, "excess friction")
    follow_alarms(made, VALVE, {AlarmKind.FRICTION_HIGH: shown}, time.time_ns())
    return made


VALVE = KeptValve("/fv_1/identifier", "FV-1")
STRANGER = "/fv_2/identifier"


def test_an_alarm_is_answered_in_the_file_under_the_name_of_the_account(file):
    """The record has who, when and what; a valve that the file does not keep is called."""
    begin, cache = time.time_ns(), HistoryCache(file.path)
    cache.refresh()
    visit = Visit("anna", False, cache)

    assert not visit.acknowledge(VALVE.name, "on Monday").success
    assert len(alarm_events(file, AlarmFilter())) == 1
    visit.may = True
    answer = visit.acknowledge(VALVE.name, "on Monday")
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
    visit.acknowledge(STRANGER, "on Monday")
    values = {"alarm_kind": "friction_high", "alarm_who": "anna", "alarm_text": "on Monday"}
    assert visit.called == [(STRANGER, ServiceRequest("acknowledge", values))]


def test_all_alarms_of_a_valve_are_taken_out_of_service_for_some_hours():
    visit = Visit("", True, HistoryCache(None))
    request = AlarmRequest(AlarmAction.TAKE_OUT, "bo", duration=2.5 * 3600)
    visit.run(visit.context.answer_alarm(VALVE.name, None, request))
    values = {"alarm_kind": "all", "alarm_who": "bo", "alarm_text": "", "alarm_hours": 2.5}
    assert visit.called == [(VALVE.name, ServiceRequest("out_of_service", values, True))]


def test_an_alarm_on_a_server_is_answered_there_where_no_identifier_is_heard(file, database):
    copied(file.path, database)
    cache = HistoryCache(database)
    cache._refresh()
    live, kept = Visit("", True, cache), Visit("", True, cache, is_live=False)

    live.acknowledge(VALVE.name)
    assert [node for node, _ in live.called] == [VALVE.name]
    assert kept.acknowledge(STRANGER) == (False, f"{STRANGER}: the history has no such valve")
    assert not kept.press().success
    assert kept.acknowledge(VALVE.name) == (True, "friction high: acknowledged")
    newest = alarm_events(History(database), AlarmFilter())[0].event
    assert (newest.action, newest.who) == (AlarmAction.ACKNOWLEDGE, "bo")


@pytest.mark.parametrize("is_file", [True, False])
def test_many_alarms_are_answered_at_once(file, is_file):
    """In the file, or where it is elsewhere, by the identifiers."""
    cache = HistoryCache(file.path if is_file else None)
    visit = Visit("anna", False, cache)
    alarms = [(VALVE, AlarmKind.FRICTION_HIGH), (VALVE, AlarmKind.FRICTION_LOW)]
    request = AlarmRequest(AlarmAction.ACKNOWLEDGE, "bo")

    def answer():
        return visit.run(visit.context.answer_alarms(alarms, request))

    assert not answer().success
    visit.may = True
    assert answer() == (True, "1 of 2 alarms acknowledged" if is_file else "2 done")
    whos = [request.values["alarm_who"] for _, request in visit.called]
    assert whos == ([] if is_file else ["anna"] * 2)
    assert visit.logged == ["anna calls acknowledge for 2 alarms"]
    assert (alarm_events(file, AlarmFilter())[0].event.who == "anna") == is_file


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


def test_a_report_is_found_by_the_path_that_its_identifier_names(files):
    assert files.report(f"/elsewhere/reports/{NAMED}.html") == f"/files/reports/{NAMED}.html"
    assert files.report(f"/elsewhere/{NAMED}_2.html") is None
    assert files.report("../secret") is None


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
        ({"time_zone": "Mars/Olympus"}, "time_zone"),
        ({"time_zone": "../../etc/passwd"}, "time_zone"),
    ],
)
def test_impossible_options_are_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        DashboardOptions(**changes)
