# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Friction by the levels at which force and stem come to rest together.

A stem that follows its force to a level, and stays there with it, is held by its friction. In a
slowly sampled record that is all that is certain: which signal was read first affects each sample
of a move, but none of a level.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from valve_friction_ros.identification.engine.departures import by_least_magnitudes
from valve_friction_ros.identification.engine.friction_curve import FrictionCurve
from valve_friction_ros.identification.engine.intervals import Estimated
from valve_friction_ros.identification.engine.lags import LARGEST_LAG
from valve_friction_ros.identification.engine.sliding_averages import (
    MeasuredSignal,
    away_from_stops,
    force_and_stem,
)
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.identification.trust.uncertainty import (
    MEDIAN_MAGNITUDE,
    NORMAL_QUANTILE,
    half_width,
)
from valve_friction_ros.model.recording import StampedRecord
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import runs_of

_Array = NDArray[np.float64]

_LEAST_TIME, _LEAST_SAMPLES = 10.0, 4
"""Time, s, and samples in which force and stem are still at a level."""

_NOISE, _OF_STEM, _OF_FORCE = 4.0, 4e-3, 0.01
"""Range of a signal that is still, in deviations of its noise and as a share of its whole range."""

_APART, _BEYOND = 0.02, 2.0
"""Distance between two levels, as a share of the stem's range; and the most by which the force goes
beyond a level on the way to it, in ranges of a still force."""

_CREEP = 0.1
"""Share of the friction by which the force may change in the first half of a rest: a force that
creeps on holds the stem by less than its friction."""

_UNSEEN = 0.15
"""Half width due to what a still signal hides, over its range: the dead band of a historian or the
step of a converter shifts all levels that are reached from one side alike."""

_FEWEST, _OUTLIER, _CLEARLY = 3, 4.0, 3.0
"""Levels that are needed in each direction; deviations beyond which a level is left out; and the
least slope of the lines, in its deviations: without a spring, any force holds a stem anywhere."""

_AT_REST, _LARGEST_HALF_WIDTH = 0.06, 0.5
"""Half width over the value by which friction near rest may differ from that at the mean speed; and
the largest half width at which the levels say anything."""


def curve_of_levels(record: StampedRecord, valve: Valve) -> FrictionCurve | None:
    """Return the friction by the levels of a slowly sampled record.

    None for a faster one, whose moves say more; where there are too few levels; and where the force
    is not a line over the position in each direction, rising with it.
    """
    force, stem = force_and_stem(record, valve)
    step = max(force.period, stem.period)
    if step <= LARGEST_LAG:
        return None
    levels = _levels(force, stem, step)
    levels = levels.but(~away_from_stops(levels.rows[:, 1], valve))
    found = _curve(levels.creeping_by(2.0 * levels.force), step)
    if found is None:
        return None
    creep = max(_CREEP * found.numbers[SLIDING].value, 2.0 * levels.force)
    return _curve(levels.creeping_by(creep), step)


class _Levels(NamedTuple):
    """Levels, and the ranges of a `force`, N, and a `stem`, m, that are still.

    Each has one of the `rows`: the side from which the stem came, its position, the force, the
    range of the force in the first half of the rest, and the mean speed of the move before, m/s.
    """

    rows: _Array
    force: float
    stem: float

    def but(self, which: NDArray[np.bool_]) -> "_Levels":
        """Leave some levels out."""
        return self._replace(rows=self.rows[~which])

    def creeping_by(self, most: float) -> "_Levels":
        """Keep the levels whose force changes by no more than `most`, N."""
        return self.but(self.rows[:, 3] > most)


