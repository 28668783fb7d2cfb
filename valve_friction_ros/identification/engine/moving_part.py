# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The part of a record that is fitted: around the motion of the stem, and of a bounded length."""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.result import Pause
from valve_friction_ros.model.recording import StampedRecord, StampedSignal
from valve_friction_ros.signals import all_around, runs_of, stamped_noise

_AROUND = 2.0
_END = 20
_MOVED_NOISE, _MOVED_SHARE = 8.0, 5e-3
"""Time, s, kept before and after the motion; samples whose median is the place of the stem at rest;
and the distance at which it has left that place, in deviations of its noise and as a share of its
range."""

_LONGEST = 640.0
_LONGEST_SAMPLES = 16_000
_LONGEST_OF_ALL = 5_000.0
"""Longest motion that is fitted: in s, in samples if they are slow, and in s however slow they are.

Chosen: with 32,000 steps of 20 ms and more, what the steps lose of the corners of the pressure
outweighs the noise, and F_v comes out several intervals wrong; 5,000 s take 5 s."""

_WINDOW_SAMPLES, _WINDOWS = 20, 2000
"""Fewest samples in a window in which the stem rests or moves; most windows in a record."""

_CREPT_NOISE, _CREPT_SHARE = 1.5, 2e-4
"""Distance between the means of two windows of a stem that creeps, as for `_MOVED_NOISE`."""

_SAME_NOISE, _SAME_SHARE = 2.0, 2e-3
"""Distance below which a stem has kept its place in a rest, as for `_MOVED_NOISE`."""


class MovingPart(NamedTuple):
    """The part of a record that is fitted, and the rests that were left out of it.

    Each sample of the `record` is shifted earlier by the `pauses` before it, which are on that
    time. `motion` is the time of the motion in the whole record, s; 0 where no rest was looked for.
    """

    record: StampedRecord
    pauses: tuple[Pause, ...] = ()
    motion: float = 0.0

    @property
    def duration(self) -> float:
        """Time from the first to the last position, s."""
        return _duration(self.record)

    @property
    def is_stretch(self) -> bool:
        """Whether motion was left out, too."""
        return self.duration < self.motion


def moving_part(record: StampedRecord) -> MovingPart:
    """Return the part of a record that is fitted.

    A stem at rest, above all at a stop, shows nothing of its friction, so the part begins and ends
    with motion. A record of hours is shortened further: rests are left out, and if it is still too
    long, the stretch in which the stem travels furthest is taken. More motion would cost time and
    improve no number, as the steps of the simulation grow with it.
    """
    record = _around_motion(record)
    period = max(record.drive.period, record.position.period)
    longest = min(max(_LONGEST, _LONGEST_SAMPLES * period), _LONGEST_OF_ALL)
    if _duration(record) <= longest:
        return MovingPart(record)
    windows = _Windows.of(record, period)
    edges, rests = windows.edges, windows.rests()
    motion = _duration(record) - sum(float(edges[last] - edges[first]) for first, last in rests)
    begin, end = windows.furthest(rests, longest)
    inside = [(edges[first], edges[last]) for first, last in rests if begin <= first < end]
    return MovingPart(*_without(_between(record, edges[begin], edges[end]), inside), motion)


def _duration(record: StampedRecord) -> float:
    return float(record.position.time[-1] - record.position.time[0])


def _around_motion(record: StampedRecord) -> StampedRecord:
    """Return the part of a record in which the stem moves, and `_AROUND` before and after it."""
    stem = record.position
    span = float(np.ptp(stem.value))
    reach = max(_MOVED_NOISE * stamped_noise(stem), _MOVED_SHARE * span)
    ends = [float(np.median(part)) for part in (stem.value[:_END], stem.value[-_END:])]
    left = np.flatnonzero(np.abs(stem.value - ends[0]) > reach)
    back = np.flatnonzero(np.abs(stem.value - ends[1]) > reach)
    if not (left.size and back.size):
        return record
    return _between(record, stem.time[left[0]] - _AROUND, stem.time[back[-1]] + _AROUND)


def _between(record: StampedRecord, begin: float, end: float) -> StampedRecord:
    """Return the samples between two times; all of them where too few lie there."""
    signals = []
    for signal in (record.drive, record.position):
        kept = (signal.time >= begin) & (signal.time <= end)
        if np.count_nonzero(kept) < StampedSignal.FEWEST:
            return record
        signals.append(StampedSignal(signal.time[kept], signal.value[kept]))
    return StampedRecord(signals[0], signals[1], record.driven_by)


