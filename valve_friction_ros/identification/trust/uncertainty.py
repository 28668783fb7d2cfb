# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Standard errors and intervals that are valid for correlated residuals."""

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.trust.student import student_quantile

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
        Samples a block; shortened where fewer than 8 blocks would remain.

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
