# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Alarms and baselines over DDS: their life, their answers, and that they outlive a killed node."""

import contextlib
import math
import re
import sqlite3
import time

import pytest
from histories import OTHER, START, VALVE, success
from live_nodes import ERROR, NODE, OK, WARN, values_of
from records import quick_record
from std_msgs.msg import Float64
from std_srvs.srv import SetBool
from webhook_server import Receiver

from valve_friction_ros.health import AlarmAction, AlarmKind, AlarmRequest, Baseline, Level
from valve_friction_ros.history import (
    HistoryFile,
    KeptBaseline,
    alarm_events,
    read_alarms,
    request_many,
)
from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION
from valve_friction_ros.settings import ALARM_KINDS
from valve_friction_ros.wording import utc_second

TAKEN = " (by the identification of 2023-11-14 22:13 UTC)"
"""What `~/set_baseline` says it took: the stamps of the tests begin at 1.7e9 s."""
HEALTHY, TIGHT = quick_record(), quick_record(HIGH_FRICTION)
OLD, NEW = (Baseline.of(identify(record, BENCH_VALVE)) for record in (HEALTHY, TIGHT))
USAGE = (  # of which a kill may cost the last minute
    "travelled_distance [m]",
    "travelled_distance in all [m]",
    "reversals",
    "reversals in all",
    "strokes",
    "breakaways",
    "time_watched [s]",
    "time_watched in all [s]",
    "time_near_seat [s]",
    "travel_histogram [s]",
)
AGE = re.compile(r" \(identified \d+ (s|min) ago, before the restart\)")


def test_an_alarm_outlives_a_kill(live):
    node = live.start_identifier()
    client = live.client
    client.set_baseline(HEALTHY)
    client.identified(TIGHT)
    before = state(client, "friction_high", "unacknowledged")
    assert before.level == ERROR
    node = live.restart()
    after = client.next_status()
    assert after.level == ERROR
    (line,) = (one for one in node.errors.splitlines() if "baseline Coulomb friction 152.7" in one)
    assert "from the history" in line
    assert client.parameters(NODE, "baseline_coulomb_friction") == [OLD.coulomb_friction]
    assert AGE.sub("", after.message) == before.message
    assert AGE.search(after.message)
    old, new = values_of(before), values_of(after)
    assert new["estimate_from"] == "before the restart"
    assert float(new["estimate_age [s]"]) > 0
    changing = {"estimate_from", "estimate_age [s]", *USAGE}
    same = [
        key
        for key in new
        if key in old and key not in changing and not key.startswith(("buffered_", "samples_"))
    ]
    assert {key: new[key] for key in same} == {key: old[key] for key in same}
    shown = {"NE 107", "friction_ratio", "friction_ratio low", "coulomb_friction [N]", "fit [%]"}
    assert shown <= set(same)
    ratio = client.latched(Float64, f"{NODE}/friction/friction_ratio").data
    assert ratio == pytest.approx(float(old["friction_ratio"]), rel=1e-8)

    assert not client.trigger("set_baseline").success
    assert not client.trigger("identify").success
    status = client.next_status(lambda one: "refused" in one.message, "a refusal")
    assert status.level == ERROR
    assert AGE.search(status.message)
    client.identified(HEALTHY)
    status = client.statuses[-1][1]
    assert status.level == OK
    assert "before the restart" not in status.message
    assert values_of(status)["estimate_from"] == "this run"


@pytest.mark.parametrize("gone", ["removed", "replaced"])
def test_a_history_that_goes_while_the_node_runs_costs_no_baseline(live, history, gone):
    node = live.start_identifier()
    client = live.client
    client.set_baseline(HEALTHY)
    kept = history.baseline(VALVE.name)
    if gone == "removed":
        for one in history.path.parent.glob("history.sqlite*"):
            one.unlink()
    else:
        other = HistoryFile(history.path.with_name("other"))
        other.add(success(START, valve=OTHER))
        other.path.rename(history.path)
    client.identified(TIGHT)
    assert client.statuses[-1][1].level == ERROR
    client.wait_until(lambda: "baseline in force is stored again" in node.errors, "a warning")
    again = history.baseline(VALVE.name)
    assert (again.baseline, again.time) == (kept.baseline, kept.time)


