# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a node logs once at its start: that it prepares, and that it is ready."""

import time

from rclpy.node import Node

from valve_friction_ros.model.compiled import kernels_are_cached
from valve_friction_ros.nodes.plumbing.worker import Worker

_QUICK = 5.0
"""Time, s, of a preparation that is not worth a line."""


class Readiness:
    """Tells whether a worker has prepared what a node needs; logs `ready` once it has."""

    def __init__(self, node: Node, worker: Worker, ready: str) -> None:
        self._node = node
        self._worker = worker
        self._ready = ready
        self._tell_at = time.monotonic() + _QUICK
        self._is_ready = self._has_told = False

    @property
    def problem(self) -> str | None:
        """That the node is preparing; None once it is ready."""
        if not self._worker.is_preparing:
            return None
        if kernels_are_cached():
            return "preparing: numeric code is compiled, once after an installation"
        return (
            "preparing: numeric code is compiled, at each start, because no folder for it can be "
            "written: set NUMBA_CACHE_DIR to one"
        )

    @property
    def is_slow(self) -> bool:
        """Whether the preparation is worth a line: it lasts longer than loading does."""
        return self.problem is not None and time.monotonic() > self._tell_at

    def values(self) -> dict[str, str]:
        """Return the value of the diagnostic while the node is preparing."""
        return {} if self.problem is None else {"preparing": self.problem}

    def look(self) -> bool:
        """Return whether the node is ready; log what has not been logged."""
        if self._is_ready:
            return True
        problem, log = self.problem, self._node.get_logger()
        if problem is None:
            self._is_ready = True
            log.info(f"ready: {self._ready}")
        elif not self._has_told and self.is_slow:
            self._has_told = True
            log.info(problem)
        return self._is_ready
