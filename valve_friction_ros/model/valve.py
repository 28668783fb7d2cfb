"""The valve as built: what is known before an identification."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.checks import require_finite, require_positive

__all__ = ["Valve"]


@dataclass(frozen=True)
class Valve:
    """Geometry and instruments of a single-acting sliding-stem valve.

    Attributes
    ----------
    diaphragm_area : float
        Effective area S_a of the actuator diaphragm, m².
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

    diaphragm_area: float
    pressure_reference: float = 0.0
    travel: float = math.inf
    pressure_minimum: float = -math.inf
    pressure_maximum: float = math.inf

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require_positive("diaphragm_area", self.diaphragm_area)
        require_finite("pressure_reference", self.pressure_reference)
        if self.travel != math.inf:
            require_positive("travel", self.travel)
        if not self.pressure_minimum < self.pressure_maximum:
            raise ValueError(
                f"pressure_minimum ({self.pressure_minimum:g}) must be below "
                f"pressure_maximum ({self.pressure_maximum:g})"
            )

    def actuator_force(self, pressure: NDArray[np.float64]) -> NDArray[np.float64]:
        """Force F_ext = S_a·(P − P_ref) in N of the actuator at `pressure` in Pa."""
        return self.diaphragm_area * (pressure - self.pressure_reference)

    def actuator_pressure(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Pressure in Pa at which the actuator exerts `force` in N."""
        return force / self.diaphragm_area + self.pressure_reference

    def sensor_reads(self, pressure: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return for each `pressure` in Pa whether it lies within the range of the sensor."""
        return (pressure >= self.pressure_minimum) & (pressure <= self.pressure_maximum)

    def share_of_travel(self, distance: float) -> float:
        """Express `distance` in m as a share of the travel, nan for a machine without stops."""
        return distance / self.travel if math.isfinite(self.travel) else math.nan
