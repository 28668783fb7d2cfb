"""The mean friction of the sliding stem: the work of friction over the distance."""

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.units import SLIDING
from valve_friction_ros.model.karnopp_parameters import KarnoppParameters

__all__ = ["FINEST_SLIDING", "SLIDING", "mean_over_distance", "mean_sliding_friction", "mean_speed"]

FINEST_SLIDING = 3e-3
"""Least half width of its interval, as a share of the value, however quiet the record is.

The speed of the stem, and so the mean friction, is known no better than the step of the simulation
allows."""


def mean_over_distance(values: NDArray[np.float64], velocity: NDArray[np.float64]) -> float:
    """Mean of `values` over the distance that the stem slides at `velocity`, m/s; 0 at rest."""
    speed = np.abs(velocity)
    return float(np.sum(values * speed) / max(float(np.sum(speed)), np.finfo(float).tiny))


def mean_speed(velocity: NDArray[np.float64]) -> float:
    """Return ∫|v|·|dx| / ∫|dx|, m/s: the speed at which a viscous friction has its mean."""
    return mean_over_distance(np.abs(velocity), velocity)


def mean_sliding_friction(model: KarnoppParameters, velocity: NDArray[np.float64]) -> float:
    """Return the sliding friction of a model, N, whose stem moves at `velocity`, m/s."""
    return mean_over_distance(np.abs(model.sliding_friction(velocity)), velocity)
