# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The simulation of the stem, 62.4 s at 1 kHz; what is told is for one sample."""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from benchmark.harness.rows import Row
from benchmark.speed.measuring import PERIOD, PRESSURES, VALVES, Settings, medians, pressure
from valve_friction_ros.model import BENCH_VALVE, KarnoppParameters, Valve, balanced_state, simulate

_ACCURACY = 1e-9
"""Largest position error of a peer, m: of the order of ours, 0.4 nm."""

_PEER_SAMPLES = {"square": slice(10_400), "sine": slice(10_400), "noisy square": slice(5200, 5600)}
"""Samples for the peers: a period of the square wave, or 0.4 s of sliding."""

_TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
_SUBSTEPS = (100, 1000, 3000, 10_000, 30_000)
_TIMES_FASTER = 1000
_TIMES_FLOOR = 2

Floats = NDArray[np.float64]
Simulation = Callable[[Floats], Floats]


def ivp(
    valve: Valve,
    parameters: KarnoppParameters,
    pressure: Floats,
    period: float,
    method: str,
    tolerance: float,
) -> Floats:
    """Simulate with `solve_ivp` from rest, one call per slide, which ends by an event at rest.

    A stuck phase costs only a search for the sample at which the stem breaks away. The stem must
    not reach a travel stop, and F_s must equal F_c. `tolerance` is relative; the absolute tolerance
    is the same share of 10 mm and 10 mm/s.
    """
    mass, spring = parameters.mass, parameters.spring_constant
    coulomb, viscous = parameters.coulomb_friction, parameters.viscous_friction
    forces = valve.actuator_force(pressure) - parameters.spring_preload
    last = forces.size - 1
    rates = np.append(np.diff(forces), 0.0) / period
    times = np.arange(forces.size) * period
    positions = np.empty(forces.size)
    position = balanced_state(valve, parameters, float(pressure[0])).position
    now = 0.0
    jacobian = np.array([[0.0, 1.0], [-spring / mass, -viscous / mass]])
    while True:
        sample = math.ceil(now / period - 1e-9)
        loose = np.abs(forces[sample:] - spring * position) > coulomb
        if not loose.any():
            positions[sample:] = position
            return positions
        first = sample + int(np.argmax(loose))
        positions[sample:first] = position
        side = math.copysign(1.0, forces[first] - spring * position)
        begin = now
        if first > sample:
            excess = side * (forces[first - 1] - spring * position) - coulomb
            begin = max(now, (first - 1) * period - excess / (side * rates[first - 1]))

        def motion(time: float, state: Floats, side: float = side) -> tuple[float, float]:
            index = min(int(time / period), last)
            force = forces[index] + rates[index] * (time - index * period)
            pull = force - spring * state[0] - side * coulomb - viscous * state[1]
            return state[1], pull / mass

        def stops(time: float, state: Floats, side: float = side, begin: float = begin) -> float:
            return side * float(state[1]) if time > begin else 1.0

        stops.terminal, stops.direction = True, -1
        wanted = times[(times >= begin) & (times <= times[-1])]
        kick = side * 1e-12
        solution = solve_ivp(
            motion,
            (begin, times[-1]),
            (position, kick),
            method=method,
            jac=lambda *_: jacobian,
            events=stops,
            t_eval=wanted,
            rtol=tolerance,
            atol=0.01 * tolerance,
        )
        if len(solution.t):
            positions[first : first + len(solution.t)] = solution.y[0]
        if solution.status != 1:
            return positions
        now, position = float(solution.t_events[0][0]), float(solution.y_events[0][0][0])


@numba.njit(cache=True)
def _euler(
    forces: Floats,
    period: float,
    substeps: int,
    position: float,
    mass: float,
    spring: float,
    coulomb: float,
    viscous: float,
    limit: float,
) -> Floats:
    positions = np.empty_like(forces)
    positions[0] = position
    velocity = 0.0
    step = period / substeps
    for sample in range(1, forces.size):
        rate = (forces[sample] - forces[sample - 1]) / substeps
        for substep in range(substeps):
            pull = forces[sample - 1] + rate * substep - spring * position
            if abs(velocity) < limit:
                if abs(pull) <= coulomb:
                    velocity, acceleration = 0.0, 0.0
                else:
                    acceleration = (pull - math.copysign(coulomb, pull)) / mass
            else:
                friction = math.copysign(coulomb, velocity) + viscous * velocity
                acceleration = (pull - friction) / mass
            position += step * velocity
            velocity += step * acceleration
        positions[sample] = position
    return positions


