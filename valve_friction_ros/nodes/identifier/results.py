# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The latched topics of an identifier: what is known of its valve, and each number of it."""

import math
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray

from valve_friction_ros.health import FrictionMonitor, dead_band
from valve_friction_ros.history import HistoryEntry
from valve_friction_ros.identification import SLIDING, UNITS, Result
from valve_friction_ros.nodes.plumbing.messages import sweep_message, time_message
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode
from valve_friction_ros.nodes.plumbing.qos import LATCHED

_FIGURES = (
    "dead_band",
    "friction_ratio",
    "sliding_speed",
    "fit",
    "rms",
    "threshold",
    "sigma",
    "r_squared",
)


_LOOKS_COST = 1e4
"""Time between two looks for a subscriber over that of a look, which goes through the graph."""
_FRICTIONS = (*UNITS, SLIDING)


class EstimateTopic:
    """Publishes what is known of the valve in one message, when it has changed.

    It is on the graph once somebody subscribes to it. Without the parameter `estimate_topic` it
    does nothing.
    """

    def __init__(self, node: PolledNode, is_wanted: bool) -> None:
        self._node, self._is_wanted = node, is_wanted
        self._topic = node.resolve_topic_name("~/estimate")
        if is_wanted:
            node.offered[self._topic] = "diagnostic_msgs/msg/DiagnosticStatus"
        self._publisher: Publisher | None = None
        self._last: DiagnosticStatus | None = None
        self._look_at = -math.inf

    def publish(self, status: DiagnosticStatus) -> None:
        """Publish a status, unless it is the one before."""
        if self._is_asked_for() and self._publisher is not None and status != self._last:
            self._last = status
            self._publisher.publish(status)

    def _is_asked_for(self) -> bool:
        """Return whether somebody subscribes, or did; that costs a ten-thousandth of a core."""
        begun = time.monotonic()
        if not self._is_wanted or self._publisher is not None or begun < self._look_at:
            return self._publisher is not None
        if self._node.count_subscribers(self._topic):
            self._publisher = self._node.create_publisher(DiagnosticStatus, self._topic, LATCHED)
            del self._node.offered[self._topic]
        now = time.monotonic()
        self._look_at = now + _LOOKS_COST * (now - begun)
        return self._publisher is not None


class NumberTopics:
    """Publishes a result as numbers: all with a stamp, and each on a topic of its own.

    The parameters `result_topic` and `number_topics` ask for them.
    """

    def __init__(self, node: Node) -> None:
        self._result: Publisher | None = None
        if node.get_parameter("result_topic").value:
            self._result = node.create_publisher(JointState, "~/result", LATCHED)
        self._friction: dict[str, Publisher] = {}
        self._half_width: dict[str, Publisher] = {}
        self._published: dict[str, Publisher] = {}
        self._sweep: Publisher | None = None
        if not node.get_parameter("number_topics").value:
            return
        self._friction, self._half_width, self._published = (
            {name: node.create_publisher(Float64, f"~/{kind}/{name}", LATCHED) for name in names}
            for kind, names in (
                ("friction", (*_FRICTIONS, *_FIGURES)),
                ("half_width", _FRICTIONS),
                ("published", UNITS),
            )
        )
        self._sweep = node.create_publisher(Float64MultiArray, "~/sweep", LATCHED)

    def publish(self, result: Result | HistoryEntry, monitor: FrictionMonitor) -> None:
        """Publish a result that the monitor has accepted, or the numbers kept of an earlier one."""
        ratio = monitor.diagnosis().ratio
        unknown = float("nan")
        if isinstance(result, Result):
            evidence, fit, rms = result.evidence, result.fit, result.rms
            sweep = None if result.estimate is None else result.estimate.sweep
            if self._sweep is not None:
                self._sweep.publish(sweep_message(sweep))
        else:
            evidence, (fit, rms, _) = {}, result.fit
        figures: dict[str, Any] = {
            **dict.fromkeys(_FRICTIONS, unknown),
            **result.values,
            "dead_band": dead_band(result, monitor.settings.valve),
            "friction_ratio": unknown if ratio is None else ratio.value,
            "sliding_speed": result.sliding_speed,
            "fit": fit,
            "rms": rms,
            **{name: evidence.get(name, unknown) for name in ("threshold", "sigma", "r_squared")},
        }
        known = result.parameters
        half_widths = {name: known[name].half_width for name in _FRICTIONS if name in known}
        published = {name: known[name].published for name in UNITS if name in known}
        for publishers, numbers in (
            (self._friction, figures),
            (self._half_width, half_widths),
            (self._published, published),
        ):
            for name, publisher in publishers.items():
                publisher.publish(Float64(data=numbers.get(name, unknown)))
        if self._result is not None:
            names = (*_FRICTIONS, *_FIGURES)
            message = JointState(
                name=list(names),
                position=[figures[name] for name in names],
                effort=[half_widths.get(name, unknown) for name in names],
            )
            message.header.stamp = time_message(monitor.seen_until or 0)
            self._result.publish(message)
