"""Changes of friction: found, dated, and told from what is no change."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.evidence.series import Series

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
    size : float
        Mean of the blocks after it over that of the blocks before it.
    ratio : float
        Friction after it over friction before it.
    low, high : float
        Interval of the ratio.
    """

    block: int
    earliest: float
    latest: float
    size: float
    ratio: float
    low: float
    high: float

    @property
    def is_declared(self) -> bool:
        """Whether it is large enough to be told."""
        return abs(math.log(self.size)) >= math.log1p(DECLARED)


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
    contrasts = _Contrasts(friction, covariance, _between(friction))
    places = np.arange(1, count)
    old, new, errors = contrasts.between(places, places)
    statistics = np.abs(new - old) / errors
    inner = slice(_LEAST_BLOCKS - 1, count - _LEAST_BLOCKS)
    likeliest = inner.start + int(np.argmax(statistics[inner]))
    size = float(new[likeliest] / old[likeliest])
    # An unlucky scale of few blocks needs more.
    sure = _SURE * math.sqrt(1.0 + 4.0 / count)
    if statistics[likeliest] < sure or max(size, 1.0 / size) < 1.0 + _LET_GO:
        return None
    best = int(np.argmax(statistics))
    place = int(places[best])
    if place == count - 1:  # the last block may hold the change itself, or be an outlier
        return None
    possible = places[statistics**2 >= statistics[best] ** 2 - _DATE] + begin
    # It lies within one of both blocks beside the place, so neither tells the ratio.
    beside = np.array([place])
    found = contrasts.between(np.maximum(beside - 1, 1), beside + 1)
    before, after, error = (float(one[0]) for one in found)
    ratio, share = after / before, 2.0 * error / min(before, after)
    return Split(
        block=begin + place,
        earliest=float(series.begin[max(int(possible[0]) - 1, 0)]),
        latest=float(series.end[min(int(possible[-1]), series.end.size - 1)]),
        size=size,
        ratio=ratio,
        low=ratio * math.exp(-share),
        high=ratio * math.exp(share),
    )


class _Contrasts:
    """Means of the blocks before one place and from another one on, and of their difference.

    All come from sums over parts of the covariance, so hundreds of places cost little.
    """

    def __init__(
        self, friction: NDArray[np.float64], covariance: NDArray[np.float64], between: float
    ) -> None:
        self._sums = np.concatenate(([0.0], np.cumsum(friction)))
        self._parts = np.zeros((friction.size + 1, friction.size + 1))
        self._parts[1:, 1:] = np.cumsum(np.cumsum(covariance, axis=0), axis=1)
        self._between = between

    def between(
        self, ends: NDArray[np.intp], begins: NDArray[np.intp]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return mean before each end, mean from each begin on, and error of the difference, N."""
        sums, parts, last = self._sums, self._parts, self._sums.size - 1
        before, after = ends, last - begins
        upper = parts[ends, ends]
        lower = parts[last, last] - 2.0 * parts[last, begins] + parts[begins, begins]
        mixed = parts[ends, last] - parts[ends, begins]
        variance = upper / before**2 + lower / after**2 - 2.0 * mixed / (before * after)
        scattered = self._between**2 * (1.0 / before + 1.0 / after)
        errors = np.sqrt(np.maximum(variance, 0.0) + scattered)
        return sums[ends] / before, (sums[last] - sums[begins]) / after, errors


def _between(friction: NDArray[np.float64]) -> float:
    """Return the standard deviation of one block, N, by the differences of successive ones."""
    steps = np.abs(np.diff(friction))
    scatter = 1.4826 * float(np.median(steps)) / math.sqrt(2.0)
    return max(scatter, _SCATTER * float(np.median(friction)))
