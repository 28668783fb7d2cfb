# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The motion of a valve under a drive, compiled once per friction law."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from benchmark.reality.plants import laws
from benchmark.reality.plants.laws import INNER, SLIDING, V, X
from benchmark.reality.plants.parameters import ELEMENTS, STEPS, Constants, Law, Plant, constants

GRID = 1e-4
"""Sample period of the simulated signals, s."""

SUMS = 6
"""Number of sums over the record: ∫|dx|, ∫|F·dx|, ∫F_c|dx|, ∫dt of motion, ∫F_c·dt of motion, and
the largest friction without its viscous part."""

_LOWEST, _HIGHEST = -0.15, 1.15
"""Limits of a controller's command."""


class Loop(NamedTuple):
    """The source of the command (0 to 1), and the converter from command to pressure.

    Attributes
    ----------
    closed : bool
        Whether a controller sets the command; else the signal is the command.
    flow : bool
        Whether the controller measures the flow; else it measures the stem position.
    gain, integral_time : float
        Gain (1) and integral time (s) of the PI controller.
    every : int
        Grid points per action of the controller.
    process_lag : float
        First-order lag, s, from opening to measured flow.
    bottom, span : float
        Pressure at command 0, and its change from command 0 to 1, Pa.
    converter_lag : float
        First-order lag of the converter, s.
    """

    closed: bool
    flow: bool
    gain: float
    integral_time: float
    every: int
    process_lag: float
    bottom: float
    span: float
    converter_lag: float


@numba.njit(inline="always")
def _trend(place: float, change: float, bend: float) -> float:
    """Return a change from −½ to ½ of `change` as `place` runs from 0 to 1."""
    middle = place - 0.5
    return change * (middle + bend * (2.0 * middle * middle - 1.0 / 6.0))


@numba.njit
def stem_pull(c: Constants, position: float, pressure: float) -> float:
    """Return the net force of actuator, spring and medium on the stem, N."""
    place = position / c.travel
    area = c.area * (1.0 + c.area_change * (place - 0.5))
    curved = 0.5 * c.spring_curve * (place - 1.0)
    load = c.preload + c.spring * position * (1.0 + curved)
    flow = 0.0
    if c.flow_force != 0.0:
        flow = c.flow_force * max(place, 0.0) ** c.flow_exponent
    return area * (pressure - c.pressure_reference) - load - flow


def _advancer(advance: Callable[..., float]) -> Callable[..., float]:
    """Compile the motion between two grid points for one friction law."""

    @numba.njit(nogil=True)
    def travelled(
        c: Constants,
        state: NDArray[np.float64],
        pressures: NDArray[np.float64],
        target: float,
        shares: tuple[float, float],
        in_time: float,
        step: float,
        sums: NDArray[np.float64],
    ) -> float:
        """Advance by one point, update the sums, and return the friction at the end."""
        distance, work, by_distance, moving, by_time = 0.0, 0.0, 0.0, 0.0, 0.0
        pressure, inside = pressures[0], pressures[1]
        friction, largest = 0.0, 0.0
        for _ in range(round(GRID / step)):
            pressure += shares[0] * (target - pressure)
            inside += shares[1] * (pressure - inside)
            scale = in_time
            if c.along_change != 0.0:
                scale *= 1.0 + _trend(state[X] / c.travel, c.along_change, c.along_bend)
            friction = advance(c, state, stem_pull(c, state[X], inside), scale, step)
            after = state[X] + step * state[V]
            if after < c.lowest or after > c.highest:
                after = min(max(after, c.lowest), c.highest)
                state[V] = 0.0
                state[SLIDING] = 0.0
            moved = abs(after - state[X])
            state[X] = after
            if moved > 0.0:
                distance += moved
                work += abs(friction) * moved
                by_distance += scale * moved
                moving += step
                by_time += scale * step
                largest = max(largest, abs(friction - c.viscous * state[V]))
        pressures[0], pressures[1] = pressure, inside
        sums[0] += distance
        sums[1] += work
        sums[2] += by_distance * c.coulomb
        sums[3] += moving
        sums[4] += by_time * c.coulomb
        sums[5] = max(sums[5], largest)
        return friction

    compiled: Callable[..., float] = travelled
    return compiled


@numba.njit
def _controlled(loop: Loop, error: float, integral: float) -> tuple[float, float]:
    """Return command and integral of a PI controller."""
    rate = loop.gain * error / loop.integral_time
    integral = min(max(integral + rate * loop.every * GRID, _LOWEST), _HIGHEST)
    return min(max(loop.gain * error + integral, _LOWEST), _HIGHEST), integral


@numba.njit
def _seen(loop: Loop, measured: float, opening: float) -> float:
    """Return the measurement of the controller: the opening, or the flow that follows it."""
    if loop.flow:
        return measured + GRID / loop.process_lag * (opening - measured)
    return opening


