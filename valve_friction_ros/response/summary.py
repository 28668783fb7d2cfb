# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Robust figures of the latest moves, and what they mean.

The actuator pressure shows whether the positioner or the valve is at fault. If the stem ignores
large steps, it has seized, its sensor is frozen, or it gets no pressure.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from itertools import combinations, pairwise
from typing import Any, NamedTuple

import numpy as np

from valve_friction_ros.health.levels import Finding, Level, StatusSignal
from valve_friction_ros.model.checks import equal_by_fields
from valve_friction_ros.response.moves import Hunting, StepAnswer
from valve_friction_ros.wording import Code, said

_DOMINANT = 0.6
"""Share of a time, or of a deviation, from which one part of it is the cause."""

_STICKY = 0.02
"""Pressure needed to overcome friction, as the travel it would give, from which friction is the
cause: twice the dead band of a good valve (1 %)."""

_FREE = 0.01
"""The same pressure, as a good valve needs it, up to which friction is not the cause."""

_FEWEST_JUDGED = 5
"""Moves needed for a verdict."""

_MAJORITY = 0.8
"""Share of the moves that must agree."""

_LEAST_SPREAD = 0.05
"""Least distance between two steady positions that give the travel per pressure, share of the
travel."""

_MOST_POINTS = 30

_FEWEST_OF_A_DIRECTION = 3


class AnswerCause(Enum):
    """Cause of a late, slow or inaccurate stem."""

    FRICTION = auto()
    LATE = auto()
    SLOW = auto()
    SETTING = auto()
    UNKNOWN = auto()
    PRESSURE_ANSWERS = auto()
    """For ignored steps: the pressure responds to every step, but the stem does not follow."""
    PRESSURE_SILENT = auto()
    PRESSURE_ANSWERS_SOME = auto()
    STICTION = auto()
    """For hunting."""
    NOT_FRICTION = auto()


def travel_per_pressure(moves: Sequence[StepAnswer]) -> float:
    """Return the travel per pressure, share of the travel per pascal; nan if unknown.

    It is the median slope between the ends of two moves in the same direction (Theil and Sen):
    friction offsets both ends to the same side.
    """
    slopes = []
    for way in (-1.0, 1.0):
        ends = [(m.pressure, m.position) for m in moves if m.change * way > 0 and not m.at_stop]
        slopes += [
            (x - other_x) / (p - other_p)
            for (p, x), (other_p, other_x) in combinations(ends[-_MOST_POINTS:], 2)
            if abs(x - other_x) >= _LEAST_SPREAD and p != other_p
        ]
    if len(slopes) < _FEWEST_JUDGED:
        return math.nan
    slope = float(np.median(slopes))
    return slope if slope > 0 else math.nan


def _by_push(move: StepAnswer, slope: float, otherwise: AnswerCause) -> AnswerCause:
    """Return friction if the stem needed much pressure to move, `otherwise` if it needed little."""
    push = move.push * slope
    if push >= _STICKY:
        return AnswerCause.FRICTION
    return otherwise if push <= _FREE else AnswerCause.UNKNOWN


def late_cause(move: StepAnswer, slope: float) -> AnswerCause:
    """Return why a stem began to move late or not at all."""
    total = move.dead_time if move.moved else move.held
    if not move.pressure_rested:
        return _by_push(move, slope, AnswerCause.UNKNOWN)
    late = total if math.isnan(move.pressure_delay) else min(move.pressure_delay, total)
    if late >= _DOMINANT * total:
        return AnswerCause.LATE
    if late <= (1 - _DOMINANT) * total:
        return _by_push(move, slope, AnswerCause.SLOW)
    return AnswerCause.UNKNOWN


def slow_cause(move: StepAnswer, slope: float) -> AnswerCause:
    """Return why a stem reached 86.5 % of its move late."""
    if not move.t86 > 0 or not move.pressure_rested:
        return AnswerCause.UNKNOWN
    late = min(move.pressure_delay, move.dead_time)
    if late >= _DOMINANT * move.t86:
        return AnswerCause.LATE
    if move.dead_time - late >= _DOMINANT * move.t86:
        return _by_push(move, slope, AnswerCause.SLOW)
    moving = move.t86 - move.dead_time
    if moving < _DOMINANT * move.t86:
        return AnswerCause.UNKNOWN
    with_pressure = (move.pressure_t86 - move.dead_time) / moving
    if with_pressure >= _DOMINANT:
        return AnswerCause.SLOW
    return AnswerCause.UNKNOWN


