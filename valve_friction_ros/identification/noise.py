"""Sensor noise, read from the record itself."""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs

__all__ = ["position_noise", "velocity_noise"]

_MEDIAN_TO_DEVIATION = 0.6745 * np.sqrt(6.0)


def position_noise(position: NDArray[np.float64]) -> float:
    """Estimate the standard deviation of white noise on the stem position, m.

    Read from the second differences, which a moving stem hardly touches: of white noise with
    standard deviation s their median magnitude is 0.6745·√6·s.
    """
    if position.size < 3:
        return 0.0
    return float(np.median(np.abs(np.diff(position, 2))) / _MEDIAN_TO_DEVIATION)


def velocity_noise(noise: float, sample_period: float, window: int, order: int) -> float:
    """Propagate white position `noise` in m to the standard deviation of the velocity in m/s."""
    weights = savgol_coeffs(window, order, deriv=1, delta=sample_period)
    return noise * float(np.linalg.norm(weights))
