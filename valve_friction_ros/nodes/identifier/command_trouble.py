# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Why commands of the stem cannot be used."""

import math

from valve_friction_ros.health import Finding, Level, StatusSignal
from valve_friction_ros.wording import Code, said

_PATIENCE = 60.0
"""Time, s, for which commands come, and none can be used, before it is found."""


class CommandTrouble:
    """Remembers what is wrong with the latest commands, and since when none could be used."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Forget it, as where nobody gives commands any more."""
        self._problem = ""
        self._first = self._last = math.nan

    @property
    def problem(self) -> str:
        """What is wrong with the latest commands; empty: nothing."""
        return self._problem

    def take(self, problem: str, is_used: bool, now: float) -> None:
        """Note what is wrong with commands that have come at a time, s, and whether one is used."""
        self._problem = problem
        if is_used:
            self._first = self._last = math.nan
            return
        self._last = now
        if math.isnan(self._first):
            self._first = now

    def findings(self) -> list[Finding]:
        """Return a finding where commands have come for a minute, and none could be used."""
        if not self._last - self._first >= _PATIENCE:
            return []
        unusable = said(Code.COMMANDS_UNUSABLE, problem=self._problem)
        return [Finding(Level.WARN, StatusSignal.CHECK_FUNCTION, unusable)]
