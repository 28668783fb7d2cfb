"""Velocity and acceleration of the stem by local polynomials, Appendix A."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Derivatives", "differentiate", "savgol_weights"]


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


def savgol_weights(
    window: int, order: int, degree: int = 0, sample_period: float = 1.0
) -> NDArray[np.float64]:
    """Return the weights of a Savitzky–Golay filter, to convolve a signal with.

    They are those of `scipy.signal.savgol_coeffs`, whose import takes half a second.

    Parameters
    ----------
    window : int
        Length of the window, samples, above `order`.
    order : int
        Order of the polynomials.
    degree : int
        Degree of the derivative in the middle of the window; 0 smoothes.
    sample_period : float
        Time between two samples, s.

    Returns
    -------
    ndarray of float, shape (window,)
        The weights, the last sample's first.
    """
    # Over places from −1 to 1 the powers stay apart, however long the window is.
    powers = np.vander(np.linspace(-1.0, 1.0, window), order + 1, increasing=True)
    size = 0.5 * (window - 1) * sample_period
    weights = np.linalg.pinv(powers)[degree] * (math.factorial(degree) / size**degree)
    return np.asarray(weights[::-1], dtype=np.float64)


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
        np.convolve(position, savgol_weights(window, order, degree, sample_period), "valid")
        for degree in (1, 2)
    )
    return Derivatives(
        np.asarray(velocity, dtype=np.float64),
        np.asarray(acceleration, dtype=np.float64),
        window // 2,
    )
