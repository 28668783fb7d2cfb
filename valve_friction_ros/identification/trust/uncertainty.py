"""Standard errors and intervals that are valid for correlated residuals."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.trust.estimating_equation import EstimatingEquation
from valve_friction_ros.identification.trust.student import student_quantile

__all__ = [
    "CONFIDENCE",
    "Covariance",
    "block_covariance",
    "half_width",
    "plain_sandwich",
    "stroke_length",
    "worst_case",
]

CONFIDENCE = 0.95
"""Probability that an interval covers the true value; the usual choice of metrology (GUM)."""

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
        """Half the width of the interval of gᵀθ that covers the true value with `CONFIDENCE`."""
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


def block_covariance(equation: EstimatingEquation, block: int) -> Covariance:
    """Sandwich covariance of the root of an equation, from sums over blocks of samples.

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
    equation : EstimatingEquation
        At its root.
    block : int
        Samples a block; shortened where fewer than 8 blocks would remain.

    Returns
    -------
    Covariance
        All nan if the record is too short or the equation is singular.

    References
    ----------
    R. M. Bell and D. F. McCaffrey, Survey Methodology 28 (2002) 169–181.
    """
    one, two = equation.slopes
    free = one.shape[1]
    ends = _block_ends(one.shape[0], block)
    blocks = ends.size
    if blocks <= free or not equation.is_definite:
        return _unknown(free)
    scale = np.sqrt(np.abs(np.diag(equation.curvature)))
    values, vectors = np.linalg.eigh(equation.curvature / np.outer(scale, scale))
    root = (vectors / np.sqrt(values)) @ vectors.T
    sums = np.add.reduceat(equation.scores, ends) / scale @ root
    mixed = [
        first.T @ second
        for first, second in zip(np.split(one, ends[1:]), np.split(two, ends[1:]), strict=True)
    ]
    curvatures = np.array(mixed) / np.outer(scale, scale)
    information = root @ (curvatures + curvatures.transpose(0, 2, 1)) @ root
    shares, axes = np.linalg.eigh(information)
    enlarged = axes / np.sqrt(1 - np.clip(shares, 0.0, _LARGEST_SHARE))[:, None, :]
    undone = enlarged @ axes.transpose(0, 2, 1)
    contributions = np.einsum("bij,bj->bi", undone, sums) @ root / scale
    return Covariance(contributions, undone @ (root / scale), information)


def plain_sandwich(equation: EstimatingEquation, block: int) -> NDArray[np.float64]:
    """Return A⁻¹·(Σ_b s_b s_bᵀ)·A⁻¹, the scatter of the scores as they are, shape (p, p).

    For a score test: away from the root of an equation the shares of the information do not
    measure how far the fit has reduced the residuals. The blocks are those of
    `block_covariance`.
    """
    sums = np.add.reduceat(equation.scores, _block_ends(equation.scores.shape[0], block))
    spread = np.linalg.lstsq(equation.curvature, sums.T, rcond=1e-14)[0]
    return np.asarray(spread @ spread.T, dtype=np.float64)


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
    return student_quantile(0.5 + CONFIDENCE / 2, freedom) * standard_error


def stroke_length(simulated: NDArray[np.float64]) -> int:
    """Mean number of samples between the reversals of a simulated stem."""
    steps = np.diff(simulated)
    moving = np.sign(steps[steps != 0])
    reversals = int(np.count_nonzero(np.diff(moving)))
    return simulated.size // (reversals + 1)


def worst_case(curvature: NDArray[np.float64], samples: int, misfit: float) -> NDArray[np.float64]:
    """Bound the effect of a systematic misfit on the estimate.

    A misfit of root mean square s, of any shape, moves the least-squares estimate by

        |Δθ_i| ≤ s·√n·√[(SᵀS)⁻¹]_ii      (Cauchy–Schwarz),

    with the sensitivities S, of which the curvature is 2·SᵀS.

    Parameters
    ----------
    curvature : ndarray of float, shape (p, p)
        Derivative of the estimating equation.
    samples : int
        Number of samples n.
    misfit : float
        Root mean square of the systematic misfit, m.

    Returns
    -------
    ndarray of float, shape (p, p)
        (s·√n)²·(SᵀS)⁻¹: the bound of any combination gᵀθ is √(gᵀ·that·g).
    """
    scale = np.sqrt(np.abs(np.diag(curvature)))
    if not (scale > 0).all():
        return np.full_like(curvature, np.nan)
    inverse = np.linalg.pinv(curvature / np.outer(scale, scale)) / np.outer(scale, scale)
    bound: NDArray[np.float64] = misfit**2 * samples * (inverse + inverse.T)
    return bound
