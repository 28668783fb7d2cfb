# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Standard errors, correlations and intervals that are valid for correlated residuals."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from statistics import NormalDist
from typing import NamedTuple, TypedDict, TypeVar

import numpy as np
from numpy.typing import NDArray

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
    """Return the t that Student's distribution stays below with a probability.

    Parameters
    ----------
    probability : float
        Above 0.5 and below 1.
    freedom : float
        Degrees of freedom, above zero; infinitely many make it the normal distribution.

    Notes
    -----
    Above zero the distribution function is concave, so Newton's method from zero rises towards the
    quantile without passing it. scipy.special would do, but takes 55 MB and a fifth of a second of
    processor time in a program that needs nothing else of it.
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

    Parameters
    ----------
    groups : sequence of sequences
        Independent members of each kind, at least one per group.
    statistic : callable
        From groups to named values.

    Returns
    -------
    Jackknife
        Values, standard errors, degrees of freedom.

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

    Parameters
    ----------
    gradients : mapping of str to ndarray of float, shape (p,)
        Derivatives of each number by the coordinates. A number that does not vary is left out.
    covariance : ndarray of float, shape (p, p)
        Covariance of the coordinates.
    own : mapping of str to float, optional
        Variance of a number that it shares with no other number.

    Examples
    --------
    The sum of two independent numbers of variance 1 and 3 has a correlation of 1/2 with the first.

    >>> import numpy as np
    >>> gradients = {"one": np.array([1.0, 0.0]), "sum": np.array([1.0, 1.0])}
    >>> found = correlation_of(gradients, np.diag([1.0, 3.0]))
    >>> found["names"], found["matrix"][0]
    (['one', 'sum'], [1.0, 0.5])
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

_FEWEST_BLOCKS = 8
"""Fewest blocks of a record. Chosen: 7 degrees of freedom make an interval 2.4 standard errors;
with 3 it would be 3.2."""

_LARGEST_SHARE = 0.95
"""Largest share H of the information in one block for which (1 − H)^(−1/2) corrects its residuals.

Chosen: the factor is then 4.5; beyond, the fit has absorbed the block."""


@dataclass(frozen=True, eq=False)
class Covariance:
    """Covariance of an estimate, from what each block of the record contributes to it.

    Attributes
    ----------
    contributions : ndarray of float, shape (b, p)
        Change of the estimate by the residuals of each block, each as large as if that block had
        not been fitted.
    weights : ndarray of float, shape (b, p, p)
        For each block W = (1 − H_b)^(−1/2)·A^(−1/2), with W·g the weight of its scores A^(−1/2)·s_b
        in the combination gᵀθ (`block_covariance`).
    information : ndarray of float, shape (b, p, p)
        Share of each block in the information; their sum is the unit matrix.
    """

    contributions: NDArray[np.float64]
    weights: NDArray[np.float64]
    information: NDArray[np.float64]

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Covariance of the free coordinates, shape (p, p)."""
        return np.asarray(self.contributions.T @ self.contributions, dtype=np.float64)

    def standard_error(self, gradient: NDArray[np.float64]) -> float:
        """Return the standard error of the combination gᵀθ, g of shape (p,)."""
        return float(np.linalg.norm(self.contributions @ gradient))

    def half_width(self, gradient: NDArray[np.float64]) -> float:
        """Half the width of the interval of gᵀθ that covers the true value with `CONFIDENCE`.

        Infinite without degrees of freedom.
        """
        error = self.standard_error(gradient)
        return half_width(error, self.freedom(gradient)) if error > 0 else error

    def freedom(self, gradient: NDArray[np.float64]) -> float:
        """Degrees of freedom behind the standard error of gᵀθ.

        The variance is a sum of squares over the blocks. Were the residuals white, it would have
        the first two moments of a χ² with this freedom (Satterthwaite).
        """
        weights = self.weights @ gradient
        informed = np.einsum("bij,bj->bi", self.information, weights)
        moments = np.diag(np.sum(weights * informed, axis=1)) - informed @ informed.T
        return float(np.trace(moments) ** 2 / max(np.sum(moments**2), np.finfo(float).tiny))


def block_covariance(
    slope: NDArray[np.float64], residual: NDArray[np.float64], block: int
) -> Covariance:
    """Sandwich covariance of a least-squares estimate, from sums over blocks of samples.

    Residuals at 1 kHz are far from independent: the error of one stroke is in all its samples.
    Sums over blocks as long as that memory are independent, so their scatter measures the
    uncertainty of the whole sum, whatever happens inside a block. The fit has reduced each block's
    residuals by the share H_b of the information that the block holds; (1 − H_b)^(−1/2)
    undoes that, exactly if the residuals are white and no block holds nearly all information:

        cov = A^(−1/2) · (Σ_b g_b g_bᵀ) · A^(−1/2),    g_b = (1 − H_b)^(−1/2) · A^(−1/2) · s_b,
        H_b = A^(−1/2) · A_b · A^(−1/2) ,

    with the scores s_b and the curvature A_b summed over the block.

    Parameters
    ----------
    slope : ndarray of float, shape (n, p)
        Derivatives of the residuals by the coordinates.
    residual : ndarray of float, shape (n,)
        Model minus measurement, at the estimate.
    block : int
        Samples per block; shortened where fewer than 8 blocks would remain.

    Returns
    -------
    Covariance
        All nan if the record is too short or the regression is singular.

    References
    ----------
    R. M. Bell and D. F. McCaffrey, Survey Methodology 28 (2002) 169–181.
    """
    free = slope.shape[1]
    ends = _block_ends(slope.shape[0], block)
    scale = np.linalg.norm(slope, axis=0)
    if ends.size <= free or not (scale > 0).all():
        return _unknown(free)
    slope = slope / scale
    values, vectors = np.linalg.eigh(slope.T @ slope)
    if values[0] <= np.finfo(float).eps * values[-1]:
        return _unknown(free)
    root = (vectors / np.sqrt(values)) @ vectors.T
    sums = np.add.reduceat(slope * residual[:, None], ends) @ root
    curvatures = np.array([part.T @ part for part in np.split(slope, ends[1:])])
    information = root @ curvatures @ root
    shares, axes = np.linalg.eigh(information)
    enlarged = axes / np.sqrt(1 - np.clip(shares, 0.0, _LARGEST_SHARE))[:, None, :]
    undone = enlarged @ axes.transpose(0, 2, 1)
    contributions = np.einsum("bij,bj->bi", undone, sums) @ root / scale
    return Covariance(contributions, undone @ (root / scale), information)


def _block_ends(samples: int, block: int) -> NDArray[np.int64]:
    """First sample of each block, of about equal lengths."""
    length = max(min(block, samples // _FEWEST_BLOCKS), 1)
    blocks = samples // length
    return np.linspace(0, samples, blocks + 1).astype(np.int64)[:-1]


def _unknown(free: int) -> Covariance:
    nothing = np.full((1, free, free), np.nan)
    return Covariance(nothing[0, :1], nothing, nothing)


def half_width(standard_error: float, freedom: float) -> float:
    """Half the width of the interval that covers the true value with `CONFIDENCE`."""
    if not freedom > _LEAST_FREEDOM:
        return math.inf
    return student_quantile(0.5 + CONFIDENCE / 2, freedom) * standard_error


def stroke_length(simulated: NDArray[np.float64]) -> int:
    """Mean number of samples between the reversals of a simulated stem."""
    steps = np.diff(simulated)
    moving = np.sign(steps[steps != 0])
    reversals = int(np.count_nonzero(np.diff(moving)))
    return simulated.size // (reversals + 1)
