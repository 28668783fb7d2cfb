# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""Random valves, their instruments and their imperfections."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmark.reality.plants import Body, Friction, Law, Plant, Trend
from benchmark.reality.sensors import Instruments, Sensor, Stamping

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
    """A valve and its converter."""

    plant: Plant  # the valve
    # pressure at command 0 and 1, Pa
    low: float
    high: float
    filling: float  # first-order lag from command to pressure, s
    sensor: tuple[float, float]  # range of the pressure sensor, Pa
    kind: str  # "diaphragm", "piston" or "cylinder"; a cylinder has no spring

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


_RATES = (100.0, 200.0, 500.0, 1000.0)
_QUIET = (2e-4, 8e-4)
"""Noise of an ordinary sensor, share of its range."""

_MOST = 3
"""Maximum number of simultaneous imperfections."""

_Random = np.random.Generator


@dataclass(frozen=True)
class Draft:
    """A valve and its instruments, to which imperfections are added."""

    valve: DrawnValve
    instruments: Instruments

    def body(self, **changes: Any) -> "Draft":
        """Change fields of the body."""
        plant = self.valve.plant
        return self._plant(body=replace(plant.body, **changes))

    def friction(self, **changes: Any) -> "Draft":
        """Change fields of the friction."""
        plant = self.valve.plant
        return self._plant(friction=replace(plant.friction, **changes))

    def _plant(self, **changes: Any) -> "Draft":
        valve = replace(self.valve, plant=replace(self.valve.plant, **changes))
        return replace(self, valve=valve)

    def sensor(self, which: str, **changes: Any) -> "Draft":
        """Change fields of the "pressure" or "position" sensor."""
        sensor = replace(getattr(self.instruments, which), **changes)
        return replace(self, instruments=replace(self.instruments, **{which: sensor}))

    def sensors(self, **changes: Any) -> "Draft":
        """Change fields of both sensors."""
        return self.sensor("pressure", **changes).sensor("position", **changes)

    def clocks(self, together: bool, **changes: Any) -> "Draft":
        """Change fields of both clocks."""
        one = self.instruments
        return replace(
            self,
            instruments=replace(
                one,
                pressure_stamping=replace(one.pressure_stamping, **changes),
                position_stamping=replace(one.position_stamping, **changes),
                together=together,
            ),
        )

    @property
    def travel(self) -> float:
        """Nominal travel, m."""
        return self.valve.plant.body.travel

    @property
    def period(self) -> float:
        """Time between two samples, s."""
        return 1.0 / self.instruments.position_stamping.rate


def instruments_of(valve: DrawnValve, random: _Random) -> Instruments:
    """Draw ordinary instruments: low noise, both signals sampled together at 100 Hz or more."""
    travel = valve.plant.body.travel
    low, high = valve.sensor
    noise = log_uniform(random, *_QUIET)
    stamping = Stamping(rate=float(random.choice(_RATES)))
    return Instruments(
        Sensor(log_uniform(random, *_QUIET) * (high - low), low, high),
        Sensor(noise * travel, -0.05 * travel, 1.05 * travel),
        stamping,
        stamping,
    )


def _signed(random: _Random, low: float, high: float) -> float:
    return float(random.choice([-1.0, 1.0])) * log_uniform(random, low, high)


def _noise(draft: Draft, random: _Random) -> Draft:
    for which in ("pressure", "position"):
        sensor = getattr(draft.instruments, which)
        size = (sensor.high - sensor.low) * log_uniform(random, 1e-3, 4e-3)
        draft = draft.sensor(which, noise=size)
    return draft


def _lag_of(which: str) -> Callable[[Draft, _Random], Draft]:
    return lambda draft, random: draft.sensor(which, lag=log_uniform(random, 5e-3, 80e-3))


def _offset(draft: Draft, random: _Random) -> Draft:
    late = replace(draft.instruments.position_stamping, offset=_signed(random, 5e-3, 60e-3))
    return replace(draft, instruments=replace(draft.instruments, position_stamping=late))


def _jitter(draft: Draft, random: _Random) -> Draft:
    shares = random.uniform(0.05, 0.3), draft.period * random.uniform(0.02, 0.15)
    return draft.clocks(False, jitter=shares[0], stamp_error=shares[1])


def _drops(draft: Draft, random: _Random) -> Draft:
    if random.random() < 0.3:
        number, length = int(random.integers(1, 4)), log_uniform(random, 0.2, 2.0)
        return draft.clocks(draft.instruments.together, bursts=number, burst=length)
    return draft.clocks(random.random() < 0.5, drops=log_uniform(random, 0.01, 0.2))


def _held(draft: Draft, random: _Random) -> Draft:
    which = str(random.choice(["pressure", "position"]))
    return draft.sensor(which, hold=log_uniform(random, 5e-3, 0.1))