def euler(
    valve: Valve,
    parameters: KarnoppParameters,
    pressure: Floats,
    period: float,
    substeps: int,
) -> Floats:
    """Simulate (1) and (2) by a compiled Euler method with `substeps` steps per sample."""
    return _euler(
        valve.actuator_force(pressure) - parameters.spring_preload,
        period,
        substeps,
        balanced_state(valve, parameters, float(pressure[0])).position,
        parameters.mass,
        parameters.spring_constant,
        parameters.coulomb_friction,
        parameters.viscous_friction,
        max(parameters.limit_velocity, 1e-7),
    )


@numba.njit(cache=True)
def bare_recursion(forces: Floats) -> tuple[Floats, Floats]:
    """Step a linear second-order system under a force that is linear between samples."""
    positions, velocities = np.empty_like(forces), np.empty_like(forces)
    position, velocity = 0.0, 0.0
    positions[0], velocities[0] = position, velocity
    for sample in range(1, forces.size):
        force, change = forces[sample - 1], forces[sample] - forces[sample - 1]
        place = 0.999 * position + 9e-4 * velocity + 1e-9 * force + 1e-10 * change
        velocity = -0.1 * position + 0.9 * velocity + 1e-6 * force + 1e-7 * change
        position = place
        positions[sample], velocities[sample] = position, velocity
    return positions, velocities


def _loosest(
    candidates: Sequence[tuple[str, Simulation]],
    driving: Floats,
    expected: Floats,
) -> tuple[str, Simulation] | None:
    """Return the first candidate that is accurate enough, or None."""
    for name, candidate in candidates:
        with np.errstate(all="ignore"):
            error = np.max(np.abs(candidate(driving) - expected))
        if error <= _ACCURACY:
            return name, candidate
    return None


def _ladders(parameters: KarnoppParameters) -> Iterator[list[tuple[str, Simulation]]]:
    """Yield each peer with settings from the loosest to the strictest."""
    for method in ("LSODA", "Radau"):
        yield [
            (
                f"solve_ivp {method}, rtol {tolerance:g}",
                lambda p, m=method, t=tolerance: ivp(BENCH_VALVE, parameters, p, PERIOD, m, t),
            )
            for tolerance in _TOLERANCES
        ]
    yield [
        (
            f"Euler, compiled, {substeps} steps a sample",
            lambda p, s=substeps: euler(BENCH_VALVE, parameters, p, PERIOD, s),
        )
        for substeps in _SUBSTEPS
    ]


def _rows(valve_name: str, pressure_name: str, settings: Settings) -> Iterator[Row]:
    parameters, driving = VALVES[valve_name], pressure(pressure_name)
    item = f"{pressure_name}, {valve_name} friction"
    settings.say(f"simulation, {item}")
    forces = BENCH_VALVE.actuator_force(driving)
    ours = partial(simulate, BENCH_VALVE, parameters, sample_period=PERIOD)
    seconds = medians(
        {"ours": lambda: ours(driving), "floor": lambda: bare_recursion(forces)},
        10 * settings.repeats,
    )
    each = 1e9 * seconds["ours"] / driving.size
    floor = 1e9 * seconds["floor"] / driving.size
    told = "bare recursion", f"within {_TIMES_FLOOR} times", each <= _TIMES_FLOOR * floor
    yield Row(item, each, "ns", floor, *told)
    short = driving[_PEER_SAMPLES[pressure_name]]
    expected = ours(short).position
    best_ivp = np.inf
    for ladder in _ladders(parameters):
        found = _loosest(ladder, short, expected)
        if found is None:
            settings.say(f"{ladder[0][0]}: not accurate at any setting")
            continue
        name, simulation = found
        repeats = settings.repeats if "Euler" in name else 1
        cost = medians({"peer": partial(simulation, short)}, repeats)["peer"]
        peer = 1e9 * cost / short.size
        if "solve_ivp" in name:
            best_ivp = min(best_ivp, peer)
        yield Row(item, each, "ns", peer, name)
    goal, met = f"{_TIMES_FASTER} times faster", bool(best_ivp >= _TIMES_FASTER * each)
    yield Row(item, each, "ns", float(best_ivp), "the better solve_ivp", goal, met)


def measure(settings: Settings) -> Iterator[Row]:
    """Measure the simulation against a bare recursion, `solve_ivp` and Euler's method."""
    for pressure_name in PRESSURES:
        for valve_name in VALVES:
            yield from _rows(valve_name, pressure_name, settings)
