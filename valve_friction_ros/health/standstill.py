# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Detection of a stem that rests between its stops although the pressure demands a move."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.diagnosis import FrictionLimits
from valve_friction_ros.health.levels import Finding, Level, StatusSignal
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.model.checks import equal_by_fields
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams import Samples
from valve_friction_ros.wording import Code, said

_STILL = 0.005
"""Band, over the travel, in which a stem is at rest: above noise and creep. Chosen."""

_BLOCK = 10_000_000_000
"""Averaging time, ns: a stem that can move does so within it. Chosen."""

_BLOCK_OF_TEST = 2_000_000_000
"""Averaging time in a test, ns. Chosen: several times the lag of any sensor and actuator."""

HELD_FRICTION = "held_friction"
"""Name of the largest static friction that a standstill demands."""

_STOP = 0.03
"""Share of the travel from an end within which a stem may rest on its stop. Chosen."""

_MOST_BLOCKS = 1000
"""Most means of the pressure that wait for a position; the oldest are dropped."""


@equal_by_fields
@dataclass(frozen=True)
class Standstill:
    """A stem at rest, with the pressures that did not move it.

    Attributes
    ----------
    since : int
        Start of the rest, ns since 1970 (UTC).
    position : float
        Position of the rest, m.
    lowest_pressure, highest_pressure : float
        Range of the block means of the pressure, Pa.
    """

    since: int
    position: float
    lowest_pressure: float
    highest_pressure: float

    def least_friction(self, valve: Valve) -> float:
        """Return the static friction, N, below which the stem would have moved.

        At rest |S_a·(P − P_ref) − k·x − F_0| ≤ F_s. A change of pressure by ΔP without motion
        therefore needs 2·F_s ≥ S_a·ΔP, whatever the spring.
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


def _means(samples: Samples, length: int) -> dict[int, _Mean]:
    """Return the sums of each block in order; a call usually covers a single block."""
    stamps, values = samples
    if not stamps.size:
        return {}
    first, last = int(stamps.min()) // length, int(stamps.max()) // length
    if first == last:
        return {first: _mean_of(values)}
    blocks = stamps // length
    return {block: _mean_of(values[blocks == block]) for block in np.unique(blocks).tolist()}


class StandstillCounter:
    """Tracks the present standstill of a valve without storing samples.

    The stem is at rest in a block if its mean has not moved and its deviation is small. The
    pressure of a block is used once the stem is at rest in a later block: this gives the stem time
    to move, and the sensor time to show it.

    Parameters
    ----------
    travel : float
        Distance between the stops, m.
    block : int
        Averaging time, ns.
    """

    def __init__(self, travel: float, block: int = _BLOCK) -> None:
        self._band, self._length = _STILL * travel, block
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
        """The present standstill; None without a rest of the stem and a pressure during it."""
        if self._since is None or not self._lowest <= self._highest:
            return None
        return Standstill(self._since, self._place, self._lowest, self._highest)

    def add(self, pressures: Samples, positions: Samples) -> None:
        """Take samples that are finite and in range; positions of an older block restart."""
        for block, mean in _means(pressures, self._length).items():
            self._pressures[block] = self._pressures.get(block, _Mean()).with_more(mean)
        for block, mean in _means(positions, self._length).items():
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
        """Judge a complete block of positions."""
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
            self._since, self._place = block * self._length, mean.value
        for one in [one for one in self._pressures if one <= block]:
            del self._pressures[one]


def held_numbers(recording: Recording, valve: Valve) -> dict[str, Measured]:
    """Return the largest static friction, N, that a standstill in a record demands, and its place.

    The numbers are ``held_friction``; ``held_force``, the mean of the lowest and the highest force
    during the standstill, N; and ``held_position``, m. They are empty without a standstill. They do
    not exclude that a stop held the stem.
    """
    if not math.isfinite(valve.travel):
        return {}
    counter, found = StandstillCounter(valve.travel, _BLOCK_OF_TEST), list[Standstill]()
    stamps = np.round(recording.time * 1e9).astype(np.int64)
    cuts = np.flatnonzero(np.diff(stamps // _BLOCK_OF_TEST)) + 1
    for part in np.split(np.arange(stamps.size), cuts):
        counter.add(
            Samples(stamps[part], recording.drive[part]),
            Samples(stamps[part], recording.position[part]),
        )
        found += filter(None, [counter.standstill])
    if not found:
        return {}
    most = max(found, key=lambda one: one.least_friction(valve))
    middle = 0.5 * (most.lowest_pressure + most.highest_pressure)
    return {
        HELD_FRICTION: Measured(most.least_friction(valve), 0.0),
        "held_force": Measured(valve.actuator_force(middle), 0.0),
        "held_position": Measured(most.position, _STILL * valve.travel),
    }


def held_finding(
    numbers: Mapping[str, Measured], baseline: Baseline, valve: Valve, limits: FrictionLimits
) -> Finding | None:
    """Find that a test met more friction than `limits` allow, by its `held_numbers`.

    Return None without them, and where a stop may have held the stem.
    """
    swing, middle, place = (
        numbers.get(name) for name in (HELD_FRICTION, "held_force", "held_position")
    )
    if swing is None or place is None:
        return None
    least = _surely_held(swing, middle, place, baseline, valve)
    ratio = least / _healthy_friction(baseline)
    if not ratio > limits.warn_ratio:
        return None
    is_error = ratio > limits.error_ratio
    return Finding(
        Level.ERROR if is_error else Level.WARN,
        StatusSignal.FAILURE if is_error else StatusSignal.MAINTENANCE_REQUIRED,
        said(Code.HELD_IN_TEST, position=place.value, friction=least, ratio=ratio),
        leads=True,
        friction_ratio=ratio,
    )


def _surely_held(
    swing: Measured, middle: Measured | None, place: Measured, baseline: Baseline, valve: Valve
) -> float:
    """Return the largest static friction that clearly held the stem in a test, N, or 0.

    It is half of the swing of the force. At an end of its range, as in a partial stroke, the stem
    may have been pressed on a stop. The force beyond k·x + F_0 on that side is then ignored.
    """
    can_rise, can_fall = _room(place.value, baseline, valve)
    if can_rise and can_fall:
        return swing.value
    spring, preload = (baseline.numbers.get(name) for name in ("spring_constant", "spring_preload"))
    if not (can_rise or can_fall) or middle is None or spring is None or preload is None:
        return 0.0
    inwards = middle.value - spring.value * place.value - preload.value
    doubt = math.hypot(
        spring.half_width * place.value, spring.value * place.half_width, preload.half_width
    )
    return swing.value + min((inwards if can_rise else -inwards) - doubt, 0.0)


def standstill_finding(
    standstill: Standstill, valve: Valve, baseline: Baseline, factor: float
) -> Finding | None:
    """Find a stem that needs more than `factor` times the friction of its baseline to move.

    Return None unless it rests inside the range of motion of the baseline, away from its ends: at
    an end it may rest on a stop under any pressure.
    """
    if not all(_room(standstill.position, baseline, valve)):
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


def _room(position: float, baseline: Baseline, valve: Valve) -> tuple[bool, bool]:
    """Return whether a stem can clearly move up from a position, and down.

    It can within the range of motion of the baseline: no stop lies there.
    """
    numbers, margin = baseline.numbers, _STOP * valve.travel
    low, high = numbers.get("lowest_position"), numbers.get("highest_position")
    if low is None or high is None:
        return False, False
    return position < high.value - margin, position > low.value + margin


def _healthy_friction(baseline: Baseline) -> float:
    """Return the largest static friction that the baseline allows, N.

    The sliding friction is no less than F_c, so F_s is at most the sliding friction plus F_s − F_c.
    """
    numbers, slip = baseline.numbers, baseline.numbers.get("slip_force")
    if baseline.sliding is not None and slip is not None:
        largest = baseline.sliding.value + baseline.sliding.half_width
        return largest + max(slip.value, 0.0) + slip.half_width
    found = [one for name in ("coulomb_friction", "static_friction") if (one := numbers.get(name))]
    if baseline.coulomb_friction is not None:
        found.append(Measured(baseline.coulomb_friction, baseline.half_width))
    if baseline.sliding is not None:
        found.append(Measured(baseline.sliding.value, baseline.sliding.half_width))
    return max(one.value + one.half_width for one in found)
