# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Severity of findings on a valve, and the grades of a first survey: good, watch or bad."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum, IntEnum
from types import MappingProxyType
from typing import Any

from valve_friction_ros.wording import Statement, sentence


class Survey(Enum):
    """Grade of a valve in a first survey."""

    UNKNOWN = "unknown"
    """Cannot be determined from the record."""
    GOOD = "good"
    WATCH = "watch"
    BAD = "bad"


@dataclass(frozen=True)
class SurveyLimits:
    """Bounds of the dead band of actuator and valve, without a positioner.

    Attributes
    ----------
    watch, bad : float
        Dead band (F_c + F_s)/k over the travel. Without a spring: twice the friction over the force
        of the actuator's range.

    Raises
    ------
    ValueError
        Unless 0 < watch < bad.

    Notes
    -----
    The defaults are the limits of ``ptfe`` in `PACKING_LIMITS`.
    """

    watch: float = 0.10
    bad: float = 0.20

    @classmethod
    def of_packing(
        cls, packing: str = "ptfe", watch: float | None = None, bad: float | None = None
    ) -> "SurveyLimits":
        """Return the limits of a class of packing; `watch` and `bad` override them if given.

        Raises ValueError for an unknown class, or limits that are out of order.
        """
        if packing not in PACKING_LIMITS:
            raise ValueError(f"packing must be {' or '.join(PACKING_LIMITS)}, got {packing!r:.60}")
        usual = PACKING_LIMITS[packing]
        return cls(usual.watch if watch is None else watch, usual.bad if bad is None else bad)

    def __post_init__(self) -> None:
        if not 0 < self.watch < self.bad:
            raise ValueError(
                "limits must satisfy 0 < survey_watch < survey_bad, got survey_watch "
                f"{self.watch:g}, survey_bad {self.bad:g}"
            )


PACKING_LIMITS: Mapping[str, SurveyLimits] = MappingProxyType(
    {"ptfe": SurveyLimits(), "graphite": SurveyLimits(0.15, 0.30)}
)
"""Limits by class of packing.

They come from the packings that the paper measured on one valve: 5 % with low friction, 21 % with
high friction, at which its loop oscillates, and 27 % with graphite and a slip jump. Half of the
oscillating dead band is the limit of watch. Graphite is allowed half as much again, by choice."""


def surveyed(band: float, half_width: float, limits: SurveyLimits | None = None) -> Survey:
    """Return the grade of a dead band, a share, with half the width of its 95 % interval.

    Good and bad require the whole interval. An interval that spans from good to bad is unknown.
    """
    limits = limits or SurveyLimits()
    low, high = band - half_width, band + half_width
    if math.isnan(low) or (low < limits.watch and high >= limits.bad):
        return Survey.UNKNOWN
    if low >= limits.bad:
        return Survey.BAD
    return Survey.GOOD if high < limits.watch else Survey.WATCH


class Level(IntEnum):
    """Severity, numbered as in diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


class StatusSignal(Enum):
    """Status signals of NAMUR NE 107."""

    GOOD = ""
    FAILURE = "F"
    CHECK_FUNCTION = "C"
    OUT_OF_SPECIFICATION = "S"
    MAINTENANCE_REQUIRED = "M"


@dataclass(frozen=True)
class Finding:
    """A finding on a valve besides the diagnosis of its friction.

    Attributes
    ----------
    level : Level
        Severity.
    status_signal : StatusSignal
        The severity as a status signal of NE 107.
    statement : Statement
        The finding, and what to check.
    numbers : tuple of str
        Names of the numbers behind it, if any.
    leads : bool
        Whether it concerns friction, and is newer or more certain than the latest identification.
    friction_ratio : float
        Friction over its baseline behind it; nan if there is none.
    """

    level: Level
    status_signal: StatusSignal
    statement: Statement
    numbers: tuple[str, ...] = field(default=(), compare=False)
    leads: bool = field(default=False, compare=False)
    friction_ratio: float = field(default=math.nan, compare=False)

    @property
    def message(self) -> str:
        """The finding in one sentence."""
        return sentence(self.statement)

    def to_dict(self) -> dict[str, Any]:
        """Return a mapping of plain values: ``level``, ``ne_107`` and ``message``."""
        return {
            "level": self.level.name,
            "ne_107": self.status_signal.value,
            "message": self.message,
        }

    def __str__(self) -> str:
        """Return level and message on one line."""
        return f"{self.level.name}: {self.message}"


def by_severity(findings: Iterable[Finding]) -> list[Finding]:
    """Return findings, the most severe first; equal levels keep their order."""
    return sorted(findings, key=lambda finding: -finding.level)
