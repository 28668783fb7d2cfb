# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Stamped samples: on arrival, in columns, in a buffer, and on a uniform time grid."""

import math
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from valve_friction_ros.held_signals import FEWEST_BUNCHES, LONG_PAUSE, Pauses
from valve_friction_ros.identification.refusal import LittleMotionError, RefusalError
from valve_friction_ros.model.checks import equal_by_fields
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.model.recording import Recording, StampedRecord, StampedSignal
from valve_friction_ros.wording import lasting, percentage

DAY = 86_400_000_000_000
"""A day, ns."""

END_OF_TIME = 2**63 - 1
"""Latest stamp, ns since 1970; the largest integer in SQLite and PostgreSQL."""


_CHUNK = 1024
"""Samples that are kept and dropped together. Chosen: about 1 s at 1 kHz."""

_FEWEST_RECENT = 100
"""Least stamps for the median sampling period, if so many exist. Chosen."""

_OVERTAKEN_PERIODS = 1.5
"""Sampling periods by which a stamp may go back without a jump of the clock: two neighbours swapped
in transport go back by one period, plus jitter."""

_LONGEST_OFFSET = int(np.iinfo(np.uint32).max)


def nanoseconds(seconds: float) -> int:
    """Convert seconds to whole nanoseconds, rounding to the nearest."""
    return round(seconds * 1e9)


class Samples(NamedTuple):
    """Part of a stamped signal: increasing times, ns, and values, SI units, shape (n,) each."""

    stamps: NDArray[np.int64]
    values: NDArray[np.float64]

    @classmethod
    def joined(cls, *parts: "Samples") -> "Samples":
        """Join successive parts; without parts the result is empty."""
        return cls(
            np.concatenate([np.empty(0, np.int64), *(part.stamps for part in parts)]),
            np.concatenate([np.empty(0), *(part.values for part in parts)]),
        )

    def within(self, begin: int, end: int) -> "Samples":
        """Return the samples from `begin` to `end`, ns, both included."""
        first = int(np.searchsorted(self.stamps, begin))
        last = int(np.searchsorted(self.stamps, end, side="right"))
        return Samples(self.stamps[first:last], self.values[first:last])

    def averaged(self, count: int) -> "Samples":
        """Return the means of each `count` successive samples, at their mean stamps.

        A motion at constant speed keeps its values at its times, so averaging adds no lag between
        signals. The last samples are left out if they do not fill a mean. A mean over more than
        twice the usual time spans a pause, and is left out too.
        """
        means = self.stamps.size // count
        if count <= 1 or not means:
            return self
        stamps = self.stamps[: means * count].reshape(means, count)
        values = self.values[: means * count].reshape(means, count)
        period = int(np.median(np.diff(self.stamps)))
        is_whole = stamps[:, -1] - stamps[:, 0] <= 2 * count * period
        since = stamps[:, 0] + (stamps - stamps[:, :1]).sum(axis=1) // count
        return Samples(since[is_whole], values.mean(axis=1)[is_whole])


def _array(numbers: range) -> NDArray[np.int64]:
    return np.arange(numbers.start, numbers.stop, numbers.step, dtype=np.int64)


class _Chunk(NamedTuple):
    """Consecutive samples, with stamps as offsets (ns) from the first; a range if evenly spaced."""

    first: int
    last: int
    offsets: range | NDArray[np.uint32] | NDArray[np.int64]
    values: NDArray[np.float64]

    @classmethod
    def of(cls, stamps: NDArray[np.int64], values: NDArray[np.float64]) -> "_Chunk":
        first, last = int(stamps[0]), int(stamps[-1])
        offsets, kept = stamps - first, values.copy()
        step = int(offsets[1])
        even = range(0, step * stamps.size, step)
        if np.array_equal(offsets, _array(even)):
            return cls(first, last, even, kept)
        fits = last - first <= _LONGEST_OFFSET
        return cls(first, last, offsets.astype(np.uint32) if fits else offsets, kept)

    @property
    def nbytes(self) -> int:
        offsets = self.offsets
        return self.values.nbytes + (0 if isinstance(offsets, range) else offsets.nbytes)

    @property
    def stamps(self) -> NDArray[np.int64]:
        offsets = self.offsets
        if isinstance(offsets, range):
            return self.first + _array(offsets)
        return self.first + offsets.astype(np.int64)


