# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Response of a stem in service: moves after steps of the command, and hunting between steps."""

import math
from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.steps.step_response import first_beyond, step_test
from valve_friction_ros.model.checks import equal_by_fields
from valve_friction_ros.signals import position_noise, quantisation_step
from valve_friction_ros.streams import Samples

_SAME_COMMAND = 1e-3
"""Largest variation of a held command, share of the travel. Chosen: a tenth of the dead band of a
good valve (1 %)."""

_GATE = 6.0
"""Standard deviations of the noise beyond which a sample has left the held value."""

_TRANSIT = 0.1
"""Longest time of a jump, s. Chosen: the cycle of a fast controller."""

_JUMP_SHARE = 0.7
"""Least share of the change that a jump makes between two samples; a ramp spreads its change."""

_NOISE_SAMPLES, _FEWEST_NOISE_SAMPLES, _LONGEST_PERIOD = 256, 32, 0.5
"""Samples in the estimate of the noise, their least number, and their longest period, s."""

_Transit = tuple[int, float, float, float]


class CommandStep(NamedTuple):
    """A change of the command, given once the command has reached its next value."""

    stamp: int
    """Start of the change, ns."""
    before: float
    after: float
    """The command before and after, in the unit of the samples."""
    held: float
    """Time for which the command was constant before, s."""
    is_step: bool
    """Whether the command jumped; False for a ramp."""


class CommandHolds:
    """Finds the changes of a command that holds its value until the next sample.

    The command may be published at each cycle or only when it changes. Its noise is estimated, and
    is not taken for a change.
    """

    def __init__(self, travel: float) -> None:
        self._least = _SAME_COMMAND * travel
        self._gate = self._least
        self._recent: deque[tuple[int, float]] = deque(maxlen=_NOISE_SAMPLES)
        self._level = math.nan
        self._count = 0
        self._since = 0
        self._last = math.nan
        self._transit: _Transit | None = None

    def take(self, samples: Samples) -> list[CommandStep]:
        """Take samples in the order of their stamps; return the changes that they complete."""
        if not samples.stamps.size:
            return []
        self._recent.extend(zip(*(part.tolist() for part in samples), strict=True))
        if float(np.ptp(samples.values)) > 0:
            self._gate = max(self._least, _GATE * self._noise())
        found: list[CommandStep] = []
        for stamp, value in zip(samples.stamps.tolist(), samples.values.tolist(), strict=True):
            found += self.advance(stamp)
            self._take_one(stamp, value)
            self._last = value
        return found

    def _noise(self) -> float:
        """Estimate the noise; zero for a command that is published only when it changes."""
        stamps, values = (np.array(part) for part in zip(*self._recent, strict=True))
        if (
            values.size < _FEWEST_NOISE_SAMPLES
            or float(np.median(np.diff(stamps))) > _LONGEST_PERIOD * 1e9
        ):
            return 0.0
        # Not `sensor_noise`: the levels of a command are not the codes of a converter.
        return position_noise(values)

    def advance(self, stamp: int) -> list[CommandStep]:
        """Note that no sample arrived before `stamp`, ns; return the change that this completes."""
        if self._transit is None or (stamp - self._transit[0]) / 1e9 < _TRANSIT:
            return []
        start, before, held, last = self._transit
        self._transit = None
        change = abs(self._level - before)
        is_step = change >= 2 * self._gate and abs(self._level - last) >= _JUMP_SHARE * change
        return [CommandStep(start, before, self._level, held, is_step)]

    def _take_one(self, stamp: int, value: float) -> None:
        if abs(value - self._level) <= self._gate:
            self._count += 1
            self._level += (value - self._level) / self._count
            return
        if self._transit is None and self._count:
            self._transit = stamp, self._level, (stamp - self._since) / 1e9, self._last
            self._since = stamp
        elif not self._count:
            self._since = stamp
        self._level, self._count = value, 1


_PERIOD = 0.01
"""Least time between two points of the grid, s."""

_BEFORE = 0.5
"""Time before the step over which the steady values are averaged, s."""

_VISIBLE = 1e-3
"""Share of the travel above which the stem has moved. Chosen: a tenth of the dead band of a good
valve (1 %), above the creep of a stem before it breaks away."""


