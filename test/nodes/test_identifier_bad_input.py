# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Bad input through the topics: each is refused with its cause, and the next record identifies."""

import math

import numpy as np
import pytest
from live_nodes import NODE, SECOND, SimulatedClock, stamps_of, values_of
from records import quick_record

from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION

RECORD = quick_record()
STAMPS = stamps_of(RECORD)
ONE_HOUR = 3600 * SECOND


METHOD = "published"
"""What is refused is refused before any method; this one takes a few milliseconds."""


@pytest.fixture(scope="module")
def identifier(shared):
    return shared.client_of_identifier({"method": METHOD})


@pytest.fixture
def client(identifier):
    identifier.empty_the_buffer()
    return identifier


def with_value(values, index, value):
    changed = np.array(values)
    changed[index] = value
    return changed


def send(client, part=slice(None), pressure=None, position=None, stamps=STAMPS):
    """Publish the record with other values in place of its own."""
    values = (
        RECORD.pressure if pressure is None else pressure,
        RECORD.position if position is None else position,
    )
    client.send(*((stamps[part], signal[part]) for signal in values))


def bad_pressure(value):
    return lambda client: send(client, pressure=with_value(RECORD.pressure, 321, value))


def with_joints(**fields):
    def publish(client):
        send(client, slice(250))
        client.send_joints(STAMPS[250], **fields)
        client.send_pressure(STAMPS[250], RECORD.pressure[250])
        send(client, slice(251, 500))

    return publish


def gap(client):
    send(client, slice(150))
    send(client, slice(225, 500))


def gap_of_stem(client):
    client.send((STAMPS, RECORD.pressure), (STAMPS[:150], RECORD.position[:150]))
    client.send(position=(STAMPS[225:], RECORD.position[225:]))


def apart(client):
    client.send((STAMPS, RECORD.pressure), (STAMPS + ONE_HOUR, RECORD.position))


OUTSIDE = ("actuator_pressure outside the sensor's range", "0 to 250000 Pa", "(1 samples)")
BAD_INPUTS = {  # what is published, how many samples of it are taken, words of the refusal
    "empty": (lambda _: None, 0, "no samples of actuator_pressure"),
    "nan pressure": (bad_pressure(math.nan), 999, "actuator_pressure is not finite (1 samples)"),
    "other joint": (
        with_joints(name=["arm"], position=[0.01]),
        999,
        "has no position for the joint (1 samples)",
    ),
    "pressure too high": (bad_pressure(260e3), 999, *OUTSIDE),
    "apart in time": (apart, 1000, "do not overlap", "3.6e+03 s later"),
}
GAPS = {"gap": (gap, 850), "gap of stem": (gap_of_stem, 925)}


def identifies_the_next_record(client):
    client.identified(RECORD)
    expected = identify(RECORD, BENCH_VALVE, method=METHOD).values["coulomb_friction"]
    assert client.friction("coulomb_friction") == {"coulomb_friction": expected}


@pytest.mark.parametrize("name", BAD_INPUTS)
def test_is_refused_with_its_cause_and_the_next_record_identifies(client, name):
    publish, count, *words = BAD_INPUTS[name]
    publish(client)
    response = client.identify_all(count)
    assert not response.success, response.message
    for word in words:
        assert word in response.message
    values = client.last_values()
    assert values["estimate_valid"] == "false"
    assert values["reason"] == response.message
    identifies_the_next_record(client)


@pytest.mark.parametrize("name", GAPS)
def test_a_gap_costs_the_stretch_around_it(client, name):
    publish, count = GAPS[name]
    assert client.set_together(NODE, {"method": "plant"}).successful
    publish(client)
    assert client.identified_whole(count)
    values = client.last_values()
    assert client.set_together(NODE, {"method": METHOD}).successful
    assert values["estimate_valid"] == "true"
    assert values["method"] == "plant"
    friction, half_width = (
        float(values[f"coulomb_friction {which}[N]"]) for which in ("", "half width ")
    )
    assert abs(friction - LOW_FRICTION.coulomb_friction) < half_width < 0.05 * friction


