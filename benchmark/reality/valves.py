# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Randomly generated valves of all sizes and frictions, each consistent in itself."""

import math
from dataclasses import dataclass

import numpy as np

from benchmark.reality.plants import Body, Friction, Plant

_AREAS = (0.004, 0.12)
_TRAVELS = (0.008, 0.08)
_SPRINGS = (2e4, 2e6)
_FRICTIONS = (0.003, 0.3)
"""Ranges of areas, m²; travels, m; springs, N/m; and F_c over the spring force of the travel."""

_DIAPHRAGM = ((0.2e5, 1.0e5), (0.4e5, 2.0e5), (0.8e5, 2.4e5))
_PISTON = ((0.5e5, 4.0e5), (1.0e5, 6.0e5))
_SENSORS = (1.6e5, 2.5e5, 4e5, 6e5, 10e5)
"""Pressure ranges of the actuator, and ranges of commercial sensors, Pa."""

_SLIPS = (1.15, 2.0)
_SLIP_SPEEDS = (0.3e-3, 5e-3)
_LARGEST_JUMP = 0.1
"""F_s over F_c of a slipping packing, its v_s (m/s), and the largest F_s − F_c, share of the spring
force: beyond it the stem jumps through half its travel."""

_VISCOUS = (0.1, 3.0)
_SLOWEST = 0.6
"""Viscous over Coulomb friction at the speed of a large step, and the largest F_v/k over the
filling time, since no real valve is slower than its actuator."""

_FILLING = (0.9, 1.27e-3, 0.3)
_MASS = (3.0, 1.27e-3, 0.8)
"""Laws of filling time (s) and mass (kg): value at a reference volume (m³), that volume, and the
exponent of the volume."""

_ABSOLUTE = 101325.0
_OVERDRIVEN = 1.15
"""Atmosphere, Pa, and the largest command of a controller."""


@dataclass(frozen=True)
class DrawnValve:
    """A valve and its converter.

    Attributes
    ----------
    plant : Plant
        The valve.
    low, high : float
        Pressure at command 0 and 1, Pa.
    filling : float
        First-order lag from command to pressure, s.
    sensor : tuple of float
        Range of the pressure sensor, Pa.
    kind : str
        "diaphragm", "piston" or "cylinder"; a cylinder has no spring.
    """

    plant: Plant
    low: float
    high: float
    filling: float
    sensor: tuple[float, float]
    kind: str

    @property
    def slips(self) -> bool:
        """Whether friction falls at breakaway."""
        return self.plant.friction.static > self.plant.friction.coulomb

    @property
    def settling(self) -> float:
        """Time, s, until a third of a command step remains."""
        if not self.plant.body.spring:
            return self.filling
        return self.filling + self.plant.friction.viscous / self.plant.body.spring

    @property
    def friction_share(self) -> float:
        """F_c over the spring force or, without a spring, over the actuator force."""
        body = self.plant.body
        whole = body.spring * body.travel or 0.5 * body.area * (self.high - self.low)
        return self.plant.friction.coulomb / whole


def log_uniform(random: np.random.Generator, low: float, high: float) -> float:
    """Draw a number whose logarithm is uniform."""
    return float(low * (high / low) ** random.random())


def _size(random: np.random.Generator, largest_area: float) -> tuple[float, float]:
    """Draw area and travel: large actuators have long travels, with much scatter."""
    while True:
        area = log_uniform(random, _AREAS[0], largest_area)
        travel = 0.012 * (area / _AREAS[0]) ** 0.5 * math.exp(random.uniform(-0.6, 0.6))
        if _TRAVELS[0] <= travel <= _TRAVELS[1]:
            return area, travel


def _by_volume(law: tuple[float, float, float], volume: float, scatter: float) -> float:
    size, reference, power = law
    return size * math.exp(power * math.log(volume / reference) + scatter)


def _packing(
    random: np.random.Generator, slips: bool, force: float, speed: float, stiffest: float
) -> Friction:
    """Draw a packing for a spring `force` (N), a typical `speed` (m/s) and the largest F_v."""
    ratio = log_uniform(random, *_SLIPS) if slips else 1.0
    largest = min(_FRICTIONS[1], _LARGEST_JUMP / max(ratio - 1.0, 1e-9))
    coulomb = force * log_uniform(random, _FRICTIONS[0], largest)
    viscous = min(log_uniform(random, *_VISCOUS) * coulomb / speed, stiffest)
    fall = log_uniform(random, *_SLIP_SPEEDS) if slips else 0.0
    return Friction(coulomb, ratio * coulomb, viscous, stribeck_velocity=fall)


def drawn_valve(random: np.random.Generator, slips: bool, reserve: float = 1.0) -> DrawnValve:
    """Draw a valve with a spring, whose actuator can stroke it against its friction.

    `reserve` is the factor by which friction may grow while this remains true.
    """
    while True:
        piston = random.random() < 0.25
        area, travel = _size(random, 0.06 if piston else _AREAS[1])
        ranges = _PISTON if piston else _DIAPHRAGM
        low, high = ranges[random.integers(len(ranges))]
        volume = area * travel
        filling = _by_volume(_FILLING, volume, random.uniform(-0.7, 0.7))
        mass = _by_volume(_MASS, volume, random.uniform(-0.6, 0.6))
        speed = 0.4 * travel / filling
        # The spring force is the unit here, because friction is a share of it.
        share = _packing(random, slips, 1.0, speed, math.inf)
        beside = 1.1 * share.coulomb + 0.3 * (share.static - share.coulomb)
        force = area * (high - low) / (1.0 + 2.0 * reserve * beside)
        spring = force / travel
        if not _SPRINGS[0] <= spring <= _SPRINGS[1]:
            continue
        friction = Friction(
            share.coulomb * force,
            share.static * force,
            min(share.viscous * force, _SLOWEST * filling * spring),
            stribeck_velocity=share.stribeck_velocity,
        )
        is_absolute = random.random() < 0.2
        zero = _ABSOLUTE if is_absolute else 0.0
        preload = area * low + reserve * beside * force
        body = Body(mass, spring, preload, area, zero, travel)
        top = next(one for one in _SENSORS if one >= low + _OVERDRIVEN * (high - low))
        kind = "piston" if piston else "diaphragm"
        sensor = (zero, zero + top)
        return DrawnValve(Plant(body, friction), zero + low, zero + high, filling, sensor, kind)


def drawn_cylinder(random: np.random.Generator, slips: bool) -> DrawnValve:
    """Draw a cylinder without a spring; its pressure is the difference between its chambers."""
    area, travel = _size(random, 0.03)
    highest = float(random.choice([1e5, 3e5, 6e5]))
    volume = area * travel
    filling = 0.05 * _by_volume(_FILLING, volume, random.uniform(-0.7, 0.7))
    mass = _by_volume(_MASS, volume, random.uniform(-0.6, 0.6))
    speed = travel * log_uniform(random, 0.05, 0.3)
    force = 0.5 * area * highest
    friction = _packing(random, slips, force, speed, math.inf)
    offset = force * random.uniform(-0.02, 0.02)
    body = Body(mass, 0.0, offset, area, 0.0, travel)
    plant = Plant(body, friction)
    return DrawnValve(plant, -highest, highest, filling, (-highest, highest), "cylinder")
