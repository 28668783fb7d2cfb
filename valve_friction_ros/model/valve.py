# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The valve as built, and the parameters of its friction model, equations (1) and (2)."""

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from valve_friction_ros.model.checks import require_finite, require_non_negative, require_positive
from valve_friction_ros.model.drive import Drive

_BELOW, _ABOVE = (4.0 - 3.8) / 16.0, (20.5 - 20.0) / 16.0
"""Shares of its range by which a sensor reads beyond it: 3.8 to 20.5 mA by NAMUR NE 43."""

_Samples = TypeVar("_Samples", float, NDArray[np.float64])


@dataclass(frozen=True)
class Valve:
    """Geometry and instruments of a single-acting sliding-stem valve.

    Attributes
    ----------
    diaphragm_area : float, optional
        Effective area S_a of the actuator diaphragm, m²; None for a machine without a diaphragm,
        which is driven by a force.
    pressure_reference : float
        Pressure P_ref at which the actuator exerts no force, Pa: 101325 for a sensor of
        absolute pressure, 0 for a gauge sensor.
    travel : float
        The stem moves between stops at 0 and at `travel`, m. Infinity: no stops.
    pressure_minimum, pressure_maximum : float
        Range of the pressure sensor, Pa. A reading clearly outside is a fault of the sensor
        (`readings`).

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
        """The drive of the stem."""
        return Drive.FORCE if self.diaphragm_area is None else Drive.PRESSURE

    @property
    def force_per_drive(self) -> float:
        """Force per unit of the drive: S_a in m², or 1 where a force drives the stem."""
        return 1.0 if self.diaphragm_area is None else self.diaphragm_area

    def actuator_force(self, drive: _Samples) -> _Samples:
        """Force F_ext = S_a·(P − P_ref) in N at a pressure in Pa; a force is unchanged."""
        if self.diaphragm_area is None:
            return drive
        return self.diaphragm_area * (drive - self.pressure_reference)

    def actuator_drive(self, force: _Samples) -> _Samples:
        """Pressure in Pa at which the actuator exerts `force` in N; without a diaphragm `force`."""
        if self.diaphragm_area is None:
            return force
        return force / self.diaphragm_area + self.pressure_reference

    @property
    def readings(self) -> tuple[float, float]:
        """Lowest and highest pressure that a sound sensor may read, Pa.

        A transmitter reads beyond its range by as much as NAMUR NE 43 reserves for measured values:
        a vented actuator may read slightly below zero.
        """
        span = self.pressure_maximum - self.pressure_minimum
        if not math.isfinite(span):
            return self.pressure_minimum, self.pressure_maximum
        return self.pressure_minimum - _BELOW * span, self.pressure_maximum + _ABOVE * span

    def sensor_reads(self, pressure: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return for each `pressure` in Pa whether a sound sensor may read it."""
        lowest, highest = self.readings
        return (pressure >= lowest) & (pressure <= highest)

    def share_of_travel(self, distance: float) -> float:
        """Express `distance` in m as a share of the travel, nan for a machine without stops."""
        return distance / self.travel if math.isfinite(self.travel) else math.nan


@dataclass(frozen=True)
class KarnoppParameters:
    """Moving mass, friction and spring of a valve.

    The stem obeys ``m·ẍ = S_a·(P − P_ref) − k·x − F_0 − friction``.

    Attributes
    ----------
    mass : float
        Mass m of the moving parts, kg, above zero.
    viscous_friction : float
        Coefficient F_v, N·s/m.
    coulomb_friction : float
        Friction force F_c of the sliding stem, N.
    static_friction : float
        Largest friction force F_s of the resting stem, N, not below `coulomb_friction`.
        Where it is above, the stem jumps as it breaks away (slip jump).
    spring_constant : float
        Stiffness k of the actuator spring, N/m. Zero: no spring.
    spring_preload : float
        Spring force F_0 = k·x̄ at x = 0, N; x̄ is the bias of (10).
    limit_velocity : float
        Speed DV, m/s, at which a sliding stem comes to rest if the static friction can
        hold it. Zero is the exact limit: it rests when its speed reaches zero.
    stribeck_velocity : float
        Speed v_s, m/s, over which the friction of the moving stem falls from F_s to F_c,
        ``F_c + (F_s − F_c)·exp(−(ẋ/v_s)²)``. Zero, as published: it falls at once.
    coulomb_asymmetry, viscous_asymmetry : float
        Shares a, between −1 and 1, by which the friction is larger on the way up (1 + a) and
        smaller on the way down (1 − a). The first scales F_c and F_s, the second F_v.
        Zero, as published: equal friction in both directions.

    Raises
    ------
    ValueError
        If a quantity is impossible; the message names it.

    Examples
    --------
    >>> import valve_friction_ros as vf
    >>> packing = vf.KarnoppParameters(
    ...     mass=1.6, viscous_friction=4865.0, coulomb_friction=150.0, static_friction=180.0,
    ...     spring_constant=2.05e5,
    ... )
    >>> packing.static_friction - packing.coulomb_friction
    30.0
    >>> vf.KarnoppParameters(1.6, 4865.0, 150.0, 140.0, 2.05e5)
    Traceback (most recent call last):
        ...
    ValueError: static_friction (140) must not be below coulomb_friction (150)
    """

    mass: float
    viscous_friction: float
    coulomb_friction: float
    static_friction: float
    spring_constant: float
    spring_preload: float = 0.0
    limit_velocity: float = 0.0
    stribeck_velocity: float = 0.0
    coulomb_asymmetry: float = 0.0
    viscous_asymmetry: float = 0.0

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require_positive("mass", self.mass)
        require_non_negative("viscous_friction", self.viscous_friction)
        require_non_negative("coulomb_friction", self.coulomb_friction)
        require_non_negative("static_friction", self.static_friction)
        require_non_negative("spring_constant", self.spring_constant)
        require_finite("spring_preload", self.spring_preload)
        require_non_negative("limit_velocity", self.limit_velocity)
        require_non_negative("stribeck_velocity", self.stribeck_velocity)
        for name in ("coulomb_asymmetry", "viscous_asymmetry"):
            if not abs(require_finite(name, getattr(self, name))) < 1:
                raise ValueError(f"{name} must lie between -1 and 1, got {getattr(self, name):g}")
        if self.static_friction < self.coulomb_friction:
            raise ValueError(
                f"static_friction ({self.static_friction:g}) must not be below "
                f"coulomb_friction ({self.coulomb_friction:g})"
            )

    def sliding_friction(self, velocity: ArrayLike) -> NDArray[np.float64]:
        """Friction force in N on a stem that slides at `velocity` (m/s), against its motion.

        Zero where the velocity is zero: the stem rests there, and friction balances the other
        forces.
        """
        speed = np.abs(np.asarray(velocity, dtype=np.float64))
        side = np.sign(velocity)
        excess = self.static_friction - self.coulomb_friction
        fall = np.exp(-((speed / self.stribeck_velocity) ** 2)) if self.stribeck_velocity else 0.0
        dry = (self.coulomb_friction + excess * fall) * (1 + side * self.coulomb_asymmetry)
        viscous = self.viscous_friction * speed * (1 + side * self.viscous_asymmetry)
        force: NDArray[np.float64] = side * (dry + viscous)
        return force