def test_cleared_while_the_stem_moves(client):
    """The first samples after `clear` are refused as too few, and the node's level stays."""
    send(client)
    assert client.identify_all(2 * len(RECORD)).success
    level = client.statuses[-1][1].level
    assert client.trigger("clear").success
    send(client, slice(200, 203), stamps=STAMPS + 2 * round(RECORD.duration * SECOND))
    response = client.identify_all(6)
    assert not response.success
    assert response.message.startswith("the record is too short: 3 samples")
    assert client.statuses[-1][1].level == level


@pytest.mark.parametrize("signal", ["pressure", "stem"])
def test_stamps_that_go_back_clear_the_buffer(client, signal):
    send(client)
    assert client.identify_all(2 * len(RECORD)).success
    back = STAMPS[0] - SECOND
    if signal == "pressure":
        client.send_pressure(back, RECORD.pressure[0])
    else:
        client.send_stem(back, RECORD.position[0])
    topic = {"pressure": "actuator_pressure", "stem": "stem_state"}[signal]
    reason = client.identify_all(0).message
    assert "no samples" in reason
    assert f"the buffer was cleared: the time stamps of {topic} jumped back by 5.99 s" in reason
    identifies_the_next_record(client)


def test_the_log_tells_a_clearing_right_after_a_bad_sample(live):
    process = live.start_identifier()
    client = live.client
    client.send_pressure(STAMPS[0], math.nan)
    client.wait_until(lambda: "not finite: check sensor" in process.errors, "a warning")
    client.send_pressure(STAMPS[1], RECORD.pressure[0])
    client.send_pressure(STAMPS[0], RECORD.pressure[1])  # at once: no other warning may hide it
    client.wait_for_buffered(0)
    client.wait_until(
        lambda: (
            "the buffer was cleared: the time stamps of actuator_pressure jumped back by 0.01 s"
            in process.errors
        ),
        "the warning",
    )


def test_a_record_that_ended_long_ago_is_refused(live):
    """By the node's clock, whatever its stamps: of one signal that fell silent, then of another."""
    parameters = {"method": METHOD, "use_sim_time": True, "input_timeout": 3.0}
    client = live.client_of_identifier(parameters)
    clock, after = SimulatedClock(client), STAMPS[-1] + 165 * SECOND

    def set_clock(second):
        clock.now = second * SECOND
        clock.run_until(
            lambda: any(stamp.sec == second for stamp, _ in client.statuses[-2:]), "the time", 0
        )

    for begin, topic, send_other in (
        (1_000, "actuator_pressure", lambda: client.send_stem(after, RECORD.position[0])),
        (2_000, "stem_state", lambda: client.send_pressure(after, RECORD.pressure[0])),
    ):
        set_clock(begin)
        client.identified(RECORD)
        estimate = client.last_values()
        taken = int(estimate["samples_taken"])
        set_clock(begin + 59)  # within the window
        assert client.trigger("identify").success
        set_clock(begin + 224)
        send_other()
        client.wait_until(
            lambda taken=taken: client.last_values()["samples_taken"] == str(taken + 1),
            "the sample",
        )
        response = client.refusal("identify")
        reason = f"the record is old: its last usable sample of {topic} arrived 224 s ago"
        assert reason in response
        status = client.next_status(lambda one, why=reason: why in one.message, "the refusal")
        shown = values_of(status)
        assert shown["estimate_valid"] == "false"
        assert shown["reason"].startswith(reason)
        assert float(shown["estimate_age [s]"]) == 165.0
        assert shown["coulomb_friction [N]"] == estimate["coulomb_friction [N]"]


def test_a_stamp_within_a_period_of_the_last_costs_its_sample_alone(client):
    send(client, slice(250))
    client.send_stem(STAMPS[249] - 4_000_000, 1.0)
    send(client, slice(250, 500))
    assert client.identify_all(2 * len(RECORD)).success
    assert "stem_state arrived out of order" in client.last_values()["samples_rejected causes"]
