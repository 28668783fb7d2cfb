# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What holds of every simulation, whatever the parameters and the pressure."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    KarnoppParameters,
    StemState,
    Valve,
    advance,
    simulate,
)

EPS = np.finfo(float).eps
AREA = 0.0445
TRAVEL = 0.03

seeds = st.integers(0, 2**32 - 1)


def magnitude(lowest, highest):
    return st.floats(math.log10(lowest), math.log10(highest)).map(lambda power: 10**power)


def zero_or(strategy):
    return st.one_of(st.just(0.0), strategy)


@st.composite
def packings(draw):
    coulomb = draw(zero_or(magnitude(1e-2, 1e4)))
    return KarnoppParameters(
        mass=draw(magnitude(1e-3, 1e3)),
        viscous_friction=draw(zero_or(magnitude(1e-3, 1e6))),
        coulomb_friction=coulomb,
        static_friction=coulomb + draw(zero_or(magnitude(1e-2, 1e4))),
        spring_constant=draw(zero_or(magnitude(1.0, 1e7))),
        spring_preload=draw(zero_or(st.floats(-3000.0, 3000.0))),
        limit_velocity=draw(zero_or(magnitude(1e-6, 1.0))),
    )


@st.composite
def pressures(draw):
    """Noise, a random walk or random steps of up to 100 kPa (4.45 kN)."""
    generator = np.random.default_rng(draw(seeds))
    samples = draw(st.integers(2, 200))
    amplitude = draw(magnitude(1.0, 1e5))
    noise = amplitude * generator.standard_normal(samples)
    kind = draw(st.sampled_from(["noise", "walk", "steps"]))
    if kind == "walk":
        return np.cumsum(noise) / 10
    return np.repeat(noise, 20)[:samples] if kind == "steps" else noise


speeds = st.tuples(st.sampled_from([-1.0, 1.0]), magnitude(1e-12, 1.0)).map(math.prod)
starts = st.builds(StemState, st.floats(0.0, TRAVEL), zero_or(speeds))
periods = magnitude(1e-4, 1e-1)
travels = st.sampled_from([TRAVEL, math.inf])


def simulated(parameters, pressure, period, start, travel):
    valve = Valve(AREA, travel=travel)
    found = simulate(valve, parameters, pressure, period, start)
    return found, valve.actuator_force(pressure) - parameters.spring_preload


@given(packings(), pressures(), periods, starts)
@settings(max_examples=200)
def test_finite_and_inside_the_travel(parameters, pressure, period, start):
    found, _ = simulated(parameters, pressure, period, start, TRAVEL)
    assert np.isfinite(found.velocity).all()
    assert found.position.min() >= 0
    assert found.position.max() <= TRAVEL


@given(packings(), pressures(), periods, starts, travels)
@settings(max_examples=200)
def test_static_friction_holds_whatever_rests(parameters, pressure, period, start, travel):
    """A resting stem's pull is within F_s, unless it is pressed against a stop."""
    found, force = simulated(parameters, pressure, period, start, travel)
    pull = force - parameters.spring_constant * found.position
    pressed = (found.position == travel) & (pull > 0)
    if travel < math.inf:
        pressed |= (found.position == 0) & (pull < 0)
    resting = (found.velocity == 0) & ~pressed
    resting[0] = False  # the start is as given
    # The pull is a difference, so it is known to a rounding or two of its terms.
    terms = np.abs(force) + parameters.spring_constant * np.abs(found.position)
    over = np.abs(pull) - parameters.static_friction
    assert (over <= 4 * EPS * terms)[resting].all()


