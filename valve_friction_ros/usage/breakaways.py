"""Starts of a stem after a rest."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["Breakaways"]

_SECOND = 1_000_000_000


class Breakaways:
    """Counts how often a resting stem starts.

    Time is cut into whole seconds of the stamps. The stem rests in a second in which it stays
    within the dead band, and moves in one in which it does not; a breakaway is a second of motion
    after a second of rest. So stick-slip counts each slip beyond the dead band, and a stem that
    creeps by less than the dead band in a second counts nothing.

    Attributes
    ----------
    count : int
        Breakaways.
    """

    def __init__(self) -> None:
        self.count = 0
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget what the stem did; no breakaway counts before it has rested again."""
        self._rested = False
        self._is_whole = False
        self._second: int | None = None
        self._low = self._high = self._last = 0.0
        self._band = 0.0

    def add(self, stamps: NDArray[np.int64], position: NDArray[np.float64], band: float) -> None:
        """Count positions, m, at increasing stamps, ns, shape (n,) each; dead band in m."""
        self._band = band
        seconds = stamps // _SECOND
        begins = np.flatnonzero(np.diff(seconds, prepend=seconds[0] - 1))
        lows = np.minimum.reduceat(position, begins).tolist()
        highs = np.maximum.reduceat(position, begins).tolist()
        lasts = position[np.append(begins[1:], position.size) - 1].tolist()
        for second, low, high, last in zip(
            seconds[begins].tolist(), lows, highs, lasts, strict=True
        ):
            if second != self._second:
                self._end_second()
                self._second = second
            self._low, self._high = min(self._low, low), max(self._high, high)
            self._last = last

    def _end_second(self) -> None:
        """Judge the second that has passed; the next one begins where the stem is."""
        if self._second is None:
            self._low, self._high = np.inf, -np.inf
            return
        moved = self._high - self._low > self._band
        self.count += moved and self._rested
        self._rested = self._is_whole and not moved
        self._is_whole = True
        self._low = self._high = self._last
