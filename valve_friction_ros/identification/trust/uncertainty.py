# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Standard errors, correlations and intervals, and the mean friction of the sliding stem."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from statistics import NormalDist
from sys import float_info
from typing import NamedTuple, TypedDict, TypeVar

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.valve import KarnoppParameters

_MANY = 1e8
"""Degrees of freedom from which the quantile is that of the normal distribution to 10⁻⁸."""

_TINY = 1e-300
_ROUNDING = 1e-15
_MOST_TERMS = 10_000
_MOST_STEPS = 200
"""A fraction of n degrees of freedom takes some √n terms; each step towards a quantile far out in
the tail of few degrees of freedom doubles it at least."""


@cache
def student_quantile(probability: float, freedom: float) -> float:
    """Return the t that Student's distribution stays below with a probability above 0.5.

    Infinitely many degrees of freedom make it the normal distribution. Above zero the distribution
    function is concave, so Newton's method from zero rises towards the quantile without passing it.
    scipy.special would do, but takes 55 MB and a fifth of a second of processor time in a program
    that needs nothing else of it.
    """
    freedom = min(freedom, _MANY)
    half = 0.5 * freedom
    scale = math.exp(math.lgamma(half + 0.5) - math.lgamma(half)) / math.sqrt(math.pi * freedom)
    t = 0.0
    for _ in range(_MOST_STEPS):
        density = scale * (1 + t * t / freedom) ** -(half + 0.5)
        step = (1 - probability - _above(t, freedom)) / -density
        t += step
        if not step > _ROUNDING * t:
            break
    return t


def _above(t: float, freedom: float) -> float:
    """Return P(T > t) for t ≥ 0: half the incomplete beta function I_x(n/2, 1/2), x = n/(n + t²).

    By its continued fraction (Abramowitz and Stegun 26.5.8, evaluated as Lentz does), or by that
    of 1 − I where it converges faster.
    """
    share = freedom / (freedom + t * t)
    half = 0.5 * freedom
    if share < (half + 1) / (half + 2.5):
        return 0.5 * _beta(half, 0.5, share, t * t / (freedom + t * t))
    return 0.5 - 0.5 * _beta(0.5, half, t * t / (freedom + t * t), share)


def _beta(a: float, b: float, x: float, rest: float) -> float:
    """Return the regularised incomplete beta function I_x(a, b); `rest` is 1 − x."""
    if x <= 0.0:
        return 0.0
    logarithm = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b)
    front = math.exp(logarithm + a * math.log(x) + b * math.log(rest)) / a
    numerator, denominator = 1.0, 1.0 / _not_zero(1 - (a + b) * x / (a + 1))
    value = denominator
    for order in range(1, _MOST_TERMS):
        even = order * (b - order) * x / ((a + 2 * order - 1) * (a + 2 * order))
        odd = -(a + order) * (a + b + order) * x / ((a + 2 * order) * (a + 2 * order + 1))
        for term in (even, odd):
            denominator = 1.0 / _not_zero(1 + term * denominator)
            numerator = _not_zero(1 + term / numerator)
            value *= numerator * denominator
        if abs(numerator * denominator - 1) < _ROUNDING:
            break
    return front * value


def _not_zero(value: float) -> float:
    return value if abs(value) > _TINY else _TINY


_Member = TypeVar("_Member")


class Jackknife(NamedTuple):
    """Values of all members together, their standard errors, and the degrees of freedom.

    A standard error is nan where a group has a single member; the freedom is members less groups.
    """

    values: Mapping[str, float]
    standard_errors: Mapping[str, float]
    freedom: int


def jackknife(
    groups: Sequence[Sequence[_Member]],
    statistic: Callable[[Sequence[Sequence[_Member]]], Mapping[str, float]],
) -> Jackknife:
    """Evaluate `statistic`, and its standard error from the scatter within the groups.

    Leaving out each of the n members of a group in turn gives n values θ_i, and the group's share
    of the variance is (n − 1)/n·Σ(θ_i − mean θ)². For a mean this is s²/n. The effect of
    one member's error on several quantities is included.

    References
    ----------
    B. Efron and C. Stein, Annals of Statistics 9 (1981) 586–596.
    """
    values = dict(statistic(groups))
    variances = dict.fromkeys(values, 0.0)
    for index, group in enumerate(groups):
        size = len(group)
        if size < 2:
            variances = dict.fromkeys(values, math.nan)
            break
        trials = [
            statistic([*groups[:index], [*group[:one], *group[one + 1 :]], *groups[index + 1 :]])
            for one in range(size)
        ]
        for name in values:
            mean = sum(trial[name] for trial in trials) / size
            scatter = sum((trial[name] - mean) ** 2 for trial in trials)
            variances[name] += (size - 1) / size * scatter
    errors = {name: math.sqrt(variance) for name, variance in variances.items()}
    return Jackknife(values, errors, sum(map(len, groups)) - len(groups))


