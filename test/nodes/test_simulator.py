# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The simulated valve over topics: the model's own numbers, at the pressure's stamps."""

import math

import numpy as np
import pytest
from live_nodes import NAMESPACE, SECOND, START, STREAM, stamp_of
from sensor_msgs.msg import JointState

from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    SineWave,
    simulate,
)

NODE = f"{NAMESPACE}/simulator"
PERIOD = 0.01
PRESSURE = SineWave(period=10.0).sample(np.arange(1000) * PERIOD)
STAMPS = START + 10_000_000 * np.arange(1000, dtype=np.int64)
KARNOPP = ("mass", "viscous_friction", "coulomb_friction", "static_friction", "spring_constant")
EXACT = {"rtol": 0, "atol": 1e-12}  # m; pressure in and position out are doubles


@pytest.fixture(scope="module")
def running(shared):
    process = shared.start("simulator")
    states = shared.client.listen(JointState, f"{NAMESPACE}/stem_state", STREAM)
    shared.client.connect_pressure()
    shared.client.wait_until(
        lambda: shared.client.node.count_publishers(f"{NAMESPACE}/stem_state"), "the stem"
    )
    return shared.client, states, process, [START]


@pytest.fixture
def stem(running):
    """Publish pressures to a stem that starts at rest, with low friction."""
    client, states, _, begin = running
    values = {name: getattr(LOW_FRICTION, name) for name in KARNOPP}
    assert client.set_together(NODE, {"travel": BENCH_VALVE.travel, **values}).successful
    begin[0] -= 1000 * SECOND  # back in time: the stem starts anew
    return Stem(client, states, begin[0])


class Stem:
    def __init__(self, client, states, start):
        self.client = client
        self.states = states
        self.start = start
        self.states.clear()

    def respond(self, pressure, first=0):
        """Publish samples, the first of them number `first`; return positions and velocities."""
        stamps = self.start + 10_000_000 * np.arange(first, first + len(pressure), dtype=np.int64)
        self.states.clear()
        self.client.send(pressure=(stamps, pressure))
        self.client.wait_until(lambda: len(self.states) >= len(pressure), "the stem's states")
        assert [stamp_of(state.header.stamp) for state in self.states] == stamps.tolist()
        assert all(list(state.name) == ["stem"] for state in self.states)
        return (
            np.array([state.position[0] for state in self.states]),
            np.array([state.velocity[0] for state in self.states]),
        )


def test_stem_follows_the_model_at_the_stamps_of_the_pressure(stem):
    position, velocity = stem.respond(PRESSURE)
    expected = simulate(BENCH_VALVE, LOW_FRICTION, PRESSURE, PERIOD)
    assert np.ptp(position) > 0.01
    np.testing.assert_allclose(position, expected.position, **EXACT)
    np.testing.assert_allclose(velocity, expected.velocity, rtol=0, atol=1e-9)


def test_friction_changes_while_it_runs(stem):
    before, _ = stem.respond(PRESSURE[:400])
    tightened = {name: getattr(HIGH_FRICTION, name) for name in KARNOPP}
    result = stem.client.set_together(NODE, tightened)
    assert result.successful, result.reason
    after, _ = stem.respond(PRESSURE[400:], first=400)

    start = simulate(BENCH_VALVE, LOW_FRICTION, PRESSURE[:400], PERIOD)
    end = simulate(BENCH_VALVE, HIGH_FRICTION, PRESSURE[399:], PERIOD, start.end)
    np.testing.assert_allclose(before, start.position, **EXACT)
    np.testing.assert_allclose(after, end.position[1:], **EXACT)
    unchanged = simulate(BENCH_VALVE, LOW_FRICTION, PRESSURE, PERIOD).position[400:]
    assert np.abs(after - unchanged).max() > 1e-3