def deviation_cause(moves: Sequence[StepAnswer], slope: float) -> AnswerCause:
    """Return why a stem settles away from its command.

    Friction leaves the stem short of the command in both directions. If the stem is off to the same
    side after both, the setting of the positioner is the cause, provided that the stem moves.
    """
    resting = [m for m in moves if m.settled and not m.at_stop]
    follows = 2 * sum(m.moved for m in resting) > len(resting)
    errors = {way: [m.steady_error for m in resting if m.change * way > 0] for way in (1.0, -1.0)}
    if min(map(len, errors.values())) < _FEWEST_OF_A_DIRECTION:
        return AnswerCause.UNKNOWN
    up, down = (float(np.median(each)) for each in errors.values())
    size = float(np.median(np.abs([*errors[1.0], *errors[-1.0]])))
    offset, behind = abs(up + down) / 2, (up - down) / 2
    if offset >= _DOMINANT * size and abs(behind) <= (1 - _DOMINANT) * size:
        return AnswerCause.SETTING if follows else AnswerCause.UNKNOWN
    if behind < _DOMINANT * size:
        return AnswerCause.UNKNOWN
    pushes = [m.push * slope for m in moves if m.rested and not m.at_stop]
    push = float(np.percentile(pushes or [math.nan], 75))
    if push >= max(_STICKY, behind):
        return AnswerCause.FRICTION
    return AnswerCause.SETTING if follows and push <= _FREE < behind else AnswerCause.UNKNOWN


def majority_cause(
    moves: Sequence[StepAnswer], slope: float, cause_of: Callable[[StepAnswer, float], AnswerCause]
) -> AnswerCause:
    """Return the cause on which most moves agree.

    Moves from or to a stop, and moves of a stem that did not rest before, are left out. The cause
    is unknown with fewer than five moves, or if less than four in five agree.
    """
    asked = [cause_of(m, slope) for m in moves if m.rested and not m.at_stop]
    if len(asked) >= _FEWEST_JUDGED:
        for cause in AnswerCause:
            if asked.count(cause) >= _MAJORITY * len(asked):
                return cause
    return AnswerCause.UNKNOWN


ANSWER_TIME = 5.0
"""Time, s, that a step must last before a stem that does not move has ignored it."""

_LATEST, _MOST_ANSWERED = 5, 1
"""Latest large steps that are judged, and the most that a faulty valve may have answered."""

_LEAST_STEP, _LARGE_STEP = 0.02, 0.05
"""Bounds of a large step, share of the travel. No step below the first is large: it is twice the
dead band of a good valve (1 %). Every step from the second on is large, unless the dead band is
known to be wider. Chosen."""

_FROM_STOP = 0.1
"""Least size of a large step from or to a stop, share of the travel: a positioner may hold the stem
on its seat up to a few percent (cut-off). Chosen."""


def has_ignored(move: StepAnswer) -> bool:
    """Return whether a step lasted long enough but did not move the stem."""
    return not move.moved and move.held >= ANSWER_TIME


def large_step(moves: Sequence[StepAnswer], dead_band: float = math.nan) -> float:
    """Return the size from which a stem should answer a step, share of the travel.

    It is the dead band if known, else the median of the answered steps, or 5 % without any.
    """
    if math.isfinite(dead_band):
        return max(dead_band, _LEAST_STEP)
    sizes = [abs(m.change) for m in moves if m.moved]
    # Commands of the same size differ by rounding.
    usual = (1 - 1e-6) * float(np.median(sizes)) if sizes else _LARGE_STEP
    return min(max(usual, _LEAST_STEP), (1 - 1e-6) * _LARGE_STEP)


SIZES = (0.0, 0.005, 0.01, 0.02, 0.05, 0.1, math.inf)
"""Bounds of the size classes of steps, share of the travel."""

