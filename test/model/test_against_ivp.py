# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The simulated stem against an independent integration, and the properties that it must have."""

import math
from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    KarnoppParameters,
    SineWave,
    SquareWave,
    StemState,
    TriangleWave,
    Valve,
    advance,
    converter_response,
    simulate,
)

SAMPLE_PERIOD = 1e-3

# Tolerances of the integration. A step errs by about RTOL of 29 mm and of 0.07 m/s, and such errors
# die out with the stem's own 24 to 340 ms, in which it makes about a hundred steps.
RTOL, ATOL = 1e-10, 1e-13
AGREED_POSITION = 1e-9  # m
AGREED_VELOCITY = 1e-9  # m/s
BY_CHORDS = 1e-7  # m
STEM_NOISE = 28.6e-6  # m, of the sensor of the paper's bench


def leaves(position, pull, slope, duration, valve, parameters):
    """Time and side of the breakaway of the resting stem, or `duration` and 0."""
    found = [(duration, 0)]
    for side, blocked in ((1, position >= valve.travel), (-1, position <= 0 < math.inf)):
        if blocked and math.isfinite(valve.travel):
            continue
        limit = (1 + side * parameters.coulomb_asymmetry) * parameters.static_friction
        missing = limit - side * pull
        if missing < 0:
            found.append((0.0, side))
        elif side * slope > 0:
            found.append((missing / (side * slope), side))
    return min(found)


def slide(state, force, slope, duration, side, valve, parameters):
    """Integrate the sliding stem until rest, travel stop or the end of the stretch."""
    mass, spring = parameters.mass, parameters.spring_constant
    coulomb, static = parameters.coulomb_friction, parameters.static_friction
    viscous = (1 + side * parameters.viscous_asymmetry) * parameters.viscous_friction
    falls_at, scale = parameters.stribeck_velocity, side * (1 + side * parameters.coulomb_asymmetry)
    end_of_travel = valve.travel if side > 0 else (0.0 if valve.travel < math.inf else -math.inf)

    def motion(t, state):
        x, v = state
        level = coulomb
        if falls_at:
            level += (static - coulomb) * math.exp(-((max(side * v, 0.0) / falls_at) ** 2))
        return v, (force + slope * t - spring * x - scale * level - viscous * v) / mass

    def rest(t, state):
        return side * state[1] if t > 0 else 1.0

    def stop(_, state):
        return side * (end_of_travel - state[0])

    linear = np.array([[0.0, 1.0], [-spring / mass, -viscous / mass]])
    for event in (rest, stop):
        event.terminal, event.direction = True, -1
    solution = solve_ivp(
        motion,
        (0.0, duration),
        state,
        method="LSODA",
        jac=None if falls_at else lambda *_: linear,
        events=(rest, stop) if math.isfinite(end_of_travel) else (rest,),
        dense_output=True,
        rtol=RTOL,
        atol=ATOL,
    )
    position, velocity = solution.y[:, -1]
    if solution.status == 1:
        velocity = 0.0
        if len(solution.t_events) > 1 and solution.t_events[1].size:
            position = end_of_travel
    return solution.t[-1], (position, velocity), solution.sol


def integrate(valve, parameters, knots, pressure, times, position):
    """Position and velocity at `times`, from rest, the pressure linear between `knots`.

    Each phase between two knots is integrated by itself, so no step crosses a kink.
    """
    forces = valve.actuator_force(pressure) - parameters.spring_preload
    out = np.full((2, times.size), np.nan)
    state, side = (position, 0.0), 0
    for begin, end, force, after in zip(knots, knots[1:], forces, forces[1:], strict=False):
        slope = (after - force) / (end - begin)
        now = 0.0
        while now < end - begin:
            offset = times - begin - now
            here, left = force + slope * now, end - begin - now
            if side == 0:
                pull = here - parameters.spring_constant * state[0]
                passed, side = leaves(state[0], pull, slope, left, valve, parameters)
                if passed >= left:
                    passed, side = left, 0
                inside = (offset >= 0) & (offset <= passed)
                out[:, inside] = np.reshape((state[0], 0.0), (2, 1))
            else:
                passed, state, dense = slide(state, here, slope, left, side, valve, parameters)
                inside = (offset >= 0) & (offset <= passed)
                if inside.any():
                    out[:, inside] = dense(offset[inside])
                if state[1] == 0.0:
                    side = 0
            now += passed
    out[:, -1] = state
    return out


