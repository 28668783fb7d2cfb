"""Standard errors and intervals that hold for correlated residuals."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

__all__ = [
    "CONFIDENCE",
    "Covariance",
    "block_covariance",
    "half_width",
    "stroke_length",
    "worst_case",
]

CONFIDENCE = 0.95
"""Probability with which an interval is meant to cover the true value."""

_FEWEST_BLOCKS = 8


class Covariance(NamedTuple):
    """Covariance of an estimate, and the degrees of freedom behind it.

    Attributes
    ----------
    matrix : ndarray of float, shape (p, p)
        Covariance of the free parameters.
    freedom : int
        Degrees of freedom for intervals.
    """

    matrix: NDArray[np.float64]
    freedom: int


def block_covariance(
    scores: NDArray[np.float64], curvature: NDArray[np.float64], block: int
) -> Covariance:
    """Sandwich covariance of the root of Σ scores = 0, from sums over blocks of samples.

    Residuals at 1 kHz are anything but independent: what one stroke leaves is left at all its
    samples. Sums over blocks as long as that memory are, so their scatter measures the
    uncertainty of the whole sum, whatever happens inside a block:

        cov = A⁻¹ · (Σ_b s_b s_bᵀ) · A⁻ᵀ · n_b / (n_b − p),  s_b = Σ_{t in b} scores_t ,

    with n_b − p degrees of freedom.

    Parameters
    ----------
    scores : ndarray of float, shape (n, p)
        Terms of the estimating equation.
    curvature : ndarray of float, shape (p, p)
        Its derivative A.
    block : int
        Samples a block; shortened where fewer than max(8, 2·p) blocks would remain.

    Returns
    -------
    Covariance
        All nan if the record is too short or the equation is singular.
    """
    samples, free = scores.shape
    fewest = max(_FEWEST_BLOCKS, 2 * free)
    length = max(min(block, samples // fewest), 1)
    blocks = samples // length
    sums = scores[: blocks * length].reshape(blocks, length, free).sum(axis=1)
    scale = np.sqrt(np.abs(np.diag(curvature)))
    if blocks <= free or not (scale > 0).all():
        return Covariance(np.full((free, free), np.nan), 1)
    scaled = curvature / np.outer(scale, scale)
    if np.linalg.cond(scaled) > 1 / np.finfo(float).eps:
        return Covariance(np.full((free, free), np.nan), 1)
    spread = np.linalg.solve(scaled, (sums / scale).T) / scale[:, None]
    return Covariance(spread @ spread.T * blocks / (blocks - free), blocks - free)


def half_width(standard_error: float, freedom: int) -> float:
    """Half the width of the interval that covers the true value with `CONFIDENCE`."""
    return float(student.ppf(0.5 + CONFIDENCE / 2, freedom)) * standard_error


def stroke_length(simulated: NDArray[np.float64]) -> int:
    """Mean number of samples between the reversals of a simulated stem."""
    steps = np.diff(simulated)
    moving = np.sign(steps[steps != 0])
    reversals = int(np.count_nonzero(np.diff(moving)))
    return simulated.size // (reversals + 1)


def worst_case(curvature: NDArray[np.float64], samples: int, misfit: float) -> NDArray[np.float64]:
    """Bound what a systematic misfit can have done to the estimate.

    A misfit of root mean square s, however it is shaped, moves the least-squares estimate by

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
