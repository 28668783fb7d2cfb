# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A planned stroke test, played over DDS: the identifier reports what the plan promised."""

import json

import pytest
from live_nodes import NAMESPACE, SECOND, STREAM, stamp_of
from sensor_msgs.msg import JointState

from valve_friction_ros.commands.plan_test import player, write_test
from valve_friction_ros.identification import IdentificationSettings
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION
from valve_friction_ros.planning import Conditions, Limits, known_friction, plan_test

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
