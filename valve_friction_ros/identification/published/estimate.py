# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The estimate: the parameters that the published method finds."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.drawing import Curve, Drawing, Panel
from valve_friction_ros.identification.published.sweep import Sweep
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.identification.units import UNITS
from valve_friction_ros.model.valve import KarnoppParameters, Valve

SETTLED_SHARE = 0.1
"""Largest difference of σ_s in the chosen region, as a share of σ_s at the threshold. Chosen."""

_THRESHOLD = "threshold δv [m/s]"


def sweep_panels(
    thresholds: NDArray[np.float64],
    coulomb_friction: NDArray[np.float64],
    sigma: NDArray[np.float64],
    threshold: float,
    friction: Parameter,
) -> tuple[Panel, Panel]:
    """Return F_c and σ_s over the threshold δv, with the chosen threshold and the resulting F_c."""
    chosen = int(np.argmin(np.abs(thresholds - threshold)))
    marker = Curve([threshold], [coulomb_friction[chosen]], "o")
    return (
        Panel(
            "coulomb",
            _THRESHOLD,
            "Coulomb friction $F_c$ [N]",
            (Curve(thresholds, coulomb_friction), marker),
            "δv sweep (● published choice, dashed: result, with 95 % band)",
            level=friction,
        ),
        Panel(
            "sigma",
            _THRESHOLD,
            "$\\sigma_s$ [N]",
            (Curve(thresholds, np.maximum(sigma, 1e-9 * np.nanmax(sigma))),),
            chosen=threshold,
            is_logarithmic=True,
        ),
    )


def r_squared_panel(sweep: Sweep, threshold: float) -> Panel:
    """Return R²_s over the threshold δv, a detail for reports."""
    curve = Curve(sweep.thresholds, sweep.r_squared)
    return Panel("r_squared", _THRESHOLD, "$R^2_s$ [-]", (curve,), chosen=threshold, is_detail=True)


def chosen_region(sweep: Sweep, threshold: float) -> tuple[float, float]:
    """Return the lowest and highest threshold, m/s, of the region around the chosen threshold."""
    choice = int(np.argmin(np.abs(sweep.thresholds - threshold)))
    level = sweep.sigma[choice]
    settled = np.abs(sweep.sigma - level) <= SETTLED_SHARE * level
    others = np.flatnonzero(~settled)
    below, above = others[others < choice], others[others > choice]
    first = int(below[-1]) + 1 if below.size else 0
    last = int(above[0]) - 1 if above.size else sweep.thresholds.size - 1
    return float(sweep.thresholds[min(first, choice)]), float(sweep.thresholds[max(last, choice)])


@dataclass(frozen=True, eq=False)
class Estimate:
    """The parameters that the published method finds, with the figures of their sweep.

    Attributes
    ----------
    mass, viscous_friction, coulomb_friction : float
        See `static_friction`.
    static_friction, spring_constant, spring_preload : float
        Parameters in SI units, as regressed: an impossible value (a negative mass, say) is shown
        as it is, with a warning.
    threshold : float
        Chosen threshold δv, m/s.
    samples : int
        Samples faster than the threshold.
    sigma : float
        Standard deviation σ_s of the force residual (17), N.
    r_squared : float
        R²_s of (18).
    fixed : tuple of str
        Parameters that were given or assumed, not identified.
    warnings : tuple of str
        Limitations of the numbers, one sentence each.
    settings : IdentificationSettings
        Settings in force; an assumed mass is among the fixed parameters.
    sweep : Sweep
        The whole sweep.
    """

    mass: float
    viscous_friction: float
    coulomb_friction: float
    static_friction: float
    spring_constant: float
    spring_preload: float
    threshold: float
    samples: int
    sigma: float
    r_squared: float
    fixed: tuple[str, ...]
    warnings: tuple[str, ...]
    settings: IdentificationSettings = field(repr=False)
    sweep: Sweep = field(repr=False)

    @property
    def values(self) -> dict[str, float]:
        """The parameters by name, in the order of `UNITS`."""
        return {name: getattr(self, name) for name in UNITS}

    def drawing(self, parameters: Mapping[str, Parameter], valve: Valve) -> Drawing:  # noqa: ARG002
        """Return the sweep as figures and reports show it (`Exhibit`)."""
        sweep, settings = self.sweep, self.settings
        low, high = chosen_region(sweep, self.threshold)
        panels = sweep_panels(
            sweep.thresholds,
            sweep.estimates["coulomb_friction"],
            sweep.sigma,
            self.threshold,
            parameters["coulomb_friction"],
        )
        return Drawing(
            (*panels, r_squared_panel(sweep, self.threshold)),
            "Sweep of the velocity threshold δv",
            f"The friction force balance, fitted to the samples faster than each threshold δv. "
            f"Chosen: {self.threshold * 1e3:.3g} mm/s, with {self.samples} samples above it, σ_s "
            f"{self.sigma:.4g} N and R² {self.r_squared:.5f}. Shaded: the region around it, "
            f"{low * 1e3:.3g} to {high * 1e3:.3g} mm/s, where σ_s stays within "
            f"{100 * SETTLED_SHARE:.0f} % of that.",
            "Coulomb friction, standard deviation and correlation over the velocity threshold, "
            "with the chosen threshold and the region around it marked.",
            (low, high),
            settings={
                "of the published method": f"window {settings.published_window} samples, "
                f"polynomial order {settings.order}, {settings.steps} thresholds"
            },
        )

    def parameters(self) -> KarnoppParameters:
        """Return the parameters as a model to simulate.

        Raises ValueError if an identified value is impossible; the message names it.
        """
        return KarnoppParameters(**self.values)


def possible_model(estimate: Estimate) -> KarnoppParameters | None:
    """Return the regressed values as a model, None where one of them is impossible."""
    try:
        return estimate.parameters()
    except ValueError:
        return None
