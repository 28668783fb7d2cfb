"""A stamped signal: the samples of a stream, and the buffer of its last seconds."""

from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["SampleBuffer", "Samples", "nanoseconds"]

_CHUNK = 1024
"""Samples that are kept and dropped together. Chosen: about 1 s at 1 kHz."""

_FEWEST_RECENT = 100
"""Stamps that the sampling period is the median of, if there are as many. Chosen."""

_OVERTAKEN = 1.5
"""Sampling periods by which a stamp may go back without a jump of the clock: two neighbours that
changed places on their way, with jitter, go back by one."""

_LONGEST_OFFSET = int(np.iinfo(np.uint32).max)


def nanoseconds(seconds: float) -> int:
    """Convert seconds to whole nanoseconds, rounding to the nearest."""
    return round(seconds * 1e9)


class Samples(NamedTuple):
    """Part of a stamped signal: times, ns, increasing, and values, SI units, shape (n,) each."""

    stamps: NDArray[np.int64]
    values: NDArray[np.float64]

    @classmethod
    def joined(cls, *parts: "Samples") -> "Samples":
        """Join parts that follow each other; none are an empty one."""
        return cls(
            np.concatenate([np.empty(0, np.int64), *(part.stamps for part in parts)]),
            np.concatenate([np.empty(0), *(part.values for part in parts)]),
        )

    def within(self, begin: int, end: int) -> "Samples":
        """Return those from `begin` to `end`, ns, both included."""
        first = int(np.searchsorted(self.stamps, begin))
        last = int(np.searchsorted(self.stamps, end, side="right"))
        return Samples(self.stamps[first:last], self.values[first:last])

    def averaged(self, count: int) -> "Samples":
        """Return the means of each `count` samples that follow each other, at their mean stamps.

        A motion at constant speed keeps its values at its times, so no signal is late against
        another. The latest samples that do not fill a mean are left out, and so is a mean over more
        than twice the time that so many samples take: it spans a pause.
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
    """Consecutive samples, their stamps as offsets (ns) from the first; a step alone if even."""

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

    def count_before(self, stamp: int) -> int:
        return int(np.searchsorted(self.stamps, stamp))


class SampleBuffer:
    """The last `window` seconds of one signal, in bounded memory.

    A sample takes 8 bytes where 1024 stamps are evenly spaced to the nanosecond, else 12, or 16
    where they last longer than the 4.29 s that 32 bits of nanoseconds hold; at most 1024 samples
    older than the window are still in memory.
    """

    def __init__(self, window: float) -> None:
        self._window = nanoseconds(window)
        self._open = Samples(np.empty(_CHUNK, np.int64), np.empty(_CHUNK, np.float64))
        self._filled = 0
        self._closed: deque[_Chunk] = deque()
        self._last_stamp: int | None = None

    def __len__(self) -> int:
        """Count the samples of the last window."""
        return self._filled + sum(len(chunk.values) for chunk in self._closed) - self._outside()

    @property
    def nbytes(self) -> int:
        """Memory that the samples take, bytes."""
        opened = sum(part.nbytes for part in self._open)
        return opened + sum(chunk.nbytes for chunk in self._closed)

    @property
    def last_stamp(self) -> int | None:
        """Stamp of the newest sample, ns, or None."""
        return self._last_stamp

    def append(self, stamp: int, value: float) -> None:
        """Add a sample; its stamp (ns) must be later than the last one."""
        self._open.stamps[self._filled] = stamp
        self._open.values[self._filled] = value
        self._last_stamp = stamp
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
            self._last_stamp = int(samples.stamps[begin - 1])
            if self._filled == _CHUNK:
                self._close()

    def clear(self) -> None:
        """Forget all samples."""
        self._filled = 0
        self._closed.clear()
        self._last_stamp = None

    def _close(self) -> None:
        """Compress the open chunk, and drop the chunks before the window."""
        self._closed.append(_Chunk.of(*self._open))
        self._filled = 0
        while self._closed[0].last < self._begin():
            self._closed.popleft()

    def _begin(self) -> int:
        """Return the stamp with which the last window begins."""
        return 0 if self._last_stamp is None else self._last_stamp - self._window

    def _outside(self) -> int:
        """Count the samples still in memory that are older than the window."""
        begin, outside = self._begin(), 0
        for chunk in self._closed:
            before = chunk.count_before(begin)
            outside += before
            if before < len(chunk.values):
                return outside
        return outside + int(np.searchsorted(self._open.stamps[: self._filled], begin))

    def overtaken(self, stamps: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Tell which of the next stamps, ns, are a little before a stamp that came earlier.

        A little is 1.5 sampling periods, of the median that these and the last stamps have.
        """
        found = np.zeros(stamps.size, np.bool_)
        if not stamps.size:
            return found
        last = int(stamps[0]) if self._last_stamp is None else self._last_stamp
        if stamps[0] >= last and (stamps[1:] >= stamps[:-1]).all():
            return found
        steps = np.diff(np.concatenate((self._recent(), stamps)))
        if not (forward := steps[steps > 0]).size:
            return found
        most = _OVERTAKEN * float(np.median(forward))
        for place, stamp in enumerate(stamps.tolist()):
            found[place] = 0 < last - stamp <= most
            last = last if found[place] else stamp
        return found

    def _recent(self) -> NDArray[np.int64]:
        """Return the last stamps, at most 1024 and at least as many as there are up to 100."""
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
