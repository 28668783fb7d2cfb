# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Stribeck and asymmetric friction against an independent integration, and their limits."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from valve_friction_ros.model import (
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    KarnoppParameters,
    SquareWave,
    converter_response,
    simulate,
)

PERIOD = 1e-3
TIME = np.arange(0, 21, PERIOD)
PRESSURE = converter_response(SquareWave().sample(TIME), PERIOD)
FALLING = replace(GRAPHITE_PACKING, viscous_friction=9e4, stribeck_velocity=3.26e-3)


def independent(valve, parameters):
    """The stem by phases: at rest until the pull exceeds F_s, then integrated until it stops."""

    def acceleration(side):
        def derivative(time, state):
            position, velocity = state
            speed = max(side * velocity, 1e-300)
            force = np.interp(time, TIME, PRESSURE) - valve.pressure_reference
            pull = (
                force * valve.diaphragm_area
                - parameters.spring_preload
                - parameters.spring_constant * position
            )
            friction = float(parameters.sliding_friction(side * speed))
            return [velocity, (pull - friction) / parameters.mass]

        return derivative

    def stops(_, state):
        return state[1] * side

    stops.terminal, stops.direction = True, -1
    forces = valve.actuator_force(PRESSURE) - parameters.spring_preload
    up = parameters.static_friction * (1 + parameters.coulomb_asymmetry)
    down = parameters.static_friction * (1 - parameters.coulomb_asymmetry)
    place = simulate(valve, parameters, PRESSURE[:1], PERIOD).position[0]
    now, positions = 0.0, np.full(TIME.size, np.nan)
    while now < TIME[-1]:
        pull = forces - parameters.spring_constant * place
        leaves = np.flatnonzero((now < TIME) & ((pull > up) | (pull < -down)))
        if not leaves.size:
            positions[now <= TIME] = place
            break
        index = leaves[0]
        side, limit = (1, up) if pull[index] > up else (-1, down)
        before, after = side * pull[index - 1], side * pull[index]
        leaving = TIME[index - 1] + PERIOD * max(limit - before, 0.0) / (after - before)
        leaving = max(leaving, now)
        positions[(now <= TIME) & (leaving >= TIME)] = place
        slide = solve_ivp(
            acceleration(side),
            (leaving, TIME[-1]),
            [place, side * 1e-12],
            method="Radau",
            events=stops,
            rtol=1e-8,
            atol=1e-11,
            max_step=5e-3,
            dense_output=True,
        )
        during = (leaving < TIME) & (slide.t[-1] >= TIME)
        positions[during] = slide.sol(TIME[during])[0]
        place, now = slide.y[0, -1], slide.t[-1]
    return positions


@pytest.mark.parametrize(
    "parameters",
    [
        FALLING,
        replace(FALLING, coulomb_asymmetry=-0.05, viscous_asymmetry=-0.1),
        replace(GRAPHITE_PACKING, coulomb_asymmetry=0.1, viscous_asymmetry=0.3),
    ],
    ids=["stribeck", "both", "asymmetric"],
)
def test_against_independent_integration(parameters):
    """Within a tenth of the micrometre that the published model is held to."""
    positions = simulate(GRAPHITE_VALVE, parameters, PRESSURE, PERIOD).position
    assert np.abs(positions - independent(GRAPHITE_VALVE, parameters)).max() < 1e-7


def test_friction_force_of_the_sliding_stem():
    """The law, written out: v = v_s leaves 1/e of F_s − F_c."""
    parameters = KarnoppParameters(
        1.0,
        10.0,
        2.0,
        5.0,
        0.0,
        stribeck_velocity=0.5,
        coulomb_asymmetry=0.1,
        viscous_asymmetry=-0.2,
    )
    up, down, rest = parameters.sliding_friction([0.5, -0.5, 0.0])
    assert up == pytest.approx(1.1 * (2 + 3 / np.e) + 0.8 * 5, rel=1e-14)
    assert down == pytest.approx(-0.9 * (2 + 3 / np.e) - 1.2 * 5, rel=1e-14)
    assert rest == 0


def test_slow_fall_is_plain_friction_at_the_static_level():
    """A Stribeck velocity far above all speeds: friction stays at F_s."""
    endless = replace(GRAPHITE_PACKING, stribeck_velocity=1e3)
    level = replace(GRAPHITE_PACKING, coulomb_friction=GRAPHITE_PACKING.static_friction)
    falling, plain = (
        simulate(GRAPHITE_VALVE, one, PRESSURE, PERIOD).position for one in (endless, level)
    )
    assert np.abs(falling - plain).max() < 1e-9


def test_mirrored_asymmetry_mirrors_the_motion():
    """Up and down exchanged with the sign of the force: the stem moves as in a mirror."""
    valve = replace(GRAPHITE_VALVE, travel=np.inf)
    skewed = replace(FALLING, spring_preload=0.0, coulomb_asymmetry=0.2, viscous_asymmetry=0.1)
    mirrored = replace(skewed, coulomb_asymmetry=-0.2, viscous_asymmetry=-0.1)
    pressure = PRESSURE - PRESSURE.mean()
    up = simulate(valve, skewed, pressure, PERIOD).position
    down = simulate(valve, mirrored, -pressure, PERIOD).position
    assert np.abs(up + down).max() < 1e-15


@pytest.mark.parametrize("name", ["coulomb_asymmetry", "viscous_asymmetry"])
@pytest.mark.parametrize("value", [1.0, -1.0, np.nan])
def test_impossible_asymmetry(name, value):
    with pytest.raises(ValueError, match=name):
        replace(GRAPHITE_PACKING, **{name: value})
