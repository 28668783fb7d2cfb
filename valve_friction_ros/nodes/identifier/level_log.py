# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Changes of a valve's level and faults of its data: each begin and each end is logged once."""

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node

from valve_friction_ros.health import Level
from valve_friction_ros.wording import Statement, sentence

_CALM = 10.0
"""Time, s, without a fault after which it is logged as over. Chosen: one that comes and goes is
one fault."""


class LevelLog:
    """Logs the level of a valve when it has changed; it begins at OK."""

    def __init__(self, node: Node) -> None:
        self._log = node.get_logger()
        self._level = Level.OK

    def follow(self, status: DiagnosticStatus) -> None:
        """Log the level of a status, if it is not the one before."""
        level = Level(status.level[0])
        if level == self._level:
            return
        line = f"level {self._level.name} → {level.name}: {status.message}"
        self._level = level
        # rclpy wants a severity to keep to its line of code.
        if level is Level.OK:
            self._log.info(line)
        elif level is Level.WARN:
            self._log.warning(line)
        else:
            self._log.error(line)


class FaultLog:
    """Logs when a fault begins, and when it has been over for a while.

    Times are those of a steady clock, s.
    """

    def __init__(self, node: Node) -> None:
        self._log = node.get_logger()
        self._begun: dict[Statement, float] = {}
        self._seen: dict[Statement, float] = {}
        self._repeated: dict[Statement, int] = {}

    def follow(self, faults: Mapping[Statement, Statement], now: float) -> None:
        """Take the faults of now: what is wrong, which does not change, and all of it."""
        for what, statement in faults.items():
            if what not in self._begun:
                self._begun[what] = now
                self._log.warning(sentence(statement))
            self._seen[what] = now
        for what in [one for one, seen in self._seen.items() if now - seen >= _CALM]:
            again = self._repeated.pop(what, 0)
            lasted = self._seen.pop(what) - self._begun.pop(what)
            times = f", {again} times more" if again else ""
            self._log.info(f"over after {lasted:.0f} s{times}: {what}")

    def note(self, what: Statement, statement: Statement, now: float) -> None:
        """Take what happens at an instant; a repetition soon after it belongs to the same fault."""
        if what in self._begun:
            self._repeated[what] = self._repeated.get(what, 0) + 1
        self.follow({what: statement}, now)
