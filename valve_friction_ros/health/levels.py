# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Severity of what is found on a valve."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum, IntEnum
from typing import Any

from valve_friction_ros.wording import Statement, sentence


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
    statement : Statement
        What is found, and what to check.
    numbers : tuple of str
        Names of the numbers that it rests on, if any.
    leads : bool
        Whether it is about the friction, and newer or surer than the latest identification.
    friction_ratio : float
        Friction over its baseline that it rests on; nan if on none.
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
