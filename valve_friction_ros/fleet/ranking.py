"""The order of valves: which needs attention first."""

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from valve_friction_ros.fleet.row import Cell
from valve_friction_ros.health import FrictionLimits, Level, StatusSignal

__all__ = ["Status", "ranked", "reaches", "status_of"]


class Status(NamedTuple):
    """The diagnosis of a row in one word, and the colour class that goes with it."""

    word: str
    colour: str


_LIMITS = FrictionLimits()
_MAYBE = "maybe"
_BY_SIGNAL = {
    StatusSignal.FAILURE.value: "excessive",
    StatusSignal.OUT_OF_SPECIFICATION.value: "collapsed",
    StatusSignal.MAINTENANCE_REQUIRED.value: "grown",
    StatusSignal.CHECK_FUNCTION.value: "check",
}


def _friction_level(row: Mapping[str, Cell]) -> Level | None:
    return Level[str(row["level"])] if row.get("level") else None


def _level(row: Mapping[str, Cell]) -> Level | None:
    """Return the level of friction and findings together; None for a refused valve."""
    own, others = _friction_level(row), row.get("findings_level")
    return own if own is None or not others else max(own, Level[str(others)])


def _number(row: Mapping[str, Cell], name: str) -> float:
    value = row.get(name)
    return float(value) if isinstance(value, (int, float)) else -math.inf


def status_of(row: Mapping[str, Cell]) -> Status:
    """Say how a valve is: a word, and ``error``, ``warn``, ``maybe``, ``ok`` or ``none``."""
    level, ratio = _level(row), _number(row, "ratio")
    if level is None:
        return Status("refused", "none")
    if level > (_friction_level(row) or Level.OK):
        return Status("changed", level.name.lower())
    if level is Level.OK or row["ne_107"] == StatusSignal.CHECK_FUNCTION.value:
        by_ratio = _status_of_ratio(ratio)
        if level is Level.OK or by_ratio.colour == _MAYBE:
            return by_ratio
    if row["ne_107"] == StatusSignal.MAINTENANCE_REQUIRED.value and ratio < 1:
        return Status("fallen", level.name.lower())
    return Status(_BY_SIGNAL[str(row["ne_107"])], level.name.lower())


def _status_of_ratio(ratio: float) -> Status:
    if ratio == -math.inf:
        return Status("no comparison", "none")
    if ratio >= _LIMITS.warn_ratio:
        return Status("perhaps grown", _MAYBE)
    if ratio <= _LIMITS.low_warn_ratio:
        return Status("perhaps fallen", _MAYBE)
    return Status("normal", "ok")


def _need(row: Mapping[str, Cell]) -> tuple[float, float, float, str, str]:
    """Return what sorts first the valve that needs attention most."""
    level, ratio = _level(row), _number(row, "ratio")
    change = abs(math.log(ratio)) if ratio > 0 else -math.inf
    severity = -1.0 if level is None else float(level)
    names = (str(row["recording"]), str(row["valve"]))
    return (-severity, -change, -_number(row, "dead_band_of_travel"), *names)


def ranked(rows: Iterable[Mapping[str, Cell]]) -> list[Mapping[str, Cell]]:
    """Sort rows by diagnosis, then by the change of friction, then by the dead band.

    A friction that has halved has changed as much as one that has doubled. Refused valves, of which
    nothing is known, come last.
    """
    return sorted(rows, key=_need)


def reaches(row: Mapping[str, Cell], level: Level) -> bool:
    """Return whether the diagnosis of a row is as severe as `level`, or more."""
    found = _level(row)
    return found is not None and found >= level
