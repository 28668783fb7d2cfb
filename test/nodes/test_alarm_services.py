# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The life of an alarm over DDS: raised, acknowledged, shelved, out of service, through a kill."""

import time

from live_nodes import NAMESPACE, values_of
from records import quick_record
from std_srvs.srv import SetBool
from webhook_server import Receiver

from valve_friction_ros.health import AlarmAction, AlarmKind, AlarmRequest, Baseline
from valve_friction_ros.history import alarm_events, read_alarms, request_many
from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION
from valve_friction_ros.settings import ALARM_KINDS

NODE = f"{NAMESPACE}/identifier"
HEALTHY, TIGHT = quick_record(), quick_record(HIGH_FRICTION)
KNOWN = {
    "baseline_coulomb_friction": Baseline.of(identify(HEALTHY, BENCH_VALVE)).coulomb_friction,
    "input_timeout": 600.0,
}


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


def test_a_life_of_an_alarm(live, history):
    node = live.start_identifier(KNOWN)
    client = live.client
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
    refused = client.trigger("acknowledge")
    assert (refused.success, refused.message) == (
        False,
        "who is empty: give your name",
    )
    answer = ask(client, "acknowledge", text="repack on Monday")
    assert (answer.success, answer.message) == (True, "friction high: acknowledged")
    live.kill(node)

    live.start_identifier(KNOWN)
    state(client, "friction_high", "acknowledged")
    answer = ask(client, "shelve", hours=2.0, kind="friction_high")
    assert answer.message.startswith("friction high: shelved until 20")
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


def test_an_impossible_request_is_refused_as_it_is_written(live):
    live.start_identifier(KNOWN)
    for name, value in (("alarm_kind", "unknown"), ("alarm_hours", float("inf"))):
        (answer,) = live.client.set_parameters(NODE, {name: value})
        assert not answer.successful
        assert "\n" not in answer.reason


def test_nobody_is_alerted_while_an_alarm_is_shelved(live):
    with Receiver() as receiver:
        live.start_identifier({**KNOWN, "webhook_url": receiver.url, "webhook_period": 0.0})
        client = live.client
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


def test_what_another_process_keeps_is_seen(live, history):
    """The dashboard acknowledges many alarms at once, in the file."""
    live.start_identifier(KNOWN)
    client = live.client
    client.identified(TIGHT)
    state(client, "friction_high", "unacknowledged")
    (valve,) = history.valves()
    request = AlarmRequest(AlarmAction.ACKNOWLEDGE, "A. Operator", "all at once")
    asked = [(valve, AlarmKind.FRICTION_HIGH)]
    client.wait_until(lambda: read_alarms(history, valve.name), "the alarm in the file")
    assert request_many(history, asked, request, time.time_ns()) == 1
    state(client, "friction_high", "acknowledged")
    client.identified(HEALTHY)
    state(client, "friction_high", "normal")
    client.wait_until(
        lambda: read_alarms(history, valve.name)[AlarmKind.FRICTION_HIGH].state.name == "NORMAL",
        "the end in the file",
    )
