# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Parameters of a simulated valve: body and friction, with their deviations from the ideal."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

PRESSURE_RANGE = (41740.0, 206840.0)
"""Converter pressure at 0 % and 100 % input, Pa."""


class Law(Enum):
    """Law of the friction force as a function of the motion."""

    MOREAU = "moreau"
    """Set-valued at rest; falls from static to Coulomb friction with speed (Stribeck)."""

    KARNOPP = "karnopp"
    """Equation (2) to the letter: below the limit velocity static friction acts."""

    LATCHED = "latched"
    """Karnopp, but after breakaway the stem slides until its speed falls below the limit."""

    LUGRE = "lugre"
    """A bristle that bends before the stem slides (Canudas de Wit, 1995)."""

    MAXWELL = "maxwell"
    """Several springs in parallel that slip one after the other (Iwan; generalized Maxwell)."""


@dataclass(frozen=True)
class Trend:
    """A smooth relative change over the travel or the record.

    Attributes
    ----------
    change : float
        Total relative change from start to end, around the middle.
    bend : float
        Curvature: parabolic part as a share of `change`, between −1 and 1.
    """

    change: float = 0.0
    bend: float = 0.0


@dataclass(frozen=True)
class Friction:
    """Friction of a packing.

    Attributes
    ----------
    coulomb, static, viscous : float
        F_c (N), F_s (N) and F_v (N·s/m).
    stribeck_velocity : float
        Speed, m/s, at which the excess of F_s over F_c has fallen by a factor of e; 0: at once.
    law : Law
        Friction law.
    presliding : float
        Displacement, m, over which the force builds up, for LuGre and Maxwell.
    limit_velocity : float
        DV of the two Karnopp laws, m/s.
    asymmetry : float
        Relative excess of F_c and F_s upward, and their relative deficit downward.
    along_travel : Trend
        Change of F_c and F_s from the seat to the end of the travel.
    in_record : Trend
        Change of F_c and F_s from the first to the last second of the record.
    """

    coulomb: float
    static: float
    viscous: float
    stribeck_velocity: float = 0.0
    law: Law = Law.MOREAU
    presliding: float = 0.0
    limit_velocity: float = 0.0
    asymmetry: float = 0.0
    along_travel: Trend = field(default_factory=Trend)
    in_record: Trend = field(default_factory=Trend)

    def scaled(self, factor: float) -> "Friction":
        """Return a packing with all its friction `factor` times as large."""
        return replace(
            self,
            coulomb=self.coulomb * factor,
            static=self.static * factor,
            viscous=self.viscous * factor,
        )


@dataclass(frozen=True)
class Body:
    """All parameters of a valve except friction.

    Attributes
    ----------
    mass, spring, preload : float
        m (kg), k (N/m) at the middle of the travel, and F_0 (N).
    area, pressure_reference, travel : float
        S_a (m²) at the middle of the travel, P_ref (Pa) and nominal travel (m).
    spring_curve, area_change : float
        Relative change of stiffness and of area from the seat to the end of the travel.
    flow_force, flow_exponent : float
        Downward force of the medium at full travel, N, and exponent of its rise with the opening.
    seat, top : float
        Distances of the stops from their nominal positions, m, positive inward.
    volume_lag : float
        First-order lag, s, from the pressure sensor to the diaphragm.
    """

    mass: float
    spring: float
    preload: float
    area: float = 0.0445
    pressure_reference: float = PRESSURE_RANGE[0]
    travel: float = 0.028575
    spring_curve: float = 0.0
    area_change: float = 0.0
    flow_force: float = 0.0
    flow_exponent: float = 2.0
    seat: float = 0.0
    top: float = 0.0
    volume_lag: float = 0.0


@dataclass(frozen=True)
class Plant:
    """A valve: body and friction."""

    body: Body
    friction: Friction


PACKINGS: Mapping[str, Plant] = MappingProxyType(
    {
        "low": Plant(Body(1.542, 2.05e5, 231.65), Friction(152.7, 152.7, 4865.0)),
        "high": Plant(Body(1.75, 2.05e5, 231.65), Friction(606.0, 606.0, 4.48e4)),
        "graphite": Plant(
            Body(1.6, 2.069e5, 2571.0, pressure_reference=0.0), Friction(665.4, 942.4, 7.05e4)
        ),
    }
)
"""The paper's bench valve with light and with strong tightening, and a graphite packing."""

STEPS = {
    Law.MOREAU: 5e-6,
    Law.KARNOPP: 5e-6,
    Law.LATCHED: 5e-6,
    Law.LUGRE: 4e-6,
    Law.MAXWELL: 2.5e-6,
}
"""Time step of each law, s."""

ELEMENTS = 6
"""Number of springs in the Maxwell law."""

_BRISTLE_DAMPING = 0.7
"""Damping ratio of stem and bristle before sliding."""


class Constants(NamedTuple):
    """A plant as plain numbers for compiled code, in SI units; see `Body` and `Friction`."""

    mass: float
    spring: float
    preload: float
    spring_curve: float
    area: float
    area_change: float
    pressure_reference: float
    flow_force: float
    flow_exponent: float
    travel: float
    lowest: float
    highest: float
    volume_lag: float
    coulomb: float
    static: float
    viscous: float
    stribeck_velocity: float
    limit_velocity: float
    asymmetry: float
    along_change: float
    along_bend: float
    record_change: float
    record_bend: float
    stiffness: float
    bristle_damping: float


def constants(plant: Plant) -> Constants:
    """Return the constants of a plant."""
    body, friction = plant.body, plant.friction
    bends = friction.law in (Law.LUGRE, Law.MAXWELL)
    stiffness = friction.static / friction.presliding if bends else 0.0
    numbers = {
        **vars(body),
        **vars(friction),
        "lowest": body.seat,
        "highest": body.travel - body.top,
        "along_change": friction.along_travel.change,
        "along_bend": friction.along_travel.bend,
        "record_change": friction.in_record.change,
        "record_bend": friction.in_record.bend,
        "stiffness": stiffness,
        "bristle_damping": 2 * _BRISTLE_DAMPING * float(np.sqrt(stiffness * body.mass)),
    }
    return Constants(**{name: numbers[name] for name in Constants._fields})
