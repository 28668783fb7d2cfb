# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sliding friction by whole strokes, for a stem that jumps from rest to rest.

Between two reversals the stem has no kinetic energy to give: the mean of the force over the stroke
is the force of the spring at its middle and the mean friction, however the stem moved. A stem that
jumps in less time than a regression of its sliding takes (`friction_curve`) is described as well.
"""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.engine.balance_regression import LagPrior
from valve_friction_ros.identification.engine.imperfections import sensor_span, zero_drift
from valve_friction_ros.identification.engine.intervals import ROUNDING, Budget, Estimated
from valve_friction_ros.identification.engine.numbers import RECTANGLE
from valve_friction_ros.identification.engine.sliding_averages import (
    FINEST_STEP,
    LAGS,
    WORK_LAGS,
    MeasuredSignal,
    away_from_stops,
    least_stroke,
    quiet_grid,
    turns_of,
    work_of_rounding,
)
from valve_friction_ros.identification.trust.uncertainty import (
    CONFIDENCE,
    NORMAL_QUANTILE,
    half_width,
)
from valve_friction_ros.model.valve import Valve

_Array = NDArray[np.float64]

_LONGEST = 0.1
"""Longest time, s, over which the signals are averaged: a stem that hunts rests for seconds."""

_FEWEST_SAMPLES = 20
_COEFFICIENTS = 3
"""Friction, spring and preload, which more strokes than that determine with their scatter."""

_PIECES = 8
"""Pieces, at least, into which the strokes are cut where there are fewer; what a stem has of
kinetic energy between two pieces of a stroke is part of their scatter."""

_ROUNDS = 5
"""Rounds in which regression and scatter come to agree."""

_JUMP, _NEAR = 0.1, np.array([[-4], [-1], [2], [5]])
"""Share of a stroke that the stem jumps from one point of the grid to the next; and the points at
equal distances between which it does, as averaging spreads a jump over three of them."""

_LEAST_SCATTER = 1e-3
"""Deviation of a stroke's force, as a share of the range of the force, that is always assumed."""

_FLAT = 1e-3
"""Precision of a prior that leaves a spring of ten times the slope of the whole record open."""


class StrokeForces(NamedTuple):
    """The force of each stroke, and the friction by all of them.

    Attributes
    ----------
    sliding : Estimated
        Work of friction over the distance, N.
    speed, friction : ndarray of float, shape (s,)
        Mean velocity of each stroke (m/s, negative downward) and its friction, of the same sign, N.
    scatter, deviation : float
        Deviation of a stroke's friction, and that of the force, N.
    mean_speed : float
        Over the distance, m/s.
    averaging_time : float
        Over which the signals are averaged, s.
    """

    sliding: Estimated
    speed: _Array
    friction: _Array
    scatter: float
    deviation: float
    mean_speed: float
    averaging_time: float


