# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The moves of the last time in robust figures, and what they mean.

The actuator pressure tells whether the positioner or the valve is to blame. A stem that ignores
large steps has seized, its sensor is frozen, or it gets no pressure.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from itertools import combinations, pairwise
from typing import Any, NamedTuple

import numpy as np

from valve_friction_ros.health import Finding, Level, StatusSignal
from valve_friction_ros.response.moves import Hunting, StepAnswer
from valve_friction_ros.wording import Code, said

_DOMINANT = 0.6
"""Share of a time, or of a deviation, above which one part of it is the cause."""

_STICKY = 0.02
"""Pressure that friction takes, as the travel that it would make, above which it is to blame:
twice the dead band of a good valve (1 %)."""

_FREE = 0.01
"""As above: what a good valve takes."""

_FEWEST_JUDGED = 5
"""Moves that a verdict needs."""

_MAJORITY = 0.8
"""Share of them that must agree."""

_LEAST_SPREAD = 0.05
"""Share of the travel over which steady positions must lie to give the travel per pressure."""

_MOST_POINTS = 30

_FEWEST_OF_A_DIRECTION = 3


class AnswerCause(Enum):
    """What makes a stem late, slow or wrong."""

    FRICTION = auto()
    LATE = auto()
    SLOW = auto()
    SETTING = auto()
    UNKNOWN = auto()
    PRESSURE_ANSWERS = auto()
    """Of ignored steps: to all of them, which the stem does not follow."""
    PRESSURE_SILENT = auto()
    PRESSURE_ANSWERS_SOME = auto()
    STICTION = auto()
    """Of hunting."""
    NOT_FRICTION = auto()


def travel_per_pressure(moves: Sequence[StepAnswer]) -> float:
    """Return the share of the travel that a pascal makes; nan if not known.

    It is the median slope between the ends of two moves of one direction (Theil and Sen), which
    friction holds off to the same side.
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
    """Blame friction if it took much pressure, and `otherwise` if it took little."""
    push = move.push * slope
    if push >= _STICKY:
        return AnswerCause.FRICTION
    return otherwise if push <= _FREE else AnswerCause.UNKNOWN


def late_cause(move: StepAnswer, slope: float) -> AnswerCause:
    """Return why a stem began to move late, or did not."""
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
    """Return why a stem had late what it should have had at T86."""
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
    """Return why a stem comes to rest where the command does not want it.

    Friction leaves it behind after moves of either direction. Where the stem is off to one side
    after both, its pressure has been led there, if the stem moves at all.
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
    """Return what most moves blame.

    Moves from or to a stop, and of a stem that did not rest, are left out. Fewer than five, or
    less than four in five that agree, tell nothing.
    """
    asked = [cause_of(m, slope) for m in moves if m.rested and not m.at_stop]
    if len(asked) >= _FEWEST_JUDGED:
        for cause in AnswerCause:
            if asked.count(cause) >= _MAJORITY * len(asked):
                return cause
    return AnswerCause.UNKNOWN


ANSWER_TIME = 5.0
"""Time, s, for which a step must last before a stem that rests has ignored it."""

_LATEST, _MOST_ANSWERED = 5, 1
"""Latest large steps that are judged, and how many of them a stem in trouble may have answered."""

_LEAST_STEP, _LARGE_STEP = 0.02, 0.05
"""Share of the travel: no step below the first is large, twice the dead band of a good valve (1 %),
and every step of the second is, unless the dead band is known to be wider. Chosen."""

_FROM_STOP = 0.1
"""Share of the travel that a step from or to a stop must have: a positioner may hold the stem on
its seat up to a few percent (cut-off). Chosen."""


@dataclass(frozen=True)
class IgnoredSteps:
    """The latest large steps, most of which the stem has ignored.

    Attributes
    ----------
    latest : tuple of StepAnswer
        They, the answered ones too.
    least : float
        Share of the travel from which a step is large.
    """

    latest: tuple[StepAnswer, ...]
    least: float

    @property
    def number(self) -> int:
        """How many were ignored."""
        return sum(map(has_ignored, self.latest))

    @property
    def cause(self) -> AnswerCause:
        """What the pressure has left to suspect."""
        answered = [math.isfinite(m.pressure_delay) for m in self.latest if has_ignored(m)]
        if all(answered):
            return AnswerCause.PRESSURE_ANSWERS
        return AnswerCause.PRESSURE_ANSWERS_SOME if any(answered) else AnswerCause.PRESSURE_SILENT


def has_ignored(move: StepAnswer) -> bool:
    """Return whether a step lasted long enough and did not move the stem."""
    return not move.moved and move.held >= ANSWER_TIME


def large_step(moves: Sequence[StepAnswer], dead_band: float = math.nan) -> float:
    """Return from which size on a stem should answer a step, share of the travel.

    It is the dead band where that is known, else the median of the steps that were answered, or 5 %
    if none was.
    """
    if math.isfinite(dead_band):
        return max(dead_band, _LEAST_STEP)
    sizes = [abs(m.change) for m in moves if m.moved]
    # Commands of one size differ by their rounding.
    usual = (1 - 1e-6) * float(np.median(sizes)) if sizes else _LARGE_STEP
    return min(max(usual, _LEAST_STEP), (1 - 1e-6) * _LARGE_STEP)


