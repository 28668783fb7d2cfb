# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Static friction from the departures of the stem: the force at which it leaves its rests.

While the stem sticks the actuator force grows or falls until it overcomes F_s:

    F(t) = ±F_s + k·x + F_0 + τ·dF/dt

at the moment t of the departure; the sign is that of the motion, and τ is the lag of the stem. No
law of the sliding friction takes part, and no simulated stem has to jump at the right moment.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.engine.coordinates import (
    IMPERFECTIONS,
    sensor_span,
    zero_drift,
)
from valve_friction_ros.identification.engine.intervals import RECTANGLE, Estimated
from valve_friction_ros.identification.engine.lags import LagPrior
from valve_friction_ros.identification.engine.sliding_averages import (
    MeasuredSignal,
    averaged_twice,
    away_from_stops,
    force_and_stem,
)
from valve_friction_ros.identification.trust.uncertainty import (
    MEDIAN_MAGNITUDE,
    NORMAL_QUANTILE,
    half_width,
)
from valve_friction_ros.model.recording import StampedRecord
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import runs_of

_Array = NDArray[np.float64]

_FEWEST, _FEWEST_ALONE = 4, 6
"""Departures that an estimate needs, a third in each direction: with a known spring, without."""

_REST, _REST_SAMPLES = 0.1, 8
"""Shortest rest before a departure: s and samples."""

_MOVES, _SHARE_OF_TOP = 6.0, 0.01
"""Speed above which the stem moves, in deviations of its noise and as a share of its top speed."""

_FAR = 12.0
_SHARE_OF_RANGE = 0.004
"""Least distance of a departure, in deviations of the stem's noise and as a share of its range."""

_ONSET = 0.15
"""Share of the first peak of the speed at which the stem has left."""

_LINE, _LINE_SAMPLES = 0.05, 6
"""Least time, s, and samples over which a line is fitted to the force before a departure."""

_MODEL = 0.02
"""Standard deviation of a departure's force as a share of it: no two rests are alike."""

_SLIP, _SURELY = 0.08, 3.0
"""The stem slips if the force against friction falls by this share of F_s, and by this many
standard deviations of a departure's force."""

_LEAST_SHARE = 0.015
"""Least half width over the value."""

_TOP = 0.999
"""Quantile of the speed that is taken as the top speed."""

_EARLY, _BETWEEN, _WHEN = 0.85, 0.4, 0.3
"""Lead with which averages show a motion, in averaging lengths; its beginning between two samples,
in samples; and the uncertainty of both, as a share of a length and a sample."""

_FEWEST_OF_LINE = 3
_OUTLIER = 4.0
_CENTRAL = 0.8
"""Deviations beyond which a departure loses weight; and the share of the departures whose scatter
widens the interval."""

_CONTRADICTED = 3.0
"""Standard deviations beyond which the departures contradict the spring of the sliding stem."""

_LINE_OF_SPRING = ("spring_constant", "spring_preload")
_ROUNDS, _L1_ROUNDS = 6, 20


class Departed(NamedTuple):
    """F_s from the departures of the stem, and their number."""

    static_friction: Estimated
    departures: int


class _Departures(NamedTuple):
    """The departures of a record, shape (n,) each.

    `side` is the sign of the motion, `force` (N) and `rate` (N/s) are those of the drive,
    `position` (m) is the position of the rest, `error` (N) the standard deviation of a force, and
    `fall` (N) the fall of the force against friction until the stem rests again. `drift` (N) is the
    possible drift of the force's zero from the middle of the record to its ends.
    """

    side: _Array
    force: _Array
    rate: _Array
    position: _Array
    error: _Array
    fall: _Array
    drift: float


def static_friction(
    record: StampedRecord,
    valve: Valve,
    numbers: Mapping[str, Estimated],
    lag: LagPrior,
) -> Departed | None:
    """Estimate F_s from the forces at which the stem leaves its rests.

    The `numbers` hold spring constant and preload, as far as they are known. None where there are
    too few departures, or the stem does not slip: a force that does not fall while the stem moves
    leaves F_s and F_c the same.
    """
    is_known = {"spring_constant", "spring_preload"} <= numbers.keys()
    force, stem = force_and_stem(record, valve)
    if is_known:
        spring = numbers["spring_constant"].value
    else:
        pressed = np.interp(stem.time, force.time, force.value)
        spring = max(float(np.polyfit(stem.value, pressed, 1)[0]), 0.0)
    found = _departures(force, stem, valve, spring)
    ups = int(np.count_nonzero(found.side > 0))
    least = _FEWEST if is_known else _FEWEST_ALONE
    if min(ups, found.side.size - ups) < least // 3 or found.side.size < least:
        return None
    estimate = _solved(found, numbers if is_known else {}, lag)
    if estimate is None:
        return None
    fall, error = float(np.median(found.fall)), float(np.median(found.error))
    slips = fall > max(_SLIP * estimate.value, _SURELY * error)
    return Departed(estimate, int(found.side.size)) if slips else None


