# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The lag of the stem behind the force: its prior, its likelihood, and its effect on numbers.

While the stem slides, F_v/k delays it as a lag of the signals does. Rests and reversals tell them
apart: a late stem leaves its rest late, viscous friction does not hold it. The likelihood of the
whole lag is therefore followed through the fits of the simulated stem, each held at a lag
(`LagProfile`), and every number is integrated over it under one heavy-tailed prior.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from sys import float_info

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.held_signals import SLOW_SAMPLING
from valve_friction_ros.identification.engine.coordinates import TIMING
from valve_friction_ros.identification.engine.posterior_fit import PosteriorFit
from valve_friction_ros.identification.settings import TIMING_UNCERTAINTY
from valve_friction_ros.identification.trust.uncertainty import CONFIDENCE, NORMAL_QUANTILE
from valve_friction_ros.model.recording import StampedRecord

_Array = NDArray[np.float64]

LARGEST_LAG = SLOW_SAMPLING
_STATED, _OF_RECORD = 3.0, 0.1
"""Largest lag that is possible, s. Where a larger timing uncertainty is stated, the largest lag in
deviations of it, and at most as a share of the record."""

_STEP, _MOST_STEPS = 1e-3, 1500
"""Step between the lags, s, and about the largest number of steps in each direction."""

_WORKS, _EVERY = 150, 10
"""The work of the force is computed at every tenth lag, and at about so many at most."""

USUAL_LAG = 4e-3
"""Scale, s, of the prior of the lag where no timing is stated, a Cauchy distribution.

One controller stamps both signals to some milliseconds; damped transmitters, tubing and separate
clocks add up to tens. Half of all plants lie within this scale, 95 % within 51 ms."""

_WIDER = 5.0
"""Deviation, in scales of the lag's prior, of a Gaussian that replaces the prior about zero."""

_LEAST_DEVIATION = 5e-4
"""Least deviation, s, of a lag from any record: the model has one lag, a valve many."""

_NEAR = 3.0
"""Deviations about the lag of a separate fit within which its numbers hold; a fit that is nearer to
the likeliest than twice as many lies in the same valley."""

_LIKELY = 16.0
"""Cost over the best up to which fits show how rough the likelihood is."""

_DEPENDENT = 1.5
"""Factor by which the logarithm of the likelihood of a lag is too sharp: the residuals of one move
are correlated. Found on drawn valves."""

_MISLED, _TEMPERED = 0.03, 10.0
"""Share of records in which the simulated stem gives a wrong lag, whatever its residual: presliding
that it does not know, or a sensor that holds its value. And the factor by which the logarithm of
the likelihood is too sharp in these. Drawn valves show about this share, and no larger factor."""

_NEGLIGIBLE, _HALVINGS = 1e-6, 24
"""Probability of a lag that affects no interval; halvings by which an interval is found."""


