# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The force balance of the sliding stem as a linear regression, equations (3) to (7)."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.settings import REGRESSED, IdentificationSettings
from valve_friction_ros.signals import Derivatives


@dataclass(frozen=True, eq=False)
class ForceBalanceRegression:
    """Regressors φ(t) of (5), the force that they explain, and the speed that selects samples.

    Attributes
    ----------
    names : tuple of str
        The free parameters, one per column.
    columns : ndarray of float, shape (n, p)
        Regressor of each free parameter.
    force : ndarray of float, shape (n,)
        Actuator force minus the contribution of the fixed parameters, N.
    speed : ndarray of float, shape (n,)
        Absolute velocity, m/s.
    fixed : mapping of str to float
        Parameters outside the regression.
    position_bias : float or None
        x̄ of (10) where the preload follows from it.
    """

    names: tuple[str, ...]
    columns: NDArray[np.float64]
    force: NDArray[np.float64]
    speed: NDArray[np.float64]
    fixed: Mapping[str, float]
    position_bias: float | None

    def complete(self, estimates: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Name the free `estimates`, shape (..., p), and add the fixed values."""
        shape = estimates.shape[:-1]
        named = {name: estimates[..., index] for index, name in enumerate(self.names)}
        for name in REGRESSED:
            if name not in named and name in self.fixed:
                named[name] = np.full(shape, self.fixed[name])
        if self.position_bias is not None:
            named["spring_preload"] = named["spring_constant"] * self.position_bias
        return {name: named[name] for name in REGRESSED}

    def fixing(self, name: str, value: float) -> "ForceBalanceRegression":
        """Fix a free parameter: its contribution to the force leaves the regression."""
        index = self.names.index(name)
        return replace(
            self,
            names=tuple(each for each in self.names if each != name),
            columns=np.delete(self.columns, index, axis=1),
            force=self.force - value * self.columns[:, index],
            fixed={**self.fixed, name: value},
        )


def force_balance_regression(
    force: NDArray[np.float64],
    position: NDArray[np.float64],
    derivatives: Derivatives,
    settings: IdentificationSettings,
) -> ForceBalanceRegression:
    """Set up the regression (4) for the m = n − d + 1 samples that have derivatives.

    Force (N) and position (m) have the shape (n,). The settings name the fixed parameters, and the
    position bias if it is known.
    """
    bias = settings.position_bias
    velocity = derivatives.velocity
    place = derivatives.inner(position)
    regressors = {
        "mass": derivatives.acceleration,
        "coulomb_friction": np.sign(velocity),
        "viscous_friction": velocity,
        "spring_constant": place if bias is None else place + bias,
        "spring_preload": np.ones_like(velocity),
    }
    if bias is not None:
        del regressors["spring_preload"]
    target = derivatives.inner(force).copy()
    for name in settings.fixed:
        if name in regressors:
            target -= settings.fixed[name] * regressors.pop(name)
    fixed = {name: value for name, value in settings.fixed.items() if name in REGRESSED}
    return ForceBalanceRegression(
        tuple(regressors),
        np.column_stack([*regressors.values()]) if regressors else np.empty((target.size, 0)),
        target,
        np.abs(velocity),
        fixed,
        bias,
    )
