# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Limits of a stroke test, and the conditions of its measurement."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.model.checks import require_non_negative, require_positive
from valve_friction_ros.model.drive import DEFAULT_LAG

_FRICTION = ("coulomb_friction", "viscous_friction", "static_friction")

AIMS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "friction": _FRICTION,
        **{name: (name,) for name in (*_FRICTION, SLIDING, "spring_constant")},
    }
)
"""Aims of a test: the numbers whose intervals matter."""

STOP_MARGIN = 0.05
"""Share of the travel that a stem without any friction keeps from either stop: an allowance for an
uncertain spring."""


@dataclass(frozen=True)
class Limits:
    """Limits of a stroke test.

    Attributes
    ----------
    lowest, highest : float
        Part of the travel in which the stem may move, shares of the travel, 0 to 1.
    speed : float
        Largest speed of the sliding stem, m/s.
    duration : float
        Longest duration, s.
    pressure_rate : float
        Largest rate of the pressure, Pa/s.
    pressure_minimum, pressure_maximum : float
        Pressures that may be set, Pa.
    allow_stops : bool
        Whether the stem may reach seat and stop; otherwise it keeps `STOP_MARGIN` from them.

    Raises
    ------
    ValueError
        If a limit is impossible; the message names it.
    """

    lowest: float = 0.2
    highest: float = 0.8
    speed: float = 10e-3
    duration: float = 60.0
    pressure_rate: float = math.inf
    pressure_minimum: float = -math.inf
    pressure_maximum: float = math.inf
    allow_stops: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.lowest < self.highest <= 1:
            raise ValueError(
                "the part of the travel must be given from low to high within 0 to 100 %, got "
                f"{100 * self.lowest:g} % to {100 * self.highest:g} %"
            )
        require_positive("speed", self.speed)
        require_positive("duration", self.duration)
        if not self.pressure_rate > 0:
            raise ValueError(f"pressure_rate must be above zero, got {self.pressure_rate:g}")
        if not self.pressure_minimum < self.pressure_maximum:
            raise ValueError(
                f"pressure_minimum ({self.pressure_minimum:g}) must be below "
                f"pressure_maximum ({self.pressure_maximum:g})"
            )


@dataclass(frozen=True)
class Conditions:
    """Sampling, sensor noise and converter of a stroke test.

    Attributes
    ----------
    sample_rate : float
        Samples per second of both signals, Hz.
    position_noise : float
        Standard deviation of the stem sensor, m.
    pressure_noise : float
        Standard deviation of the pressure sensor, Pa.
    converter_lag : float
        Time constant of the converter that sets the pressure, s.

    Raises
    ------
    ValueError
        If a value is impossible; the message names it.
    """

    sample_rate: float = 100.0
    position_noise: float = 10e-6
    pressure_noise: float = 100.0
    converter_lag: float = DEFAULT_LAG

    def __post_init__(self) -> None:
        require_positive("sample_rate", self.sample_rate)
        require_non_negative("position_noise", self.position_noise)
        require_non_negative("pressure_noise", self.pressure_noise)
        require_non_negative("converter_lag", self.converter_lag)
