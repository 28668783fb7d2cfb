# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The truth about a record: numbers to compare an identification with."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmark.reality.plants.kernel import Motion
from benchmark.reality.plants.parameters import Body, Friction, Law, Plant, Trend
from benchmark.reality.sensors import Instruments

NAMES = (
    "mass",
    "viscous_friction",
    "coulomb_friction",
    "static_friction",
    "spring_constant",
    "spring_preload",
    "limit_velocity",
    "sliding_friction",
    "stribeck_velocity",
    "coulomb_asymmetry",
    "viscous_asymmetry",
    "clock_offset",
)
"""Numbers of a truth, SI units.

``limit_velocity`` is DV of a Karnopp plant, 0 for others. ``sliding_friction`` is ∫|F·dx|/∫|dx| of
the record. ``stribeck_velocity`` is nan if F_s equals F_c, and ``spring_constant`` is nan without a
spring. ``coulomb_asymmetry`` is the relative excess of friction upward. ``clock_offset`` is the
apparent delay of the stem, s, including slow sensors and the actuator volume. Spring and preload
are slope and intercept of all forces along the travel, referred to the nominal area."""


@dataclass(frozen=True)
class TrueValue:
    """A number, and the ambiguity of its definition.

    Attributes
    ----------
    value : float
        The number, SI unit.
    spread : float
        Largest distance to another sensible definition: friction that changes along the travel has
        different means over distance and over time.
    """

    value: float
    spread: float = 0.0

    def error(self, estimate: float) -> float:
        """Return the distance of an estimate from all definitions, SI unit, ≥ 0."""
        return max(abs(estimate - self.value) - self.spread, 0.0)


def _among(value: float, others: Iterable[float]) -> TrueValue:
    return TrueValue(value, max((abs(other - value) for other in others), default=0.0))


def _factor(trend: Trend, place: float) -> float:
    middle = place - 0.5
    return 1.0 + trend.change * (middle + trend.bend * (2.0 * middle**2 - 1.0 / 6.0))


def _load(body: Body, position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the forces of spring and medium, N, referred to the nominal area."""
    place = position / body.travel
    spring = body.spring * position * (1.0 + 0.5 * body.spring_curve * (place - 1.0))
    flow = body.flow_force * np.maximum(place, 0.0) ** body.flow_exponent
    area = 1.0 + body.area_change * (place - 0.5)
    load: NDArray[np.float64] = (body.preload + spring + flow) / area
    return load


def _springs(
    body: Body, position: NDArray[np.float64], drifts: Iterable[float]
) -> tuple[TrueValue, TrueValue]:
    """Return k and F_0 over the range visited, by time, by the ends, and nominal."""
    low, high = float(position.min()), float(position.max())
    places = np.linspace(low, high, 200, dtype=np.float64)
    fits = [np.polyfit(where, _load(body, where), 1) for where in (places, position[::100])]
    ends = np.array([low, high])
    fits.append(np.polyfit(ends, _load(body, ends), 1))
    slopes: list[float] = [float(fit[0]) for fit in fits]
    intercepts = [float(fit[1]) for fit in fits]
    middle, *shifts = drifts
    preload = intercepts[0] + middle
    seen = [one + shift for one in (*intercepts[1:], body.preload) for shift in (middle, *shifts)]
    seen += [intercepts[0] + shift for shift in shifts]
    return _among(slopes[0], (*slopes[1:], body.spring)), _among(preload, seen)


def _frictions(plant: Plant, motion: Motion, middle: float) -> tuple[TrueValue, TrueValue]:
    """Return F_c and F_s by distance, by time, in the middle, and for the nominal area."""
    body, friction = plant.body, plant.friction
    place = middle / body.travel
    area = 1.0 + body.area_change * (place - 0.5)
    by_place = friction.coulomb * _factor(friction.along_travel, place)
    levels = (motion.coulomb_by_distance, motion.coulomb_by_time, by_place)
    coulomb = _among(levels[0], (*levels[1:], levels[0] / area))
    ratio = friction.static / friction.coulomb
    peaks = [ratio * level for level in levels[1:]] + [ratio * levels[0] / area]
    if friction.law in (Law.LUGRE, Law.MAXWELL):
        peaks.append(motion.largest)
    return coulomb, _among(ratio * levels[0], peaks)


def _sliding(motion: Motion, recorded: NDArray[np.bool_]) -> TrueValue:
    """Return the friction work per distance, with and without elastic bending."""
    position, force = motion.position[recorded], motion.friction[recorded]
    lost = float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(position)))
    if motion.distance == 0.0:
        return TrueValue(math.nan)
    return _among(motion.work / motion.distance, (abs(lost) / motion.distance,))


def _offset(plant: Plant, instruments: Instruments) -> TrueValue:
    """Return the clock offset, with and without lags that have the same effect."""
    stem, pressure = instruments.position, instruments.pressure
    clocks = instruments.position_stamping.offset - instruments.pressure_stamping.offset
    lags = stem.lag - pressure.lag + plant.body.volume_lag
    held = 0.5 * (stem.hold - pressure.hold)
    return _among(clocks + lags + held, (clocks, clocks + lags, clocks + held))


def _limit_velocity(friction: Friction) -> float:
    karnopp = friction.law in (Law.KARNOPP, Law.LATCHED)
    return friction.limit_velocity if karnopp else 0.0


def truth_of(
    plant: Plant, motion: Motion, instruments: Instruments, duration: float
) -> dict[str, TrueValue]:
    """Return the truth about a record of `duration` seconds; see `NAMES`.

    If a number changes in the record or has no single definition, its value is the mean over the
    distance, and `spread` covers the other definitions.
    """
    recorded = motion.time >= -1e-9
    position = motion.position[recorded]
    middle = 0.5 * float(position.min() + position.max())
    body, friction = plant.body, plant.friction
    falls = friction.static > friction.coulomb
    end = body.area * instruments.pressure.drift * duration
    spring, preload = _springs(body, position, (0.5 * end, 0.0, end))
    coulomb, static = _frictions(plant, motion, middle)
    # Friction that is larger upward has the same effect as a larger preload.
    one_sided = abs(friction.asymmetry) * coulomb.value
    # If the diaphragm area differs here from the nominal area, all forces scale by that factor.
    seen = 1.0 / (1.0 + body.area_change * (middle / body.travel - 0.5))
    sliding = _sliding(motion, recorded)
    return {
        "mass": TrueValue(body.mass),
        "viscous_friction": _among(friction.viscous, (friction.viscous * seen,)),
        "coulomb_friction": coulomb,
        "static_friction": static,
        "spring_constant": spring if body.spring else TrueValue(math.nan),
        "spring_preload": TrueValue(preload.value, preload.spread + one_sided),
        "limit_velocity": TrueValue(_limit_velocity(friction)),
        "sliding_friction": TrueValue(
            sliding.value, sliding.spread + abs(seen - 1.0) * sliding.value
        ),
        "stribeck_velocity": TrueValue(friction.stribeck_velocity if falls else math.nan),
        "coulomb_asymmetry": TrueValue(friction.asymmetry),
        "viscous_asymmetry": TrueValue(0.0),
        "clock_offset": _offset(plant, instruments),
    }
