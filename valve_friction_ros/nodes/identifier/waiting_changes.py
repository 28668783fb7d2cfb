# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Changes that wait for a file of the history that cannot be written."""

from collections.abc import Callable
from threading import Lock
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from valve_friction_ros.history import HistoryFile

_MOST = 1000

_Change = Callable[["HistoryFile"], None]


class WaitingChanges:
    """Changes in their order, in bounded number, for two threads.

    Where too many wait, the oldest identification is given up: others come. Without any it is the
    oldest change. How many were given up is counted.

    Parameters
    ----------
    most : int
        Changes that wait at most.
    """

    def __init__(self, most: int = _MOST) -> None:
        self._most = most
        self._lock = Lock()
        self._waiting: list[tuple[_Change, bool]] = []
        self._identifications = self._others = 0

    def add(self, change: _Change, identification: bool = False) -> None:
        """Have a change wait, unless it does; give up another one where there are too many."""
        with self._lock:
            if any(change == one for one, _ in self._waiting):
                return
            self._waiting.append((change, identification))
            if len(self._waiting) > self._most:
                goes = next((k for k, (_, is_one) in enumerate(self._waiting) if is_one), 0)
                _, is_one = self._waiting.pop(goes)
                self._identifications += is_one
                self._others += not is_one

    def first(self) -> _Change | None:
        """Return the oldest change, which goes on waiting; None if none waits."""
        with self._lock:
            return self._waiting[0][0] if self._waiting else None

    def remove(self, change: _Change) -> None:
        """Let a change go that was made, unless it was given up meanwhile."""
        with self._lock:
            self._waiting = [one for one in self._waiting if one[0] != change]

    @property
    def given_up(self) -> str:
        """What was given up, in words; empty if nothing was."""
        counts = (self._identifications, "identification"), (self._others, "other change")
        told = [f"{count} {what}{'s' * (count > 1)}" for count, what in counts if count]
        return " and ".join(told)

    def forget_given_up(self) -> None:
        """Count from now on."""
        with self._lock:
            self._identifications = self._others = 0
