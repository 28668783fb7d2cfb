# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The valve as built: what is known before an identification."""

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.checks import require_finite, require_positive
from valve_friction_ros.model.drive import Drive

_Samples = TypeVar("_Samples", float, NDArray[np.float64])


@dataclass(frozen=True)
class Valve:
    """Geometry and instruments of a single-acting sliding-stem valve.

    Attributes
    ----------
    diaphragm_area : float, optional
        Effective area S_a of the actuator diaphragm, m²; None for a machine without a diaphragm,
        which a force drives.
    pressure_reference : float
        Pressure P_ref at which the actuator exerts no force, Pa: 101325 for a sensor of
        absolute pressure, 0 for a gauge sensor.
    travel : float
        The stem moves between stops at 0 and at `travel`, m. Infinity: no stops.
    pressure_minimum, pressure_maximum : float
        Range of the pressure sensor, Pa. A reading outside is a fault of the sensor.

    Raises
    ------
    ValueError
        If a quantity is impossible; the message names it.

    Examples
    --------
    >>> import valve_friction_ros as vf
    >>> valve = vf.Valve(diaphragm_area=0.0445, pressure_reference=101325.0, travel=28.575e-3)
    >>> float(valve.actuator_force(201325.0))
    4450.0
    """

    diaphragm_area: float | None = None
    pressure_reference: float = 0.0
    travel: float = math.inf
    pressure_minimum: float = -math.inf
    pressure_maximum: float = math.inf

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        if self.diaphragm_area is not None:
            require_positive("diaphragm_area", self.diaphragm_area)
        require_finite("pressure_reference", self.pressure_reference)
        if self.travel != math.inf:
            require_positive("travel", self.travel)
        if not self.pressure_minimum < self.pressure_maximum:
            raise ValueError(
                f"pressure_minimum ({self.pressure_minimum:g}) must be below "
                f"pressure_maximum ({self.pressure_maximum:g})"
            )

    @property
    def driven_by(self) -> Drive:
        """What drives the stem."""
        return Drive.FORCE if self.diaphragm_area is None else Drive.PRESSURE

    @property
    def force_per_drive(self) -> float:
        """Force per unit of the drive: S_a in m², or 1 where a force drives the stem."""
        return 1.0 if self.diaphragm_area is None else self.diaphragm_area

    def actuator_force(self, drive: _Samples) -> _Samples:
        """Force F_ext = S_a·(P − P_ref) in N at a pressure in Pa; a force is passed on."""
        if self.diaphragm_area is None:
            return drive
        return self.diaphragm_area * (drive - self.pressure_reference)

    def actuator_drive(self, force: _Samples) -> _Samples:
        """Pressure in Pa at which the actuator exerts `force` in N; without a diaphragm `force`."""
        if self.diaphragm_area is None:
            return force
        return force / self.diaphragm_area + self.pressure_reference

    def sensor_reads(self, pressure: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return for each `pressure` in Pa whether it lies within the range of the sensor."""
        return (pressure >= self.pressure_minimum) & (pressure <= self.pressure_maximum)

    def share_of_travel(self, distance: float) -> float:
        """Express `distance` in m as a share of the travel, nan for a machine without stops."""
        return distance / self.travel if math.isfinite(self.travel) else math.nan