def _departures(
    force: MeasuredSignal, stem: MeasuredSignal, valve: Valve, spring: float
) -> _Departures:
    step = stem.period
    time = np.arange(max(force.time[0], stem.time[0]), min(force.time[-1], stem.time[-1]), step)
    rows: list[tuple[float, ...]] = []
    if time.size > 4 * _REST_SAMPLES:
        position = np.interp(time, stem.time, stem.value)
        length = _averaged_over(position, stem.noise)
        smooth = averaged_twice(position, length)
        speed = np.abs(np.gradient(smooth, step))
        seen = _Stem(time, smooth, speed, length, stem.noise)
        of_noise = stem.noise * math.sqrt(2.0 / length) / (length * step)
        top = float(np.quantile(speed, _TOP))
        moving = speed > max(_MOVES * of_noise, _SHARE_OF_TOP * top)
        least = max(_FAR * stem.noise, _SHARE_OF_RANGE * float(np.ptp(smooth)))
        rest = max(round(_REST / step), _REST_SAMPLES, 2 * length)
        before = 0
        for begin, end in runs_of(moving):
            start, before = before, end
            if begin - start < rest or abs(smooth[end - 1] - smooth[begin]) < least:
                continue
            row = _departure(force, seen, (start, begin, end), spring)
            if row is not None:
                rows.append(row)
    found = np.array(rows).reshape(-1, 6)
    minutes = float(force.time[-1] - force.time[0]) / 60.0
    drift = zero_drift(sensor_span(force.value), minutes)
    side, applied, rate, place, error, fall = found[away_from_stops(found[:, 3], valve)].T
    return _Departures(side, applied, rate, place, error, fall, drift)


def _averaged_over(position: _Array, noise: float) -> int:
    """Return how many samples to average over, twice, so that a jump of the stem stands out."""
    length = 1
    while length < _REST_SAMPLES:
        fastest = float(np.quantile(np.abs(np.gradient(averaged_twice(position, length))), 0.995))
        if noise * math.sqrt(2.0 / length) / length < fastest / (4.0 * _MOVES):
            break
        length += 1
    return length


@dataclass(frozen=True, eq=False)
class _Stem:
    """A stem on a grid of `time`, averaged twice over `length` samples."""

    time: _Array
    position: _Array
    speed: _Array
    length: int
    noise: float


