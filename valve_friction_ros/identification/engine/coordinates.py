# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Coordinates in which the stem of a sliding valve is linear.

While it slides, the stem is at

    x = F/k − F_0/k ∓ F_c/k − (F_v/k)·ẋ .

In 1/k, F_0/k, F_c/k and F_v/k this is linear, so the linear model of a fit holds far along the
valleys in which friction, spring and delay compensate one another. Everything except the fit
itself uses the physical coordinates.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Coordinates = Mapping[str, float]
"""Value of each coordinate of the model."""

MAIN = (
    "coulomb_friction",
    "viscous_friction",
    "spring_constant",
    "spring_preload",
    "start_position",
)
"""Coordinates of the Karnopp model without its imperfections."""

_OVER_SPRING = ("coulomb_friction", "viscous_friction", "spring_preload", "slip_force")


def straight(at: Coordinates, names: tuple[str, ...]) -> dict[str, float]:
    """Replace the free coordinates `names` by the straight ones, under the same names."""
    spring = at["spring_constant"]
    result = dict(at)
    for name in _OVER_SPRING:
        if name in names:
            result[name] = at[name] / spring
    result["spring_constant"] = 1.0 / spring
    return result


def physical(at: Coordinates, names: tuple[str, ...]) -> dict[str, float]:
    """Undo `straight`."""
    spring = 1.0 / at["spring_constant"]
    result = dict(at)
    for name in _OVER_SPRING:
        if name in names:
            result[name] = at[name] * spring
    result["spring_constant"] = spring
    return result


def jacobian(at: Coordinates, names: tuple[str, ...]) -> NDArray[np.float64]:
    """Differentiate the physical coordinates by the straight ones, shape (p, p).

    With c = 1/k and b = F/k: ∂k/∂c = −k², ∂F/∂b = k, ∂F/∂c = −F·k.
    """
    spring = at["spring_constant"]
    result = np.eye(len(names))
    for row, name in enumerate(names):
        if name in _OVER_SPRING:
            result[row, row] = spring
    if "spring_constant" in names:
        column = names.index("spring_constant")
        result[column, column] = -(spring**2)
        for row, name in enumerate(names):
            if name in _OVER_SPRING:
                result[row, column] = -at[name] * spring
    return result