_COARSEST = 5e-3
"""Coarsest step of a converter, share of the travel: 8 bits."""

_PRESSURE_SHARE = 0.02
"""Share of its largest change in a move at which the pressure has begun to respond."""

_TAIL = 0.4
"""Final share of the time since the step that must be quiet for a settled stem."""

_T86 = -math.expm1(-2.0)

_Values = NDArray[np.float64]


@equal_by_fields
@dataclass(frozen=True)
class StepAnswer:
    """Response of stem and actuator to a step of the command.

    Positions are shares of the travel. Times are in s after the step, nan where unknown.

    Attributes
    ----------
    stamp : int
        Stamp of the step, ns.
    change : float
        Signed size of the step.
    held : float
        Time until the stem settled or the next command came.
    moved : bool
        Whether the stem moved.
    settled : bool
        Whether stem and pressure came to rest.
    dead_time, t63, t86, overshoot : float
        As in `StepMetrics`, for a stem that rested before the step; all but the dead time also
        need a settled stem.
    steady_error : float
        Command minus position of the settled stem.
    deviation, high_deviation : float
        Mean and 95th percentile in time of the magnitude of command minus position.
    pressure_delay : float
        Time until the pressure began to change in the direction of the command; nan if it never
        did.
    pressure_t86 : float
        Time until the pressure had made 86.5 % of its change from the first movement of the stem to
        the end.
    push : float
        Change of the pressure in the direction of the command until the stem first moved, Pa; the
        largest change if the stem did not move.
    pressure, position : float
        Means over the final part, Pa and share of the travel.
    rested, pressure_rested : bool
        Whether the stem and the pressure rested before the step.
    at_stop : bool
        Whether the move began or ended at a stop, where the pressure shows no friction.
    """

    stamp: int
    change: float
    held: float
    moved: bool
    settled: bool
    dead_time: float
    t63: float
    t86: float
    overshoot: float
    steady_error: float
    deviation: float
    high_deviation: float
    pressure_delay: float
    pressure_t86: float
    push: float
    pressure: float
    position: float
    rested: bool
    pressure_rested: bool
    at_stop: bool


_AT_STOP = 0.02
"""Share of the travel within which the stem is at a stop. Chosen: above the position error."""


def stem_noise(position: _Values) -> float:
    """Estimate the noise of a position, share of the travel, including converter rounding.

    The converter step is bounded: two levels of a jumping stem may look like two of its codes.
    """
    step = min(quantisation_step(position), _COARSEST)
    return math.hypot(position_noise(position), step / math.sqrt(12.0))


def is_quiet(values: _Values, least: float) -> bool:
    """Return whether a signal is constant to within `least` or its noise."""
    if values.size < 2:
        return False
    band = max(least, 2 * _GATE * position_noise(values))
    # Compare thirds: the noise hides a slow drift in the range of the whole.
    thirds = [float(np.mean(part)) for part in np.array_split(values, 3) if part.size]
    return float(np.ptp(values)) <= band and max(thirds) - min(thirds) <= max(least, band / 4)


def _steady(values: _Values) -> float:
    return float(np.mean(values))


def evaluated(
    change: CommandStep, stem: Samples, pressure: Samples, end: int, travel: float
) -> StepAnswer | None:
    """Evaluate the move after a step of the command, from signals in m and Pa that begin before it.

    It lasts to `end`, ns, when the stem settled or the next command came. None if the signals do
    not cover the step.
    """
    before = change.stamp - round(min(_BEFORE, change.held / 2) * 1e9)
    covered = all(s.stamps.size and s.stamps[0] <= before for s in (stem, pressure))
    if not covered or min(stem.stamps[-1], pressure.stamps[-1], end) <= change.stamp:
        return None
    period = max(float(np.median(np.diff(stem.stamps))) / 1e9, _PERIOD)
    start = max(math.ceil((change.stamp - before) / 1e9 / period), 2)
    count = start + round((end - change.stamp) / 1e9 / period)
    grid = (np.arange(count, dtype=np.float64) - start) * period
    x = np.interp(grid, (stem.stamps - change.stamp) / 1e9, stem.values) / travel
    p = np.interp(grid, (pressure.stamps - change.stamp) / 1e9, pressure.values)
    if count - start < 10:
        return None
    return _measured(change, grid, x, p, start, travel)