def ignored_steps(moves: Sequence[StepAnswer], dead_band: float = math.nan) -> IgnoredSteps | None:
    """Return the latest five large steps if at most one of them was answered; else None.

    Parameters
    ----------
    moves : sequence of StepAnswer
        Oldest first.
    dead_band : float
        Share of the travel; nan if not known.
    """
    least = large_step(moves, dead_band)
    large = [
        m
        for m in moves
        if abs(m.change) >= (max(least, _FROM_STOP) if m.at_stop else least)
        and (m.moved or has_ignored(m))
    ]
    found = IgnoredSteps(tuple(large[-_LATEST:]), least)
    enough = len(found.latest) == _LATEST
    return found if enough and found.number >= _LATEST - _MOST_ANSWERED else None


SIZES = (0.0, 0.005, 0.01, 0.02, 0.05, 0.1, math.inf)
"""Bounds of the classes of steps, share of the travel."""

FIGURES = ("dead_time", "t63", "t86", "overshoot", "steady_error", "steady_deviation")
"""Names of the figures of a summary that are spreads."""

_FEWEST_COMPARED = 5
"""Moves whose median is compared with a limit."""


class Spread(NamedTuple):
    """Median and 10 % and 90 % quantiles of some moves; nan without any."""

    median: float
    low: float
    high: float
    number: int

    @classmethod
    def of(cls, values: Sequence[float]) -> "Spread":
        """Describe the finite ones of some values."""
        finite = [value for value in values if math.isfinite(value)]
        if not finite:
            return cls(math.nan, math.nan, math.nan, 0)
        low, median, high = (float(q) for q in np.percentile(finite, (10, 50, 90)))
        return cls(median, low, high, len(finite))

    def to_dict(self) -> dict[str, Any]:
        """Return a mapping of plain values, None where nothing is known."""
        return {name: _known(value) for name, value in self._asdict().items()}


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value


@dataclass(frozen=True)
class ResponseLimits:
    """Limits of the answer in service; 0: none.

    A plant must set them: what is late depends on the loop, and a dead time on the step.

    Attributes
    ----------
    deviation : float
        Magnitude of the steady deviation, median of the moves, share of the travel.
    dead_time, t86 : float
        Medians of the moves, s.
    """

    deviation: float = 0.0
    dead_time: float = 0.0
    t86: float = 0.0

    def __post_init__(self) -> None:
        """Refuse limits below zero."""
        if min(self.deviation, self.dead_time, self.t86) < 0:
            raise ValueError("limits of the response must not be negative")


@dataclass(frozen=True)
class ResponseSummary:
    """The answers to the latest steps.

    Attributes
    ----------
    moves : tuple of StepAnswer
        The steps that were evaluated.
    dead_time, t63, t86 : Spread
        s.
    overshoot : Spread
        Share of the move.
    steady_error : Spread
        Command less position, share of the travel, with its sign.
    steady_deviation : Spread
        Its magnitude.
    ignored : tuple of StepAnswer
        Steps that lasted at least five seconds and did not move the stem.
    by_size : tuple of (int, int)
        Steps that moved the stem, and all, in each class of `SIZES`.
    travel_per_pressure : float
        Share of the travel that a pascal makes; nan if not known.
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
        """Return a mapping of plain values, None where nothing is known; times in s."""
        return {
            "moves": len(self.moves),
            "ignored": len(self.ignored),
            "largest_ignored": self.largest_ignored,
            "smallest_answered": _known(self.smallest_answered),
            **{name: getattr(self, name).to_dict() for name in FIGURES},
        }

    @property
    def largest_ignored(self) -> float:
        """90 % quantile of the steps that the stem ignored, share of the travel; 0: none."""
        return float(np.percentile([abs(m.change) for m in self.ignored] or [0.0], 90))

    @property
    def smallest_answered(self) -> float:
        """10 % quantile of those that it answered; nan if none."""
        return Spread.of([abs(m.change) for m in self.moves if m.moved]).low

    def least_dead_time(self, dead_band: float = math.nan) -> Spread:
        """Return the dead times, s, with the time that large steps which were ignored have lasted.

        The latter is a lower bound. `dead_band` is a share of the travel, nan if not known.
        """
        large = large_step(self.moves, dead_band)
        return Spread.of(
            [
                m.held if has_ignored(m) and abs(m.change) >= large else m.dead_time
                for m in self.moves
            ]
        )

    def cause(self, which: str, limit: float = 0.0) -> AnswerCause:
        """Return what is to blame for the `dead_time`, the `t86` or the `deviation`.

        The moves beyond the limit are asked; without a limit, the slower half.
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
    """Summarise moves; those whose stem may still have answered count as neither."""
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


def response_findings(
    summary: ResponseSummary,
    limits: ResponseLimits,
    swinging: Hunting | None,
    dead_band: float = math.nan,
) -> list[Finding]:
    """Say what is wrong with the answers.

    That is: large steps that are ignored, limits that the median of five moves passes, hunting. The
    dead band is a share of the travel, nan if not known.
    """
    findings = []
    ignored = ignored_steps(summary.moves, dead_band)
    if ignored is not None:
        findings.append(
            _warning(
                Code.STEPS_IGNORED,
                ignored.cause,
                number=ignored.number,
                steps=len(ignored.latest),
                least=ignored.least,
            )
        )
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