CORRELATION = "correlation"
"""Name of the evidence that holds the correlation of the parameters."""


class Correlation(TypedDict):
    """Names of numbers, and a row of correlations for each, in that order."""

    names: list[str]
    matrix: list[list[float]]


def correlation_of(
    gradients: Mapping[str, NDArray[np.float64]],
    covariance: NDArray[np.float64],
    own: Mapping[str, float] | None = None,
) -> Correlation:
    """Return the correlation of numbers that depend on correlated coordinates.

    The `gradients`, (p,), are the derivatives of each number by the coordinates of this
    `covariance`, (p, p); `own` is the variance that a number shares with no other. A number that
    does not vary is left out.
    """
    rows = np.array(list(gradients.values()))
    whole = rows @ covariance @ rows.T
    whole += np.diag([(own or {}).get(name, 0.0) for name in gradients])
    kept = np.diag(whole) > 0
    whole = whole[np.ix_(kept, kept)]
    deviation = np.sqrt(np.diag(whole))
    matrix = np.clip(whole / np.outer(deviation, deviation), -1.0, 1.0)
    np.fill_diagonal(matrix, 1.0)
    names = [name for name, is_kept in zip(gradients, kept.tolist(), strict=True) if is_kept]
    return {"names": names, "matrix": matrix.tolist()}


CONFIDENCE = 0.95
"""Probability that an interval covers the true value; the usual choice of metrology (GUM)."""

NORMAL_QUANTILE = NormalDist().inv_cdf(0.5 + CONFIDENCE / 2)
"""Half width over the standard deviation of a normal error: 1.96."""

MEDIAN_MAGNITUDE = 0.6745
"""Median magnitude of a normal error over its standard deviation."""

_LEAST_FREEDOM = 0.05
"""Degrees of freedom below which nothing is known: the interval is 10²⁰ standard errors wide."""


def half_width(standard_error: float, freedom: float) -> float:
    """Half the width of the interval that covers the true value with `CONFIDENCE`."""
    if not freedom > _LEAST_FREEDOM:
        return math.inf
    return student_quantile(0.5 + CONFIDENCE / 2, freedom) * standard_error


COMPARABLE = "comparable"
"""Name of the evidence that compares the sliding frictions of two records.

``shared_half_width``, N, is the part of the half width that another record of the same sensors has
in common; ``speed_exponent`` is d ln F / d ln v at the sliding speed, and ``half_width`` is the
half width of the exponent without the common part."""

SPEED_EXPONENT = "speed_exponent"
"""Name of d ln F / d ln v at the sliding speed: friction near it grows as this power of speed."""

FINEST_SLIDING = 3e-3
"""Least half width of a sliding friction, as a share of its value, however quiet the record is.

The speed of the stem, and so the mean friction, is known no better than the step of the simulation
allows."""


def mean_over_distance(values: NDArray[np.float64], velocity: NDArray[np.float64]) -> float:
    """Mean of `values` over the distance that the stem slides at `velocity`, m/s; 0 at rest."""
    speed = np.abs(velocity)
    return float(np.sum(values * speed) / max(float(np.sum(speed)), float_info.min))


def mean_speed(velocity: NDArray[np.float64]) -> float:
    """Return ∫|v|·|dx| / ∫|dx|, m/s: the speed at which a viscous friction has its mean."""
    return mean_over_distance(np.abs(velocity), velocity)


def mean_sliding_friction(model: KarnoppParameters, velocity: NDArray[np.float64]) -> float:
    """Return the sliding friction of a model, N, whose stem moves at `velocity`, m/s."""
    return mean_over_distance(np.abs(model.sliding_friction(velocity)), velocity)
