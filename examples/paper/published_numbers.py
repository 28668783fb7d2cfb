# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The paper's own numbers, in SI units."""

from types import MappingProxyType

from valve_friction_ros.model import PRESSURE_RANGE, KarnoppParameters

PACKINGS = ("low", "high")
"""The packings of the paper."""

PRESSURE_SPAN = PRESSURE_RANGE[1] - PRESSURE_RANGE[0]
"""Input range, Pa."""

NOMINAL_MASS = 1.6
"""Mass of the moving parts, kg (section 4)."""

POSITION_BIAS = 1.13e-3
"""x̄ for the paper's estimates, m: the mean of (16)."""

SIGNATURE_SPRING = MappingProxyType({"low": 2.0293e5, "high": 2.0391e5})
"""k of (15) in (16), N/m."""

SIGNATURE_BIAS = MappingProxyType({"low": 1.12e-3, "high": 1.14e-3})
"""x̄ of (14) in (16), m."""

DEAD_ZONE_RATIO = 3.0
"""Lower bound of the ratio of the dead zones, high over low (Fig. 2)."""

CHOSEN_THRESHOLD = 0.01
"""Approximate δv chosen by the paper, m/s (Figs. 3 and 4)."""

VARIANCE_THRESHOLD = 0.012
"""δv above which the estimates scatter, m/s (Fig. 3)."""


def _model(
    mass: float, spring_constant: float, viscous_friction: float, coulomb_friction: float
) -> KarnoppParameters:
    return KarnoppParameters(
        mass=mass,
        viscous_friction=viscous_friction,
        coulomb_friction=coulomb_friction,
        static_friction=coulomb_friction,
        spring_constant=spring_constant,
        spring_preload=spring_constant * POSITION_BIAS,
    )


MODEL_1 = MappingProxyType(
    {"low": _model(1.542, 2.05e5, 4865.0, 152.7), "high": _model(1.75, 2.05e5, 4.48e4, 606.0)}
)
"""Table 1, model 1: the sweep."""

MODEL_2 = MappingProxyType(
    {
        "low": _model(NOMINAL_MASS, 2.03e5, 1.15e4, 157.5),
        "high": _model(NOMINAL_MASS, 2.04e5, 2.15e4, 691.27),
    }
)
"""Table 1, model 2: the force balance."""
