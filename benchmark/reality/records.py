# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""Records of random valves, and the truth about them."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmark.reality.motions import Drive, Kind, drawn_drive
from benchmark.reality.plants import GRID, Body, Law, Motion, Plant, Trend, move
from benchmark.reality.sensors import Instruments, Signal, measured
from benchmark.reality.valves import Draft, drawn_cylinder, drawn_imperfections, drawn_valve


@dataclass(frozen=True)
class TrueValue:
    """A number, and the ambiguity of its definition."""

    value: float  # the number, SI unit
    # largest distance to another sensible definition: friction that changes along the travel has
    # different means over distance and over time
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
    return (body.preload + spring + flow) / area


def _springs(
    body: Body, position: NDArray[np.float64], drifts: Iterable[float]
) -> tuple[TrueValue, TrueValue]:
    """Return k and F_0 over the range visited, by time, by the ends, and nominal."""
    low, high = float(position.min()), float(position.max())
    places = np.linspace(low, high, 200, dtype=np.float64)
    fits = [np.polyfit(where, _load(body, where), 1) for where in (places, position[::100])]
    ends = np.array([low, high])
    fits.append(np.polyfit(ends, _load(body, ends), 1))
    slopes, intercepts = (list(map(float, one)) for one in zip(*fits, strict=True))
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


def truth_of(
    plant: Plant, motion: Motion, instruments: Instruments, duration: float
) -> dict[str, TrueValue]:
    """Return the truth about a record of `duration` seconds, SI units.

    If a number changes in the record or has no single definition, its value is the mean over the
    distance, and `spread` covers the other definitions. Spring and preload are slope and intercept
    of all forces along the travel, referred to the nominal area. The clock offset is the apparent
    delay of the stem, including slow sensors and the actuator volume.
    """
    recorded = motion.time >= -1e-9
    position = motion.position[recorded]
    middle = 0.5 * float(position.min() + position.max())
    body, friction = plant.body, plant.friction
    falls = friction.static > friction.coulomb
    is_karnopp = friction.law in (Law.KARNOPP, Law.LATCHED)
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
        "limit_velocity": TrueValue(friction.limit_velocity if is_karnopp else 0.0),
        "sliding_friction": TrueValue(
            sliding.value, sliding.spread + abs(seen - 1.0) * sliding.value
        ),
        "stribeck_velocity": TrueValue(friction.stribeck_velocity if falls else math.nan),
        "coulomb_asymmetry": TrueValue(friction.asymmetry),
        "viscous_asymmetry": TrueValue(0.0),
        "clock_offset": _offset(plant, instruments),
    }


_TRIES = 100
_LEAST_MOVE = 0.008
"""Smallest move, share of the travel, that a record must contain in both directions. Hunting needs
`_REVERSALS` reversals of `_LEAST_SWING` instead. Otherwise valve and drive are drawn again: no
method finds friction where nothing slides."""

_REVERSALS = 6
_LEAST_SWING = 0.004


class Case(NamedTuple):
    """A record to make: valve `number` with this `motion` in the run of an `entropy`.

    `again` selects another record of the valve, with another signal and other noise. `change` is
    its friction over that of the original valve. The packing `slips` or not; None draws that too.
    `reserve` is the factor by which friction may grow while the actuator can still stroke the
    valve.
    """

    entropy: int
    motion: Kind
    number: int
    again: int = 0
    change: float = 1.0
    slips: bool | None = None
    reserve: float = 1.0

    @property
    def name(self) -> str:
        """The case in a few words."""
        again = f"-{self.again}" if self.again else ""
        grown = f" x{self.change:g}" if self.change != 1.0 else ""
        return f"{self.motion.value} {self.number}{again}{grown}"


@dataclass(frozen=True)
class Nominal:
    """The user's knowledge of the valve."""

    # S_a (m²), P_ref (Pa) and the travel (m)
    diaphragm_area: float
    pressure_reference: float
    travel: float
    # range of the pressure sensor, Pa
    pressure_minimum: float = -20e3
    pressure_maximum: float = 270e3
    has_spring: bool = True  # whether there is a spring


@dataclass(frozen=True, eq=False)
class Record:
    """A record as written by the sensors, with the truth."""

    nominal: Nominal  # the valve as described by the user
    pressure: Signal  # Pa
    position: Signal  # m
    truth: dict[str, TrueValue]
    name: str = ""  # of the case
    kind: str = ""  # of the valve
    slips: bool = False  # whether the packing slips
    share: float = math.nan  # F_c over the force of the spring
    rate: float = math.nan  # samples per second
    imperfections: tuple[str, ...] = ()
    start: float = math.nan  # true position at the start of the record, m
    # clock offset of the stem ("delay"), lag of its sensor ("stem_lag"), and lag of the volume
    # minus that of the pressure sensor ("force_lag"), s
    late: Mapping[str, float] = field(default_factory=dict)


