"""Sensor noise, read from the record itself."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs

__all__ = ["position_noise", "quantisation_step", "sensor_noise", "velocity_noise"]

_MEDIAN_TO_DEVIATION = 0.6745 * np.sqrt(6.0)


def position_noise(position: NDArray[np.float64]) -> float:
    """Estimate the standard deviation of white noise on the stem position, m.

    Read from the second differences, which a moving stem hardly touches: of white noise with
    standard deviation s their median magnitude is 0.6745·√6·s.
    """
    if position.size < 3:
        return 0.0
    return float(np.median(np.abs(np.diff(position, 2))) / _MEDIAN_TO_DEVIATION)


def quantisation_step(signal: NDArray[np.float64]) -> float:
    """Estimate the step of a converter: the smallest distance between two values of `signal`.

    Zero where hardly any two samples are equal, as in a signal that was never quantised.
    """
    values = np.unique(signal)
    if values.size < 2 or values.size > 0.5 * signal.size:
        return 0.0
    gaps = np.diff(values)
    return float(gaps[gaps > 1e-6 * gaps.max()].min())


def sensor_noise(signal: NDArray[np.float64]) -> float:
    """Standard deviation of a sensor's noise, in the unit of `signal`, rounding included.

    The larger of what the second differences show (`position_noise`) and of the rounding error,
    1/√12 of the converter's step, which they miss where the signal hardly changes.
    """
    return max(position_noise(signal), quantisation_step(signal) / math.sqrt(12.0))


def velocity_noise(noise: float, sample_period: float, window: int, order: int) -> float:
    """Propagate white position `noise` in m to the standard deviation of the velocity in m/s."""
    weights = savgol_coeffs(window, order, deriv=1, delta=sample_period)
    return noise * float(np.linalg.norm(weights))