def _measured(
    change: CommandStep, grid: _Values, x: _Values, p: _Values, start: int, travel: float
) -> StepAnswer:
    period, low, high = grid[1] - grid[0], change.before / travel, change.after / travel
    command = np.where(grid < 0, low, high)
    tail = slice(start + round((1 - _TAIL) * (grid.size - start)), None)
    way, span = math.copysign(1.0, high - low), float(np.ptp(p))
    settled = is_quiet(x[tail], _VISIBLE) and is_quiet(p[tail], 0.05 * span)
    least = max(_VISIBLE, _GATE * stem_noise(x))
    (step,) = step_test(command, x, period, [start], least).steps
    pre_x, pre_p = x[: start - 1], p[: start - 1]
    answer, rise = way * (x[start:] - _steady(pre_x)), way * (p[start:] - _steady(pre_p))
    dead_time = period * float(first_beyond(answer, least))
    moved = step.moved and math.isfinite(dead_time)
    gate = max(_GATE * position_noise(p), _PRESSURE_SHARE * float(np.max(np.abs(rise))))
    delay = period * float(first_beyond(rise, gate)) if gate > 0 else math.nan
    away = np.abs(command[start:] - x[start:])
    push, pressure_t86 = float(np.max(rise)), math.nan
    if moved:
        push = float(np.interp(dead_time, grid[start:], rise))
        rest = float(np.mean(rise[tail.start - start :])) - push
        pressure_t86 = period * float(first_beyond(rise, push + _T86 * max(rest, 0.0)))
    rested = is_quiet(pre_x, _VISIBLE)
    known = settled and moved and rested
    return StepAnswer(
        stamp=change.stamp,
        change=high - low,
        held=float(grid[-1]),
        moved=moved,
        settled=settled,
        dead_time=dead_time if moved and rested else math.nan,
        t63=step.t63 if known else math.nan,
        t86=step.t86 if known else math.nan,
        overshoot=step.overshoot if known else math.nan,
        steady_error=high - _steady(x[tail]) if settled else math.nan,
        deviation=float(np.mean(away)),
        high_deviation=float(np.percentile(away, 95)),
        pressure_delay=delay,
        pressure_t86=pressure_t86,
        push=push,
        pressure=_steady(p[tail]),
        position=_steady(x[tail]),
        rested=rested,
        pressure_rested=is_quiet(pre_p, 0.05 * span),
        at_stop=any(
            not _AT_STOP < each < 1 - _AT_STOP for each in (low, high, float(x[0]), float(x[-1]))
        ),
    )


_LEAST_SWING = 3e-3
"""Smallest swing of a limit cycle, share of the travel."""

_SWING_GATE = 8.0
"""Smallest swing, in standard deviations of the noise."""

_SWINGS = 5
"""Latest swings (half periods) that hunting needs."""

_REGULAR_SWINGS = 2.5
"""Largest ratio between periods, and between swings, of one limit cycle."""

_ENDED_SWINGS = 2.0
"""Time without a turn that ends a limit cycle, over its longest half period."""

_NEAR_END = 0.1
"""Share of a swing, at either end, in which a signal is near that end. A sine spends 0.41 of the
time there, a triangle 0.2, a square all of it."""

_DRIVEN_SHARE = 0.25
"""Largest swing of the command, as a share of the swing of the stem. Noise may hide a small swing,
so that the command seems constant."""

_SQUARE, _SWINGING = 0.7, 0.5


@equal_by_fields
@dataclass(frozen=True)
class Hunting:
    """A limit cycle at a constant command.

    Attributes
    ----------
    period : float
        Period, s.
    amplitude : float
        Peak to peak, share of the travel.
    sticks : bool
        Whether the stem rests at both ends and jumps while the pressure keeps changing: stiction
        with integral action of the positioner. False if this cannot be determined.
    """

    period: float
    amplitude: float
    sticks: bool


