"""Velocity and acceleration of the stem by local polynomials, Appendix A."""

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

__all__ = ["Derivatives", "differentiate"]


class Derivatives(NamedTuple):
    """Velocity and acceleration at every sample that has a full window around it.

    Attributes
    ----------
    velocity : ndarray of float, shape (n − d + 1,)
        Velocity, m/s.
    acceleration : ndarray of float, shape (n − d + 1,)
        Acceleration, m/s².
    margin : int
        Samples without a full window at either end, (d − 1)/2: entry 0 belongs to sample `margin`.
    """

    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    margin: int

    def inner(self, samples: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the part of `samples`, shape (n,), with derivatives, shape (n − d + 1,)."""
        return samples[self.margin : samples.size - self.margin]


def differentiate(
    position: NDArray[np.float64], sample_period: float, window: int = 31, order: int = 3
) -> Derivatives:
    """Differentiate sampled positions by a least-squares polynomial in a sliding window.

    Equation (20) and the two that follow it, taken at the middle of each window: a
    Savitzky–Golay filter. The first and last (d − 1)/2 samples have no full window; they get no
    derivative, because that of a one-sided window is less accurate.

    Parameters
    ----------
    position : ndarray of float, shape (n,)
        Stem position, m, n at least `window`.
    sample_period : float
        Time between two samples, s.
    window : int
        Window length d, samples, odd.
    order : int
        Polynomial order n, at least 2 and below `window`.

    Returns
    -------
    Derivatives
        Exact where the position is a polynomial of degree `order` or lower.

    Raises
    ------
    ValueError
        If there are fewer samples than the window is long.

    References
    ----------
    A. Savitzky and M. J. E. Golay, Analytical Chemistry 36 (1964) 1627–1639.
    """
    if position.size < window:
        raise ValueError(
            f"{position.size} samples are fewer than the derivative window of {window}: "
            "use a longer record or a shorter window"
        )
    velocity, acceleration = (
        np.convolve(
            position,
            scipy.signal.savgol_coeffs(window, order, deriv=degree, delta=sample_period),
            "valid",
        )
        for degree in (1, 2)
    )
    return Derivatives(velocity, acceleration, window // 2)