class _Windows(NamedTuple):
    """Equal windows of a record between `edges`, s, and the motion of the stem in each.

    The mean of the positions, and the distance between the extreme ones, m; a window without a
    sample has the mean of the one before it. `noise` is their deviation, `span` the range of all of
    them, m.
    """

    edges: NDArray[np.float64]
    mean: NDArray[np.float64]
    range: NDArray[np.float64]
    noise: float
    span: float

    @classmethod
    def of(cls, record: StampedRecord, period: float) -> "_Windows":
        """Divide a record whose slower signal has this period."""
        stem = record.position
        duration = _duration(record)
        least = max(_AROUND, _WINDOW_SAMPLES * period, duration / _WINDOWS)
        length = math.ceil(least / period) * period
        # Between two samples, so that joined parts keep the sample period.
        edges = stem.time[0] + np.arange(int(duration / length) + 2) * length - 0.5 * period
        first = np.searchsorted(stem.time, edges[:-1])
        full = np.flatnonzero(np.diff(first, append=stem.time.size))
        starts = first[full]
        counts = np.diff(starts, append=stem.time.size)
        last_full = np.maximum.accumulate(
            np.where(np.isin(np.arange(first.size), full), np.arange(first.size), 0)
        )
        extent = np.zeros(first.size)
        extent[full] = np.maximum.reduceat(stem.value, starts)
        extent[full] -= np.minimum.reduceat(stem.value, starts)
        mean = np.zeros(first.size)
        mean[full] = np.add.reduceat(stem.value, starts) / counts
        return cls(edges, mean[last_full], extent, stamped_noise(stem), float(np.ptp(stem.value)))

    def _beyond(self, noises: float, share: float) -> float:
        return max(noises * self.noise, share * self.span)

    def rests(self) -> list[list[int]]:
        """Return first and one-past-last window of each rest, without windows next to motion."""
        crept = np.abs(np.diff(self.mean)) > self._beyond(_CREPT_NOISE, _CREPT_SHARE)
        moves = self.range > self._beyond(_MOVED_NOISE, _MOVED_SHARE)
        moves[1:] |= crept
        moves[:-1] |= crept
        same = self._beyond(_SAME_NOISE, _SAME_SHARE)
        return [
            [first, last]
            for first, last in runs_of(all_around(~moves, 1))
            if abs(self.mean[last - 1] - self.mean[first]) < same
        ]

    def furthest(self, rests: Iterable[Sequence[int]], longest: float) -> tuple[int, int]:
        """Return first and one-past-last window of the furthest travel in `longest` s of motion."""
        kept = np.ones(self.mean.size, dtype=np.bool_)
        for first, last in rests:
            kept[first:last] = False
        where = np.flatnonzero(kept)
        count = max(int(longest / float(self.edges[1] - self.edges[0])), 1)
        if where.size <= count:
            return 0, self.mean.size
        way = np.concatenate([[0.0], np.cumsum(self.range[where])])
        best = int(np.argmax(way[count:] - way[:-count]))
        return int(where[best]), int(where[best + count - 1]) + 1


def _without(
    record: StampedRecord, rests: Sequence[tuple[float, float]]
) -> tuple[StampedRecord, tuple[Pause, ...]]:
    """Return a record without rests, and the pauses in their places, if samples remain."""
    if not rests:
        return record, ()
    begins, ends = np.array(rests).T
    removed = np.concatenate([[0.0], np.cumsum(ends - begins)])
    signals = []
    for signal in (record.drive, record.position):
        passed = np.searchsorted(ends, signal.time, side="right")
        inside = np.searchsorted(begins, signal.time, side="right") > passed
        time = (signal.time - removed[passed])[~inside]
        if time.size < StampedSignal.FEWEST:
            return record, ()
        signals.append(StampedSignal(time, signal.value[~inside]))
    pauses = tuple(
        Pause(float(begin - before), float(after - before))
        for begin, before, after in zip(begins, removed[:-1], removed[1:], strict=True)
    )
    return StampedRecord(signals[0], signals[1], record.driven_by), pauses