def _dead_band(draft: Draft, random: _Random) -> Draft:
    return draft.sensors(dead_band=log_uniform(random, 1e-3, 5e-3)).clocks(False)


def _drift(draft: Draft, random: _Random) -> Draft:
    sensor = draft.instruments.pressure
    share = _signed(random, 5e-4, 3e-3)
    return draft.sensor("pressure", drift=share * (sensor.high - sensor.low) / 60.0)


def _trend(random: _Random) -> Trend:
    return Trend(_signed(random, 0.03, 0.2), random.uniform(-0.6, 0.6))


def _curved(draft: Draft, random: _Random) -> Draft:
    choice = int(random.integers(3))
    if choice == 0:
        return draft.body(spring_curve=_signed(random, 0.01, 0.06))
    if choice == 1:
        return draft.body(area_change=-log_uniform(random, 0.005, 0.03))
    body = draft.valve.plant.body
    force = body.spring * body.travel * log_uniform(random, 0.005, 0.04)
    return draft.body(flow_force=force, flow_exponent=float(random.choice([2.0, 3.0])))


def _bending(law: Law) -> Callable[[Draft, _Random], Draft]:
    """Let the packing bend by up to 0.2 % of the travel before it slides."""
    return lambda draft, random: draft.friction(
        law=law, presliding=draft.travel * log_uniform(random, 2e-4, 2e-3)
    )


def _dead_zone(law: Law) -> Callable[[Draft, _Random], Draft]:
    return lambda draft, random: draft.friction(
        law=law, limit_velocity=log_uniform(random, 0.1e-3, 1e-3)
    )


def _stops(draft: Draft, random: _Random) -> Draft:
    """Move both stops by up to 2 % of the travel."""
    seat, top = draft.travel * random.uniform(-0.02, 0.02, 2)
    return draft.body(seat=float(seat), top=float(top))


IMPERFECTIONS: Mapping[str, Callable[[Draft, np.random.Generator], Draft]] = {
    "noise": _noise,
    "coloured noise": lambda draft, random: draft.sensors(colour=log_uniform(random, 5e-3, 5e-2)),
    "quantised": lambda draft, random: draft.sensors(bits=int(random.integers(8, 13))),
    "stem lag": _lag_of("position"),
    "pressure lag": _lag_of("pressure"),
    "volume": lambda draft, random: draft.body(volume_lag=log_uniform(random, 5e-3, 80e-3)),
    "clock offset": _offset,
    "low rate": lambda draft, random: draft.clocks(
        draft.instruments.together, rate=log_uniform(random, 20.0, 80.0)
    ),
    "jitter": _jitter,
    "cut stamps": lambda draft, random: draft.clocks(
        False, jitter=0.2, resolution=draft.period * random.uniform(0.2, 1.0)
    ),
    "drops": _drops,
    "held": _held,
    "dead band": _dead_band,
    "zero drift": _drift,
    "asymmetric": lambda draft, random: draft.friction(asymmetry=_signed(random, 0.02, 0.12)),
    "along travel": lambda draft, random: draft.friction(along_travel=_trend(random)),
    "in record": lambda draft, random: draft.friction(in_record=_trend(random)),
    "curved": _curved,
    "stops": _stops,
    "LuGre": _bending(Law.LUGRE),
    "Maxwell": _bending(Law.MAXWELL),
    "Karnopp": _dead_zone(Law.KARNOPP),
    "latched": _dead_zone(Law.LATCHED),
}
"""Imperfections by name; each draws its own size."""

_EXCLUDE = (
    {"noise", "coloured noise", "quantised"},
    {"stem lag", "pressure lag", "volume", "clock offset"},
    {"low rate", "jitter", "cut stamps", "drops", "held", "dead band"},
    {"asymmetric", "along travel", "in record"},
    {"LuGre", "Maxwell", "Karnopp", "latched"},
)
"""Groups of mutually exclusive imperfections."""


def drawn_imperfections(
    valve: DrawnValve, random: np.random.Generator
) -> tuple[Draft, tuple[str, ...]]:
    """Add one to three imperfections to a valve with ordinary instruments, and name them."""
    draft = Draft(valve, instruments_of(valve, random))
    wanted = int(random.integers(1, _MOST + 1))
    names: list[str] = []
    for name in map(str, random.permutation(list(IMPERFECTIONS))):
        # Without a spring none can be curved; a packing that slips has its own friction curve.
        is_odd = name == "curved" and not valve.plant.body.spring
        is_odd |= name in ("Karnopp", "latched") and valve.slips
        if is_odd or any(name in group and group & set(names) for group in _EXCLUDE):
            continue
        names = [*names, name][:wanted]
    # The rate comes first, because others depend on it.
    for name in sorted(names, key=lambda one: one != "low rate"):
        draft = IMPERFECTIONS[name](draft, random)
    return draft, tuple(names)
