"""Severity of what is found on a valve."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum, IntEnum
from typing import Any

__all__ = ["Finding", "Level", "StatusSignal", "by_severity"]


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
    """One thing found on a valve beside its friction.

    Attributes
    ----------
    level : Level
        Severity.
    status_signal : StatusSignal
        The severity as a status signal of NE 107.
    message : str
        One sentence that says what to check.
    numbers : tuple of str
        Names of the numbers that it rests on, if any.
    leads : bool
        Whether it is about the friction, and newer or surer than the latest identification.
    friction_ratio : float
        Friction over its baseline that it rests on; nan if on none.
    """

    level: Level
    status_signal: StatusSignal
    message: str
    numbers: tuple[str, ...] = field(default=(), compare=False)
    leads: bool = field(default=False, compare=False)
    friction_ratio: float = field(default=math.nan, compare=False)

    def to_dict(self) -> dict[str, Any]:
        """Return it as a mapping of plain values: ``level``, ``ne_107`` and ``message``."""
        return {
            "level": self.level.name,
            "ne_107": self.status_signal.value,
            "message": self.message,
        }

    def __str__(self) -> str:
        """Return level and message on one line."""
        return f"{self.level.name}: {self.message}"


def by_severity(findings: Iterable[Finding]) -> list[Finding]:
    """Return findings, the most severe first; those of one level keep their order."""
    return sorted(findings, key=lambda finding: -finding.level)
