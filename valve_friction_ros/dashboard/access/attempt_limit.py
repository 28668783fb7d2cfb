"""A bound on how often something is tried."""

import math
from collections import OrderedDict, deque
from collections.abc import Callable

__all__ = ["AttemptLimit"]

_MOST_KEYS = 10_000


class AttemptLimit:
    """Counts the attempts of each key, such as an address, within a sliding time.

    The keys that have tried least recently are forgotten above 10,000.

    Parameters
    ----------
    most : int
        Attempts within `period`.
    period : float
        s.
    clock : callable
        Returns the time, s.
    """

    def __init__(self, most: int, period: float, clock: Callable[[], float]) -> None:
        self._most, self._period, self._clock = most, period, clock
        self._times: OrderedDict[str, deque[float]] = OrderedDict()

    def wait(self, key: str) -> int:
        """Return the time until the key may try again, s; 0 if now."""
        times = self._times.get(key, deque())
        if len(times) < self._most:
            return 0
        return max(0, math.ceil(times[0] + self._period - self._clock()))

    def count(self, key: str) -> None:
        """Count an attempt."""
        times = self._times.setdefault(key, deque(maxlen=self._most))
        times.append(self._clock())
        self._times.move_to_end(key)
        if len(self._times) > _MOST_KEYS:
            self._times.popitem(last=False)

    def forgive(self, key: str) -> None:
        """Uncount the latest attempt, which was right."""
        times = self._times.get(key)
        if times:
            times.pop()
