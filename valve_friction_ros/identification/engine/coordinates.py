# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Coordinates of the fit: imperfections of a plant with their priors, and a straight form of all.

Each imperfection has a Gaussian prior about zero. Where the record does not determine it, the
prior remains, and widens every interval that depends on it. While it slides, the stem is at

    x = F/k − F_0/k ∓ F_c/k − (F_v/k)·ẋ .

In 1/k, F_0/k, F_c/k and F_v/k this is linear, so the linear model of a fit holds far along the
valleys in which friction, spring and delay compensate one another. Everything except the fit
itself uses the physical coordinates.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray


class Profile(Enum):
    """Prior knowledge of a valve and its instruments.

    ``PLANT`` expects every imperfection, and a lag between the signals even where none was stated.
    ``BENCH`` is a rig with good instruments: the Karnopp model alone, with mass, slip and a
    friction that falls with speed, and no lag except a stated one.
    """

    PLANT = "plant"
    BENCH = "bench"

    @property
    def has_imperfections(self) -> bool:
        """Whether imperfections are part of the fit."""
        return self is Profile.PLANT


TIMING = ("delay", "stem_lag", "force_lag")
"""A late clock of the stem, s; a slow sensor of the stem, s; a volume before the diaphragm, or
with the other sign a slow sensor of the pressure, s. Their sum is the lag of the stem."""


@dataclass(frozen=True)
class Imperfection:
    """Deviation of its prior, step of differentiation, least size and name in a sentence."""

    deviation: float
    step: float
    least: float
    words: str


IMPERFECTIONS: Mapping[str, Imperfection] = MappingProxyType(
    {
        "delay": Imperfection(1.0, 0.0002, 1e-3, "clock offset (stem late or early)"),
        "stem_lag": Imperfection(1.0, 0.0002, 1e-3, "lag of a slow stem sensor"),
        "force_lag": Imperfection(1.0, 0.0002, 1e-3, "lag of the pressure: slow sensor or volume"),
        "along_travel": Imperfection(0.1, 0.001, 0.01, "friction that varies along the travel"),
        "in_record": Imperfection(0.1, 0.001, 0.01, "friction that changes during the record"),
        "at_low_speed": Imperfection(0.1, 0.001, 0.03, "friction that falls with speed (Stribeck)"),
        "curvature": Imperfection(
            0.02, 0.0002, 1e-3, "spring, area or flow force that is nonlinear along the travel"
        ),
        "cubic": Imperfection(0.01, 0.0002, 2e-3, "spring stiffness that varies along the travel"),
        "drift": Imperfection(1e-3, 5e-05, 5e-4, "drifting zero of the pressure sensor"),
        "presliding": Imperfection(2e-5, 2e-06, 2e-6, "presliding (elastic motion before sliding)"),
        "limit_velocity": Imperfection(
            3e-4, 0.0001, 5e-5, "velocity dead zone (limit velocity DV)"
        ),
        "viscous_asymmetry": Imperfection(
            0.1, 0.001, 0.02, "asymmetric friction, upward and downward"
        ),
        "mass": Imperfection(2.0, 0.05, math.inf, "mass"),
        "slip_force": Imperfection(0.5, 0.02, 0.0, "static friction (slip jump)"),
        "stribeck_velocity": Imperfection(4e-3, 1e-05, math.inf, "friction that falls with speed"),
    }
)
"""By the name of the coordinate. Shares are of F_c (friction, slip force), of k times the measured
range (spring) and of the force's range in a minute (drift); times s, lengths m, speeds m/s. The
deviations of the timing are shares of `timing_uncertainty`, that of the mass is a share of the
assumed mass."""

BOUNDS: Mapping[str, float] = MappingProxyType(
    {
        "coulomb_friction": 0.0,
        "viscous_friction": 0.0,
        "spring_constant": 1e-12,
        "slip_force": 0.0,
        "mass": 0.02,
        "stem_lag": 0.0,
        "presliding": 0.0,
        "limit_velocity": 0.0,
        "stribeck_velocity": 1e-4,
    }
)
"""Least values of the straight coordinates that have one; the bound of the spring is on 1/k."""