def _runner(advance: Callable[..., float]) -> Callable[..., Any]:
    """Compile the motion of a whole record for one friction law.

    Each process compiles it again: numba does not notice changes in the functions that a cached
    kernel calls, and a benchmark must not use an outdated plant.
    """
    travelled = _advancer(advance)

    @numba.njit(nogil=True)
    def run(
        c: Constants,
        loop: Loop,
        signal: NDArray[np.float64],
        disturbance: NDArray[np.float64],
        step: float,
        first: int,
        outputs: NDArray[np.float64],
        sums: NDArray[np.float64],
    ) -> None:
        """Fill the rows of `outputs`: pressure, position and friction at each point.

        The record begins at grid point `first`; so do the sums and the trend in time.
        """
        state = np.zeros(INNER + ELEMENTS)
        command = integral = signal[0]
        pressures = np.full(2, loop.bottom + loop.span * command)
        state[X] = _balance(c, pressures[0])
        measured = state[X] / c.travel
        shares = (step / loop.converter_lag, step / c.volume_lag if c.volume_lag > 0.0 else 1.0)
        record = float(max(signal.size - first, 1))
        for point in range(signal.size):
            outputs[0, point], outputs[1, point] = pressures[0], state[X]
            measured = _seen(loop, measured, state[X] / c.travel)
            if not loop.closed:
                command = signal[point]
            elif point % loop.every == 0:
                error = signal[point] - measured - disturbance[point // loop.every]
                command, integral = _controlled(loop, error, integral)
            target = loop.bottom + loop.span * command
            place = max((point - first) / record, 0.0)
            in_time = 1.0 + _trend(place, c.record_change, c.record_bend)
            if point == first:
                sums[:] = 0.0
            outputs[2, point] = travelled(c, state, pressures, target, shares, in_time, step, sums)

    compiled: Callable[..., Any] = run
    return compiled


@numba.njit
def _balance(c: Constants, pressure: float) -> float:
    """Return the equilibrium position, m, by bisection over the travel."""
    low, high = c.lowest, c.highest
    for _ in range(60):
        middle = 0.5 * (low + high)
        if stem_pull(c, middle, pressure) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


_RUNNERS: dict[Law, Callable[..., Any]] = {}


def runner_of(law: Law) -> Callable[..., Any]:
    """Return the compiled motion of a law; the first call compiles it."""
    if law not in _RUNNERS:
        _RUNNERS[law] = _runner(getattr(laws, law.value))
    return _RUNNERS[law]


@dataclass(frozen=True, eq=False)
class Motion:
    """True signals of a valve, `GRID` seconds apart.

    Attributes
    ----------
    begin : float
        Time of the first point, s; the record begins at 0.
    pressure : ndarray of float, shape (n,)
        Pressure at the sensor, Pa.
    position, friction : ndarray of float, shape (n,)
        Stem position (m) and friction force (N, positive against upward motion).
    distance, work : float
        ∫|dx| (m) and ∫|F·dx| (J) of the record.
    coulomb_by_distance, coulomb_by_time : float
        F_c averaged over the distance slid and over the time of motion, N.
    largest : float
        Largest friction without its viscous part, N.
    """

    begin: float
    pressure: NDArray[np.float64]
    position: NDArray[np.float64]
    friction: NDArray[np.float64]
    distance: float
    work: float
    coulomb_by_distance: float
    coulomb_by_time: float
    largest: float

    @property
    def time(self) -> NDArray[np.float64]:
        """Times of the points, s."""
        times: NDArray[np.float64] = np.arange(self.position.size, dtype=np.float64)
        return self.begin + GRID * times


def move(
    plant: Plant,
    loop: Loop,
    signal: NDArray[np.float64],
    disturbance: NDArray[np.float64],
    before: float,
    step: float | None = None,
) -> Motion:
    """Move a valve.

    Parameters
    ----------
    plant : Plant
        The valve.
    loop : Loop
        Converter, and controller if there is one.
    signal : ndarray of float, shape (n,)
        Command or set point, 0 to 1, at the grid points.
    disturbance : ndarray of float, shape (m,)
        Measurement noise of the controller, 1, at each of its actions.
    before : float
        Time from the first point to the start of the record, s.
    step : float, optional
        Largest time step, s; by default that of the law.

    Returns
    -------
    Motion
        Pressure, position and friction at all points; sums over the record only.
    """
    law = plant.friction.law
    substeps = int(np.ceil(GRID / (step or STEPS[law]) - 1e-9))
    outputs, sums = np.empty((3, signal.size)), np.zeros(SUMS)
    first = round(before / GRID)
    fine = GRID / substeps
    runner_of(law)(constants(plant), loop, signal, disturbance, fine, first, outputs, sums)
    distance, work, by_distance, moving, by_time, largest = (float(one) for one in sums)
    return Motion(
        begin=-before,
        pressure=outputs[0],
        position=outputs[1],
        friction=outputs[2],
        distance=distance,
        work=work,
        coulomb_by_distance=by_distance / distance if distance else plant.friction.coulomb,
        coulomb_by_time=by_time / moving if moving else plant.friction.coulomb,
        largest=largest,
    )