def _draft(case: Case, attempt: int) -> tuple[Draft, tuple[str, ...]]:
    """Draw valve, instruments and imperfections, the same for all records of a valve."""
    place = list(Kind).index(case.motion)
    random = np.random.default_rng([case.entropy, place, case.number, attempt])
    slips = bool(random.random() < 0.5) if case.slips is None else case.slips
    if case.motion is Kind.HUNTING:
        slips = True
    if case.motion is Kind.CYLINDER:
        valve = drawn_cylinder(random, slips)
    else:
        valve = drawn_valve(random, slips, case.reserve)
    return drawn_imperfections(valve, random)


def _seed(case: Case, attempt: int) -> list[int]:
    place = list(Kind).index(case.motion)
    # Changed friction means another day, with a new signal and new noise.
    return [case.entropy, place, case.number, attempt, 1, case.again]


@lru_cache(maxsize=1)
def _moved(case: Case, attempt: int) -> tuple[Draft, tuple[str, ...], Drive, Motion]:
    """Draw and move a valve; cached, since the successful attempt becomes the record."""
    draft, names = _draft(case, attempt)
    drive = drawn_drive(case.motion, draft.valve, np.random.default_rng(_seed(case, attempt)))
    plant = draft.valve.plant
    plant = replace(plant, friction=plant.friction.scaled(case.change))
    motion = move(plant, drive.loop, drive.signal, drive.disturbance, drive.before)
    return replace(draft, valve=replace(draft.valve, plant=plant)), names, drive, motion


def _swings(position: NDArray[np.float64], least: float) -> int:
    """Count the moves of at least `least`, m, between reversals."""
    count, way, low, high = 0, 0, position[0], position[0]
    for now in position[:: round(0.02 / GRID)].tolist():
        low, high = min(low, now), max(high, now)
        if way != 1 and now - low >= least:
            count, way, high = count + 1, 1, now
        elif way != -1 and high - now >= least:
            count, way, low = count + 1, -1, now
        if way == 1 and now >= high:
            low = now
        if way == -1 and now <= low:
            high = now
    return count


def _is_excited(case: Case, draft: Draft, motion: Motion) -> bool:
    travel = draft.valve.plant.body.travel
    position = motion.position[motion.time >= 0.0]
    if case.motion is Kind.HUNTING:
        return _swings(position, _LEAST_SWING * travel) >= _REVERSALS
    return _swings(position, _LEAST_MOVE * travel) >= 2


def _jump(draft: Draft) -> float:
    """Return the smallest jump of the stem at breakaway, share of the travel."""
    body, friction = draft.valve.plant.body, draft.valve.plant.friction
    return (friction.static - friction.coulomb) / (body.spring * body.travel)


@lru_cache(maxsize=4)
def _attempt(case: Case) -> int:
    """Return the first attempt in which the healthy valve moves enough."""
    for attempt in range(_TRIES):
        if case.motion is Kind.HUNTING and _jump(_draft(case, attempt)[0]) < _LEAST_SWING:
            continue
        draft, _, _, motion = _moved(case, attempt)
        if _is_excited(case, draft, motion):
            return attempt
    raise ValueError(f"{case.name}: no valve moves in {_TRIES} draws")


def make_record(case: Case) -> Record:
    """Make a record, reproducible to the last bit."""
    attempt = _attempt(case._replace(again=0, change=1.0))
    draft, names, drive, motion = _moved(case, attempt)
    valve, instruments = draft.valve, draft.instruments
    body = valve.plant.body
    seed = int(np.random.default_rng(_seed(case, attempt)).integers(2**31))
    pressure, position = measured(motion, instruments, drive.duration, seed)
    low, high = valve.sensor
    margin, sizes = 0.1 * (high - low), (body.area, body.pressure_reference, body.travel)
    nominal = Nominal(*sizes, low - margin, high + margin, body.spring > 0.0)
    truth = truth_of(valve.plant, motion, instruments, drive.duration)
    begin = round(drive.before / GRID)
    clocks = instruments.pressure_stamping.offset, instruments.position_stamping.offset
    return Record(
        nominal=nominal,
        pressure=pressure,
        position=position,
        truth=truth,
        name=case.name,
        kind=valve.kind,
        slips=valve.slips,
        share=valve.friction_share,
        rate=instruments.position_stamping.rate,
        imperfections=names,
        start=float(motion.position[begin]),
        late={
            "delay": clocks[1] - clocks[0],
            "stem_lag": instruments.position.lag,
            "force_lag": body.volume_lag - instruments.pressure.lag,
        },
    )
