# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A dashboard in forty lines: all valves of the ROS graph, the worst first.

Run ``python examples/worst_valves.py`` while identifiers run; Ctrl-C ends it. One subscription,
`/diagnostics`, covers all valves. The latched `~/estimate` has the same keys for a single valve.
"""

import contextlib

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

LEVELS = ("OK", "WARN", "ERROR", "STALE")


class WorstValves(Node):
    """Keeps the latest status of each valve, and prints the table after each change."""

    def __init__(self) -> None:
        super().__init__("worst_valves")
        self._valves: dict[str, tuple[int, str]] = {}
        self.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        known = dict(self._valves)
        for status in message.status:
            if status.name.endswith(": friction"):
                self._valves[status.hardware_id or status.name] = (status.level[0], _line(status))
        if self._valves != known:
            for tag, (level, line) in sorted(self._valves.items(), key=lambda one: -one[1][0]):
                print(f"{LEVELS[level]:5} {tag:12} {line}", flush=True)


def _line(status: DiagnosticStatus) -> str:
    values = {one.key: one.value for one in status.values}
    ratio = values.get("friction_ratio", "no ratio")
    return f"NE 107 {values.get('NE 107', '?')}  {ratio:8}  {status.message.partition(':')[0]}"


if __name__ == "__main__":
    rclpy.init()
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(WorstValves())
