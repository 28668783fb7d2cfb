"""Messages of a stream that never arrived, by the numbers that their publishers gave them."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

__all__ = ["LossCounter", "Losses"]

_RECENT = 60.0
"""Time, s, over which the share of lost messages is told."""
_MOST_A_SECOND = 1e6
"""Messages a second of one publisher beyond which a jump of the numbers is another publisher's."""
_MOST_PUBLISHERS = 16
"""Publishers of a stream that are told apart; then the one that was silent longest is forgotten."""


class Losses(NamedTuple):
    """Messages of a stream.

    Attributes
    ----------
    lost : int
        Those that were published and never taken, in all.
    recently_lost, recently_taken : int
        Those of the last minute.
    silence : float
        Time since the last loss was seen, s; infinite without any.
    """

    lost: int = 0
    recently_lost: int = 0
    recently_taken: int = 0
    silence: float = float("inf")

    @property
    def share(self) -> float:
        """Lost messages over all that were published in the last minute; 0 without any."""
        published = self.recently_lost + self.recently_taken
        return self.recently_lost / published if published else 0.0


@dataclass
class _Publisher:
    """The next number that is expected of a publisher, and when the last one was seen, s."""

    expected: int
    seen: float


class LossCounter:
    """Counts the messages that are missing between those that were taken.

    Each publisher numbers its messages one by one. Which publisher a message is of is not told, so
    a number is that of the publisher which comes closest below it; one that no publisher could have
    reached, or that lies below all, is the first of another publisher.
    """

    def __init__(self) -> None:
        self._publishers: list[_Publisher] = []
        self._recent: deque[list[float]] = deque()
        """Of each second of the last minute: its begin, s, and the lost and the taken messages."""
        self._lost = 0
        self._last_loss: float | None = None

    def take(self, numbers: Sequence[int], now: float) -> None:
        """Take the numbers of messages in the order in which they came, at the time `now`, s."""
        if not numbers:
            return
        lost = 0
        if not self._are_next(numbers, now):
            found = np.asarray(numbers, dtype=np.int64)
            begin = 0
            for end in (*np.flatnonzero(np.diff(found) != 1).tolist(), found.size - 1):
                lost += self._followed(int(found[begin]), int(found[end]), now)
                begin = end + 1
        if not self._recent or now - self._recent[-1][0] >= 1.0:
            self._recent.append([now, 0, 0])
            self._drop_old(now)
        self._recent[-1][1] += lost
        self._recent[-1][2] += len(numbers)
        if lost:
            self._lost, self._last_loss = self._lost + lost, now

    def _are_next(self, numbers: Sequence[int], now: float) -> bool:
        """Take the numbers of a single publisher without a loss; tell if that is what they are."""
        one = self._publishers[0] if len(self._publishers) == 1 else None
        if (
            one is None
            or numbers[0] != one.expected
            or numbers[-1] - one.expected != len(numbers) - 1
        ):
            return False
        one.expected, one.seen = numbers[-1] + 1, now
        return True

    def _drop_old(self, now: float) -> None:
        while self._recent and now - self._recent[0][0] > _RECENT:
            self._recent.popleft()

    def _followed(self, first: int, last: int, now: float) -> int:
        """Take a piece of numbers; return how many are missing before it."""
        known = [one for one in self._publishers if one.expected <= first]
        one = max(known, key=lambda one: one.expected, default=None)
        # What comes within one look was sent since the look before.
        if one is None or first - one.expected > _MOST_A_SECOND * max(now - one.seen, 1e-3):
            if len(self._publishers) >= _MOST_PUBLISHERS:
                self._publishers.remove(min(self._publishers, key=lambda one: one.seen))
            self._publishers.append(_Publisher(last + 1, now))
            return 0
        missing, one.expected, one.seen = first - one.expected, last + 1, now
        return missing

    def forget(self) -> None:
        """Forget the publishers: what comes next is the first of each; the counts stay."""
        self._publishers.clear()

    def losses(self, now: float) -> Losses:
        """Return the counts at the time `now`, s."""
        if self._last_loss is None:
            return Losses()
        self._drop_old(now)
        return Losses(
            self._lost,
            round(sum(lost for _, lost, _ in self._recent)),
            round(sum(taken for _, _, taken in self._recent)),
            now - self._last_loss,
        )
