# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Process that publishes the topics of many valves, made from what one identifier has published.

The messages are serialised beforehand, so that the process itself takes little of the machine. Each
second one valve is identified anew.
"""

import argparse
import math
import random
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from copy import deepcopy
from datetime import datetime, timezone
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.signals import SignalHandlerOptions

from valve_friction_ros.nodes.plumbing.qos import LATCHED

_BEGIN = time.time()
_BEATS = 4
"""Beats after which the counters of a valve repeat."""
_COUNTERS = ("reversals", "breakaways", "buffered_samples")
_KINDS = (
    (0, "", 1.0, "friction normal"),
    (0, "", 1.03, "friction normal"),
    (1, "M", 1.44, "friction has grown"),
    (0, "", 0.98, "friction normal"),
    (2, "F", 2.31, "excessive friction"),
    (0, "", 1.01, "friction normal"),
    (0, "", 1.05, "friction normal"),
    (2, "S", 0.41, "friction has collapsed"),
    (0, "", math.nan, "no baseline: call ~/set_baseline on the healthy valve"),
)
"""Level, letter of NE 107, ratio (nan without a baseline) and first words of the diagnosis."""
_SCALED = ("coulomb_friction", "sliding_friction", "dead_band", "static_friction")


def ratio_of(index: int) -> float | None:
    """Return the friction of a valve over its baseline, or None without a baseline."""
    ratio = _KINDS[index % len(_KINDS)][2]
    return None if math.isnan(ratio) else ratio


def identifier_of(index: int) -> str:
    """Return the name of the identifier of a valve."""
    return f"/area_{1 + index // 40}/fv_{1001 + index}/identifier"


def tag_of(index: int) -> str:
    """Return the tag of a valve."""
    return f"{10 + index // 40}-FV-{1001 + index}"


def status_of(template: DiagnosticStatus, index: int, beat: int) -> DiagnosticStatus:
    """Return the status of a valve at a beat: the template with its own numbers."""
    anew = beat >= _BEATS
    chance = random.Random(1000 * index + (beat if anew else 0))
    level, letter, ratio, words = _KINDS[index % len(_KINDS)]
    ratio *= chance.uniform(0.98, 1.02)
    size = random.Random(index).uniform(0.5, 2.0)
    made = time.time() if anew else _BEGIN - chance.uniform(60, 86_400)
    own = {
        "NE 107": letter,
        "estimate_time": f"{datetime.fromtimestamp(made, timezone.utc):%Y-%m-%dT%H:%M:%S.%fZ}",
        "friction_ratio": f"{ratio:.9g}",
        "friction_ratio low": f"{ratio * 0.95:.9g}",
        "friction_ratio high": f"{ratio * 1.05:.9g}",
    }
    status = deepcopy(template)
    status.name = f"{identifier_of(index)}: friction"
    status.hardware_id = tag_of(index)
    status.level = bytes([level])
    status.message = words
    if not math.isnan(ratio):
        figures = f"{ratio:.2f} ({ratio * 0.95:.2f} to {ratio * 1.05:.2f})"
        status.message += f": sliding friction is {figures} times its baseline"
    status.values = [
        KeyValue(
            key=value.key, value=own.get(value.key, _own(value, beat, size, ratio_of(index) or 1.0))
        )
        for value in template.values
        if not (math.isnan(ratio) and value.key.startswith(("friction_ratio", "baseline")))
    ]
    return status


def _own(value: KeyValue, beat: int, size: float, ratio: float) -> str:
    """Return a value for a valve with friction scaled by `size` and grown by `ratio`."""
    if value.key.partition(" ")[0] in _COUNTERS:
        return str(15_000 + beat % _BEATS)
    factor = size if value.key.startswith("baseline") else size * ratio
    if value.key.startswith((*_SCALED, "baseline")) and value.key.endswith("]"):
        return f"{float(value.value) * factor:.9g}"
    return str(value.value)


def _diagnostics(status: DiagnosticStatus) -> bytes:
    return serialize_message(DiagnosticArray(status=[status]))


def _due(count: int) -> Iterator[tuple[int, int]]:
    """Yield beat and index of each valve when due, evenly spread over each beat of a second."""
    begin, beat = time.monotonic(), 0
    while True:
        for index in range(count):
            due = begin + beat + index / count
            if (wait := due - time.monotonic()) > 0.005:
                time.sleep(wait)
            yield beat, index
        beat += 1


def _publish(node: Node, template: DiagnosticStatus, count: int, is_still: bool) -> Iterator[None]:
    """Publish; unless the plant is still, identify the next valve at each beat."""
    diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 1000)
    estimates = [
        node.create_publisher(DiagnosticStatus, f"{identifier_of(index)}/estimate", LATCHED)
        for index in range(count)
    ]
    known = [[status_of(template, index, beat) for beat in range(_BEATS)] for index in range(count)]
    arrays = [[_diagnostics(status) for status in beats] for beats in known]
    latched = [[serialize_message(status) for status in beats] for beats in known]
    del known
    print("publishing", flush=True)  # the parent process waits for this
    for beat, index in _due(count):
        if not is_still and index == beat % count and beat >= _BEATS:
            anew = status_of(template, index, beat)
            arrays[index] = [_diagnostics(anew)] * _BEATS
            latched[index] = [serialize_message(anew)] * _BEATS
        diagnostics.publish(arrays[index][beat % _BEATS])
        estimates[index].publish(latched[index][beat % _BEATS])
        yield


def main(arguments: Sequence[str] | None = None) -> int:
    """Publish until SIGTERM."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("template", type=Path, help="a serialised DiagnosticStatus")
    parser.add_argument("--valves", type=int, default=500)
    parser.add_argument("--still", action="store_true", help="no valve is identified anew")
    options = parser.parse_args(arguments)
    stopped: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: stopped.append(number))
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("plant", enable_rosout=False, start_parameter_services=False)
    template = deserialize_message(options.template.read_bytes(), DiagnosticStatus)
    for _ in _publish(node, template, options.valves, options.still):
        if stopped:
            break
    node.destroy_node()
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