def _turns(values: _Values, gate: float) -> list[int]:
    """Return the samples of the extremes that differ by more than `gate` from the previous one."""
    turns: list[int] = []
    low = high = 0
    way = 0
    for place, value in enumerate(values.tolist()):
        if value > values[high]:
            high = place
        if value < values[low]:
            low = place
        if way >= 0 and values[high] - value > gate:
            turns.append(high)
            way, low = -1, place
        elif way <= 0 and value - values[low] > gate:
            turns.append(low)
            way, high = 1, place
        if way > 0 and value > values[high]:
            high = place
    return turns


def _crossing(values: _Values, turn: int, following: int) -> int:
    """Return the sample at which a swing crosses its middle; noise blurs the ends."""
    swing = values[turn : following + 1] - values[turn]
    return turn + int(np.argmax(np.abs(swing) >= abs(swing[-1]) / 2))


def _near_ends(values: _Values, gate: float) -> float:
    """Return the share of the time that a signal spends near the ends of its range."""
    low, high = (float(each) for each in np.percentile(values, (2, 98)))
    near = max(_NEAR_END * (high - low), gate)
    return float(np.mean((values <= low + near) | (values >= high - near)))


def _means(times: _Values, wanted: _Values, edges: _Values) -> _Values:
    """Return the means between edges of a command that holds its value until the next sample."""
    areas = np.concatenate([[0.0], np.cumsum(wanted[:-1] * np.diff(times))])
    last = np.maximum(np.searchsorted(times, edges, side="right") - 1, 0)
    means: _Values = np.diff(areas[last] + wanted[last] * (edges - times[last])) / np.diff(edges)
    return means


def _own_swing(turns: _Values, times: _Values, wanted: _Values) -> float:
    """Return the swing of the command over the swings of a stem that turns at these times.

    It is the root sum square of two changes of the mean from one swing to the next: of the swings
    themselves, and of swings shifted by a quarter of a period. The lag of the stem then does not
    matter. For a sine the result is 4/π of the amplitude.
    """
    edges = turns, (turns[1:] + turns[:-1]) / 2
    changes = [np.median(np.abs(np.diff(_means(times, wanted, each)))) for each in edges]
    return float(np.hypot(*changes))


def hunting(
    stem: Samples, pressure: Samples, wanted: Samples, since: int, travel: float
) -> Hunting | None:
    """Look for a limit cycle while the command is constant, from a time `since`, ns, on.

    Position, m, pressure, Pa, and command, m, have about ten samples per second; the command may
    come only when it changes. None without five regular swings, or if the command itself swings
    with the stem.
    """
    held = stem.stamps >= since
    times, x = (stem.stamps[held] - since) / 1e9, stem.values[held] / travel
    if x.size < 4 * _SWINGS or pressure.stamps.size < 2:
        return None
    gate = max(_LEAST_SWING, _SWING_GATE * stem_noise(x))
    turns = _turns(x, gate)[-_SWINGS - 1 :]
    if len(turns) <= _SWINGS:
        return None
    swings = np.abs(np.diff(x[turns]))
    halves = np.diff(times[[_crossing(x, *pair) for pair in pairwise(turns)]])
    # Halves may differ, as friction up and down does; whole periods must not.
    wholes = halves[1:] + halves[:-1]
    if (
        min(float(swings.min()), float(wholes.min())) <= 0
        or max(float(swings.max() / swings.min()), float(wholes.max() / wholes.min()))
        > _REGULAR_SWINGS
    ):
        return None
    if times[-1] - times[turns[-1]] > _ENDED_SWINGS * halves.max():
        return None
    asked = (wanted.stamps - since) / 1e9, wanted.values / travel
    if _own_swing(times[turns], *asked) > _DRIVEN_SHARE * float(np.median(swings)):
        return None
    cycle = slice(turns[0], turns[-1] + 1)
    p = np.interp(times[cycle] * 1e9 + since, pressure.stamps, pressure.values)
    quiet = _SWING_GATE / 2 * stem_noise(x)
    sticks = _near_ends(x[cycle], quiet) >= _SQUARE and _near_ends(p, 0.0) <= _SWINGING
    return Hunting(float(np.mean(wholes)), float(np.median(swings)), sticks)
