"""One stamped signal: the samples of a stream, and the buffer that keeps its last seconds."""

from array import array
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["SampleBuffer", "Samples", "nanoseconds"]

_SLACK = 0.1
"""Share of the window by which a buffer may run over before it is cut, so that cuts are rare."""


def nanoseconds(seconds: float) -> int:
    """Convert seconds to whole nanoseconds, rounding to the nearest."""
    return round(seconds * 1e9)


class Samples(NamedTuple):
    """A stretch of a stamped signal.

    Attributes
    ----------
    stamps : ndarray of int64, shape (n,)
        Times, ns, increasing.
    values : ndarray of float, shape (n,)
        Values at those times, SI units.
    """

    stamps: NDArray[np.int64]
    values: NDArray[np.float64]


class SampleBuffer:
    """The last seconds of one signal, in bounded memory (16 bytes a sample).

    Parameters
    ----------
    window : float
        Time to keep, s.
    """

    def __init__(self, window: float) -> None:
        self._window = nanoseconds(window)
        self._stamps = array("q")
        self._values = array("d")

    def __len__(self) -> int:
        """Count the samples."""
        return len(self._stamps)

    @property
    def last_stamp(self) -> int | None:
        """Stamp of the newest sample, ns, or None."""
        return self._stamps[-1] if self._stamps else None

    def append(self, stamp: int, value: float) -> None:
        """Add a sample; its stamp (ns) must be later than the last one."""
        self._stamps.append(stamp)
        self._values.append(value)
        if stamp - self._stamps[0] > self._window * (1 + _SLACK):
            self._cut()

    def clear(self) -> None:
        """Forget all samples."""
        self._stamps = array("q")
        self._values = array("d")

    def _cut(self) -> None:
        stamps = np.array(self._stamps)
        outside = int(np.searchsorted(stamps, stamps[-1] - self._window))
        del self._stamps[:outside]
        del self._values[:outside]

    def samples(self) -> Samples:
        """Copy the samples of the last window."""
        stamps = np.array(self._stamps, dtype=np.int64)
        values = np.array(self._values, dtype=np.float64)
        if stamps.size == 0:
            return Samples(stamps, values)
        inside = stamps >= stamps[-1] - self._window
        return Samples(stamps[inside], values[inside])
