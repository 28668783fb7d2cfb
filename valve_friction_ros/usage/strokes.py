"""Distance and reversals of a stem, with a dead band, so that noise counts nothing."""

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["StrokeCounter"]


class StrokeCounter:
    """Adds up the strokes between reversals.

    The stem has reversed once it has come back by more than the dead band from the farthest point
    of its stroke. That point is the turning point, and the distance is the sum of the strokes from
    turning point to turning point, up to the farthest point of the stroke under way. So a signal
    that stays within the dead band counts nothing, and what is counted never shrinks. This is the
    travel accumulator and the cycle counter of digital valve controllers, except that a stroke
    counts whole, however far beyond the dead band it ends.

    Attributes
    ----------
    distance : float
        Distance, m.
    reversals : int
        Reversals.
    """

    def __init__(self) -> None:
        self.distance = 0.0
        self.reversals = 0
        self._direction = 0
        self._low, self._high = math.inf, -math.inf
        self._farthest = 0.0
        """Farthest point of the stroke under way, counted in its direction, m."""

    def begin_anew(self) -> None:
        """Forget the position of the stem; the next one counts no distance."""
        self._direction = 0
        self._low, self._high = math.inf, -math.inf

    def add(self, position: NDArray[np.float64], band: float) -> None:
        """Count positions, m, shape (n,), finite, with a dead band, m."""
        begin = 0
        while begin < position.size:
            follow = self._follow if self._direction else self._wait
            begin += follow(position[begin:], band)

    def _wait(self, position: NDArray[np.float64], band: float) -> int:
        """Follow the stem until its first stroke; return the number of positions used."""
        low = np.minimum(np.minimum.accumulate(position), self._low)
        high = np.maximum(np.maximum.accumulate(position), self._high)
        last = _first(high - low > band)
        self._low, self._high, here = float(low[last]), float(high[last]), float(position[last])
        if self._high - self._low > band:
            self._direction = 1 if here == self._high else -1
            self._farthest = self._direction * here
            self.distance += self._high - self._low
        return last + 1

    def _follow(self, position: NDArray[np.float64], band: float) -> int:
        """Follow a stroke to its end; return the number of positions used."""
        along = self._direction * position
        farthest = np.maximum(np.maximum.accumulate(along), self._farthest)
        last = _first(farthest - along > band)
        turn, here = float(farthest[last]), float(along[last])
        self.distance += turn - self._farthest
        self._farthest = turn
        if turn - here > band:
            self.distance += turn - here
            self.reversals += 1
            self._direction, self._farthest = -self._direction, -here
        return last + 1


def _first(is_so: NDArray[np.bool_]) -> int:
    """Return the first place where it is so, or else the last place."""
    place = int(is_so.argmax())
    return place if is_so[place] else is_so.size - 1
