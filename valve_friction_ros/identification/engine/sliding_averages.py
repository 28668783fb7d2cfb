# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Force and stem of a record averaged alike, and the work of the force over the distance."""

import math
from collections.abc import Callable, Mapping, Sequence
from sys import float_info
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.held_signals import SLOW_SAMPLING, without_repeats
from valve_friction_ros.identification.engine.lags import LagPrior
from valve_friction_ros.identification.trust.uncertainty import MEDIAN_MAGNITUDE
from valve_friction_ros.model.recording import StampedRecord, StampedSignal
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import all_around, quantisation_step, stamped_noise

_Array = NDArray[np.float64]

_FEWEST, FEWEST_EACH_WAY = 20, 6
_MOST = 4000
"""Averages that a regression needs, in all and in each direction, and the most that it takes."""

_SLIDES = 0.02
_SURELY = 3.0
_NOISE_OF_SPEED = 0.1
"""Speed above which the stem slides, as a share of twice the mean speed and in deviations of the
speed's noise; and the largest such noise, as a share of twice the mean speed."""

_OF_STOPS = 3e-3
"""Share of the travel next to a stop that is left out: the stop carries force there."""

_FEW_PAUSES, _PAUSE = 0.05, 3.0
"""A signal is sent on change if more than this share of its pauses are so many times the usual."""

_MARGIN = 2.0
"""Distance of an average from a rest or a reversal, in averaging lengths, at which the stem clearly
slides."""


_SURE_MOVE, _OF_RANGE, _LARGEST_MOVE = 6.0, 5e-3, 0.25
"""Least move that has a speed, in deviations of the noise of a move and as a share of the stem's
range, and the largest share of the range that noise may demand."""

_QUARTILE, _QUARTER_MAGNITUDE = 0.25, 0.3186
"""Share of the pairs of moves that show noise alone, and the magnitude below which that share of
normal noise of unit deviation lies. A stem that jumps in most samples leaves the others."""

_LEAST_PAUSE = 0.5
"""Least time of a move, in lower quartiles of the sampling intervals."""

_WORK_NOISE = 5e-3
_STROKE_NOISE, _STROKE = 6.0, 0.03
"""Largest share of noise in the work; least stroke that is part of the distance, in deviations of
the stem's noise and as a share of its range: a wandering sensor, or its last bit, moves no stem."""

_SURE_STROKE = 3.0
"""Length of a run, over the least stroke, above which it is clearly a stroke."""

_END_NOISE = 3e-3
"""Noise over the range that may be left at the ends of the strokes.

Noise that lasts is alike in both halves of the samples, and lengthens each stroke by some
deviations."""

FINEST_STEP, _SHARED = 4e-3, 4
"""Least time, s, over which the stem is averaged for that; and samples that share what they
average."""

_STUCK = 5
"""Equal samples that show that noise does not carry a signal across the steps of its converter."""

_COVERED = 0.7
"""Least share of the distance that remains after averaging; else the stem reverses within."""

_SLOWER, _KEPT = 4, 0.95
"""Averages over this many averaging times separate lasting noise from motion, where they leave this
share of the distance."""


