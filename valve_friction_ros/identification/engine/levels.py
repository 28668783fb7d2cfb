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
from sys import float_info
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from valve_friction_ros.held_signals import SLOW_SAMPLING
from valve_friction_ros.identification.engine.departures import by_least_magnitudes
from valve_friction_ros.identification.engine.friction_curve import FrictionCurve
from valve_friction_ros.identification.engine.intervals import AT_REST, Estimated
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

_OF_STEM, _OF_FORCE = 4e-3, 0.01
"""Range of a signal that is still, as a share of its whole range; at least that of its noise."""

_APART = 0.02
"""Distance between two levels, as a share of the stem's range."""

_CREEP = 0.05
"""Share of the friction by which the force may go beyond a level on the way to it, or change in the
first half of the rest: a force that goes back holds the stem by less than its friction."""

_GAP = 10.0
"""Periods without a sample after which a stem may have come from anywhere."""

_HIDDEN = 0.15
"""Half width due to what a still signal hides, over its range: the dead band of a historian or the
step of a converter shifts all levels that are reached from one side alike."""

_FEWEST, _MANY = 3, 12
_OUTLIER, _CLEARLY = 4.0, 3.0
"""Levels that are needed in each direction, and in all before one may be left out; deviations
beyond which it is; and the least slope of the lines, in its deviations: without a spring, any force
holds a stem anywhere."""

_AT_REST, _LARGEST_HALF_WIDTH = 0.06, 0.5
"""Half width over the value by which friction near rest may differ from that at the mean speed; and
the largest half width at which the levels say anything."""


class _Levels(NamedTuple):
    """Levels, and the ranges of a `force`, N, and a `stem`, m, that are still.

    Each has one of the `rows`: the side from which the stem came, its position, the force, and the
    mean speed of the move before, m/s.
    """

    rows: _Array
    force: float
    stem: float


def curve_of_levels(record: StampedRecord, valve: Valve) -> FrictionCurve | None:
    """Return the friction by the levels of a slowly sampled record.

    None for a faster one, whose moves say more; where there are too few levels; and where the force
    is not a line over the position in each direction, rising with it.
    """
    force, stem = force_and_stem(record, valve)
    step = max(force.period, stem.period)
    if step <= SLOW_SAMPLING:
        return None
    found = _curve(_levels(force, stem, valve, step), step)
    if found is None:
        return None
    creep = _CREEP * found.numbers[SLIDING].value
    return _curve(_levels(force, stem, valve, step, creep), step)


