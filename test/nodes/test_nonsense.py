# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sensors that say nonsense, over real topics: told within 5 s and cleared; no false alarm."""

import time

import pytest
import rclpy
from histories import START, success
from live_nodes import OK, STREAM, WARN, values_of
from processes import PATIENCE
from sensor_msgs.msg import FluidPressure, JointState

from benchmark.soak_plant import PERIOD, TOLD_WITHIN, Nonsense, said
from valve_friction_ros.health import Baseline
from valve_friction_ros.history import KeptBaseline, KeptValve

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
