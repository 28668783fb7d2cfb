# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the dashboard shows, read as it prints it."""

import json
import subprocess
import threading
import time
from collections.abc import Callable
from typing import NamedTuple

__all__ = ["Group", "Picture"]

_LOOK = 0.1


class Group(NamedTuple):
    """The valves of one host: those shown as heard and as silent, and the fewest samples held."""

    heard: int = 0
    silent: int = 0
    fewest: int = 0


class Picture:
    """The newest line of the dashboard, read in a thread.

    Parameters
    ----------
    process : subprocess.Popen
        The dashboard.
    """

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process
        self._groups: dict[str, Group] = {}
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        for line in self._process.stdout or ():
            found = json.loads(line)["groups"]
            self._groups = {name: Group(**group) for name, group in found.items()}

    def group(self, name: str) -> Group:
        """Return what is shown of the valves of a host."""
        return self._groups.get(name, Group())

    def time_until(
        self, condition: Callable[["Picture"], bool], patience: float, begin: float | None = None
    ) -> float:
        """Wait until the picture is so; return the time since `begin` or now, s; inf if never."""
        begin = time.monotonic() if begin is None else begin
        while not condition(self):
            if time.monotonic() - begin > patience:
                return float("inf")
            if self._process.poll() is not None:
                raise RuntimeError(f"the dashboard ended with {self._process.returncode}")
            time.sleep(_LOOK)
        return time.monotonic() - begin
