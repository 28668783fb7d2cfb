# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Names and units of the parameters, for all methods and all renderings."""

from collections.abc import Mapping
from types import MappingProxyType

SLIDING = "sliding_friction"
"""Parameter name: ∫|F_friction|·|dx| / ∫|dx| over the record, N."""

CLOCK_OFFSET = "clock_offset"
"""Parameter name. Its value, s, is positive if the stem's time stamps are late."""

UNITS: Mapping[str, str] = MappingProxyType(
    {
        "mass": "kg",
        "viscous_friction": "N·s/m",
        "coulomb_friction": "N",
        "static_friction": "N",
        "spring_constant": "N/m",
        "spring_preload": "N",
    }
)
"""Unit of each parameter of the Karnopp model, in the order in which they are shown."""

PARAMETER_UNITS: Mapping[str, str] = MappingProxyType(
    {
        **UNITS,
        "stribeck_velocity": "m/s",
        "coulomb_asymmetry": "1",
        "viscous_asymmetry": "1",
        CLOCK_OFFSET: "s",
        SLIDING: "N",
    }
)
"""Unit of every parameter that a result can hold; those after `UNITS` appear only if demanded."""

_SUFFIXES = {
    "kg": "_kg",
    "N": "_n",
    "N·s/m": "_n_s_per_m",
    "N/m": "_n_per_m",
    "m/s": "_m_per_s",
    "s": "_s",
}


def column_suffix(parameter: str) -> str:
    """Return the unit of a parameter as a column-name suffix; empty for a pure number."""
    return _SUFFIXES.get(PARAMETER_UNITS.get(parameter, ""), "")
