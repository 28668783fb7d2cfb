# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Imperfections of a valve and its instruments, with random sizes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from benchmark.reality.plants import Law, Trend
from benchmark.reality.sensors import Instruments, Sensor, Stamping
from benchmark.reality.valves import DrawnValve, log_uniform

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


IMPERFECTIONS: Mapping[str, Callable[[Draft, np.random.Generator], Draft]] = MappingProxyType(
    {
        "noise": _noise,
        "coloured noise": lambda draft, random: draft.sensors(
            colour=log_uniform(random, 5e-3, 5e-2)
        ),
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
)
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