def _levels(force: MeasuredSignal, stem: MeasuredSignal, step: float) -> _Levels:
    time = np.arange(max(force.time[0], stem.time[0]), min(force.time[-1], stem.time[-1]), step)
    length = max(math.ceil(_LEAST_TIME / step), _LEAST_SAMPLES)
    if time.size < 2 * length:
        return _Levels(np.empty((0, 5)), 0.0, 0.0)
    pressed, position = (np.interp(time, one.time, one.value) for one in (force, stem))
    range_ = float(np.ptp(position))
    creep = max(_OF_FORCE * float(np.ptp(pressed)), _NOISE * force.noise)
    resting = max(_OF_STEM * range_, _NOISE * stem.noise)
    rests = _range_ahead(position, length) <= resting
    still = rests & (_range_ahead(pressed, length) <= creep)
    rows: list[tuple[float, ...]] = []
    last, since = math.nan, 0
    for begin, end in runs_of(rests):
        place = float(np.mean(position[begin : begin + length]))
        if abs(place - last) <= _APART * range_:
            since = end
            continue
        side, moved, last = float(np.sign(place - last)), abs(place - last), place
        first = begin + int(np.argmax(still[begin:end]))
        level = float(np.mean(pressed[first : first + length]))
        beyond = float(np.max(side * (pressed[since : first + 1] - level)))
        half = pressed[first : max((begin + end) // 2, first) + length]
        together = bool(still[first]) and first - begin <= length
        if math.isfinite(side) and together and beyond <= _BEYOND * creep:
            speed = moved / (max(begin - since, 1) * step)
            rows.append((side, place, level, float(np.ptp(half)), speed))
        since = end
    return _Levels(np.array(rows).reshape(-1, 5), creep, resting)


def _range_ahead(signal: _Array, length: int) -> _Array:
    """Return the range of a signal in the `length` samples from each on, infinite near its end."""
    found = np.full(signal.size, math.inf)
    windows = sliding_window_view(signal, length)
    found[: len(windows)] = np.ptp(windows, axis=1)
    return found


def _curve(levels: _Levels, step: float) -> FrictionCurve | None:
    """Fit a line over the position to the forces of some levels, shifted by the friction."""
    side, place, force, _, speed = levels.rows.T
    ups = int(np.count_nonzero(side > 0))
    if min(ups, side.size - ups) < _FEWEST or not np.ptp(place) > 0.0:
        return None
    columns = np.column_stack([side, place - np.mean(place), np.ones_like(place)])
    left = np.abs(force - columns @ by_least_magnitudes(columns, force))
    deviation = max(float(np.median(left)) / MEDIAN_MAGNITUDE, _UNSEEN * levels.force)
    usual = left <= _OUTLIER * deviation
    columns, force, side, speed = columns[usual], force[usual], side[usual], speed[usual]
    freedom = force.size - columns.shape[1]
    if freedom < 1 or np.linalg.matrix_rank(columns) < columns.shape[1]:
        return None
    inverse = np.linalg.inv(columns.T @ columns)
    friction, slope, _ = estimate = inverse @ (columns.T @ force)
    left = force - columns @ estimate
    scatter = math.sqrt(float(left @ left) / freedom)
    of_levels = half_width(scatter * math.sqrt(float(inverse[0, 0])), freedom)
    unseen = _UNSEEN * math.hypot(levels.force, float(slope) * levels.stem)
    of_record = math.hypot(of_levels, unseen)
    width = math.hypot(of_record, _AT_REST * abs(float(friction)))
    of_slope = scatter * math.sqrt(float(inverse[1, 1]))
    if slope <= _CLEARLY * of_slope or not width <= _LARGEST_HALF_WIDTH * friction:
        return None
    return FrictionCurve(
        step,
        side * speed,
        side * float(friction) + left,
        np.full_like(left, scatter),
        {SLIDING: Estimated(float(friction), width, of_record / NORMAL_QUANTILE, 0.0)},
        sliding_speed=float(np.mean(speed)),
        stribeck_velocity=0.0,
        lag=0.0,
        inflation=1.0,
        fit=1.0 - scatter / max(float(np.std(force)), np.finfo(float).tiny),
        misfit=scatter,
    )
