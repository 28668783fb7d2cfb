# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Bad input through the topics: refused with its cause, or told within 5 s; no false alarm."""

import math
import time

import numpy as np
import pytest
import rclpy
from histories import START, success
from live_nodes import NODE, OK, SECOND, STREAM, WARN, SimulatedClock, stamps_of, values_of
from processes import PATIENCE
from records import quick_record
from sensor_msgs.msg import FluidPressure, JointState

from benchmark.soak_plant import PERIOD, TOLD_WITHIN, Nonsense, said
from valve_friction_ros.health import Baseline
from valve_friction_ros.history import KeptBaseline, KeptValve
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
    "apart in time": (apart, 1000, "do not overlap", "60 min later"),
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


# Sensors that say nonsense

HEALTHY = Baseline(150.0, 3.0)
SLOW, STILL, PLAYED = "slow", "still", "played"
KINDS = {one.name.lower(): one for one in Nonsense}
VALVES = (*KINDS, SLOW, STILL, PLAYED)
WAIT = 3.0
"""Time between two samples of a sensor that reports seldom, s."""


@pytest.fixture
def publishers(live):
    """The publishers of pressure and stem of each valve; those of one are of a player of bags."""
    context = live.client.context
    nodes = [
        rclpy.create_node(name, context=context, enable_rosout=False)
        for name in ("sensors", "rosbag2_player")
    ]
    yield {
        valve: (
            nodes[valve == PLAYED].create_publisher(
                FluidPressure, f"/{valve}/actuator_pressure", STREAM
            ),
            nodes[valve == PLAYED].create_publisher(JointState, f"/{valve}/stem_state", STREAM),
        )
        for valve in VALVES
    }
    for node in nodes:
        node.destroy_node()


class Plant:
    """What the diagnostics say of each valve while its sensors go on."""

    def __init__(self, client, publishers):
        self._client, self._publishers = client, publishers
        self._due = dict.fromkeys(VALVES, 0.0)
        self.is_nonsense = False

    def _send(self):
        """Publish what is due."""
        for valve, due in self._due.items():
            if time.monotonic() < due:
                continue
            self._due[valve] = time.monotonic() + (WAIT if valve == SLOW else PERIOD)
            kind = KINDS.get(valve) if self.is_nonsense else None
            kind = Nonsense.CLOCK_BEHIND if valve == PLAYED else kind
            pressure, stem = said(kind, time.time_ns())
            if valve == STILL:
                pressure.fluid_pressure, stem.position = 1.2e5, [0.006]
            for publisher, message in zip(self._publishers[valve], (pressure, stem), strict=True):
                publisher.publish(message)

    def status(self, valve):
        statuses = (one for _, one in reversed(self._client.statuses) if one.hardware_id == valve)
        return next(statuses, None)

    def wait(self, condition, what, limit=PATIENCE):
        """Let the sensors go on until `condition()` is true; return how long that took, s."""
        begun = time.monotonic()

        def met():
            self._send()
            return condition()

        self._client.wait_until(met, what, limit)
        return time.monotonic() - begun

    def go_on(self, seconds):
        end = time.monotonic() + seconds
        self.wait(lambda: time.monotonic() > end, f"{seconds} s")

    def is_calm(self, valves=VALVES):
        return all(is_calm(self.status(valve)) for valve in valves)


def is_calm(status):
    return status is not None and status.level == OK and "friction normal" in status.message


def is_told(status, kind):
    return (
        status.level == WARN
        and values_of(status)["NE 107"] == "C"
        and kind.value in status.message
        and "friction normal" not in status.message
    )


@pytest.fixture
def node(live, history):
    """One process of all valves, each healthy by its history."""
    for name in VALVES:
        valve = KeptValve(f"/{name}/identifier", name)
        history.add(success(friction=150.0, baseline=HEALTHY, valve=valve))
        history.set_baseline(valve, KeptBaseline(HEALTHY, START, START))
    parameters = {
        "valves": f"[{','.join(VALVES)}]",
        "travel": 28.575e-3,
        "pressure_minimum": 0.0,
        "pressure_maximum": 7e5,
        "diaphragm_area": 0.0445,
        "input_timeout": 10.0,
        "clock_tolerance": 60.0,
    }
    return live.start("identifiers", parameters, namespace=None)


@pytest.mark.slow
def test_nonsense_is_told_within_5_s_cleared_after_it_and_nothing_else_is(live, node, publishers):
    plant, untold = Plant(live.client, publishers), set(KINDS)
    of_sensors = [one for both in publishers.values() for one in both]
    plant.wait(lambda: all(one.get_subscription_count() for one in of_sensors), "connections")
    plant.wait(plant.is_calm, "calm")

    def all_told():
        untold.difference_update([v for v in untold if is_told(plant.status(v), KINDS[v])])
        return not untold

    plant.is_nonsense = True
    assert plant.wait(all_told, "nonsense told", 2 * TOLD_WITHIN) <= TOLD_WITHIN
    assert plant.is_calm((SLOW, STILL, PLAYED))
    plant.go_on(4.0)

    plant.is_nonsense = False
    assert plant.wait(plant.is_calm, "the end of all nonsense", 2 * TOLD_WITHIN) <= TOLD_WITHIN
    seen = len(live.client.statuses)
    plant.go_on(11.0)  # after ten the log tells the end
    assert all(is_calm(status) for _, status in live.client.statuses[seen:])
    for valve in KINDS:
        lines = [line for line in node.errors.splitlines() if f"{valve}.identifier" in line]
        told = [line for line in lines if "level " not in line]
        begun = [line for line in told if "[WARN]" in line]
        over = [line for line in told if "ended after" in line]
        assert 1 <= len(over) <= 4, (valve, told)  # wrong stamps are several faults
        assert len(begun) <= len(over) + 2, (valve, told)
