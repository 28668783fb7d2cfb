# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Whether the history file is still the one that the node began with, and the node's alone."""

import time
from pathlib import Path

from valve_friction_ros.history.place import Claim

_HANDOVER = 10.0
"""Time, s, for which a node that ends may still hold the history."""


class HistoryGuard:
    """Watches the history file of one valve.

    Parameters
    ----------
    path : Path
        The file.
    valve : str
        Name of the valve.
    """

    def __init__(self, path: Path, valve: str) -> None:
        self._path, self._valve = path, valve
        self._claim = Claim(path, valve)
        self._refused_since: float | None = None
        self._known: tuple[int, int] | None = None

    def ask(self) -> None:
        """Claim the history of the valve, unless that is done."""
        if self._claim.ask():
            self._refused_since = None
        elif self._refused_since is None:
            self._refused_since = time.monotonic()

    def release(self) -> None:
        """Leave the history to another node."""
        self._claim.release()

    @property
    def conflict(self) -> str | None:
        """That another node keeps the history of this valve, too, if so."""
        since = self._refused_since
        if since is None or time.monotonic() - since < _HANDOVER:
            return None
        return (
            f"another node keeps the history of {self._valve} in {self._path}: end one of them, "
            "or name another history_file or namespace"
        )

    @property
    def is_another(self) -> bool:
        """Whether the file is not the one that was noted last, or is not there."""
        return self._known is not None and self._identity() != self._known

    def note(self) -> None:
        """Note which file it is, if it is there."""
        self._known = self._identity() or self._known

    def _identity(self) -> tuple[int, int] | None:
        """Return by what the system tells the file from another one."""
        try:
            found = self._path.stat()
        except OSError:
            return None
        return found.st_dev, found.st_ino
