# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Publications of an identifier: the status of its valve, and the latched topics."""

import math
import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray, MultiArrayDimension, MultiArrayLayout

from valve_friction_ros.health.diagnosis import Diagnosis, dead_band, dead_band_half_width
from valve_friction_ros.health.friction_monitor import FrictionMonitor
from valve_friction_ros.health.levels import Finding, Level, StatusSignal, Survey, by_severity
from valve_friction_ros.history import HistoryEntry, Trend
from valve_friction_ros.history.status_values import (
    baseline_values,
    exact_time,
    ratio_values,
    result_values,
    trend_values,
)
from valve_friction_ros.identification.published.sweep import Sweep
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import SLIDING, UNITS
from valve_friction_ros.nodes.plumbing.messages import time_message
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode, learns_of_all_topics
from valve_friction_ros.nodes.plumbing.qos import LATCHED
from valve_friction_ros.wording import Code, said, sentence


def estimate_status(
    monitor: FrictionMonitor,
    name: str,
    hardware_id: str,
    findings: Sequence[Finding],
    trend: Trend | None,
    alarms: Mapping[str, str],
) -> DiagnosticStatus:
    """Compose the knowledge about a valve; the unit of a number is in its key.

    The status changes only with this knowledge: it gives the time of the estimate rather than its
    age, and nothing about the inputs. `alarms` are further values. The findings follow the
    diagnosis of friction; the most severe of all sets the level.
    """
    diagnosis, findings = monitor.diagnosis(), by_severity(findings)
    level, signal = diagnosis.level, diagnosis.status_signal
    if findings and findings[0].level > level:
        level, signal = findings[0].level, findings[0].status_signal
    estimate = monitor.estimate
    found = {} if estimate is None else estimate.parameters
    frictions = [found[name] for name in (SLIDING, "coulomb_friction") if name in found]
    trouble = monitor.internal_error or monitor.refusal
    valid = trouble is None and any(math.isfinite(one.value) for one in frictions)
    reason = trouble or ("" if valid or not frictions else frictions[0].reason)
    values: dict[str, str] = {
        "estimate_valid": str(valid).lower(),
        "reason": reason,
        "NE 107": signal.value,
    }
    if estimate is not None and monitor.stamp is not None:
        values["estimate_time"] = exact_time(monitor.stamp)
        values["estimate_from"] = "this run" if monitor.earlier is None else "before the restart"
        values |= result_values(estimate, monitor.settings.valve)
    values |= baseline_values(monitor.baseline)
    values |= ratio_values(diagnosis.ratio)
    if diagnosis.survey is not Survey.UNKNOWN:
        values["survey"] = diagnosis.survey.value
    values |= trend_values(trend)
    values |= alarms
    message = "; ".join(_sentences(monitor, diagnosis, findings))
    return _status(level, name, hardware_id, message, values)


def _sentences(
    monitor: FrictionMonitor, diagnosis: Diagnosis, findings: Sequence[Finding]
) -> list[str]:
    """Return the messages on a valve, one sentence each.

    The latest identification comes first. If a finding on friction leads instead, the
    identification is given with its time.
    """
    leading = [one.message for one in findings if one.leads]
    told = diagnosis.statement
    if leading and monitor.seen_until is not None:
        told = said(Code.DATED_EARLIER, of=told, time=monitor.seen_until)
    return [*leading, sentence(told), *(one.message for one in findings if not one.leads)]


def friction_status(
    estimate: DiagnosticStatus,
    monitor: FrictionMonitor,
    now: int,
    input_problems: Sequence[str],
    upkeep_problems: Sequence[str],
    more: Mapping[str, str],
    findings: Sequence[Finding],
    is_watched: bool,
) -> DiagnosticStatus:
    """Compose the status of a valve at the time `now`, ns, from its estimate.

    Problems of the inputs raise the level to at least WARN, and so do problems of the upkeep, which
    leave the diagnosis valid. An earlier estimate is shown with its age. `more` holds further
    values. A valve whose samples are unusable is not watched, and is never reported as normal.
    """
    values = {one.key: one.value for one in estimate.values}
    level, signal = Level(estimate.level[0]), StatusSignal(values["NE 107"])
    if input_problems and level < Level.WARN:
        level, signal = Level.WARN, StatusSignal.CHECK_FUNCTION
    elif upkeep_problems and level < Level.WARN:
        level, signal = Level.WARN, StatusSignal.MAINTENANCE_REQUIRED
    values["NE 107"] = signal.value
    if monitor.stamp is not None:
        values["estimate_age [s]"] = f"{(now - monitor.stamp) / 1e9:.3f}"
    values |= more
    pressures, positions = monitor.buffer.counts
    values["buffered_samples"] = str(pressures + positions)
    values["buffered_pressures"] = str(pressures)
    values["buffered_positions"] = str(positions)
    values["samples_taken"] = str(monitor.buffer.taken)
    rejected = monitor.buffer.rejected
    values["samples_rejected"] = str(sum(rejected.values()))
    if rejected:
        causes = sorted(f"{cause} ({count})" for cause, count in rejected.items())
        values["samples_rejected causes"] = "; ".join(causes)
    known = _sentences(monitor, monitor.diagnosis(now, is_watched), by_severity(findings))
    message = "; ".join([*input_problems, *upkeep_problems, *known])
    return _status(level, estimate.name, estimate.hardware_id, message, values)