FIGURES = ("dead_time", "t63", "t86", "overshoot", "steady_error", "steady_deviation")
"""Names of the figures of a summary that are spreads."""

_FEWEST_COMPARED = 5
"""Moves needed to compare their median with a limit."""


class Spread(NamedTuple):
    """Median, and 10 % and 90 % quantiles, over several moves; nan without moves."""

    median: float
    low: float
    high: float
    number: int

    @classmethod
    def of(cls, values: Sequence[float]) -> "Spread":
        """Return the spread of the finite values."""
        finite = [value for value in values if math.isfinite(value)]
        if not finite:
            return cls(math.nan, math.nan, math.nan, 0)
        low, median, high = (float(q) for q in np.percentile(finite, (10, 50, 90)))
        return cls(median, low, high, len(finite))

    def to_dict(self) -> dict[str, Any]:
        """Return a mapping of plain values, None where unknown."""
        return {name: _known(value) for name, value in self._asdict().items()}


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value


@dataclass(frozen=True)
class ResponseLimits:
    """Limits of the response in service; 0 for no limit.

    The plant must set them: the time allowed depends on the loop, and the dead time on the step.

    Attributes
    ----------
    deviation : float
        Limit of the median magnitude of the steady deviation, share of the travel.
    dead_time, t86 : float
        Limits of the medians, s.
    """

    deviation: float = 0.0
    dead_time: float = 0.0
    t86: float = 0.0

    def __post_init__(self) -> None:
        if min(self.deviation, self.dead_time, self.t86) < 0:
            raise ValueError("limits of the response must not be negative")


@equal_by_fields
@dataclass(frozen=True)
class ResponseSummary:
    """Responses to the latest steps.

    Attributes
    ----------
    moves : tuple of StepAnswer
        The evaluated steps.
    dead_time, t63, t86 : Spread
        Times, s.
    overshoot : Spread
        Share of the move.
    steady_error : Spread
        Command minus position, share of the travel, signed.
    steady_deviation : Spread
        Magnitude of the steady error.
    ignored : tuple of StepAnswer
        Steps that lasted at least five seconds but did not move the stem.
    by_size : tuple of (int, int)
        Number of answered steps, and of answered and ignored steps, in each class of `SIZES`.
    travel_per_pressure : float
        Share of the travel per pascal; nan if unknown.
    """

    moves: tuple[StepAnswer, ...]
    dead_time: Spread
    t63: Spread
    t86: Spread
    overshoot: Spread
    steady_error: Spread
    steady_deviation: Spread
    ignored: tuple[StepAnswer, ...]
    by_size: tuple[tuple[int, int], ...]
    travel_per_pressure: float

    def to_dict(self) -> dict[str, Any]:
        """Return a mapping of plain values, None where unknown; times in s."""
        return {
            "moves": len(self.moves),
            "ignored": len(self.ignored),
            "largest_ignored": self.largest_ignored,
            "smallest_answered": _known(self.smallest_answered),
            **{name: getattr(self, name).to_dict() for name in FIGURES},
        }

    @property
    def largest_ignored(self) -> float:
        """90 % quantile of the size of ignored steps, share of the travel; 0 without any."""
        return float(np.percentile([abs(m.change) for m in self.ignored] or [0.0], 90))

    @property
    def smallest_answered(self) -> float:
        """10 % quantile of the size of answered steps, share of the travel; nan without any."""
        return Spread.of([abs(m.change) for m in self.moves if m.moved]).low

    def least_dead_time(self, dead_band: float = math.nan) -> Spread:
        """Return the dead times, s, where ignored large steps enter with the time they lasted.

        That time is a lower bound. `dead_band` is a share of the travel, nan if unknown.
        """
        large = large_step(self.moves, dead_band)
        return Spread.of(
            [
                m.held if has_ignored(m) and abs(m.change) >= large else m.dead_time
                for m in self.moves
            ]
        )

    def cause(self, which: str, limit: float = 0.0) -> AnswerCause:
        """Return the cause of the `dead_time`, the `t86` or the `deviation`.

        A time is judged by the moves beyond the limit; without a limit, by the slower half.
        """
        slope = self.travel_per_pressure
        if which == "deviation":
            return deviation_cause(self.moves, slope)
        spread, cause_of = {
            "dead_time": (self.dead_time, late_cause),
            "t86": (self.t86, slow_cause),
        }[which]
        least = limit if limit > 0 else spread.median
        slow = [
            m
            for m in self.moves
            if getattr(m, which) >= least
            or (which == "dead_time" and has_ignored(m) and m.held >= least)
        ]
        return majority_cause(slow, slope, cause_of)