@pytest.mark.slow
def test_two_nodes_of_one_valve_are_told(live):
    live.start_identifier()
    first = live.nodes[-1]
    live.start_identifier()
    told = "another node writes the history of /fv_101/identifier"
    status = live.client.next_status(lambda one: told in one.message, "the second node")
    assert status.level == WARN
    assert values_of(status)["NE 107"] == "M"
    live.kill(first)
    seen = len(live.client.statuses)
    live.client.wait_until(
        lambda: any(one.level == OK for _, one in live.client.statuses[seen:]), "one node"
    )


@pytest.mark.parametrize(
    "damage", ["identification SET level = 'high'", "baseline SET half_width = 'x'"]
)
def test_rows_that_cannot_be_read_stop_no_node(live, history, damage):
    history.add(success())
    history.set_baseline(VALVE, KeptBaseline(Baseline(100.0), START, START))
    connection = sqlite3.connect(history.path)
    connection.executescript(f"PRAGMA ignore_check_constraints = ON; UPDATE {damage}")
    connection.close()
    live.start_identifier()
    status = live.client.next_status()
    assert status.level == WARN
    assert f"{history.path}: a row holds no result: " in status.message
    live.client.identified(HEALTHY)


def test_a_node_without_a_history_says_so_and_keeps_nothing(live, history):
    client = live.client_of_identifier({"history_file": "''"})
    told = client.status_values()["history"]
    assert told == (
        "none, because history_file is empty: diagnosis and baseline are lost when this node stops"
    )
    client.identified(HEALTHY)
    assert client.trigger("set_baseline").message == (f"baseline: {OLD}; previous: none{TAKEN}")
    assert client.last_values()["friction_ratio"] == "1"
    assert client.trigger("restore_baseline").message == f"baseline: none; previous: {OLD}"
    client.next_status(lambda one: "no baseline yet" in one.message, "no baseline")
    assert math.isnan(*client.parameters(NODE, "baseline_coulomb_friction"))
    assert not history.path.exists()


def test_the_baseline_is_guarded_and_restored(live, history):
    client = live.client_of_identifier()
    assert client.refusal("restore_baseline").startswith("there is no ~/set_baseline to undo")
    client.identified(HEALTHY)
    assert client.trigger("set_baseline").message == (f"baseline: {OLD}; previous: none{TAKEN}")
    client.identified(TIGHT)
    for service in ("set_baseline", "restore_baseline"):
        refused = client.refusal(service)
        assert refused.startswith("the valve is in ERROR, which a new baseline could hide")
        assert "if the valve is healthy, set baseline_in_alarm to true" in refused
    told = client.status_values()
    assert (told["baseline_possible"], told["baseline_lacks valve"]) == ("false", "HEALTH")
    assert told["friction_ratio"] != "1"
    assert len(history.baselines(VALVE.name)) == 1

    assert client.set_together(NODE, {"baseline_in_alarm": True}).successful
    assert client.success("set_baseline") == f"baseline: {NEW}; previous: {OLD}{TAKEN}"
    assert client.next_status().level == OK
    live.restart()  # by its default again
    assert client.next_status().level == OK
    assert client.success("restore_baseline") == f"baseline: {OLD}; previous: {NEW}"
    status = client.next_status()
    assert status.level == ERROR
    assert "excess friction" in status.message
    assert client.parameters(NODE, "baseline_coulomb_friction") == [OLD.coulomb_friction]
    first, second, third = history.baselines(VALVE.name)
    assert (first.in_force, first.replaced, first.level) == (OLD, None, Level.OK)
    assert (second.in_force, second.replaced, second.level) == (NEW, OLD, Level.ERROR)
    assert (third.in_force, third.replaced, third.level) == (OLD, NEW, Level.OK)
    assert [one.by for one in (first, second, third)] == [*["set_baseline"] * 2, "restore_baseline"]
    kept = history.baseline(VALVE.name)
    assert kept.since == first.since < second.since
    assert kept.record is not None
    assert client.refusal("restore_baseline").startswith("there is no ~/set_baseline to undo")


