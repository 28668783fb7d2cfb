"""Sensor noise, read from samples at the stamps that they came with."""

import math

import numpy as np

from valve_friction_ros.model.stamped import StampedSignal
from valve_friction_ros.signals.noise import quantisation_step

__all__ = ["stamped_noise"]

_KEPT = 0.9
_KEPT_MEAN = 0.657347
"""Mean magnitude of the smallest 90 % of standard normal numbers: 2·(φ(0) − φ(1.645))/0.9."""


def stamped_noise(signal: StampedSignal) -> float:
    """Estimate the deviation of a sensor's white noise, rounding included, in the signal's unit.

    Each sample is compared with the straight line between its neighbours. With the share a of the
    pause that lies behind it, the difference of white noise of deviation s has the variance

        s²·(1 + a² + (1 − a)²) ,

    whatever the pauses are. The largest tenth is left out, where the stem may have been jerked.
    1/√12 of a converter's step is added in squares: where the signal hardly changes, the
    differences miss the rounding.
    """
    time, value = signal.time, signal.value
    share = (time[2:] - time[1:-1]) / (time[2:] - time[:-2])
    line = share * value[:-2] + (1.0 - share) * value[2:]
    distance = np.abs(value[1:-1] - line) / np.sqrt(1.0 + share**2 + (1.0 - share) ** 2)
    kept = max(int(_KEPT * distance.size), 1)
    white = float(np.mean(np.partition(distance, kept - 1)[:kept])) / _KEPT_MEAN
    return math.hypot(white, quantisation_step(value) / math.sqrt(12.0))