def _levels(
    force: MeasuredSignal,
    stem: MeasuredSignal,
    valve: Valve,
    step: float,
    creep: float = math.inf,
) -> _Levels:
    """Return the levels whose force creeps by no more than a limit, N, beside its noise."""
    time = np.arange(max(force.time[0], stem.time[0]), min(force.time[-1], stem.time[-1]), step)
    length = max(math.ceil(_LEAST_TIME / step), _LEAST_SAMPLES)
    if time.size < 2 * length:
        return _Levels(np.empty((0, 4)), 0.0, 0.0)
    pressed, position = (_between_gaps(one, time) for one in (force, stem))
    # The usual range of so many samples of normal noise of unit deviation, and one more.
    of_noise = 2.0 * math.sqrt(2.0 * math.log(length)) + 1.0
    ranges = [float(np.nanmax(one) - np.nanmin(one)) for one in (pressed, position)]
    still_force = max(min(_OF_FORCE * ranges[0], creep), of_noise * force.noise)
    still_stem = max(_OF_STEM * ranges[1], of_noise * stem.noise)
    most = max(min(2.0 * still_force, creep), of_noise * force.noise)
    rests = _range_ahead(position, length) <= still_stem
    still = rests & (_range_ahead(pressed, length) <= still_force)
    rows: list[tuple[float, ...]] = []
    last, since = math.nan, 0
    for begin, end in runs_of(rests):
        place = float(np.mean(position[begin : begin + length]))
        if not abs(place - last) <= _APART * ranges[1]:
            side, moved, last = float(np.sign(place - last)), abs(place - last), place
            first = begin + int(np.argmax(still[begin:end]))
            level = float(np.mean(pressed[first : first + length]))
            beyond = float(np.max(side * (pressed[since : first + 1] - level)))
            half = pressed[first : max((begin + end) // 2, first) + length]
            together = still[first] and first - begin <= length
            if together and max(beyond, float(np.ptp(half))) <= most:
                speed = moved / (max(begin - since - length + 1, 1) * step)
                rows.append((side, place, level, speed))
        since = end
    found = np.array(rows).reshape(-1, 4)
    return _Levels(found[away_from_stops(found[:, 1], valve)], still_force, still_stem)


def _between_gaps(signal: MeasuredSignal, time: _Array) -> _Array:
    """Return a signal at some times; nan in its gaps, which one that is sent on change has not."""
    values = np.interp(time, signal.time, signal.value)
    if not signal.is_sent_on_change:
        after = np.clip(np.searchsorted(signal.time, time), 1, signal.time.size - 1)
        values[np.diff(signal.time)[after - 1] > _GAP * signal.period] = math.nan
    return values


def _range_ahead(signal: _Array, length: int) -> _Array:
    """Return the range of a signal in the `length` samples from each on, infinite near its end."""
    found = np.full(signal.size, math.inf)
    windows = sliding_window_view(signal, length)
    found[: len(windows)] = np.ptp(windows, axis=1)
    return found


def _columns(side: _Array, place: _Array) -> _Array:
    """Return the columns of friction, slope and middle force of the lines."""
    return np.column_stack([side, place - np.mean(place), np.ones_like(place)])


def _curve(levels: _Levels, step: float) -> FrictionCurve | None:
    """Fit a line over the position to the forces of some levels, shifted by the friction."""
    side, place, force, speed = levels.rows.T
    if side.size >= _MANY:
        columns = _columns(side, place)
        left = np.abs(force - columns @ by_least_magnitudes(columns, force))
        deviation = max(float(np.median(left)) / MEDIAN_MAGNITUDE, _HIDDEN * levels.force)
        side, place, force, speed = levels.rows[left <= _OUTLIER * deviation].T
    ups = int(np.count_nonzero(side > 0))
    if min(ups, side.size - ups) < _FEWEST:
        return None
    columns = _columns(side, place)
    freedom = force.size - columns.shape[1]
    if np.linalg.matrix_rank(columns) < columns.shape[1]:
        return None
    inverse = np.linalg.inv(columns.T @ columns)
    friction, slope, _ = estimate = inverse @ (columns.T @ force)
    left = force - columns @ estimate
    scatter = math.sqrt(float(left @ left) / freedom)
    of_levels = half_width(scatter * math.sqrt(float(inverse[0, 0])), freedom)
    hidden = _HIDDEN * math.hypot(levels.force, float(slope) * levels.stem)
    of_record = math.hypot(of_levels, hidden)
    at_rest = _AT_REST * abs(float(friction))
    width = math.hypot(of_record, at_rest)
    sources = {AT_REST: at_rest / NORMAL_QUANTILE}
    of_slope = scatter * math.sqrt(float(inverse[1, 1]))
    if slope <= _CLEARLY * of_slope or not width <= _LARGEST_HALF_WIDTH * friction:
        return None
    return FrictionCurve(
        step,
        side * speed,
        side * float(friction) + left,
        np.full_like(left, scatter),
        {SLIDING: Estimated(float(friction), width, of_record / NORMAL_QUANTILE, sources=sources)},
        sliding_speed=float(np.mean(speed)),
        stribeck_velocity=0.0,
        lag=0.0,
        inflation=1.0,
        fit=1.0 - scatter / max(float(np.std(force)), float_info.min),
        misfit=scatter,
    )