def test_a_baseline_of_the_parameter_is_replaced_and_comes_back(live, history):
    client = live.client_of_identifier({"baseline_coulomb_friction": 140.0})
    client.identified(HEALTHY)
    given = Baseline(140.0)
    assert client.trigger("set_baseline").message == (f"baseline: {OLD}; previous: {given}{TAKEN}")
    assert client.set_together(NODE, {"baseline_coulomb_friction": 145.0}).successful
    refused = client.refusal("restore_baseline")
    assert "is no longer in force: set baseline_coulomb_friction" in refused
    given = Baseline(145.0)
    assert client.success("set_baseline") == f"baseline: {OLD}; previous: {given}{TAKEN}"
    assert client.success("restore_baseline") == f"baseline: {given}; previous: {OLD}"
    assert history.baseline(VALVE.name).baseline == given


KNOWN = {"baseline_coulomb_friction": OLD.coulomb_friction}


def state(client, kind, expected):
    return client.next_status(
        lambda one: values_of(one).get(f"alarm {kind}") == expected, f"{kind} {expected}"
    )


def ask(client, service, who="A. Operator", text="", hours=8.0, kind="all"):
    given = {"alarm_who": who, "alarm_text": text, "alarm_hours": hours, "alarm_kind": kind}
    assert all(one.successful for one in client.set_parameters(NODE, given))
    if service != "out_of_service":
        return client.trigger(service)
    return client.call(SetBool, f"{NODE}/out_of_service", SetBool.Request(data=True))


def test_settings_name_the_alarms():
    assert tuple(one.value for one in AlarmKind) == ALARM_KINDS


def require_logged(live, words):
    """What the valve shows must not read as the comment of a person."""
    log = live.nodes[-1]
    live.client.wait_until(lambda: f"alarm friction high {words}" in log.errors, words)


@pytest.mark.slow
def test_a_life_of_an_alarm(live, history):
    client = live.client_of_identifier(KNOWN)
    assert values_of(client.next_status())["alarm friction_high"] == "normal"
    refused = ask(client, "acknowledge")
    assert (refused.success, refused.message) == (
        False,
        "no alarm can be acknowledged now: all alarms of the valve are normal",
    )
    client.identified(TIGHT)
    raised = values_of(state(client, "friction_high", "unacknowledged"))
    assert raised["alarm friction_high level"] == "ERROR"
    assert raised["alarm friction_high message"].startswith("excess friction")
    refused = client.refusal("acknowledge")
    assert refused == "the parameter alarm_who is empty: set it to your name"
    answer = ask(client, "acknowledge", text="repack on Monday")
    assert (answer.success, answer.message) == (True, "friction high: acknowledged")
    require_logged(live, "acknowledged by A. Operator, comment: repack on Monday")
    live.restart(KNOWN)
    state(client, "friction_high", "acknowledged")
    answer = ask(client, "shelve", hours=2.0, kind="friction_high")
    assert answer.message.startswith("friction high: shelved until 20")
    require_logged(live, "shelved by A. Operator, condition: excess friction")
    shelved = values_of(state(client, "friction_high", "shelved"))
    assert shelved["alarm friction_high level"] == "ERROR"
    assert shelved["alarm friction_high until [time]"].startswith("20")
    assert not ask(client, "shelve", hours=721.0).success
    assert ask(client, "unshelve").success
    state(client, "friction_high", "unacknowledged")
    assert ask(client, "out_of_service", hours=100.0).success
    state(client, "data_quality", "out of service")
    client.identified(HEALTHY)
    back = client.call(SetBool, f"{NODE}/out_of_service", SetBool.Request(data=False))
    assert not back.success, "nobody has said who"
    client.set_parameters(NODE, {"alarm_who": "B. Fitter"})
    assert client.call(SetBool, f"{NODE}/out_of_service", SetBool.Request(data=False)).success
    state(client, "friction_high", "normal")

    events = [one.event for one in reversed(alarm_events(history))]
    friction = [one for one in events if one.alarm.kind is AlarmKind.FRICTION_HIGH]
    assert [one.action for one in friction] == [
        AlarmAction.RAISE,
        AlarmAction.ACKNOWLEDGE,
        AlarmAction.SHELVE,
        AlarmAction.UNSHELVE,
        AlarmAction.TAKE_OUT,
        AlarmAction.CLEAR,
        AlarmAction.PUT_BACK,
    ]
    assert [one.who for one in friction][1:4] == ["A. Operator"] * 3
    assert friction[1].text == "repack on Monday"
    assert friction[-1].who == "B. Fitter"


