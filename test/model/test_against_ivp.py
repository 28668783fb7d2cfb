# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The simulation against an independent integration of (1) and (2) by `solve_ivp` with events."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from valve_friction_ros.model import (
    SineWave,
    SquareWave,
    TriangleWave,
    converter_response,
    simulate,
)

SAMPLE_PERIOD = 1e-3

# Tolerances of the integration. A step errs by about RTOL of 29 mm and of 0.07 m/s, and such errors
# die out with the stem's own 24 to 340 ms, in which it makes about a hundred steps.
RTOL, ATOL = 1e-10, 1e-13
ASKED_POSITION = 1e-6  # m
AGREED_POSITION = 1e-9  # m
AGREED_VELOCITY = 1e-9  # m/s


def leaves(position, pull, slope, duration, valve, parameters):
    """Time and side of the breakaway of the resting stem, or `duration` and 0."""
    found = [(duration, 0)]
    for side, blocked in ((1, position >= valve.travel), (-1, position <= 0 < math.inf)):
        if blocked and math.isfinite(valve.travel):
            continue
        missing = parameters.static_friction - side * pull
        if missing < 0:
            found.append((0.0, side))
        elif side * slope > 0:
            found.append((missing / (side * slope), side))
    return min(found)


def slide(state, force, slope, duration, side, valve, parameters):
    """Integrate the sliding stem until rest, travel stop or the end of the stretch."""
    mass, spring = parameters.mass, parameters.spring_constant
    coulomb, viscous = side * parameters.coulomb_friction, parameters.viscous_friction
    end_of_travel = valve.travel if side > 0 else (0.0 if valve.travel < math.inf else -math.inf)

    def motion(t, state):
        x, v = state
        return v, (force + slope * t - spring * x - coulomb - viscous * v) / mass

    def rest(t, state):
        return side * state[1] if t > 0 else 1.0

    def stop(_, state):
        return side * (end_of_travel - state[0])

    for event in (rest, stop):
        event.terminal, event.direction = True, -1
    solution = solve_ivp(
        motion,
        (0.0, duration),
        state,
        method="LSODA",
        jac=lambda *_: np.array([[0.0, 1.0], [-spring / mass, -viscous / mass]]),
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


@pytest.mark.parametrize("name", ["low", "high", "graphite"])
@pytest.mark.parametrize(
    ("excitation", "duration"),
    [(SquareWave(), 20.8), (TriangleWave(period=30.0), 30.0), (SineWave(), 35.5)],
    ids=["square", "triangle", "sine"],
)
def test_bench(benches, name, excitation, duration):
    valve, parameters = benches[name]
    between = 100  # samples on each straight piece of the pressure
    knots = np.arange(0.0, duration + 1e-9, between * SAMPLE_PERIOD)
    pressure = converter_response(excitation.sample(knots), between * SAMPLE_PERIOD)
    times = np.arange((knots.size - 1) * between + 1) * SAMPLE_PERIOD
    found = simulate(valve, parameters, np.interp(times, knots, pressure), SAMPLE_PERIOD)
    position, velocity = integrate(
        valve, parameters, knots, pressure, times, float(found.position[0])
    )
    assert np.ptp(position) > 0.4 * valve.travel
    assert np.abs(found.position - position).max() < ASKED_POSITION
    assert np.abs(found.position - position).max() < AGREED_POSITION
    assert np.abs(found.velocity - velocity).max() < AGREED_VELOCITY


@pytest.mark.parametrize("name", ["low", "high", "graphite"])
def test_kink_at_every_sample(benches, name):
    """Noise of 1 kPa (45 N) on the way from one rest to the next."""
    valve, parameters = benches[name]
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
