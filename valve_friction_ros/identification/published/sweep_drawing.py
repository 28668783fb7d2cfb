# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sweep of the velocity threshold in figures and reports."""

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.drawing import Curve, Panel
from valve_friction_ros.identification.published.sweep import Sweep
from valve_friction_ros.identification.trust.verdict import Parameter

SETTLED_SHARE = 0.1
"""Largest difference of σ_s in the chosen region, over σ_s at the chosen threshold. Chosen."""

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
