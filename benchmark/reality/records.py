# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Records of random valves under random drives, with the measured signals and the truth."""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmark.reality.imperfections import Draft, drawn_imperfections
from benchmark.reality.motions import Drive, Kind, drawn_drive
from benchmark.reality.plants import Motion, move
from benchmark.reality.plants.kernel import GRID
from benchmark.reality.sensors import Signal, measured
from benchmark.reality.truth import TrueValue, truth_of
from benchmark.reality.valves import drawn_cylinder, drawn_valve

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
    """The user's knowledge of the valve.

    Attributes
    ----------
    diaphragm_area, pressure_reference, travel : float
        S_a (m²), P_ref (Pa) and the travel (m).
    pressure_minimum, pressure_maximum : float
        Range of the pressure sensor, Pa.
    has_spring : bool
        Whether there is a spring.
    """

    diaphragm_area: float
    pressure_reference: float
    travel: float
    pressure_minimum: float = -20e3
    pressure_maximum: float = 270e3
    has_spring: bool = True


@dataclass(frozen=True, eq=False)
class Record:
    """A record as written by the sensors, with the truth.

    Attributes
    ----------
    nominal : Nominal
        The valve as described by the user.
    pressure, position : Signal
        Stamps (ns) and values (Pa, m).
    truth : mapping of str to TrueValue
        True numbers.
    name : str
        Name of the case.
    kind : str
        Kind of the valve.
    slips : bool
        Whether the packing slips.
    share : float
        F_c over the force of the spring.
    rate : float
        Samples per second.
    imperfections : tuple of str
        Names of the imperfections.
    start : float
        True position at the start of the record, m.
    late : mapping of str to float
        Clock offset of the stem ("delay"), lag of its sensor ("stem_lag"), and lag of the volume
        minus that of the pressure sensor ("force_lag"), s.
    """

    nominal: Nominal
    pressure: Signal
    position: Signal
    truth: dict[str, TrueValue]
    name: str = ""
    kind: str = ""
    slips: bool = False
    share: float = math.nan
    rate: float = math.nan
    imperfections: tuple[str, ...] = ()
    start: float = math.nan
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


_SIGNALS = ("pressure", "position")


def save(record: Record, path: Path) -> None:
    """Write a record: ``<signal>_stamps`` (ns), ``<signal>`` (SI), and the rest as JSON."""
    parts = {
        name: value
        for name, value in vars(record).items()
        if name not in (*_SIGNALS, "nominal", "truth")
    }
    parts |= {"nominal": asdict(record.nominal)}
    parts |= {"truth": {name: asdict(one) for name, one in record.truth.items()}}
    arrays: dict[str, NDArray[Any]] = {}
    for name in _SIGNALS:
        signal = getattr(record, name)
        arrays |= {f"{name}_stamps": signal.stamps, name: signal.values}
    arrays["about"] = np.array(json.dumps(parts))
    np.savez_compressed(path, **arrays)  # type: ignore[arg-type]


def load(folder: Path) -> Iterator[Record]:
    """Read the records that `save` wrote, in order of their names."""
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as file:
            parts: dict[str, Any] = json.loads(str(file["about"]))
            parts |= {name: Signal(file[f"{name}_stamps"], file[name]) for name in _SIGNALS}
        parts["nominal"] = Nominal(**parts["nominal"])
        parts["truth"] = {name: TrueValue(**one) for name, one in parts["truth"].items()}
        parts["imperfections"] = tuple(parts["imperfections"])
        yield Record(**parts)