def test_coulomb_above_static_friction_is_refused(stem):
    (result,) = stem.client.set_parameters(NODE, {"coulomb_friction": 606.0})
    assert not result.successful
    assert "static_friction (152.7) must not be below coulomb_friction (606)" in result.reason
    result = stem.client.set_together(NODE, {"coulomb_friction": 606.0, "static_friction": 605.0})
    assert not result.successful
    assert stem.client.parameters(NODE, "coulomb_friction", "static_friction") == [152.7, 152.7]
    position, _ = stem.respond(PRESSURE[:300])
    expected = simulate(BENCH_VALVE, LOW_FRICTION, PRESSURE[:300], PERIOD)
    np.testing.assert_allclose(position, expected.position, **EXACT)


@pytest.mark.parametrize("name", [*KARNOPP, "limit_velocity", "position_noise", "diaphragm_area"])
def test_negative_parameters_are_refused(stem, name):
    (result,) = stem.client.set_parameters(NODE, {name: -1.0})
    assert not result.successful
    assert name in result.reason


def test_stamps_that_go_back_start_the_stem_anew(stem, running):
    _, _, process, _ = running
    stem.respond(PRESSURE[:500])
    warnings = process.errors.count("went back")
    position, _ = stem.respond(PRESSURE[300:400])
    expected = simulate(BENCH_VALVE, LOW_FRICTION, PRESSURE[300:400], PERIOD)
    np.testing.assert_allclose(position, expected.position, **EXACT)

    def warned():  # once in five seconds, however often they go back
        stem.respond(PRESSURE[300:400])
        return process.errors.count("went back") > warnings

    stem.client.wait_until(warned, "a warning")
    assert process.errors.count("went back") == warnings + 1


def test_bad_pressures_are_passed_over(stem):
    stem.respond(PRESSURE[:100])
    for bad in (math.nan, math.inf, -math.inf):
        stem.client.send_pressure(stem.start + SECOND, bad)
    stem.client.send_pressure(stem.start + 99 * 10_000_000, 2e5)  # repeats a stamp
    position, _ = stem.respond(PRESSURE[100:200], first=100)
    expected = simulate(BENCH_VALVE, LOW_FRICTION, PRESSURE[:200], PERIOD)
    np.testing.assert_allclose(position, expected.position[100:], **EXACT)


def test_impossible_pressures_are_passed_over(stem):
    stem.respond(PRESSURE[:100])
    for huge in (1e308, -1e306, 1e12):
        stem.client.send_pressure(stem.start + SECOND, huge)
    position, _ = stem.respond(PRESSURE[100:200], first=100)
    expected = simulate(BENCH_VALVE, LOW_FRICTION, PRESSURE[:200], PERIOD)
    np.testing.assert_allclose(position, expected.position[100:], **EXACT)


def test_travel_made_shorter_than_the_stem_is_out(stem):
    position, _ = stem.respond(PRESSURE[:500])
    assert position[-1] > 0.01
    (result,) = stem.client.set_parameters(NODE, {"travel": 0.005})
    assert result.successful, result.reason
    position, _ = stem.respond(PRESSURE[500:], first=500)
    assert np.all((position[1:] >= 0) & (position[1:] <= 0.005))


def test_slip_jump_valve_with_noise_by_seed(live):
    values = {
        **{name: getattr(GRAPHITE_PACKING, name) for name in (*KARNOPP, "spring_preload")},
        "pressure_reference": 0.0,
        "position_noise": 1e-5,
        "noise_seed": 7,
        "joint": "plug",
    }
    live.start("simulator", values)
    states = live.client.listen(JointState, f"{NAMESPACE}/stem_state", STREAM)
    live.client.connect_pressure()
    live.client.wait_until(
        lambda: live.client.node.count_publishers(f"{NAMESPACE}/stem_state"), "the stem"
    )
    live.client.send(pressure=(STAMPS, PRESSURE))
    live.client.wait_until(lambda: len(states) >= 1000, "the stem's states")
    expected = simulate(GRAPHITE_VALVE, GRAPHITE_PACKING, PRESSURE, PERIOD).position
    noise = 1e-5 * np.random.default_rng(7).standard_normal(1000)
    position = np.array([state.position[0] for state in states])
    np.testing.assert_allclose(position, expected + noise, **EXACT)
    assert list(states[0].name) == ["plug"]
