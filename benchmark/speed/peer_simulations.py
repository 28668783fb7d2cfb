# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Other ways to simulate the model: scipy's `solve_ivp`, Euler's method, a bare recursion."""

import math

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from valve_friction_ros.model import KarnoppParameters, Valve, balanced_state

__all__ = ["bare_recursion", "euler", "ivp"]


def ivp(
    valve: Valve,
    parameters: KarnoppParameters,
    pressure: NDArray[np.float64],
    period: float,
    method: str,
    tolerance: float,
) -> NDArray[np.float64]:
    """Simulate by `solve_ivp` from rest, a call for each slide, ended by an event where it stops.

    The stuck phases cost nothing but a search for the first sample that breaks the stem loose.

    Parameters
    ----------
    valve, parameters, pressure, period
        As of `simulate`; the stem must not reach a stop, and F_s must be F_c.
    method : str
        Of `solve_ivp`.
    tolerance : float
        Relative tolerance; the absolute one is this share of 10 mm and 10 mm/s.

    Returns
    -------
    ndarray of float, shape (n,)
        Positions, m.
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

        def motion(
            time: float, state: NDArray[np.float64], side: float = side
        ) -> tuple[float, float]:
            index = min(int(time / period), last)
            force = forces[index] + rates[index] * (time - index * period)
            pull = force - spring * state[0] - side * coulomb - viscous * state[1]
            return state[1], pull / mass

        def stops(
            time: float, state: NDArray[np.float64], side: float = side, begin: float = begin
        ) -> float:
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
    forces: NDArray[np.float64],
    period: float,
    substeps: int,
    position: float,
    mass: float,
    spring: float,
    coulomb: float,
    viscous: float,
    limit: float,
) -> NDArray[np.float64]:
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
    pressure: NDArray[np.float64],
    period: float,
    substeps: int,
) -> NDArray[np.float64]:
    """Simulate (1) and (2) by Euler's method with `substeps` steps a sample, compiled.

    Returns
    -------
    ndarray of float, shape (n,)
        Positions, m.
    """
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
def bare_recursion(forces: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Step a linear second-order system by a force that is linear between samples, and no more.

    Returns
    -------
    positions, velocities : ndarray of float, shape (n,)
    """
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