def averaged_twice(signal: _Array, length: int) -> _Array:
    """Average over `length` samples, twice, centred; the ends are held."""
    if length <= 1:
        return signal
    for before in (length // 2, length - 1 - length // 2):
        padded = np.pad(signal, (before, length - 1 - before), mode="edge")
        sums = np.concatenate([[0.0], np.cumsum(padded)])
        signal = (sums[length:] - sums[:-length]) / length
    return signal


def turns_of(seen: _Array, least: float) -> NDArray[np.intp]:
    """Return the samples at which strokes of at least that length, m, end, first and last too.

    A stem that nowhere moves so far has a single stroke.
    """
    turns = np.flatnonzero(np.diff(np.sign(np.diff(seen)))) + 1
    ends, way = [0], 0
    low = high = far = 0
    for turn in (*turns.tolist(), seen.size - 1):
        place = float(seen[turn])
        if way == 0:
            low = turn if place < seen[low] else low
            high = turn if place > seen[high] else high
            if seen[high] - seen[low] >= least:
                way = 1 if turn == high else -1
                ends, far = [low if way > 0 else high], turn
        elif way * (place - seen[far]) >= 0:
            far = turn
        elif abs(place - seen[far]) >= least:
            ends.append(far)
            far, way = turn, -way
    ends.append(far)
    return np.array(ends)


def _lengths(seen: _Array, measured: _Array, turns: NDArray[np.intp]) -> _Array:
    """Return the length of each stroke, m.

    The strokes end where one half of the samples, `seen`, reverses, and their lengths come from the
    other half: noise makes the extremes of one half, but not the values of the other there.
    """
    return np.asarray(np.diff(measured[turns]) * np.sign(np.diff(seen[turns])))


class MeasuredSignal(NamedTuple):
    """A signal of a sensor, N or m, with the deviation of its noise and its sampling period, s."""

    time: _Array
    value: _Array
    noise: float
    period: float

    @classmethod
    def of(cls, signal: StampedSignal, scale: float, zero: float) -> "MeasuredSignal":
        """Scale a signal and subtract a zero; each repeated value is used once."""
        fresh = without_repeats(signal)
        noise = abs(scale) * stamped_noise(fresh)
        return cls(fresh.time, scale * fresh.value - zero, noise, fresh.period)

    @property
    def is_sent_on_change(self) -> bool:
        """Whether it is sent on change, so that its pauses are no gaps."""
        pauses = np.diff(self.time)
        return float(np.quantile(pauses, 1.0 - _FEW_PAUSES)) > _PAUSE * self.period

    def halves(self, grid: _Array) -> list[_Array]:
        """Return even and odd samples on a grid, averaged where it is coarser than they are.

        A signal that is sent on change needs each sample: both halves are then the whole signal.
        """
        length = int((grid[1] - grid[0]) / self.period)
        if self.is_sent_on_change:
            return [np.interp(grid, self.time, self.value)] * 2
        parts = [(self.time[part::2], self.value[part::2]) for part in (0, 1)]
        return [np.interp(grid, time, averaged_twice(value, length)) for time, value in parts]

    def mean_speed(self, free: NDArray[np.bool_], distance: float) -> float:
        """Return the mean speed ∫|v|·|dx| / ∫|dx| where the stem is `free`, m/s.

        The speed of each move is measured over the shortest time in which the move clearly exceeds
        the noise: a jump from sample to sample, a slow ramp over many samples. Pieces of the record
        without such a move are joined in pairs until they have one. The rest of the `distance` of
        all strokes, m, is near their ends: it is taken to be half as fast.
        """
        free = free[1:] & free[:-1]
        raw, left, times = np.diff(self.value), np.diff(self.value) * free, np.diff(self.time)
        # Two stamps of a clock that jitters may nearly coincide, and no stem is that fast.
        times = np.maximum(times, _LEAST_PAUSE * float(np.quantile(times, _QUARTILE)))
        range_, covered, squares = float(np.ptp(self.value)), 0.0, 0.0
        white = noise = math.sqrt(2.0) * self.noise
        while raw.size > 1:
            # The difference of adjacent moves has three times the variance of a move's noise, which
            # grows with its time as in a random walk at most.
            unsteady = float(np.quantile(np.abs(np.diff(raw)), _QUARTILE)) / _QUARTER_MAGNITUDE
            noise = max(white, min(unsteady / math.sqrt(3.0), math.sqrt(2.0) * noise))
            demanded = min(_SURE_MOVE * noise, _LARGEST_MOVE * range_)
            sure = np.abs(left) >= max(demanded, _OF_RANGE * range_, float_info.min)
            covered += float(np.sum(np.abs(left[sure])))
            squares += float(np.sum((left[sure] ** 2 - white**2) / times[sure]))
            left, times = np.where(sure, 0.0, left), np.where(sure, 0.0, times)
            pairs = np.arange(0, raw.size, 2)
            raw, left, times = (np.add.reduceat(one, pairs) for one in (raw, left, times))
        if not squares > 0.0:
            return 0.0
        fast = squares / covered
        return fast * (0.5 + 0.5 * min(covered / distance, 1.0))


def force_and_stem(record: StampedRecord, valve: Valve) -> tuple[MeasuredSignal, MeasuredSignal]:
    """Return the actuator force, N, and the stem, m, of a record."""
    scale = valve.force_per_drive
    zero = 0.0 if valve.diaphragm_area is None else scale * valve.pressure_reference
    return (
        MeasuredSignal.of(record.drive, scale, zero),
        MeasuredSignal.of(record.position, 1.0, 0.0),
    )


class _Path(NamedTuple):
    """Distance of all strokes, m, its deviation, their number, and the work of friction, J."""

    distance: float
    deviation: float
    strokes: int
    work: float

    def beside(self, slower: "_Path") -> "_Path":
        """Return the distance that the work confirms; `slower` is averaged over a longer time.

        Noise that such averages share lengthens every stroke at its ends, and the force does no
        work there; a fast move adds work in proportion to its distance.
        """
        extra = self.distance - slower.distance
        if not (extra > 0.0 and slower.work > 0.0):
            return self
        per_distance = slower.work / slower.distance
        unreal = extra - min(max((self.work - slower.work) / per_distance, 0.0), extra)
        deviation = math.hypot(self.deviation, unreal)
        return self._replace(distance=self.distance - unreal, deviation=deviation)


class Averages(NamedTuple):
    """Averages of a record for a regression at one averaging time, in two halves where possible.

    `taken` are the indices of the averages of a clearly sliding stem; `is_free` says where it is
    away from the stops and from both ends of the record. `path` is the path of the averages there,
    and `finest` that of averages as short as noise allows.
    """

    time: _Array
    force: list[_Array]
    position: list[_Array]
    velocity: list[_Array]
    length: int
    is_free: NDArray[np.bool_]
    taken: NDArray[np.intp]
    speed: float
    noise: Mapping[str, float]
    path: _Path
    finest: _Path

    @property
    def mean_velocity(self) -> _Array:
        """Mean of both halves, m/s."""
        return 0.5 * (self.velocity[0] + self.velocity[1])

    def distance_with_work(self, noise: float) -> _Path:
        """Return the path that the work confirms; `noise`, m, is the noise of the stem."""
        length, free = _SLOWER * self.length, self.is_free
        calm = [averaged_twice(half[free], length) for half in self.position]
        slower = _path(calm, averaged_twice(self.force[0][free], length), noise)
        whole = max(self.path, self.finest)
        is_kept = slower.distance > _KEPT * self.finest.distance
        return whole.beside(slower if is_kept else self.path)


def averages_of(
    force: MeasuredSignal,
    stem: MeasuredSignal,
    valve: Valve,
    averaging_time: float,
    lag: LagPrior,
) -> Averages | None:
    """Average a record; None where too few averages are of a stem that clearly slides."""
    begin, end = max(force.time[0], stem.time[0]), min(force.time[-1], stem.time[-1])
    step = max(min(force.period, stem.period), averaging_time / 24.0)
    time = np.arange(begin, end, step)
    length = max(round(averaging_time / step), 1)
    lost = round(lag.reach / step) + 2 * length
    if time.size < 2 * lost + _FEWEST:
        return None
    position = [averaged_twice(half, length) for half in stem.halves(time)]
    velocity = [np.gradient(half, step) for half in position]
    mean = 0.5 * (velocity[0] + velocity[1])
    size = np.abs(mean)
    speed = 2.0 * float(np.sum(size**2) / max(np.sum(size), float_info.min))
    per_average = [max(averaging_time / one.period, 1.0) for one in (force, stem)]
    noise = {
        "force": force.noise * math.sqrt(2.0 / (3.0 * per_average[0])),
        "position": stem.noise * math.sqrt(2.0 / (3.0 * per_average[1])),
        "velocity": stem.noise * math.sqrt(2.0 / per_average[1]) / averaging_time,
    }
    side = np.sign(mean) * (size > max(_SLIDES * speed, _SURELY * noise["velocity"]))
    reach = int(_MARGIN * length)
    slides = all_around(side > 0, reach) | all_around(side < 0, reach)
    free = away_from_stops(0.5 * (position[0] + position[1]), valve)
    free[:lost] = free[-lost:] = False
    taken = np.flatnonzero(slides & free)
    taken = taken[taken % max(length // 2, 1) == 0]
    taken = taken[:: taken.size // _MOST + 1]
    up = int(np.count_nonzero(mean[taken] > 0))
    if (
        noise["velocity"] > _NOISE_OF_SPEED * speed
        or taken.size < _FEWEST
        or min(up, taken.size - up) < FEWEST_EACH_WAY
    ):
        return None
    averaged = [averaged_twice(half, length) for half in force.halves(time)]
    path = _path([half[free] for half in position], averaged[0][free], stem.noise)
    finer = _finest_path(force, stem, time, free, averaging_time)
    if path.distance < _COVERED * finer.distance:
        return None
    return Averages(
        time,
        averaged,
        position,
        velocity,
        length,
        free,
        taken,
        speed,
        noise,
        path,
        finer,
    )


def _finest_path(
    force: MeasuredSignal,
    stem: MeasuredSignal,
    time: _Array,
    free: NDArray[np.bool_],
    longest: float,
) -> _Path:
    """Return the distance where the stem is free, averaged until the ends of strokes are sure.

    The averaging time is at most `longest`, s.
    """

    def is_free(grid: _Array) -> NDArray[np.bool_]:
        return np.asarray(free[np.minimum(np.searchsorted(time, grid), time.size - 1)])

    grid, halves = quiet_grid(stem, (float(time[0]), float(time[-1])), longest, is_free)
    where = is_free(grid)
    return _path([half[where] for half in halves], force.halves(grid)[0][where], stem.noise)


def quiet_grid(
    stem: MeasuredSignal,
    between: tuple[float, float],
    longest: float,
    is_free: Callable[[_Array], NDArray[np.bool_]] | None = None,
) -> tuple[_Array, list[_Array]]:
    """Return the finest grid on which the noise of the stem leaves the ends of strokes sure.

    With it come the even and odd samples of the stem, m, averaged from one point to the next. The
    grid lies `between` two times, s, its period is below `longest`, s, and the noise is measured
    where the stem `is_free`.
    """
    period = max(stem.period, FINEST_STEP)
    while True:
        grid: _Array = np.arange(*between, period, dtype=np.float64)
        halves = stem.halves(grid)
        where = slice(None) if is_free is None else is_free(grid)
        seen = [half[where] for half in halves]
        noise = max(_lasting_noise(half) for half in seen)
        if noise <= _END_NOISE * float(np.ptp(seen[0])) or 2.0 * period > longest:
            return grid, halves
        period *= 2.0


def _path(halves: Sequence[_Array], force: _Array, noise: float) -> _Path:
    """Return the distance of all strokes.

    Short strokes may come from a sensor that wanders: in these the force does no work.
    """
    even, odd = halves
    least = least_stroke(even, noise)
    turns = turns_of(even, least)
    lengths = _lengths(even, odd, turns)
    whole = 0.5 * float(np.sum(lengths) + np.sum(_lengths(odd, even, turns_of(odd, least))))
    position = 0.5 * (even + odd)
    moved = np.diff(position, prepend=position[0])
    work = np.diff(np.cumsum(_off_line(force, position) * moved)[turns])
    is_short = lengths < _SURE_STROKE * least
    short, long = float(np.sum(lengths[is_short])), float(np.sum(lengths[~is_short]))
    real, of_long = 1.0, float(np.sum(work[~is_short]))
    if short > 0.0 and of_long > 0.0:
        real = min(max(float(np.sum(work[is_short])) / short * long / of_long, 0.0), 1.0)
    distance = max(whole - (1.0 - real) * short, float_info.min)
    deviation = math.sqrt(real * (1.0 - real)) * short
    return _Path(distance, deviation, max(lengths.size, 1), float(np.sum(work)))


def least_stroke(position: _Array, noise: float) -> float:
    """Return the least length of a stroke, m, of a stem whose sensor has this noise, m."""
    return max(_STROKE_NOISE * noise, _STROKE * float(np.ptp(position)))


def _off_line(force: _Array, position: _Array) -> _Array:
    """Return a force minus its straight-line fit along the travel."""
    away, force = position - np.mean(position), force - np.mean(force)
    square = max(float(away @ away), float_info.min)
    return np.asarray(force - float(away @ force) / square * away)


def _lasting_noise(position: _Array) -> float:
    """Return the deviation of what is not motion in every fourth sample, which averages share.

    It comes from fourth differences, to which even fast swings add little; for white noise of the
    deviation s theirs is √70·s.
    """
    fourth = np.abs(np.diff(position[::_SHARED], _SHARED))
    return float(np.median(fourth)) / (MEDIAN_MAGNITUDE * math.sqrt(70.0)) if fourth.size else 0.0


class Work(NamedTuple):
    """The work of the measured force, averaged as little as its noise allows.

    Averages lose the work of fast moves. `along` are the moves over the distance of all strokes;
    their noise is independent of that of the force, so it biases nothing. `noise`, N, combines the
    effect of chance on the work, half the effect of averaging over twice the time, and the
    uncertainty of the distance; `rounding`, N, is the effect of the force's converter. `speed` is
    the mean speed over the distance, m/s. `by_lag` is the work, N, where the stem is seen late by
    each of the `lags`, s, and `by_sample` its `larger_change` by a sample.
    """

    time: _Array
    force: _Array
    position: _Array
    along: _Array
    strokes: int
    noise: float
    speed: float
    rounding: float = 0.0
    lags: _Array = np.empty(0)
    by_lag: _Array = np.empty(0)
    by_sample: float = 0.0

    @classmethod
    def of(
        cls, force: MeasuredSignal, stem: MeasuredSignal, averages: Averages, lag: LagPrior
    ) -> "Work":
        """Take strokes and stops from the `averages`."""
        step = min(force.period, stem.period)
        time = np.arange(averages.time[0], averages.time[-1], step)
        after = np.minimum(np.searchsorted(averages.time, time), averages.time.size - 1)
        is_free = averages.is_free[after]
        path = averages.distance_with_work(stem.noise)
        longest = averages.length * float(averages.time[1] - averages.time[0]) / step
        length = 2 * max(round(max(force.period, stem.period) / step), 1)

        whole = [np.interp(time, one.time, one.value) for one in (force, stem)]
        sampled = np.minimum(np.searchsorted(averages.time, stem.time), averages.time.size - 1)
        speed = stem.mean_speed(averages.is_free[sampled], path.distance)
        of_force = np.searchsorted(force.time, time)

        def by(length: int) -> "Work":
            pressed, position = (averaged_twice(one, length) for one in whole)
            along = np.gradient(position) * is_free / path.distance
            # The force between two of its samples has the noise of both.
            noise = force.noise * float(np.linalg.norm(np.bincount(of_force, along)))
            return cls(time, pressed, position, along, path.strokes, noise, speed)

        work = by(length)
        while work.noise > _WORK_NOISE * abs(work.of_friction) and 2 * length <= longest:
            length *= 2
            work = by(length)
        hidden = work.of_friction - by(2 * length).of_friction
        of_path = path.deviation / path.distance * work.of_friction
        noise = math.hypot(work.noise, 0.5 * hidden, of_path)
        rounding = work_of_rounding(force, time, work.along)
        return work._replace(
            noise=noise,
            rounding=rounding,
            lags=lag.work_lags,
            by_lag=np.array([work.late_by(one) for one in lag.work_lags]),
            by_sample=larger_change(work.late_by, max(force.period, stem.period)),
        )

    @property
    def of_friction(self) -> float:
        """The work per distance, N, without a straight line of the force along the travel."""
        moving = self.along != 0.0
        return float(self.along[moving] @ _off_line(self.force[moving], self.position[moving]))

    def late_by(self, lag: float) -> float:
        """Compute the work per distance, N, if the stem is seen late by a lag, s."""
        return float(self.along @ np.interp(self.time - lag, self.time, self.force))


def larger_change(late_by: Callable[[float], float], period: float) -> float:
    """Return the larger change of a force, N, if the stem is seen a `period`, s, late or early.

    It is 0 where usual lags include that.
    """
    if period <= SLOW_SAMPLING:
        return 0.0
    here = late_by(0.0)
    return max((late_by(lag) - here for lag in (period, -period)), key=abs)


def work_of_rounding(force: MeasuredSignal, time: _Array, along: _Array) -> float:
    """Return the deviation, N, that the converter of the force makes of its work over the distance.

    A force that stays within one step of the converter is off by the same part of the step
    throughout, which no averaging removes; and again whenever it returns there from the same side.
    """
    step = quantisation_step(force.value)
    if step == 0.0:
        return 0.0
    level = np.unique(force.value, return_inverse=True)[1]
    begins = np.flatnonzero(np.diff(level, prepend=-1))
    lengths = np.diff(begins, append=level.size)
    stuck = np.repeat(lengths >= _STUCK, lengths)
    sample = np.clip(np.searchsorted(force.time, time, side="right") - 1, 0, level.size - 1)
    weight = along * stuck[sample]
    shares = np.bincount(2 * level[sample] + (along > 0), weight)
    return step / math.sqrt(12.0) * float(np.linalg.norm(shares))


def away_from_stops(position: _Array, valve: Valve) -> NDArray[np.bool_]:
    """Return where a stem is away from the stops."""
    if not math.isfinite(valve.travel):
        return np.ones(position.size, dtype=np.bool_)
    near = _OF_STOPS * valve.travel
    return np.asarray((position > near) & (position < valve.travel - near))
