# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The whole valve over DDS: what has changed beside the friction, kept and said."""

from dataclasses import replace

import numpy as np
import pytest
from live_nodes import NAMESPACE, SECOND, START, values_of
from records import quick_record, simulated, stroked_record

from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, SensorNoise

NODE = f"{NAMESPACE}/identifier"
OK, WARN, ERROR = b"\x00", b"\x01", b"\x02"
HEALTHY = quick_record()
SOFT = replace(LOW_FRICTION, spring_constant=LOW_FRICTION.spring_constant * 2 / 3)
WEAK = quick_record(SOFT)
HARDLY = SensorNoise(3e-5, 300.0, 3).applied_to(
    simulated(5e4 + 5e3 * np.sin(2 * np.pi * np.arange(500) / 250), 0.01, SOFT)
)
"""Small strokes of the valve of the soft spring, which hardly show it."""
CHANGE = "spring_constant change [%]"


def test_a_spring_that_has_lost_a_third_of_its_stiffness_is_said_and_outlives_a_kill(live, history):
    node = live.start_identifier()
    client = live.client
    client.identified(HEALTHY)
    assert CHANGE not in values_of(client.statuses[-1][1])
    assert client.trigger("set_baseline").success
    status = client.next_status(lambda one: CHANGE in values_of(one), "the change")
    assert status.level == OK
    assert float(values_of(status)[CHANGE]) == 0.0

    assert "the spring constant has changed" in client.identified(WEAK)
    status = client.statuses[-1][1]
    values = values_of(status)
    assert status.level == ERROR
    assert values["NE 107"] == "F"
    assert "the spring constant has changed: 0.667 times" in status.message
    assert float(values[CHANGE]) == pytest.approx(-100 / 3, abs=0.1)
    low, high = (float(values[f"spring_constant change {end} [%]"]) for end in ("low", "high"))
    assert low < -100 / 3 < high
    kept = history.baseline(NODE).baseline
    assert kept.numbers["spring_constant"].value == pytest.approx(
        LOW_FRICTION.spring_constant, 1e-3
    )

    refused = client.trigger("set_baseline")
    assert not refused.success
    assert "the spring constant has changed" in refused.message

    live.kill(node)
    live.start_identifier()
    after = client.next_status(lambda one: CHANGE in values_of(one), "the change after a restart")
    assert after.level == ERROR
    assert "the spring constant has changed: 0.667 times" in after.message
    assert values_of(after)[CHANGE] == values[CHANGE]


def test_an_alarm_outlives_a_record_that_does_not_show_its_number_and_a_kill(live, history):
    node = live.start_identifier()
    client = live.client
    client.identified(HEALTHY)
    assert client.trigger("set_baseline").success
    client.identified(WEAK)
    assert client.statuses[-1][1].level == ERROR
    client.identified(HARDLY)
    assert "spring_constant" not in history.last_success(NODE).numbers
    status = client.statuses[-1][1]
    assert status.level == ERROR
    assert "no record since shows it)" in status.message
    live.kill(node)
    live.start_identifier()
    after = client.next_status(lambda one: CHANGE in values_of(one), "the change after a restart")
    assert after.level == ERROR
    assert "no record since shows it)" in after.message


@pytest.mark.parametrize("is_scheduled", [False, True])
def test_lost_travel_is_said_though_its_record_is_refused(live, history, is_scheduled):
    """A sixth of the travel is lost: no model follows the record, but the stem's end is seen."""
    node = live.start_identifier()
    client = live.client
    client.identified(stroked_record())
    assert client.trigger("set_baseline").success
    assert client.next_status().level == OK
    if is_scheduled:
        client.set_parameters(NODE, {"period": 0.5})
    assert client.trigger("clear").success
    lost = stroked_record(0.16 * BENCH_VALVE.travel)
    client.send_record(lost, START + 60 * SECOND)
    client.wait_for_buffered(2 * len(lost))
    words = "travel is lost at its lower end: the stem stops +4.57 mm"
    if not is_scheduled:
        answer = client.trigger("identify")
        assert not answer.success
        assert "no friction model reproduces the record" in answer.message
        assert words in answer.message
    status = client.next_status(lambda one: words in one.message, "the lost travel")
    assert (status.level, values_of(status)["NE 107"]) == (WARN, "M")
    assert ("was refused" in status.message) == (not is_scheduled)
    assert float(values_of(status)["lower_stop change [m]"]) == pytest.approx(4.572e-3, abs=5e-5)
    client.wait_until(lambda: history.entries()[-1].refusal, "the refusal in the history")
    live.kill(node)
    live.start_identifier()
    after = client.next_status(lambda one: words in one.message, "the same after a restart")
    assert after.level == WARN


def test_a_refused_record_between_the_stops_shows_nothing(live):
    live.start_identifier()
    client = live.client
    client.identified(stroked_record())
    assert client.trigger("set_baseline").success
    still = quick_record()
    still = replace(still, position=0.4 * BENCH_VALVE.travel + 0.0 * still.position)
    assert client.trigger("clear").success
    client.send_record(still, START + 60 * SECOND)
    client.wait_for_buffered(2 * len(still))
    answer = client.trigger("identify")
    assert not answer.success
    assert "the stem did not move" in answer.message
    status = client.next_status(lambda one: "was refused" in one.message, "the refusal")
    assert status.level == OK
    assert "travel is lost" not in status.message


def test_a_restored_baseline_brings_all_its_numbers_back(live):
    node = live.start_identifier({"baseline_in_alarm": True})
    client = live.client
    client.identified(HEALTHY)
    assert client.trigger("set_baseline").success
    client.identified(WEAK)
    assert client.trigger("set_baseline").success
    assert client.next_status(lambda one: one.level == OK, "another baseline")
    live.kill(node)

    live.start_identifier({"baseline_in_alarm": True})
    assert client.next_status(lambda one: CHANGE in values_of(one), "the kept one").level == OK
    assert client.trigger("restore_baseline").success
    status = client.next_status(lambda one: one.level == ERROR, "the first baseline")
    assert "the spring constant has changed" in status.message


def test_a_limit_is_a_parameter_and_a_given_friction_says_nothing_of_the_spring(live):
    live.start_identifier({"spring_change": 0.5, "spring_failure": 0.6})
    client = live.client
    client.identified(HEALTHY)
    assert client.trigger("set_baseline").success
    client.identified(WEAK)
    assert client.statuses[-1][1].level == OK
    (refused,) = client.set_parameters(NODE, {"spring_change": 0.7})
    assert "spring_change < spring_failure" in refused.reason
    client.set_parameters(NODE, {"spring_change": 0.15})
    client.next_status(lambda one: one.level == WARN, "a tighter limit")
    client.set_parameters(NODE, {"baseline_coulomb_friction": 150.0})
    status = client.next_status(lambda one: one.level == OK, "a friction alone")
    assert CHANGE not in values_of(status)
