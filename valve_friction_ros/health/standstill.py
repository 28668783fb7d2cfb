# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A stem that stands still between its stops while the pressure asks it to move."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.levels import Finding, Level, StatusSignal
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams import Samples
from valve_friction_ros.wording import Code, said

_STILL = 0.005
"""Share of the travel within which a stem stands still: above noise and creep. Chosen."""

_BLOCK = 10_000_000_000
"""Time over which samples are averaged, ns: a stem that can move does so within it. Chosen."""

_STOP = 0.03
"""Share of the travel from an end within which a stem may rest on its stop. Chosen."""

_MOST_BLOCKS = 1000
"""Means of the pressure that wait for a position; the oldest are dropped."""


@dataclass(frozen=True)
class Standstill:
    """A stem at rest, and the pressures that it has borne meanwhile.

    Attributes
    ----------
    since : int
        From when it has been seen at rest, ns since 1970 (UTC).
    position : float
        Where it rests, m.
    lowest_pressure, highest_pressure : float
        Range of the pressure, averaged over ten seconds, Pa.
    """

    since: int
    position: float
    lowest_pressure: float
    highest_pressure: float

    def least_friction(self, valve: Valve) -> float:
        """Return the static friction, N, below which the stem would have moved.

        At rest |S_a·(P − P_ref) − k·x − F_0| ≤ F_s, so a change of pressure by ΔP that moves
        nothing needs 2·F_s ≥ S_a·ΔP, whatever the spring.
        """
        low, high = self.lowest_pressure, self.highest_pressure
        return 0.5 * (valve.actuator_force(high) - valve.actuator_force(low))


class _Mean(NamedTuple):
    """Sums over the samples of a block."""

    size: int = 0
    total: float = 0.0
    squares: float = 0.0

    def with_more(self, more: "_Mean") -> "_Mean":
        """Add samples of the same block."""
        size, total, squares = more
        return _Mean(self.size + size, self.total + total, self.squares + squares)

    @property
    def value(self) -> float:
        return self.total / self.size

    @property
    def deviation(self) -> float:
        return math.sqrt(max(self.squares / self.size - self.value**2, 0.0))


def _mean_of(values: NDArray[np.float64]) -> _Mean:
    return _Mean(values.size, float(values.sum()), float(values @ values))


def _means(samples: Samples) -> dict[int, _Mean]:
    """Return the sums of each block, in their order: some 20 times a second mostly of one."""
    stamps, values = samples
    if not stamps.size:
        return {}
    first, last = int(stamps.min()) // _BLOCK, int(stamps.max()) // _BLOCK
    if first == last:
        return {first: _mean_of(values)}
    blocks = stamps // _BLOCK
    return {block: _mean_of(values[blocks == block]) for block in np.unique(blocks).tolist()}


class StandstillCounter:
    """Follows the samples of a valve; keeps the present standstill, and no samples.

    A block of ten seconds is still where the stem's mean has stayed and its deviation is small. The
    pressure of a block counts once the stem is still in a later one: so a stem has had the time to
    move, and a sensor to say so.

    Parameters
    ----------
    travel : float
        Distance between the stops, m.
    """

    def __init__(self, travel: float) -> None:
        self._band = _STILL * travel
        self._pressures: dict[int, _Mean] = {}
        self._block: int | None = None
        self._positions = _Mean()
        self._begin()

    def _begin(self) -> None:
        self._since: int | None = None
        self._place = math.nan
        self._lowest, self._highest = math.inf, -math.inf

    @property
    def standstill(self) -> Standstill | None:
        """The present standstill; None where the stem has not been seen at rest with a pressure."""
        if self._since is None or not self._lowest <= self._highest:
            return None
        return Standstill(self._since, self._place, self._lowest, self._highest)

    def add(self, pressures: Samples, positions: Samples) -> None:
        """Take good samples: finite, within the range of their sensor; older ones begin anew."""
        for block, mean in _means(pressures).items():
            self._pressures[block] = self._pressures.get(block, _Mean()).with_more(mean)
        for block, mean in _means(positions).items():
            if self._block is not None and block < self._block:
                self._begin()
                self._pressures.clear()
                self._positions = _Mean()
            elif self._block is not None and block > self._block:
                self._close(self._block)
                self._positions = _Mean()
            self._block = block
            self._positions = self._positions.with_more(mean)
        while len(self._pressures) > _MOST_BLOCKS:
            del self._pressures[min(self._pressures)]

    def _close(self, block: int) -> None:
        """Judge a block of positions that is complete."""
        mean = self._positions
        is_still = mean.deviation <= self._band
        if is_still and abs(mean.value - self._place) <= self._band:
            for one in [one for one in self._pressures if one < block]:
                pressure = self._pressures.pop(one).value
                self._lowest = min(self._lowest, pressure)
                self._highest = max(self._highest, pressure)
            return
        self._begin()
        if is_still:
            self._since, self._place = block * _BLOCK, mean.value
        for one in [one for one in self._pressures if one <= block]:
            del self._pressures[one]


def standstill_finding(
    standstill: Standstill, valve: Valve, baseline: Baseline, factor: float
) -> Finding | None:
    """Find a stem that needs more than `factor` times the friction of its baseline to move.

    None unless it rests where the stem went when the baseline was set, away from the ends of that
    way: at an end it may rest on a stop under any pressure.
    """
    numbers, margin = baseline.numbers, _STOP * valve.travel
    low, high = numbers.get("lowest_position"), numbers.get("highest_position")
    if low is None or high is None:
        return None
    if not low.value + margin < standstill.position < high.value - margin:
        return None
    least, healthy = standstill.least_friction(valve), _healthy_friction(baseline)
    if not least > factor * healthy:
        return None
    drive = valve.driven_by
    change = (standstill.highest_pressure - standstill.lowest_pressure) / drive.size
    return Finding(
        Level.ERROR,
        StatusSignal.FAILURE,
        said(
            Code.STOOD_STILL,
            position=standstill.position,
            since=standstill.since,
            drive=drive.name,
            change=change,
            unit=drive.unit,
            ratio=least / healthy,
        ),
        leads=True,
        friction_ratio=least / healthy,
    )


def _healthy_friction(baseline: Baseline) -> float:
    """Return the largest friction that the baseline admits, N."""
    numbers = baseline.numbers
    found = [one for name in ("coulomb_friction", "static_friction") if (one := numbers.get(name))]
    if baseline.coulomb_friction is not None:
        found.append(Measured(baseline.coulomb_friction, baseline.half_width))
    if baseline.sliding is not None:
        found.append(Measured(baseline.sliding.value, baseline.sliding.half_width))
    return max(one.value + one.half_width for one in found)
