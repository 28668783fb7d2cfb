"""The whole valve over DDS: what has changed beside the friction, kept and said."""

from dataclasses import replace

import numpy as np
import pytest
from live_nodes import NAMESPACE, values_of
from records import quick_record, simulated

from valve_friction_ros.model import LOW_FRICTION, SensorNoise

NODE = f"{NAMESPACE}/identifier"
OK, WARN, ERROR = b"\x00", b"\x01", b"\x02"
HEALTHY = quick_record()
SOFT = replace(LOW_FRICTION, spring_constant=LOW_FRICTION.spring_constant * 2 / 3)
WEAK = quick_record(SOFT)
HARDLY = SensorNoise(1e-5, 100.0, 3).applied_to(
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