MASS_PER_AREA = 200.0
"""Standard deviation of the moving mass per diaphragm area, kg/m²: 8 kg at 0.04 m². The bench valve
has 36 kg/m²; stem, plug and plate of a large valve may be ten times as heavy for their area."""

_LEAST_MINUTES = 0.1
"""Least duration of a record for the drift of a zero."""

_OF_THE_MODEL = (*TIMING, "mass", "slip_force", "stribeck_velocity")
"""Coordinates that no profile leaves out."""


def zero_drift(span: float, minutes: float) -> float:
    """Return the deviation of the drift of a force's zero from the middle of a record, N.

    `span` is the range of the sensor, N (`sensor_span`); with 1 the result is a share of it.
    """
    return IMPERFECTIONS["drift"].deviation * span * max(minutes, _LEAST_MINUTES)


def sensor_span(force: NDArray[np.float64]) -> float:
    """Return the least range, N, of the sensor of a force, to which its zero drift is proportional.

    In a partial stroke the force, N, above that of the reference pressure hardly changes.
    """
    return max(float(np.ptp(force)), float(np.max(np.abs(force))))


def deviations(
    timing: float,
    assumed_mass: float,
    dry_friction: float,
    minutes: float,
    profile: Profile = Profile.PLANT,
    diaphragm_area: float = 0.0,
) -> dict[str, float]:
    """Return the standard deviation of each prior in the coordinate's own unit.

    `timing` is that of each source of a lag, s. Without it lags are left out, and so are the
    imperfections that the profile does not expect. The mass of a bench lies anywhere between zero
    and twice the assumed mass; that of a plant may be as large as its `diaphragm_area`, m²,
    suggests.
    """
    own = {name: one.deviation for name, one in IMPERFECTIONS.items()}
    own["mass"] = max(own["mass"] * assumed_mass, MASS_PER_AREA * diaphragm_area)
    own["slip_force"] *= dry_friction
    own["drift"] = zero_drift(1.0, minutes)
    for name in TIMING:
        if timing > 0:
            own[name] *= timing
        else:
            del own[name]
    if profile.has_imperfections:
        return own
    own["mass"] = assumed_mass / math.sqrt(3.0)
    return {name: deviation for name, deviation in own.items() if name in _OF_THE_MODEL}


Coordinates = Mapping[str, float]
"""Value of each coordinate of the model."""

MAIN = (
    "coulomb_friction",
    "viscous_friction",
    "spring_constant",
    "spring_preload",
    "start_position",
)
"""Coordinates of the Karnopp model without its imperfections."""

_OVER_SPRING = ("coulomb_friction", "viscous_friction", "spring_preload", "slip_force")


def straight(at: Coordinates, names: tuple[str, ...]) -> dict[str, float]:
    """Replace the free coordinates `names` by the straight ones, under the same names."""
    spring = at["spring_constant"]
    result = dict(at)
    for name in _OVER_SPRING:
        if name in names:
            result[name] = at[name] / spring
    result["spring_constant"] = 1.0 / spring
    return result


def physical(at: Coordinates, names: tuple[str, ...]) -> dict[str, float]:
    """Undo `straight`."""
    spring = 1.0 / at["spring_constant"]
    result = dict(at)
    for name in _OVER_SPRING:
        if name in names:
            result[name] = at[name] * spring
    result["spring_constant"] = spring
    return result


def jacobian(at: Coordinates, names: tuple[str, ...]) -> NDArray[np.float64]:
    """Differentiate the physical coordinates by the straight ones, shape (p, p).

    With c = 1/k and b = F/k: ∂k/∂c = −k², ∂F/∂b = k, ∂F/∂c = −F·k.
    """
    spring = at["spring_constant"]
    result = np.eye(len(names))
    for row, name in enumerate(names):
        if name in _OVER_SPRING:
            result[row, row] = spring
    if "spring_constant" in names:
        column = names.index("spring_constant")
        result[column, column] = -(spring**2)
        for row, name in enumerate(names):
            if name in _OVER_SPRING:
                result[row, column] = -at[name] * spring
    return result
