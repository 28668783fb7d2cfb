# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Stroke tests that a node plays: started, ended by limits, and reported as they were planned."""

import json

import pytest
from live_nodes import LATCHED, NAMESPACE, SECOND, START, STREAM, stamp_of
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import String

from valve_friction_ros.commands.plan_test import player, write_test
from valve_friction_ros.identification import IdentificationSettings
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION
from valve_friction_ros.planning import Conditions, Limits, known_friction, plan_test

HOME = 1e5
ROWS = ((0.0, HOME), (0.5, HOME), (2.5, 1.4e5), (600.0, 1.4e5))
NODE = f"{NAMESPACE}/stroke_player"


@pytest.fixture
def stroke_player(live, tmp_path):
    """A player; `signals` keeps its signals coming, at the position `live.position`."""
    file = tmp_path / "test.csv"
    file.write_text("time_s,pressure_pa\n" + "".join(f"{t},{p}\n" for t, p in ROWS))
    live.set_points = live.client.listen(FluidPressure, f"{NAMESPACE}/pressure_set_point", STREAM)
    live.states = live.client.listen(String, f"{NODE}/state", LATCHED)
    parameters = {"file": str(file), "file_minimum": 0.9e5, "file_maximum": 1.5e5, "silence": 5.0,
                  "position_minimum": 0.002, "position_maximum": 0.02}  # fmt: skip
    live.player = live.start("stroke_player", parameters)
    live.position, live.sent = 0.01, 0
    live.client.connect()
    return live


def signals(live):
    """Send a sample of each signal."""
    live.sent += 1
    live.client.send_pressure(START + live.sent * SECOND // 100, 1.1e5)
    live.client.send_stem(START + live.sent * SECOND // 100, live.position)


def wait(live, condition, what):
    """Wait while the signals come."""

    def met():
        signals(live)
        return condition()

    live.client.wait_until(met, what)


def last(live):
    return live.set_points[-1].fluid_pressure if live.set_points else None


def test_it_plays_when_asked_and_goes_back_by_limit_and_by_its_end(stroke_player):
    live = stroke_player
    assert not live.client.trigger("start", NODE).success  # no signal has come
    wait(live, lambda: live.sent > 50, "signals")
    assert last(live) is None  # and nothing begins by itself
    answer = live.client.trigger("start", NODE)
    assert answer.success, answer.message
    wait(live, lambda: last(live) == 1.4e5, "the highest set point")
    values = [one.fluid_pressure for one in live.set_points]
    assert values[0] == HOME
    assert values == sorted(values)
    live.position = 0.0201
    wait(live, lambda: last(live) == HOME, "the way back")
    wait(live, lambda: "beyond its limit of 0.02 m" in live.states[-1].data, "the state")
    live.position = 0.01
    wait(live, lambda: live.sent % 50 == 0, "good signals")
    assert live.client.trigger("start", NODE).success
    wait(live, lambda: last(live) > 1.2e5, "set points")
    live.player.interrupt()
    live.player.require_good_end()
    live.client.drain()
    assert last(live) == HOME


RATE, SPEED = 50.0, 4.0
NAMES = ("coulomb_friction", "sliding_friction")


@pytest.fixture(scope="module")
def plan():
    """Planned for a friction that is two thirds of the true one."""
    true = HIGH_FRICTION
    frictions = known_friction(
        true.coulomb_friction / 1.5,
        (true.spring_constant, true.spring_preload),
        true.mass,
        viscous_friction=true.viscous_friction / 1.5,
        factor=1.5,
    )
    settings = IdentificationSettings(assumed_mass=1.6)
    return plan_test(BENCH_VALVE, frictions, Limits(duration=30.0), Conditions(RATE), settings)


def test_what_is_reported_is_what_was_promised(live, plan, tmp_path):
    file = tmp_path / "stroke_test.csv"
    write_test(file, plan)
    valve = {
        "diaphragm_area": BENCH_VALVE.diaphragm_area,
        "pressure_reference": BENCH_VALVE.pressure_reference,
        "travel": BENCH_VALVE.travel,
    }
    names = (
        "mass",
        "viscous_friction",
        "coulomb_friction",
        "static_friction",
        "spring_constant",
        "spring_preload",
    )
    true = {name: getattr(HIGH_FRICTION, name) for name in names}
    live.start("simulator", {**valve, **true, "position_noise": 10e-6})
    live.start_identifier({**valve, "window": 40.0, "assumed_mass": 1.6})
    live.client.wait_until(
        lambda: live.client.node.count_publishers(f"{NAMESPACE}/stem_state"), "the stem"
    )
    heard = live.client.listen(JointState, f"{NAMESPACE}/stem_state", STREAM)
    played = {**player(plan, file), "sample_rate": RATE, "speed": SPEED, "pressure_noise": 100.0}
    live.start("pressure_source", played)

    def has_ended():
        stamps = [stamp_of(message.header.stamp) for message in heard[:1] + heard[-1:]]
        return stamps and stamps[1] - stamps[0] >= (plan.test.duration - 1.0) * SECOND

    live.client.wait_until(has_ended, "the end of the test")
    positions = [message.position[0] / BENCH_VALVE.travel for message in heard]
    assert 0.19 < min(positions) < 0.45
    assert 0.55 < max(positions) < 0.81
    response = live.client.trigger("identify")
    assert response.success, response.message
    promised = plan.forecasts[-1]
    assert promised.parameters.coulomb_friction == pytest.approx(606.0)
    values, widths = live.client.friction(*NAMES), live.client.half_widths(*NAMES)
    assert abs(values["coulomb_friction"] - 606.0) <= widths["coulomb_friction"]
    for name in NAMES:
        assert 0.4 < widths[name] / promised.half_widths[name] < 2.5, json.dumps(widths)
