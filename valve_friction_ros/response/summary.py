"""The moves of the last time in robust figures, and what they mean."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from valve_friction_ros.health import Finding, Level, StatusSignal
from valve_friction_ros.identification.trust.rounding import percentage
from valve_friction_ros.response.blame import (
    Cause,
    blamed,
    deviation_cause,
    late_cause,
    slow_cause,
    travel_per_pressure,
)
from valve_friction_ros.response.hunting import Hunting
from valve_friction_ros.response.ignored import has_ignored, ignored_steps, large_step
from valve_friction_ros.response.move import Move

__all__ = ["FIGURES", "SIZES", "ResponseLimits", "ResponseSummary", "Spread", "found", "summarised"]

SIZES = (0.0, 0.005, 0.01, 0.02, 0.05, 0.1, math.inf)
"""Bounds of the classes of steps, share of the travel."""

FIGURES = ("dead_time", "t63", "t86", "overshoot", "steady_error", "steady_deviation")
"""Names of the figures of a summary that are spreads."""

_FEWEST = 5
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
            raise ValueError("limits of the response must not be below zero")


@dataclass(frozen=True)
class ResponseSummary:
    """The answers to the latest steps.

    Attributes
    ----------
    moves : tuple of Move
        The steps that were evaluated.
    dead_time, t63, t86 : Spread
        s.
    overshoot : Spread
        Share of the move.
    steady_error : Spread
        Command less position, share of the travel, with its sign.
    steady_deviation : Spread
        Its magnitude.
    ignored : tuple of Move
        Steps that lasted at least five seconds and did not move the stem.
    by_size : tuple of (int, int)
        Steps that moved the stem, and all, in each class of `SIZES`.
    travel_per_pressure : float
        Share of the travel that a pascal makes; nan if not known.
    """

    moves: tuple[Move, ...]
    dead_time: Spread
    t63: Spread
    t86: Spread
    overshoot: Spread
    steady_error: Spread
    steady_deviation: Spread
    ignored: tuple[Move, ...]
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

    def cause(self, which: str, limit: float = 0.0) -> Cause:
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
        return blamed(slow, slope, cause_of)


def summarised(moves: Sequence[Move]) -> ResponseSummary:
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


def _warning(message: str) -> Finding:
    return Finding(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, message)


def found(
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
                f"the stem ignored {ignored.number} of the latest {len(ignored.latest)} steps of "
                f"its command of {percentage(ignored.least)} of the travel or more: "
                f"{ignored.remaining_causes}"
            )
        )
    for name, what, spread, limit in (
        ("dead_time", "begins to move", summary.least_dead_time(dead_band), limits.dead_time),
        ("t86", "has moved by 86 %", summary.t86, limits.t86),
    ):
        if limit > 0 and spread.number >= _FEWEST and spread.median > limit:
            findings.append(
                _warning(
                    f"the stem {what} {spread.median:.2g} s after its command (median of "
                    f"{spread.number} moves, limit {limit:g} s): {summary.cause(name, limit).value}"
                )
            )
    spread, limit = summary.steady_deviation, limits.deviation
    if limit > 0 and spread.number >= _FEWEST and spread.median > limit:
        findings.append(
            _warning(
                f"the stem rests {percentage(spread.median)} of its travel away from its command "
                f"(median of {spread.number} moves, limit {percentage(limit)}): "
                f"{summary.cause('deviation').value}"
            )
        )
    if swinging is not None:
        cause = (
            "it sticks and jumps while the pressure swings: stiction, and integral action: check "
            "the packing first"
            if swinging.sticks
            else "friction is not seen to be the cause: check gain and air supply of the positioner"
        )
        findings.append(
            _warning(
                f"the stem hunts by {percentage(swinging.amplitude)} of its travel every "
                f"{swinging.period:.2g} s at a constant command: {cause}"
            )
        )
    return findings