def summarised(moves: Sequence[StepAnswer]) -> ResponseSummary:
    """Summarise moves; a step too short to judge is neither answered nor ignored."""
    ignored = tuple(m for m in moves if has_ignored(m))
    counted = [m for m in moves if m.moved or has_ignored(m)]
    by_size = []
    for low, high in pairwise(SIZES):
        group = [m.moved for m in counted if low <= abs(m.change) < high]
        by_size.append((sum(group), len(group)))
    return ResponseSummary(
        moves=tuple(moves),
        dead_time=Spread.of([m.dead_time for m in moves]),
        t63=Spread.of([m.t63 for m in moves]),
        t86=Spread.of([m.t86 for m in moves]),
        overshoot=Spread.of([m.overshoot for m in moves]),
        steady_error=Spread.of([m.steady_error for m in moves]),
        steady_deviation=Spread.of([abs(m.steady_error) for m in moves]),
        ignored=ignored,
        by_size=tuple(by_size),
        travel_per_pressure=travel_per_pressure(moves),
    )


def _warning(code: Code, cause: AnswerCause, **facts: float) -> Finding:
    statement = said(code, cause=cause.name, **facts)
    return Finding(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, statement)


def _steps_ignored(moves: Sequence[StepAnswer], dead_band: float) -> Finding | None:
    """Find that the stem answered at most one of the latest five large steps."""
    least = large_step(moves, dead_band)
    latest = [
        m
        for m in moves
        if abs(m.change) >= (max(least, _FROM_STOP) if m.at_stop else least)
        and (m.moved or has_ignored(m))
    ][-_LATEST:]
    with_pressure = [math.isfinite(m.pressure_delay) for m in latest if has_ignored(m)]
    if len(latest) < _LATEST or len(with_pressure) < _LATEST - _MOST_ANSWERED:
        return None
    cause = AnswerCause.PRESSURE_SILENT
    if any(with_pressure):
        is_all = all(with_pressure)
        cause = AnswerCause.PRESSURE_ANSWERS if is_all else AnswerCause.PRESSURE_ANSWERS_SOME
    number, steps = len(with_pressure), len(latest)
    return _warning(Code.STEPS_IGNORED, cause, number=number, steps=steps, least=least)


def response_findings(
    summary: ResponseSummary,
    limits: ResponseLimits,
    swinging: Hunting | None,
    dead_band: float = math.nan,
) -> list[Finding]:
    """Return the faults of the response.

    These are ignored large steps, a median of at least five moves beyond its limit, and hunting.
    The dead band is a share of the travel, nan if unknown.
    """
    ignored = _steps_ignored(summary.moves, dead_band)
    findings = [] if ignored is None else [ignored]
    late = summary.least_dead_time(dead_band)
    for code, name, spread, limit in (
        (Code.ANSWER_LATE, "dead_time", late, limits.dead_time),
        (Code.ANSWER_SLOW, "t86", summary.t86, limits.t86),
        (Code.RESTS_AWAY, "deviation", summary.steady_deviation, limits.deviation),
    ):
        if limit > 0 and spread.number >= _FEWEST_COMPARED and spread.median > limit:
            cause = summary.cause(name, 0.0 if name == "deviation" else limit)
            facts = {"median": spread.median, "moves": spread.number, "limit": limit}
            findings.append(_warning(code, cause, **facts))
    if swinging is not None:
        cause = AnswerCause.STICTION if swinging.sticks else AnswerCause.NOT_FRICTION
        facts = {"amplitude": swinging.amplitude, "period": swinging.period}
        findings.append(_warning(Code.HUNTS, cause, **facts))
    return findings