def test_nobody_is_alerted_while_an_alarm_is_shelved(live):
    with Receiver() as receiver:
        client = live.client_of_identifier(
            {**KNOWN, "webhook_url": receiver.url, "webhook_period": 0.0}
        )
        client.identified(TIGHT)
        client.wait_until(lambda: len(receiver.requests) == 1, "an alert")
        assert ask(client, "shelve").success
        client.wait_until(lambda: len(receiver.requests) == 2, "that it is shelved")
        client.identified(HEALTHY)
        client.identified(TIGHT)
        client.next_status()
        client.next_status()
        assert len(receiver.requests) == 2
        assert ask(client, "unshelve").success
        client.wait_until(lambda: len(receiver.requests) == 3, "that it is back")
        client.watched.clear()
        assert [(one["new_level"], one["alarms"]) for one in receiver.bodies] == [
            ("ERROR", {"friction_high": "unacknowledged"}),
            ("OK", {"friction_high": "shelved"}),
            ("ERROR", {"friction_high": "unacknowledged"}),
        ]


def test_an_alarm_is_published_once_it_is_on_record(live, history):
    """A kill between the two would take back what was published."""
    client = live.client_of_identifier(KNOWN | {"error_ratio": 99.0, "warn_ratio": 98.0})
    client.identified(TIGHT)
    with contextlib.closing(sqlite3.connect(history.path, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        client.set_parameters(NODE, {"warn_ratio": 1.25})
        status = client.next_status(lambda one: one.level == WARN, "the level")
        assert values_of(status)["alarm friction_high"] == "normal"
        assert not read_alarms(history, NODE)
    published = values_of(state(client, "friction_high", "unacknowledged"))
    raised = read_alarms(history, NODE)[AlarmKind.FRICTION_HIGH].raised
    assert published["alarm friction_high raised [time]"] == utc_second(raised)


def test_what_another_process_keeps_is_seen(live, history):
    """The dashboard acknowledges many alarms at once, in the file."""
    client = live.client_of_identifier(KNOWN)
    client.identified(TIGHT)
    state(client, "friction_high", "unacknowledged")
    (valve,) = history.valves()
    request = AlarmRequest(AlarmAction.ACKNOWLEDGE, "A. Operator", "all at once")
    asked = [(valve, AlarmKind.FRICTION_HIGH)]
    assert request_many(history, asked, request, time.time_ns()) == 1
    state(client, "friction_high", "acknowledged")
    client.identified(HEALTHY)
    state(client, "friction_high", "normal")
    client.wait_until(
        lambda: read_alarms(history, valve.name)[AlarmKind.FRICTION_HIGH].state.name == "NORMAL",
        "the end in the file",
    )