def _departure(
    force: MeasuredSignal, stem: _Stem, run: tuple[int, int, int], spring: float
) -> tuple[float, ...] | None:
    """Return one departure as a row of `_Departures`.

    The stem rests from the first sample of the `run` on, moves from the second on, and rests again
    at the third.
    """
    start, begin, end = run
    step = float(stem.time[1] - stem.time[0])
    first = begin + int(np.argmax(stem.speed[begin : begin + max((end - begin) // 2, 1)]))
    slow = np.flatnonzero(stem.speed[start:first] <= _ONSET * stem.speed[first])
    if slow.size == 0:
        return None
    onset = start + int(slow[-1])
    last = min(end, stem.position.size - 1)
    side = float(np.sign(stem.position[last] - stem.position[onset]))
    # A stem that creeps after it has left is held by less than F_s.
    balance = np.interp(stem.time[start : onset + 1], force.time, force.value)
    balance = side * (balance - spring * stem.position[start : onset + 1])
    after = np.interp(stem.time[last], force.time, force.value) - spring * stem.position[last]
    width = max(round(_LINE / step), 1)
    peak = start + int(np.argmax(averaged_twice(balance, width)))
    onset = peak if peak < onset - width else onset
    moment = float(stem.time[onset]) + (_EARLY * stem.length + _BETWEEN) * step
    span = min(max(_LINE, _LINE_SAMPLES * force.period), moment - float(stem.time[start]))
    taken = (force.time > moment - span) & (force.time <= moment)
    count = int(np.count_nonzero(taken))
    if count < _FEWEST_OF_LINE:
        return None
    away = np.vander(force.time[taken] - moment, 2)
    squares = np.linalg.inv(away.T @ away)
    rate, value = squares @ (away.T @ force.value[taken])
    left = force.value[taken] - away @ np.array([rate, value])
    noise = max(force.noise, math.sqrt(float(left @ left) / (count - 2)))
    place = float(np.mean(stem.position[max(onset - stem.length, start) : onset + 1]))
    when = rate * _WHEN * (stem.length + 1) * step
    error = math.hypot(
        noise * math.sqrt(min(float(squares[1, 1]), 1.0)),
        when,
        spring * stem.noise / math.sqrt(stem.length),
    )
    fall = side * (float(value) - spring * place) - side * float(after)
    return side, float(value), float(rate), place, error, fall


def _solved(
    found: _Departures, numbers: Mapping[str, Estimated], lag: LagPrior
) -> Estimated | None:
    """Solve the balance of all departures, with the known spring unless they contradict it."""
    if not numbers:
        return _estimated(found, {}, lag)[0]
    if found.side.size >= _FEWEST_ALONE:
        alone, known = _estimated(found, {}, lag)
        apart = [numbers[name].value - known[name][0] for name in _LINE_OF_SPRING]
        doubts = [
            math.hypot(numbers[name].half_width / NORMAL_QUANTILE, known[name][1])
            for name in _LINE_OF_SPRING
        ]
        if abs(apart[0]) > _CONTRADICTED * doubts[0]:
            return alone
    return _estimated(found, numbers, lag)[0]


def _estimated(
    found: _Departures, numbers: Mapping[str, Estimated], lag: LagPrior
) -> tuple[Estimated | None, dict[str, tuple[float, float]]]:
    """Return F_s, and the spring with its standard errors.

    The part of F_s that a lag of the record explains is added to the interval: a packing that is
    loaded quickly breaks away earlier, as if there were a lag. So is half the scatter of the
    departures.
    """
    side, rate, size = found.side, found.rate, found.side.size
    middle, half = float(np.mean(found.position)), max(0.5 * float(np.ptp(found.position)), 1e-9)
    place, age = (found.position - middle) / half, np.linspace(-1.0, 1.0, size)
    plain = np.column_stack([side, place, np.ones_like(place)])
    start = by_least_magnitudes(plain, found.force)
    raw = abs(float(start[0]))
    columns = np.column_stack(
        [
            plain,
            rate,
            side * place,
            side * age,
            place**2 - 1.0 / 3.0,
            place * (place**2 - 0.6),
            age,
        ]
    )
    stiff = max(abs(float(start[1])), raw)
    shares = {name: one.deviation for name, one in IMPERFECTIONS.items()}
    deviations = np.array(
        [
            math.inf,
            math.inf,
            math.inf,
            1e-9 if lag.is_known else lag.precision(0.0) ** -0.5,
            shares["along_travel"] * raw,
            shares["in_record"] * raw,
            shares["curvature"] * stiff,
            shares["cubic"] * stiff,
            found.drift,
        ]
    )
    expected = np.zeros(deviations.size)
    if numbers:
        spring, preload = (numbers[name] for name in _LINE_OF_SPRING)
        doubts = [max(one.half_width, 1e-9) / NORMAL_QUANTILE for one in (spring, preload)]
        expected[1:3] = spring.value * half, preload.value + spring.value * middle
        deviations[1:3] = doubts[0] * half, math.hypot(doubts[1], doubts[0] * middle)
    precision = deviations**-2.0
    variance = found.error**2 + (_MODEL * raw) ** 2
    left = np.abs(found.force - plain @ start)
    estimate, covariance = expected, np.eye(expected.size)
    for _ in range(_ROUNDS):
        deviating = left / np.sqrt(variance)
        inflated = max(float(np.median(deviating)) / MEDIAN_MAGNITUDE, 1.0)
        weight = np.minimum(1.0, _OUTLIER * inflated / np.maximum(deviating, 1e-12)) ** 2
        rows = weight / (variance * inflated**2)
        information = columns.T @ (rows[:, None] * columns) + np.diag(precision)
        unit = 1.0 / np.sqrt(np.diag(information))
        covariance = np.linalg.pinv(information * np.outer(unit, unit)) * np.outer(unit, unit)
        estimate = covariance @ (columns.T @ (rows * found.force) + precision * expected)
        left = np.abs(found.force - columns @ estimate)
    error = np.sqrt(np.diag(covariance))
    (slope, level), (of_slope, of_level) = estimate[1:3].tolist(), error[1:3].tolist()
    slope, of_slope = slope / half, of_slope / half
    of_zero = (float(level - slope * middle), math.hypot(of_level, of_slope * middle))
    known = {"spring_constant": (float(slope), float(of_slope)), "spring_preload": of_zero}
    value = float(estimate[0])
    if not value > 0:
        return None, known
    timing = min(abs(float(covariance[0, 3])) * math.sqrt(precision[3]), float(error[0]))
    taken = abs(float(estimate[3]) * float(np.median(side * rate)))
    scatter = 0.5 * float(np.quantile(left, _CENTRAL))
    meaning = RECTANGLE * math.hypot(float(estimate[4]), float(estimate[5]))
    freedom = math.inf if inflated == 1.0 else size - plain.shape[1]
    width = half_width(float(error[0]), freedom)
    whole = max(math.hypot(width, taken, scatter, NORMAL_QUANTILE * meaning), _LEAST_SHARE * value)
    record = math.sqrt(max((whole / NORMAL_QUANTILE) ** 2 - timing**2, 0.0))
    return Estimated(value, whole, record, timing, shared=timing), known


def by_least_magnitudes(columns: _Array, values: _Array) -> _Array:
    """Regress with the least sum of the residuals' magnitudes, which one outlier does not move."""
    weight: _Array = np.ones(values.size)
    estimate: _Array = np.zeros(columns.shape[1])
    for _ in range(_L1_ROUNDS):
        found = np.linalg.lstsq(weight[:, None] * columns, weight * values, rcond=1e-9)[0]
        estimate = np.asarray(found, dtype=np.float64)
        left = np.abs(values - columns @ estimate)
        weight = np.asarray(np.maximum(left, 1e-3 * float(np.max(left)) + 1e-12) ** -0.5)
    return np.asarray(estimate)
