# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A thread that looks whether the nodes of a process still work, and says so where they do not."""

import contextlib
import faulthandler
from collections.abc import Sequence

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.publisher import Publisher

from valve_friction_ros.nodes.plumbing.polled_node import PolledNode
from valve_friction_ros.nodes.plumbing.systemd import notify, watchdog_time
from valve_friction_ros.nodes.plumbing.worker import Companion

LOOP_LIMIT = 10.0
"""Time, s, after which a loop that has not turned counts as stuck."""
_LOOK = 0.5
"""Time between two looks, s; they are counted, so that a process that was stopped is not stuck."""
_REPEAT = 1.0
"""Time between two messages, s."""


class Watchdog(Companion):
    """Watches the loop of some nodes from a thread of its own, as long as the context lasts.

    systemd's watchdog is served as long as the loop turns and no node has overdue work. When the
    loop has not turned for `LOOP_LIMIT`, the stacks of all threads are written to stderr once, and
    what each node says in that case is published on ``/diagnostics`` every second, in the loop's
    stead.
    """

    def __init__(self, nodes: Sequence[PolledNode]) -> None:
        super().__init__("watchdog")
        self._nodes = nodes
        # Made in time: a loop that is stuck may hold what the making of a publisher needs.
        self._publisher: Publisher | None = None
        if any(node.stuck_status("") for node in nodes):
            self._publisher = nodes[0].create_publisher(DiagnosticArray, "/diagnostics", 10)
        within = watchdog_time()
        self._look = _LOOK if within is None else min(_LOOK, max(within / 4, 0.05))
        self._turns = 0

    def begin(self) -> None:
        """Tell systemd that the nodes are there."""
        notify("READY=1")

    def end(self) -> None:
        """Tell systemd that they end."""
        notify("STOPPING=1")
        self.thread.join(1.0)  # it may be within the middleware, which is to be shut down

    def turned(self) -> None:
        """Note that the loop has turned."""
        self._turns += 1

    def run(self) -> None:
        """Look again and again."""
        seen, idle = -1, 0
        allowed, each = round(LOOP_LIMIT / self._look), round(_REPEAT / self._look)
        while not self.has_ended.wait(self._look):
            turns = self._turns
            idle = 0 if turns != seen else idle + 1
            seen = turns
            if not idle and all(node.overdue() is None for node in self._nodes):
                notify("WATCHDOG=1")
            if idle >= allowed and (idle - allowed) % each == 0:
                with contextlib.suppress(RuntimeError):  # the thread must live on
                    self._say(idle * self._look)
            if idle == allowed:
                faulthandler.dump_traceback()

    def _say(self, idle: float) -> None:
        problem = (
            f"stuck: the loop of this process has not turned for {idle:.0f} s, so nothing is "
            "taken, identified or answered: restart it, and report the stacks in its log"
        )
        if self._publisher is not None:
            message = DiagnosticArray(
                status=[one for node in self._nodes if (one := node.stuck_status(problem))]
            )
            message.header.stamp = self._nodes[0].get_clock().now().to_msg()
            self._publisher.publish(message)