@given(packings(), st.floats(-1e5, 1e5), periods, starts, travels)
@settings(max_examples=200)
def test_no_energy_from_nothing(parameters, pressure, period, start, travel):
    """Under constant force, ½·m·v² + ½·k·x² − F·x never grows."""
    found, force = simulated(parameters, np.full(100, pressure), period, start, travel)
    kinetic = parameters.mass * found.velocity**2 / 2
    spring = parameters.spring_constant * found.position**2 / 2
    work = force * found.position
    growth = np.diff(kinetic + spring - work).max()
    # Roundings of the terms, as many as the radians that the phase of the swing has run through.
    terms = (kinetic + spring + np.abs(work)).max()
    swing = period * math.sqrt(parameters.spring_constant / parameters.mass)
    assert growth <= 8 * EPS * (1 + swing) * terms


@given(packings(), pressures(), periods, starts)
def test_mirrored_force_gives_mirrored_motion(parameters, pressure, period, start):
    """Negation rounds nothing, so the mirrored motion is the same to the last digit."""
    valve = Valve(AREA)
    found = simulate(valve, parameters, pressure, period, start)
    mirrored = simulate(
        valve,
        replace(parameters, spring_preload=-parameters.spring_preload),
        -pressure,
        period,
        StemState(-start.position, -start.velocity),
    )
    np.testing.assert_array_equal(mirrored.position, -found.position)
    np.testing.assert_array_equal(mirrored.velocity, -found.velocity)


BENCHES = [
    (BENCH_VALVE, LOW_FRICTION),
    (BENCH_VALVE, HIGH_FRICTION),
    (GRAPHITE_VALVE, GRAPHITE_PACKING),
    (BENCH_VALVE, replace(LOW_FRICTION, viscous_friction=0.0, static_friction=200.0)),
    (BENCH_VALVE, replace(HIGH_FRICTION, limit_velocity=1e-4)),
]


@st.composite
def bench_pressures(draw):
    """A ragged pressure over the whole range, so strokes, rests and stops are met."""
    generator = np.random.default_rng(draw(seeds))
    levels = generator.uniform(3e4, 2.2e5, draw(st.integers(2, 20)))
    return np.interp(np.arange(20 * levels.size - 19) / 20, np.arange(levels.size), levels)


@pytest.mark.parametrize("bench", BENCHES)
@given(pressure=bench_pressures(), seed=seeds)
@settings(max_examples=40)
def test_uneven_pieces_end_where_one_run_ends(bench, pressure, seed):
    """`advance` over any cuts of each sample, the pressure linear in it, equals `simulate`."""
    valve, parameters = bench
    generator = np.random.default_rng(seed)
    period = 5e-3
    whole = simulate(valve, parameters, pressure, period)
    state = StemState(whole.position[0])
    position, velocity = [state.position], [0.0]
    for before, after in pairwise(pressure):
        cuts = np.concatenate(([0.0], np.sort(generator.uniform(0, 1, 3)), [1.0]))
        between = before + (after - before) * cuts
        for piece in range(4):
            state = advance(
                state,
                valve,
                parameters,
                (between[piece], between[piece + 1]),
                (cuts[piece + 1] - cuts[piece]) * period,
            )
        position.append(state.position)
        velocity.append(state.velocity)
    # A piece of the force is rounded to eps of 10 kN, so its slope over a short piece is unsure,
    # but the motion only by that force over the spring, or the impulse over the mass.
    np.testing.assert_allclose(position, whole.position, rtol=0, atol=1e-12)
    np.testing.assert_allclose(velocity, whole.velocity, rtol=0, atol=1e-9)


@given(packings(), pressures(), periods, starts, st.integers(0, 199))
def test_continuing_equals_going_on(parameters, pressure, period, start, cut):
    """A run cut at any sample and continued from its end is the same to the last digit."""
    cut %= pressure.size
    valve = Valve(AREA, travel=TRAVEL)
    whole = simulate(valve, parameters, pressure, period, start)
    head = simulate(valve, parameters, pressure[: cut + 1], period, start)
    tail = simulate(valve, parameters, pressure[cut:], period, head.end)
    np.testing.assert_array_equal(np.append(head.position[:-1], tail.position), whole.position)
    np.testing.assert_array_equal(np.append(head.velocity[:-1], tail.velocity), whole.velocity)
