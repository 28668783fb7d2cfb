# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Where the fits of a record start: regressions, and the ways to split what they find."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from valve_friction_ros.identification.engine.broad_model import BroadModel
from valve_friction_ros.identification.engine.coordinates import Coordinates
from valve_friction_ros.identification.engine.fitted_record import FittedRecord
from valve_friction_ros.identification.engine.imperfections import BOUNDS, TIMING
from valve_friction_ros.identification.refusal import RefusalError

_SLIDING = 0.15
"""Share of the top speed above which a stem surely slides."""

_DRY_SHARES = (0.3, 0.5, 0.7, 0.85, 0.95, 1.0)
"""Shares of the sliding friction to start F_c from; the rest is viscous."""

_LAGS = (-2.0, -1.5, -1.0, -0.5, -0.25, 0.25, 0.5, 1.0, 1.5, 2.0)
"""Lags to start from, in timing uncertainties."""

_LEAST_VISCOUS = 0.1
"""Share of the viscous friction that a start keeps: without any a stem swings, and no derivative
tells the way."""


@dataclass(frozen=True)
class Sliding:
    """A regression over the steps at which the stem surely slides.

    Attributes
    ----------
    friction : float
        Sliding friction at the mean speed, N.
    speed : float
        That speed, m/s.
    spring_constant, spring_preload : float
        The spring.
    """

    friction: float
    speed: float
    spring_constant: float
    spring_preload: float


def sliding(record: FittedRecord) -> Sliding:
    """Regress the averaged force on the side of motion, the velocity, the position and 1."""
    slow = record.slow
    fast = slow.speed > _SLIDING * np.quantile(slow.speed, 0.98)
    position = slow.lowest + 0.5 * (slow.place + 1.0) * slow.range
    columns = np.column_stack(
        [np.sign(slow.velocity), slow.velocity, position, np.ones_like(position)]
    )[fast]
    scale = np.max(np.abs(columns), axis=0)
    solution = np.linalg.lstsq(columns / scale, slow.force[fast], rcond=1e-6)[0] / scale
    dry, viscous, spring, preload = solution.tolist()
    speed = float(np.mean(slow.speed[fast]))
    if not spring > 0:
        raise RefusalError(
            "the stem does not follow the force: check that both signals belong to this valve, "
            "their directions and their units"
        )
    return Sliding(max(dry + viscous * speed, 1.0), speed, spring, preload)


def split(sliding: Sliding, share: float) -> dict[str, float]:
    """Split the sliding friction into F_c and F_v."""
    return {
        "coulomb_friction": share * sliding.friction,
        "viscous_friction": max(1.0 - share, 0.02) * sliding.friction / sliding.speed,
    }


def nearest(model: BroadModel, starts: Sequence[Coordinates]) -> list[Coordinates]:
    """Sort starts by the distance of their simulated stem from the measured one.

    The mean magnitude counts: a single jump at the wrong time says little of a start.
    """

    def distance(start: Coordinates) -> float:
        residual = model.record.position - model.readings(start)
        return float(np.sum(np.abs(residual * model.weights)))

    return sorted(starts, key=distance)


def splits(regressed: Sliding, base: Coordinates) -> list[Coordinates]:
    """Return starts that split the sliding friction in several ways."""
    return [{**base, **split(regressed, share)} for share in _DRY_SHARES]


def lagging(at: Coordinates, timing_uncertainty: float) -> list[Coordinates]:
    """Return starts with one lag each, and with as much less of the delay F_v/k.

    A sliding stem follows the force by F_v/k, and a lag of a sensor adds to that; a fit without
    lags finds their sum. From there the fit with all of them leads into many a wrong valley.
    """
    starts: list[Coordinates] = []
    for name in TIMING:
        for share in _LAGS:
            lag = share * timing_uncertainty
            viscous = at["viscous_friction"] - lag * at["spring_constant"]
            least = _LEAST_VISCOUS * at["viscous_friction"]
            if lag > BOUNDS.get(name, -np.inf) and lag != 0.0:
                starts.append({**at, name: lag, "viscous_friction": max(viscous, least)})
    return starts
