"""Changes of friction: found, dated, and told from what is no change."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.evidence.balance import Series

__all__ = ["DECLARED", "Split", "last_splits"]

_LEAST_BLOCKS = 2
"""Blocks on either side of a change: one alone may be an outlier."""

_SCATTER = 0.015
"""Least standard deviation of one block, as a share of the friction, however quiet it is."""

_SURE = 5.0
"""Standard errors from which two parts of a series are not the same friction.

Normal errors pass it once in 2·10⁶ comparisons; 1,000 hours have some 10⁵."""

_LET_GO = 0.04
"""Change from which the past is let go."""

DECLARED = 0.15
"""Change from which it is declared. Chosen: well beyond what a spring that is not straight, or a
friction along the travel, can pretend, and below the 25 % of the first alarm."""

_DATE = 9.0
"""Square of the statistic, less than at its largest, up to which a date is possible: 3²."""


class Split(NamedTuple):
    """A change of friction between two blocks of a series.

    Attributes
    ----------
    block : int
        First block after it.
    earliest, latest : float
        Interval of its time, as in `Moves`, s.
    ratio : float
        Friction after it over friction before it.
    low, high : float
        Interval of the ratio.
    """

    block: int
    earliest: float
    latest: float
    ratio: float
    low: float
    high: float

    @property
    def is_declared(self) -> bool:
        """Whether it is large enough to be told."""
        return abs(math.log(self.ratio)) >= math.log1p(DECLARED)


def last_splits(series: Series) -> tuple[Split, ...]:
    """Return the changes of a series, each within what came after the one before.

    The generalized likelihood ratio of one step, over all its possible times; it is applied again
    to the blocks after the step. The scatter between blocks is that of successive ones, so a slow
    growth widens it little.
    """
    found: list[Split] = []
    begin = 0
    while True:
        split = _split(series, begin)
        if split is None:
            return tuple(found)
        found.append(split)
        begin = split.block


def _split(series: Series, begin: int) -> Split | None:
    friction, covariance = series.friction[begin:], series.covariance[begin:, begin:]
    count = friction.size
    if count < 2 * _LEAST_BLOCKS or not np.all(friction > 0):
        return None
    between = _between(friction)
    places = np.arange(_LEAST_BLOCKS, count - _LEAST_BLOCKS + 1)
    statistics, befores, afters, errors = np.zeros((4, places.size))
    for place, block in enumerate(places.tolist()):
        step = np.concatenate((np.full(block, -1.0 / block), np.full(count - block, 1.0))).copy()
        step[block:] /= count - block
        error = math.sqrt(
            float(step @ covariance @ step) + between**2 * (1 / block + 1 / (count - block))
        )
        befores[place], afters[place] = friction[:block].mean(), friction[block:].mean()
        errors[place] = error
        statistics[place] = abs(afters[place] - befores[place]) / error
    best = int(np.argmax(statistics))
    before, after, error = befores[best], afters[best], errors[best]
    # An unlucky scale of few blocks needs more.
    sure = _SURE * math.sqrt(1.0 + 4.0 / count)
    if statistics[best] < sure or abs(after - before) < _LET_GO * min(before, after):
        return None
    possible = places[statistics**2 >= statistics[best] ** 2 - _DATE] + begin
    ratio, share = after / before, 2.0 * error / min(before, after)
    return Split(
        block=begin + int(places[best]),
        earliest=float(series.begin[max(int(possible[0]) - 1, 0)]),
        latest=float(series.end[min(int(possible[-1]), series.end.size - 1)]),
        ratio=float(ratio),
        low=float(ratio * math.exp(-share)),
        high=float(ratio * math.exp(share)),
    )


def _between(friction: NDArray[np.float64]) -> float:
    """Return the standard deviation of one block, N, by the differences of successive ones."""
    steps = np.abs(np.diff(friction))
    scatter = 1.4826 * float(np.median(steps)) / math.sqrt(2.0)
    return max(scatter, _SCATTER * float(np.median(friction)))
