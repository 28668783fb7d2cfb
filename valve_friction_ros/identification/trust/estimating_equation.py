"""The equation whose root is the estimate, sample by sample."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

__all__ = ["EstimatingEquation"]


@dataclass(frozen=True, eq=False)
class EstimatingEquation:
    """Σ_t (S₁ᵀ·r₂ + S₂ᵀ·r₁) = 0, linear about the estimate.

    S₁, r₁ and S₂, r₂ come from two halves of the samples of the pressure. Their noise is
    independent, so noise of the slopes does not correlate with noise of the residuals. Least
    squares is the case of two equal halves.

    Attributes
    ----------
    slopes : tuple of two ndarray of float, shape (n, p)
        Derivatives of the residuals by the free coordinates.
    residuals : tuple of two ndarray of float, shape (n,)
        Model minus measurement.
    """

    slopes: tuple[NDArray[np.float64], NDArray[np.float64]]
    residuals: tuple[NDArray[np.float64], NDArray[np.float64]]

    @classmethod
    def of_least_squares(
        cls, slope: NDArray[np.float64], residual: NDArray[np.float64]
    ) -> "EstimatingEquation":
        """Return the normal equation of least squares: twice Sᵀ·r = 0."""
        return cls((slope, slope), (residual, residual))

    @property
    def scores(self) -> NDArray[np.float64]:
        """Terms of the sum, one row per sample, shape (n, p)."""
        (one, two), (first, second) = self.slopes, self.residuals
        return one * second[:, None] + two * first[:, None]

    @cached_property
    def curvature(self) -> NDArray[np.float64]:
        """Derivative of the sum by the coordinates, shape (p, p), symmetric."""
        one, two = self.slopes
        mixed = one.T @ two
        return np.asarray(mixed + mixed.T, dtype=np.float64)

    @property
    def is_definite(self) -> bool:
        """Return whether the curvature has an inverse, and the root is a minimum."""
        curvature = self.curvature
        scale = np.sqrt(np.abs(np.diag(curvature)))
        if not (scale > 0).all():
            return False
        values = np.linalg.eigvalsh(curvature / np.outer(scale, scale))
        return bool(values[0] > np.finfo(float).eps * values[-1])

    def newton_step(self) -> NDArray[np.float64]:
        """Change of the coordinates that solves the equation, shape (p,)."""
        step = np.linalg.lstsq(self.curvature, self.scores.sum(axis=0), rcond=1e-14)[0]
        return -np.asarray(step, dtype=np.float64)

    def in_units(self, units: NDArray[np.float64]) -> "EstimatingEquation":
        """Return the equation by coordinates that are `units` times these."""
        one, two = self.slopes
        return EstimatingEquation((one / units, two / units), self.residuals)