FALLING = replace(GRAPHITE_PACKING, viscous_friction=9e4, stribeck_velocity=3.26e-3)
PACKINGS = {
    "low": (BENCH_VALVE, LOW_FRICTION),
    "high": (BENCH_VALVE, HIGH_FRICTION),
    "graphite": (GRAPHITE_VALVE, GRAPHITE_PACKING),
    "stribeck": (GRAPHITE_VALVE, FALLING),
    "both": (
        GRAPHITE_VALVE,
        replace(FALLING, coulomb_asymmetry=-0.05, viscous_asymmetry=-0.1),
    ),
    "asymmetric": (
        GRAPHITE_VALVE,
        replace(GRAPHITE_PACKING, coulomb_asymmetry=0.1, viscous_asymmetry=0.3),
    ),
}
WAVES = {
    "square": (SquareWave(), 20.8),
    "triangle": (TriangleWave(period=30.0), 30.0),
    "sine": (SineWave(), 35.5),
}


@pytest.mark.parametrize(
    ("name", "wave"),
    [
        *product(("low", "high", "graphite"), WAVES),
        *product(("stribeck", "both", "asymmetric"), ["square"]),
    ],
)
def test_bench(name, wave):
    (valve, parameters), (excitation, duration) = PACKINGS[name], WAVES[wave]
    between = 100  # samples on each straight piece of the pressure
    knots = np.arange(0.0, duration + 1e-9, between * SAMPLE_PERIOD)
    pressure = converter_response(excitation.sample(knots), between * SAMPLE_PERIOD)
    times = np.arange((knots.size - 1) * between + 1) * SAMPLE_PERIOD
    found = simulate(valve, parameters, np.interp(times, knots, pressure), SAMPLE_PERIOD)
    position, velocity = integrate(
        valve, parameters, knots, pressure, times, float(found.position[0])
    )
    assert np.ptp(position) > 0.4 * valve.travel
    if parameters.stribeck_velocity:  # chords stand for friction that falls with the speed
        assert np.abs(found.position - position).max() < BY_CHORDS
    else:
        assert np.abs(found.position - position).max() < AGREED_POSITION
        assert np.abs(found.velocity - velocity).max() < AGREED_VELOCITY


@pytest.mark.parametrize(("stribeck_velocity", "ratio"), [(1e-3, 1.3), (3e-3, 2.0)])
def test_stick_slip(stribeck_velocity, ratio):
    """A stem that jumps: an error in one jump delays the next."""
    packing = replace(
        GRAPHITE_PACKING,
        viscous_friction=3e3,
        static_friction=ratio * GRAPHITE_PACKING.coulomb_friction,
        stribeck_velocity=stribeck_velocity,
    )
    between = 100
    knots = np.arange(0.0, 30.0 + 1e-9, between * SAMPLE_PERIOD)
    pressure = converter_response(WAVES["triangle"][0].sample(knots), between * SAMPLE_PERIOD)
    times = np.arange((knots.size - 1) * between + 1) * SAMPLE_PERIOD
    found = simulate(GRAPHITE_VALVE, packing, np.interp(times, knots, pressure), SAMPLE_PERIOD)
    position, _ = integrate(
        GRAPHITE_VALVE, packing, knots, pressure, times, float(found.position[0])
    )
    starts = np.diff((found.velocity == 0).astype(int)) == -1
    assert np.count_nonzero(starts) > 10
    error = np.sqrt(np.mean((found.position - position) ** 2))
    assert error < STEM_NOISE


@pytest.mark.parametrize("name", ["low", "high", "graphite"])
def test_kink_at_every_sample(name):
    """Noise of 1 kPa (45 N) on the way from one rest to the next."""
    valve, parameters = PACKINGS[name]
    times = np.arange(601) * SAMPLE_PERIOD
    noise = 1000.0 * np.random.default_rng(3).standard_normal(times.size)
    pressure = 1e5 + 3e4 * np.sin(4 * np.pi * times) + noise
    found = simulate(valve, parameters, pressure, SAMPLE_PERIOD)
    position, velocity = integrate(
        valve, parameters, times, pressure, times, float(found.position[0])
    )
    resting = found.velocity == 0
    assert np.count_nonzero(np.diff(resting.astype(int))) >= 4
    assert np.abs(found.position - position).max() < AGREED_POSITION
    assert np.abs(found.velocity - velocity).max() < AGREED_VELOCITY


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


@pytest.mark.parametrize("name", ["coulomb_asymmetry", "viscous_asymmetry"])
@pytest.mark.parametrize("value", [1.0, -1.0, np.nan])
def test_impossible_asymmetry(name, value):
    with pytest.raises(ValueError, match=name):
        replace(GRAPHITE_PACKING, **{name: value})


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