def stroke_forces(
    force: MeasuredSignal, stem: MeasuredSignal, valve: Valve, lag: LagPrior
) -> StrokeForces | None:
    """Regress the mean force of each stroke on its direction and its middle.

    Parameters
    ----------
    force, stem : MeasuredSignal
        Actuator force, N, and stem position, m.
    valve : Valve
        Geometry: at its stops nothing is taken.
    lag : LagPrior
        What is known of the time by which the stem is seen late.

    Returns
    -------
    StrokeForces or None
        None where there are too few strokes for their scatter to be seen.
    """
    between = max(force.time[0], stem.time[0]), min(force.time[-1], stem.time[-1])
    if between[1] - between[0] < _FEWEST_SAMPLES * max(stem.period, FINEST_STEP):
        return None
    grid, halves = quiet_grid(stem, between, _LONGEST)
    step = float(grid[1] - grid[0])
    position, pressed = (np.mean(one, axis=0) for one in (halves, force.halves(grid)))
    turns = turns_of(halves[0], least_stroke(halves[0], stem.noise))
    turns = _cut(position, turns, math.ceil(_PIECES / max(turns.size - 1, 1)))
    moves = np.gradient(position) * away_from_stops(position, valve)
    way = np.add.reduceat(moves, turns[:-1])
    is_free = np.abs(way) > 0.0
    few = np.count_nonzero(is_free) <= _COEFFICIENTS or np.ptp(np.sign(way)) < 2.0
    if few or not np.ptp(pressed) > 0.0:
        return None

    def mean(signal: NDArray[np.floating]) -> _Array:
        """Mean of a signal over the way of each stroke."""
        return np.asarray(np.add.reduceat(signal * moves, turns[:-1])[is_free] / way[is_free])

    age = np.linspace(-1.0, 1.0, grid.size)
    drift = zero_drift(sensor_span(pressed), float(grid[-1] - grid[0]) / 60.0)
    stiff = float(np.ptp(pressed) / np.ptp(position))
    side, middle, weight = np.sign(way[is_free]), mean(position), np.abs(way[is_free])
    weight = np.sqrt(weight / np.max(weight))
    columns = np.column_stack(
        [side, stiff * (middle - np.mean(middle)), np.ones_like(side), drift * mean(age)]
    )
    rows = weight[:, None] * columns
    precision = np.diag([0.0, _FLAT, 0.0, 1.0])
    forces, freedom = mean(pressed), float(side.size - _COEFFICIENTS)
    variance = float(np.var(forces))
    for _ in range(_ROUNDS):
        covariance = np.linalg.pinv(rows.T @ rows / variance + precision, hermitian=True)
        weights = (covariance @ (rows.T * weight))[0] / variance
        left = forces - columns @ (covariance @ (rows.T @ (weight * forces)) / variance)
        scatter = math.sqrt(float(np.sum((weight * left) ** 2)) / freedom)
        variance = max(scatter, _LEAST_SCATTER * float(np.ptp(pressed))) ** 2
    by_lag = np.array([weights @ mean(np.interp(grid - late, grid, pressed)) for late in WORK_LAGS])
    value, of_lag = _over_lags(by_lag, lag)
    distance = float(np.sum(np.abs(way)))
    along = moves / distance
    rounding = work_of_rounding(force, grid, along)
    noise = force.noise * math.sqrt(step / force.period * float(along @ along))
    of_record = math.hypot(
        half_width(math.sqrt(float(covariance[0, 0])), freedom),
        NORMAL_QUANTILE * math.hypot(noise, rounding, _unseen_between(pressed, position, way)),
    )
    timing = of_lag / NORMAL_QUANTILE
    sources = {ROUNDING: rounding} if rounding > 0.0 else {}
    squares = np.add.reduceat(np.gradient(halves[0]) * np.gradient(halves[1]), turns[:-1])
    return StrokeForces(
        Estimated(
            value,
            math.hypot(of_record, of_lag),
            Budget(of_record / NORMAL_QUANTILE, timing, sources, timing),
        ),
        (squares / step)[is_free] / way[is_free],
        side * value + left,
        scatter,
        float(np.std(pressed)),
        float(np.sum(squares[is_free])) / (step * distance),
        step,
    )


def _unseen_between(force: _Array, position: _Array, way: _Array) -> float:
    """Return the deviation of the friction by what happens between two points of the grid, N.

    Where the stem jumps from one point to the next, a force that jumps too may do so before it or
    after it: in all jumps likewise. One that goes on as before and after leaves nothing open. `way`
    is that of each stroke, m.
    """
    moves = np.abs(np.diff(position))
    jumps = np.flatnonzero(moves > _JUMP * np.mean(np.abs(way)))
    before, begin, end, after = force[np.clip(jumps + _NEAR, 0, force.size - 1)]
    change = np.abs((end - begin) - 0.5 * ((begin - before) + (after - end)))
    return RECTANGLE * 0.5 * float(moves[jumps] @ change) / float(np.sum(np.abs(way)))


def _cut(position: _Array, turns: NDArray[np.intp], pieces: int) -> NDArray[np.intp]:
    """Return the ends of the pieces of equal length into which strokes are cut."""
    cuts = [turns[-1:]]
    for begin, end in pairwise(turns.tolist()):
        way = np.abs(position[begin:end] - position[begin])
        shares = np.arange(pieces) / pieces * abs(position[end] - position[begin])
        cuts.append(begin + np.searchsorted(np.maximum.accumulate(way), shares))
    return np.unique(np.concatenate(cuts))


def _over_lags(by_lag: _Array, lag: LagPrior) -> tuple[float, float]:
    """Return the mean of a friction over the probable lags, and the half width they leave, N."""
    values = np.interp(LAGS, WORK_LAGS, by_lag)
    if lag.is_known:
        return float(np.interp(0.0, LAGS, values)), 0.0
    probability = np.exp(lag.log_density(LAGS))
    probability /= np.sum(probability)
    mean = float(probability @ values)
    away = np.abs(values - mean)
    order = np.argsort(away)
    last = np.searchsorted(np.cumsum(probability[order]), CONFIDENCE)
    return mean, float(away[order][min(int(last), order.size - 1)])