def stuck_status(name: str, hardware_id: str, problem: str) -> DiagnosticStatus:
    """Compose the status of a valve whose node is stuck, fails or cannot start."""
    values = {"estimate_valid": "false", "NE 107": StatusSignal.CHECK_FUNCTION.value}
    return _status(Level.ERROR, name, hardware_id, problem, values)


def fail(status: DiagnosticStatus, failures: Sequence[str]) -> None:
    """Turn a status into that of a failing node; its message follows the cause."""
    status.level = bytes([Level.ERROR])
    status.message = "; ".join([*failures, status.message])
    for entry in status.values:
        if entry.key == "NE 107":
            entry.value = StatusSignal.CHECK_FUNCTION.value


def _status(
    level: Level, name: str, hardware_id: str, message: str, values: Mapping[str, str]
) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=bytes([level]),
        name=name,
        hardware_id=hardware_id,
        message=message,
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )


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
"""Time between two searches for a subscriber, over the duration of a search in the graph."""
_FRICTIONS = (*UNITS, SLIDING)


def _sweep_message(sweep: Sweep | None) -> Float64MultiArray:
    """Return the table of a sweep: one row per threshold, columns named in the second label.

    It is empty for a method without a sweep, so that it replaces an older latched sweep.
    """
    if sweep is None:
        return Float64MultiArray()
    columns: Mapping[str, np.ndarray] = {
        "threshold": sweep.thresholds,
        **sweep.estimates,
        "sigma": sweep.sigma,
        "r_squared": sweep.r_squared,
        "samples": sweep.samples.astype(np.float64),
    }
    table = np.column_stack([*columns.values()])
    rows, width = table.shape
    return Float64MultiArray(
        layout=MultiArrayLayout(
            dim=[
                MultiArrayDimension(label="threshold", size=rows, stride=math.prod(table.shape)),
                MultiArrayDimension(label=",".join(columns), size=width, stride=width),
            ]
        ),
        data=table.ravel().tolist(),
    )


class EstimateTopic:
    """Publishes all knowledge about the valve in one message whenever it changes.

    The publisher is created once the topic has a subscriber, if that can be seen. Without the
    parameter `estimate_topic` nothing is done.
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
        """Publish a status if it has changed."""
        if self._is_wanted and self._publisher is None:
            self._look_for_subscriber()
        if self._publisher is not None and status != self._last:
            self._last = status
            self._publisher.publish(status)

    def _look_for_subscriber(self) -> None:
        """Create the publisher once there is a subscriber; costs a ten-thousandth of a core."""
        begun = time.monotonic()
        if begun < self._look_at:
            return
        if not learns_of_all_topics() or self._node.count_subscribers(self._topic):
            self._publisher = self._node.create_publisher(DiagnosticStatus, self._topic, LATCHED)
            del self._node.offered[self._topic]
        now = time.monotonic()
        self._look_at = now + _LOOKS_COST * (now - begun)


class NumberTopics:
    """Publishes a result as numbers: all in one stamped message, and each on its own topic.

    The parameters `result_topic` and `number_topics` enable them.
    """

    def __init__(self, node: Node) -> None:
        self._result: Publisher | None = None
        if node.get_parameter("result_topic").value:
            self._result = node.create_publisher(JointState, "~/result", LATCHED)
        self._numbers: list[tuple[str, str, Publisher]] = []
        self._sweep: Publisher | None = None
        if node.get_parameter("number_topics").value:
            self._numbers = [
                (kind, name, node.create_publisher(Float64, f"~/{kind}/{name}", LATCHED))
                for kind, names in (
                    ("friction", (*_FRICTIONS, *_FIGURES)),
                    ("half_width", _FRICTIONS),
                    ("published", UNITS),
                )
                for name in names
            ]
            self._sweep = node.create_publisher(Float64MultiArray, "~/sweep", LATCHED)

    def publish(self, result: Result | HistoryEntry, monitor: FrictionMonitor) -> None:
        """Publish a result accepted by the monitor, or the stored numbers of an earlier result."""
        ratio = monitor.diagnosis().ratio
        unknown = float("nan")
        if isinstance(result, Result):
            evidence, fit, rms = result.evidence, result.fit, result.rms
            sweep = None if result.estimate is None else result.estimate.sweep
            if self._sweep is not None:
                self._sweep.publish(_sweep_message(sweep))
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
        numbers = {"friction": figures, "half_width": half_widths, "published": published}
        for kind, name, publisher in self._numbers:
            publisher.publish(Float64(data=numbers[kind].get(name, unknown)))
        if self._result is not None:
            half_widths["dead_band"] = dead_band_half_width(result, monitor.settings.valve)
            half_widths["friction_ratio"] = unknown if ratio is None else ratio.half_width
            names = (*_FRICTIONS, *_FIGURES)
            message = JointState(
                name=list(names),
                position=[figures[name] for name in names],
                effort=[half_widths.get(name, unknown) for name in names],
            )
            message.header.stamp = time_message(monitor.seen_until or 0)
            self._result.publish(message)
