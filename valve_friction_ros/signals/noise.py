"""Sensor noise, estimated from the record itself."""

import math

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.signals.derivatives import savgol_weights

__all__ = ["position_noise", "quantisation_step", "sensor_noise", "velocity_noise"]

_KEPT = 0.9
"""Share of the second differences that is used. Chosen: jerks take far less than a tenth of a
record; each further tenth left out widens the scatter of the estimate."""

_KEPT_MEAN = 0.657347
"""Mean magnitude of the smallest 90 % of standard normal numbers: 2·(φ(0) − φ(1.645))/0.9."""


def position_noise(position: NDArray[np.float64]) -> float:
    """Estimate the standard deviation of white noise on the stem position, m.

    Estimated from second differences, which the motion of the stem hardly changes: those of white
    noise of deviation s have the deviation √6·s. The largest tenth is left out, where the stem may
    have been jerked. A mean is used because a median takes values of converter codes only.
    """
    if position.size < 3:
        return 0.0
    magnitudes = np.abs(np.diff(position, 2))
    kept = max(int(_KEPT * magnitudes.size), 1)
    smallest = np.partition(magnitudes, kept - 1)[:kept]
    return float(np.mean(smallest)) / (_KEPT_MEAN * math.sqrt(6.0))


def quantisation_step(signal: NDArray[np.float64]) -> float:
    """Estimate the step of a converter: the smallest difference of two values of `signal`.

    Zero where more than half of the samples differ, as in a signal without quantisation.
    """
    values = np.unique(signal)
    if values.size < 2 or values.size > 0.5 * signal.size:
        return 0.0
    gaps = np.diff(values)
    return float(gaps[gaps > 1e-6 * gaps.max()].min())


def sensor_noise(signal: NDArray[np.float64]) -> float:
    """Estimate the deviation of a sensor's noise, in the unit of `signal`, rounding included.

    Second differences (`position_noise`) miss the rounding error of a converter where the signal
    hardly changes, and the error is not white where the signal drifts slowly. Therefore 1/√12 of
    the step is added in squares.
    """
    return math.hypot(position_noise(signal), quantisation_step(signal) / math.sqrt(12.0))


def velocity_noise(noise: float, sample_period: float, window: int, order: int) -> float:
    """Propagate white position `noise` in m to the standard deviation of the velocity in m/s."""
    weights = savgol_weights(window, order, 1, sample_period)
    return noise * float(np.linalg.norm(weights))
