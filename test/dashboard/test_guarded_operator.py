# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Services are called for those alone who may operate at that moment."""

import asyncio
import time

from valve_friction_ros.dashboard import Answer, ServiceRequest
from valve_friction_ros.dashboard.alarm_list import Asked, HistoryOperator, request_of
from valve_friction_ros.dashboard.context import GuardedOperator
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
