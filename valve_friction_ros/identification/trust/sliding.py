# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The mean friction of the sliding stem: the work of friction per distance."""

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.valve import KarnoppParameters

COMPARABLE = "comparable"
"""Name of the evidence that compares the sliding frictions of two records.

``shared_half_width``, N, is the part of the half width that another record of the same sensors has
in common; ``speed_exponent`` is d ln F / d ln v at the sliding speed, and ``half_width`` is the
half width of the exponent without the common part."""

SPEED_EXPONENT = "speed_exponent"
"""Name of d ln F / d ln v at the sliding speed: friction near it grows as this power of speed."""

FINEST_SLIDING = 3e-3
"""Least half width of a sliding friction, as a share of its value, however quiet the record is.

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