class SampleBuffer:
    """The last `window` seconds of one signal, in bounded memory.

    A sample takes 8 bytes if 1024 stamps are evenly spaced to the nanosecond. Otherwise it takes
    12 bytes, or 16 if the 1024 stamps span more than the 4.29 s that 32 bits of nanoseconds hold.
    At most 1024 samples older than the window remain in memory. `last_stamp` is the stamp of the
    newest sample, ns, or None.
    """

    def __init__(self, window: float) -> None:
        self._window = nanoseconds(window)
        self._open = Samples(np.empty(_CHUNK, np.int64), np.empty(_CHUNK, np.float64))
        self._filled = 0
        self._closed: deque[_Chunk] = deque()
        self.last_stamp: int | None = None

    def __len__(self) -> int:
        """Count the samples of the last window."""
        return self._filled + sum(len(chunk.values) for chunk in self._closed) - self._outside()

    @property
    def nbytes(self) -> int:
        """Memory used by the samples, bytes."""
        opened = sum(part.nbytes for part in self._open)
        return opened + sum(chunk.nbytes for chunk in self._closed)

    def append(self, stamp: int, value: float) -> None:
        """Add a sample; its stamp (ns) must be later than the last one."""
        self._open.stamps[self._filled] = stamp
        self._open.values[self._filled] = value
        self.last_stamp = stamp
        self._filled += 1
        if self._filled == _CHUNK:
            self._close()

    def extend(self, samples: Samples) -> None:
        """Add samples; their stamps must increase, and be later than the last one."""
        begin, count = 0, samples.stamps.size
        while begin < count:
            taken = min(count - begin, _CHUNK - self._filled)
            free = slice(self._filled, self._filled + taken)
            self._open.stamps[free] = samples.stamps[begin : begin + taken]
            self._open.values[free] = samples.values[begin : begin + taken]
            begin += taken
            self._filled += taken
            self.last_stamp = int(samples.stamps[begin - 1])
            if self._filled == _CHUNK:
                self._close()

    def clear(self) -> None:
        """Forget all samples."""
        self._filled = 0
        self._closed.clear()
        self.last_stamp = None

    def _close(self) -> None:
        """Compress the open chunk, and drop the chunks before the window."""
        self._closed.append(_Chunk.of(*self._open))
        self._filled = 0
        while self._closed[0].last < self._begin():
            self._closed.popleft()

    def _begin(self) -> int:
        """Return the stamp at which the last window begins."""
        return 0 if self.last_stamp is None else self.last_stamp - self._window

    def _outside(self) -> int:
        """Count the samples still in memory that are older than the window."""
        begin, outside = self._begin(), 0
        for chunk in self._closed:
            before = int(np.searchsorted(chunk.stamps, begin))
            outside += before
            if before < len(chunk.values):
                return outside
        return outside + int(np.searchsorted(self._open.stamps[: self._filled], begin))

    def overtaken(self, stamps: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return which of the next stamps, ns, are slightly before a stamp that arrived earlier.

        Slightly means by at most 1.5 sampling periods, the median of these and the last stamps.
        """
        found = np.zeros(stamps.size, np.bool_)
        if not stamps.size:
            return found
        last = int(stamps[0]) if self.last_stamp is None else self.last_stamp
        if stamps[0] >= last and (stamps[1:] >= stamps[:-1]).all():
            return found
        steps = np.diff(np.concatenate((self._recent(), stamps)))
        if not (forward := steps[steps > 0]).size:
            return found
        most = _OVERTAKEN_PERIODS * float(np.median(forward))
        for place, stamp in enumerate(stamps.tolist()):
            found[place] = 0 < last - stamp <= most
            last = last if found[place] else stamp
        return found

    def _recent(self) -> NDArray[np.int64]:
        """Return the last stamps: at most 1024, and at least 100 if so many exist."""
        filled = self._open.stamps[: self._filled]
        if self._filled < _FEWEST_RECENT and self._closed:
            return np.concatenate((self._closed[-1].stamps[-_FEWEST_RECENT:], filled))
        return filled

    def samples(self) -> Samples:
        """Copy the samples of the last window."""
        outside = self._outside()
        filled = slice(self._filled)
        stamps = [chunk.stamps for chunk in self._closed]
        values = [chunk.values for chunk in self._closed]
        return Samples(
            np.concatenate((*stamps, self._open.stamps[filled]))[outside:],
            np.concatenate((*values, self._open.values[filled]))[outside:],
        )


COLUMNS = ("time", "pressure", "position")
"""Columns of a table of samples: s, Pa, m."""


MOST_POSITION = 10.0
"""Largest magnitude of a stem position, m. Chosen: the longest pistons of control valves travel
0.6 m, the gates of dams some metres, and a sensor may have another zero."""

_SECOND = 1_000_000_000
"""Nanoseconds per second."""

_LATEST_SECONDS = 9.2e9
"""Largest time, s, rounded down: 64 bits of nanoseconds hold 9.22e9 s."""


class Kind(IntEnum):
    """Kind of a sample that arrived."""

    PRESSURE = 0
    POSITION = 1
    NO_POSITION = 2
    """A stem message without a position of the joint."""


class Arrivals(NamedTuple):
    """Samples that arrived since the last call.

    Attributes
    ----------
    kinds : ndarray of uint8, shape (n,)
        The `Kind` of each sample.
    stamps : ndarray of int64, shape (n,)
        Times, ns.
    values : ndarray of float, shape (n,)
        Pressures (Pa) and positions (m); nan if missing.
    """

    kinds: NDArray[np.uint8]
    stamps: NDArray[np.int64]
    values: NDArray[np.float64]

    @classmethod
    def joined(cls, parts: "Iterable[Arrivals]") -> "Arrivals":
        """Join successive arrivals; without parts the result is empty."""
        nothing = cls(np.empty(0, np.uint8), np.empty(0, np.int64), np.empty(0))
        return cls(*map(np.concatenate, zip(nothing, *parts, strict=True)))

    def plausible(self) -> "Arrivals":
        """Return the arrivals with nan for positions that no valve can reach."""
        beyond = (self.kinds == Kind.POSITION) & (np.abs(self.values) > MOST_POSITION)
        if not beyond.any():
            return self
        return self._replace(values=np.where(beyond, np.nan, self.values))

    def samples(self, kind: Kind) -> Samples:
        """Return the samples of one kind."""
        wanted = self.kinds == kind
        return Samples(self.stamps[wanted], self.values[wanted])


def rows_arrived(table: ArrayLike, labels: Sequence[str] = COLUMNS) -> Arrivals:
    """Split a table into samples of both signals: from each row the pressure, then the position.

    The table has the shape (n, 3), one row per sample, and its `labels` are `COLUMNS`. A time is
    rounded to the finest decimal that floats of this size resolve: nanoseconds below 97 days,
    microseconds for seconds since 1970. A time of whole microseconds is therefore kept exactly.

    Raises ValueError if the table has another shape or other columns, or a time does not fit a
    64-bit clock.
    """
    if tuple(labels) != COLUMNS:
        raise ValueError(f"the columns are {','.join(labels)!r}, not {','.join(COLUMNS)!r}")
    rows = np.asarray(table, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != len(COLUMNS):
        raise ValueError(f"the shape is {rows.shape}, not (n, {len(COLUMNS)})")
    kinds = np.tile(np.array([Kind.PRESSURE, Kind.POSITION], np.uint8), len(rows))
    return Arrivals(kinds, np.repeat(_stamps(rows[:, 0]), 2), rows[:, 1:].ravel())


def _stamps(seconds: NDArray[np.float64]) -> NDArray[np.int64]:
    if not (np.abs(seconds) < _LATEST_SECONDS).all():
        raise ValueError(
            "a time is not finite, or beyond the year 2262, the end of 64-bit nanoseconds"
        )
    apart = 1e9 * np.spacing(np.abs(seconds).max(initial=0.0))
    step = 10 ** max(0, math.ceil(math.log10(apart)))
    whole = np.floor(seconds)
    steps = np.rint((seconds - whole) * (_SECOND / step))
    stamps: NDArray[np.int64] = whole.astype(np.int64) * _SECOND + steps.astype(np.int64) * step
    return stamps


_MOST_MISSING = 0.5
"""Share of a signal's time in gaps above which no record is built.

More than half of the grid would be interpolated, and the noise, a median, would be zero."""

_LONGEST_SILENCE = 600_000_000_000
"""Longest pause, ns, in which a sensor that sends only on change may be silent: ten minutes."""

_NEVER = np.empty(0, np.int64)

_ON_GRID = 1e-3
"""Distance of a stamp from the grid, as a share of its period, up to which the stamp is on it.

Chosen: at 1 kHz that is 1 µs, in which a stem at 0.1 m/s moves by 0.1 µm, below any noise."""


@equal_by_fields
@dataclass(frozen=True)
class Gap:
    """The longest gap of signal `name`: `seconds` before `sample`, `since_start` s after the first.

    All gaps, `count` of them, take the `share` of the time of the signal. `bunches` is the number
    of bunches that the samples come in, with gaps of about one length between them; else 0. The
    text of a gap is a refusal with its remedy.
    """

    name: str
    sample: int
    seconds: float
    since_start: float
    share: float
    count: int = 1
    bunches: int = 0

    @property
    def what(self) -> str:
        """The refusal without its remedy."""
        return (
            f"gap of {lasting(self.seconds)} in {self.name}, {self.since_start:.3f} s after its "
            "first sample"
        )

    @property
    def is_most(self) -> bool:
        """Whether gaps take most of the time, so that no method uses the record."""
        return self.share > _MOST_MISSING

    def remedy(self, usual: str) -> str:
        """Return what to do: as `usual`, unless many gaps take most of the time."""
        if not self.is_most or self.count < FEWEST_BUNCHES:
            return usual
        return (
            f"{self.count} gaps take {percentage(self.share)} of its time; record it at a fixed "
            "rate, or export it without compression"
        )

    def __str__(self) -> str:
        if self.bunches and self.is_most:
            return (
                f"the time stamps of {self.name} come in {self.bunches} bunches, "
                f"{lasting(self.seconds)} apart: stamp each sample with the time of its "
                "measurement, not of its arrival"
            )
        usual = "use a record without a gap, or clear the buffer and record again"
        return f"{self.what}: {self.remedy(usual)}"


def _gap(name: str, samples: Samples, period: int, bad_at: NDArray[np.int64]) -> Gap | None:
    """Return the longest gap, if any; a pause after a bad value, at `bad_at`, is no silence."""
    judged = Pauses.of(*samples)
    pauses = judged.length.copy()
    silent = judged.silences & (pauses <= _LONGEST_SILENCE)
    after_bad = np.searchsorted(samples.stamps, bad_at) - 1
    silent[after_bad[(after_bad >= 0) & (after_bad < silent.size)]] = False
    pauses[silent] = 0
    longest = int(np.argmax(pauses))
    if pauses[longest] <= LONG_PAUSE * period:
        return None
    since_start = float(samples.stamps[longest] - samples.stamps[0]) / 1e9
    whole = float(samples.stamps[-1] - samples.stamps[0])
    gaps = pauses[pauses > LONG_PAUSE * period]
    return Gap(
        name,
        longest + 1,
        float(gaps.max()) / 1e9,
        since_start,
        float(np.sum(gaps)) / whole,
        gaps.size,
        judged.bunches,
    )


def _period(name: str, samples: Samples) -> int:
    """Return the median sampling period, ns; refuse a signal with fewer than two samples."""
    if samples.stamps.size == 0:
        raise LittleMotionError(f"no samples of {name}: check that it is published on this topic")
    if samples.stamps.size == 1:
        raise LittleMotionError(
            f"only one sample of {name}: check that it is sampled, and that it changes"
        )
    return int(np.median(np.diff(samples.stamps)))


def uniform_recording(
    drive: Samples,
    position: Samples,
    names: tuple[str, str] = ("actuator_pressure", "stem_state"),
    driven_by: Drive = Drive.PRESSURE,
    refusal_of: Callable[[Gap], str] = str,
    bad_at: tuple[NDArray[np.int64], NDArray[np.int64]] = (_NEVER, _NEVER),
) -> Recording:
    """Put drive and stem position on the time grid of the stem position.

    The grid starts at the first position within the time that both signals cover, and has the
    median period of the positions. Both signals are interpolated linearly. Positions that are
    already uniform keep their values to the last bit, and so does a drive with the same stamps.

    Parameters
    ----------
    drive : Samples
        Actuator pressure, Pa, or force, N.
    position : Samples
        Stem position, m.
    names : tuple of str
        Names of the two signals in a refusal.
    driven_by : Drive
        Quantity of `drive`.
    refusal_of : callable
        Returns the refusal of a gap.
    bad_at : tuple of ndarray of int, shape (n,)
        Times of the bad values of each signal, ns, which were left out.

    Returns
    -------
    Recording
        Its `start_time` is the stamp of the first sample, s. `stamped` holds the original samples
        if their stamps are not on the grid. `gap` describes the longest pause of more than ten
        periods.

    Raises
    ------
    RefusalError
        If a signal is empty or beyond any sensor, gaps take more than half of its time, or the two
        signals do not overlap.
    """
    period_of_drive = _period(names[0], drive)
    period = _period(names[1], position)
    either = (
        _gap(names[0], drive, period_of_drive, bad_at[0]),
        _gap(names[1], position, period, bad_at[1]),
    )
    gaps = [gap for gap in either if gap is not None]
    if gaps and (most := max(gaps, key=lambda gap: gap.share)).is_most:
        raise RefusalError(refusal_of(most))
    begin = max(drive.stamps[0], position.stamps[0])
    end = min(drive.stamps[-1], position.stamps[-1])
    inside = position.stamps[(position.stamps >= begin) & (position.stamps <= end)]
    if inside.size < 2:
        apart = (position.stamps[0] - drive.stamps[0]) / 1e9
        raise RefusalError(
            f"{names[0]} and {names[1]} do not overlap in time ({names[int(apart > 0)]} begins "
            f"{lasting(abs(apart))} later): check that their clocks agree and that both are "
            "recorded"
        )
    origin = inside[0]
    grid = np.arange(0, inside[-1] - origin + 1, period, dtype=np.float64)
    on_grid = [
        np.interp(grid, (signal.stamps - origin).astype(np.float64), signal.values)
        for signal in (drive, position)
    ]
    try:
        return Recording(
            period / 1e9,
            on_grid[0],
            on_grid[1],
            start_time=float(origin) / 1e9,
            stamped=_at_own_stamps(drive, position, int(origin), period, driven_by),
            driven_by=driven_by,
            gap=refusal_of(gaps[0]) if gaps else "",
        )
    except ValueError as error:
        raise RefusalError(f"{error}: check sensor and unit") from None


def _at_own_stamps(
    drive: Samples, position: Samples, origin: int, period: int, driven_by: Drive
) -> StampedRecord | None:
    """Return both signals at their own stamps; None if these are the grid, or too few."""
    signals = drive, position
    if min(samples.stamps.size for samples in signals) < StampedSignal.FEWEST:
        return None
    same_size = drive.stamps.size == position.stamps.size
    if same_size and all(_is_on_grid(samples, origin, period) for samples in signals):
        return None
    own = (
        StampedSignal((samples.stamps - origin).astype(np.float64) / 1e9, samples.values)
        for samples in signals
    )
    return StampedRecord(next(own), next(own), driven_by)


def _is_on_grid(samples: Samples, origin: int, period: int) -> bool:
    """Return whether every stamp is on the grid, and no sample is missing."""
    since = samples.stamps - origin
    off = np.abs(since - np.rint(since / period) * period)
    return bool(np.max(off) <= _ON_GRID * period and np.max(np.diff(samples.stamps)) < 1.5 * period)


DEFAULT_JOINT = "stem"
"""Default name of the stem's joint."""


def joint_index(names: Sequence[str], positions: int, joint: str) -> int | None:
    """Index of `joint` among `positions` positions; None if it is missing.

    An empty name means the first joint. So does any name if the joints have no names.
    """
    index = 0
    if joint and names:
        if joint not in names:
            return None
        index = names.index(joint)
    return index if index < positions else None


def joint_position(names: Sequence[str], positions: Sequence[float], joint: str) -> float | None:
    """Position (m) of `joint`, or of the first joint for an empty name; None if it is missing.

    A message may omit the names of its joints.
    """
    index = joint_index(names, len(positions), joint)
    return None if index is None else positions[index]


def only_joint(names: Sequence[str]) -> str:
    """Choose the stem's joint among `names`: the only joint, or the joint of the default name.

    Raises ValueError if there are several joints without the default name.
    """
    if len(names) <= 1:
        return "".join(names)
    if DEFAULT_JOINT in names:
        return DEFAULT_JOINT
    raise ValueError(f"several joints ({', '.join(names)}): specify which joint is the stem")