@dataclass(frozen=True)
class LagPrior:
    """Prior of the time by which the stem is seen late.

    A Gaussian of this deviation, s; with None the heavy-tailed prior of a plant without a stated
    timing. No lag is larger than its `reach`, s.
    """

    deviation: float | None = None
    reach: float = LARGEST_LAG

    @classmethod
    def of(cls, deviation: float | None, record: StampedRecord) -> "LagPrior":
        """Return the prior for a record, with a stated deviation, s, if any."""
        duration = float(record.position.time[-1] - record.position.time[0])
        stated = min(_STATED * (deviation or 0.0), _OF_RECORD * duration)
        return cls(deviation, max(LARGEST_LAG, stated))

    @cached_property
    def lags(self) -> _Array:
        """Lags that are possible, s."""
        count = math.ceil(min(round(self.reach / _STEP), _MOST_STEPS) / self._every) * self._every
        return np.linspace(-self.reach, self.reach, 2 * count + 1, dtype=np.float64)

    @cached_property
    def work_lags(self) -> _Array:
        """Lags, s, at which the work of the force is computed."""
        return self.lags[:: self._every]

    @property
    def _every(self) -> int:
        """Ratio of the steps of `work_lags` and `lags`, which divides the lags on either side."""
        return max(2 * min(round(self.reach / _STEP), _MOST_STEPS) // _WORKS, _EVERY)

    @property
    def is_known(self) -> bool:
        """Whether there is certainly no lag."""
        return self.deviation == 0.0

    @property
    def deviation_of_all(self) -> float:
        """Largest usual deviation of the lag, s."""
        return TIMING_UNCERTAINTY if self.deviation is None else self.deviation

    @property
    def deviation_of_each(self) -> float:
        """Deviation of each source of a lag, s: they share a stated one, else each may have all."""
        return self.deviation_of_all / (1.0 if self.deviation is None else math.sqrt(len(TIMING)))

    def precision(self, lag: float) -> float:
        """Return the precision, 1/s², of a Gaussian that stands for the prior at `lag`.

        It is wider than the heavy-tailed prior, so that a regression is not held at zero lag.
        """
        if self.deviation is not None:
            return 1.0 / max(self.deviation, 1e-9) ** 2
        return 1.0 / ((_WIDER * USUAL_LAG) ** 2 + lag * lag)

    def log_density(self, lags: _Array) -> _Array:
        """Return the logarithm of the density at each lag, s, up to a constant."""
        if self.deviation is not None:
            return np.asarray(-0.5 * (lags / max(self.deviation, 1e-9)) ** 2)
        return np.asarray(-np.log1p((lags / USUAL_LAG) ** 2))

    def probability(self, log_likelihood: _Array) -> _Array:
        """Return the probability of each of `lags`, by this prior and a likelihood."""
        log = self.log_density(self.lags) + log_likelihood
        probability = np.exp(log - log.max())
        return np.asarray(probability / np.sum(probability))


_DEVIATIONS: _Array = np.linspace(-9.0, 9.0, 3601, dtype=np.float64)
_PROBABILITIES: _Array = np.array([0.5 * math.erfc(-one / math.sqrt(2.0)) for one in _DEVIATIONS])


def normal(deviations: _Array) -> _Array:
    """Return the normal distribution function, to 1e-6."""
    return np.interp(deviations, _DEVIATIONS, _PROBABILITIES)


def mixture_half_width(
    weights: _Array, values: _Array, deviations: _Array, centre: float | None = None
) -> float:
    """Return half the width of the interval about the centre that holds `CONFIDENCE`.

    The weights of the normal distributions add up to one; the centre is their mean by default.
    """
    if centre is None:
        centre = float(np.sum(weights * values))
    spread = float(np.sum(weights * (deviations**2 + (values - centre) ** 2)))
    low, high = 0.0, 20.0 * math.sqrt(spread)
    some = weights > _NEGLIGIBLE
    weight, away = weights[some], centre - values[some]
    deviation = np.maximum(deviations[some], float_info.min)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        inside = normal((away + middle) / deviation) - normal((away - middle) / deviation)
        low, high = (middle, high) if weight @ inside < CONFIDENCE else (low, middle)
    return high


def share_of_timing(half_width: float, record: float, timing: float) -> float:
    """Return the standard uncertainty of the lag as its share of an interval.

    The tails of the lag are heavier than normal, so its share is limited to what the `half_width`
    leaves beside the uncertainty of the `record`.
    """
    whole = half_width / NORMAL_QUANTILE
    return min(timing, math.sqrt(max(whole**2 - record**2, 0.0)))


def spread_of(probability: _Array, lags: _Array) -> float:
    """Return the deviation of some lags by their probability, s, at least `_LEAST_DEVIATION`."""
    probability = probability / np.sum(probability)
    mean = float(probability @ lags)
    return math.sqrt(max(float(probability @ (lags - mean) ** 2), _LEAST_DEVIATION**2))


@dataclass(frozen=True, eq=False)
class LagProfile:
    """Likelihood of the lag, from fits that are held at several lags, in that order.

    No valley leads from these to the fits `apart`. All are compared by the `inflation` of the
    residual of the best fit. The lags are those of the `prior`.
    """

    fits: Sequence[PosteriorFit]
    apart: Sequence[PosteriorFit]
    inflation: float
    prior: LagPrior

    @classmethod
    def of(cls, fits: Sequence[PosteriorFit], prior: LagPrior) -> "LagProfile | None":
        """Return the profile of some fits; None if no fit has a lag, or the best lag is absurd."""
        able = [one for one in fits if one.lags.any() and not one.is_apart]
        if not able:
            return None
        inflation = min(able, key=lambda one: one.objective).inflation
        best = min(able, key=lambda one: one.cost(inflation))
        if abs(best.lag) >= prior.reach:
            return None
        found: list[PosteriorFit] = []
        for one in sorted(able, key=lambda one: one.cost(inflation)):
            if all(abs(one.lag - other.lag) > _LEAST_DEVIATION for other in found):
                found.append(one)
        profile = cls(sorted(found, key=lambda one: one.lag), (), inflation, prior)
        reach = 2.0 * _NEAR * profile.deviation
        apart = [
            one
            for one in fits
            if one.is_apart and reach < abs(one.lag - best.lag) and abs(one.lag) < prior.reach
        ]
        return replace(profile, apart=apart)

    @cached_property
    def lags(self) -> _Array:
        """Lag of each fit, s."""
        return np.array([one.lag for one in self.fits])

    @cached_property
    def costs(self) -> _Array:
        """Twice the negative logarithm of the likelihood of each fit, relative to the best."""
        costs = np.array([one.cost(self.inflation) for one in self.fits])
        return np.asarray(costs - np.min(costs))

    @cached_property
    def best(self) -> PosteriorFit:
        """The likeliest fit."""
        return self.fits[int(np.argmin(self.costs))]

    @cached_property
    def deviation(self) -> float:
        """Deviation of the lag by the linear model of the likeliest fit, s."""
        return max(math.sqrt(self.best.lag_variance), _LEAST_DEVIATION)

    @cached_property
    def log_likelihood(self) -> _Array:
        """Logarithm of the likelihood of each lag, by fits that are `_MISLED` at times."""
        blunt = self.by_fits / _TEMPERED
        misled = _MISLED / (1.0 - _MISLED) * np.sum(np.exp(self.by_fits)) / np.sum(np.exp(blunt))
        return np.asarray(np.logaddexp(self.by_fits, math.log(misled) + blunt))

    @property
    def spread(self) -> float:
        """Deviation of the lag by the fits alone, s."""
        return spread_of(np.exp(self.by_fits), self.prior.lags)

    @cached_property
    def by_fits(self) -> _Array:
        """Logarithm of the likelihood of each lag by the fits alone, the likeliest at 0.

        A fit may end at a kink above the least cost, never below it: the costs are those of their
        lower hull, less the mean height of the fits above it. Their root is linear between the
        fits, and is extrapolated beyond the last fits. A separate fit is at most as likely as the
        best fit.
        """
        every = self.prior.lags
        hull = _lower_hull(self.lags, self.costs)
        likely = self.costs < _LIKELY
        rough = float(np.mean((self.costs - hull)[likely]))
        roots, centre = np.sqrt(np.maximum(hull - rough, 0.0)), self.best.lag
        slopes = [1.0 / self.deviation] * 2
        for end, at in ((0, 0), (1, -1)):
            if self.fits[at] is not self.best:
                slopes[end] = roots[at] / abs(self.lags[at] - centre)
        root = np.interp(every, self.lags, roots)
        before, after = self.lags[0] - every, every - self.lags[-1]
        root = root + slopes[0] * np.maximum(before, 0.0) + slopes[1] * np.maximum(after, 0.0)
        log = -0.5 * root**2 / (_DEPENDENT * max(self.best.inflation, 1.0))
        for one in self.apart:
            rise = max(one.cost(self.inflation) - self.best.cost(self.inflation), 0.0)
            log = np.logaddexp(log, -0.5 * (rise + ((every - one.lag) / self.deviation) ** 2))
        return np.asarray(log)

    def along(self, numbers: Mapping[PosteriorFit, float], slope: float) -> _Array:
        """Interpolate a number of the fits at each lag.

        Beyond the fits it has the `slope` of the linear model of the likeliest fit.
        """
        every = self.prior.lags
        values = np.interp(every, self.lags, [numbers[one] for one in self.fits])
        values += slope * np.minimum(every - self.lags[0], 0.0)
        values += slope * np.maximum(every - self.lags[-1], 0.0)
        for one in self.apart:
            values[np.abs(every - one.lag) < _NEAR * self.deviation] = numbers[one]
        return values


def _lower_hull(places: _Array, heights: _Array) -> _Array:
    """Return the lower convex hull of points in the order of their places, at each of them."""
    hull: list[int] = []
    for last in range(places.size):
        while len(hull) > 1:
            first, middle = hull[-2:]
            run, rise = places[last] - places[first], heights[last] - heights[first]
            if (heights[middle] - heights[first]) * run < rise * (places[middle] - places[first]):
                break
            hull.pop()
        hull.append(last)
    return np.asarray(np.interp(places, places[hull], heights[hull]))
