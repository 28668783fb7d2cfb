# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Whether each sample arrived, and whether `/diagnostics` never fell silent."""

import shutil
import time
from pathlib import Path

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from std_srvs.srv import Trigger

from benchmark.churn.ledger import Ledger
from benchmark.churn.places import AUDITED, RATE, STREAMS
from benchmark.churn.visitor import Visitor

__all__ = ["audit", "missing_samples"]

_PERIOD = 25.0
"""Time between two looks into the buffer, s: less than half of what it holds."""


def _stamps(bag: Path) -> dict[str, np.ndarray]:
    types = get_typestore(Stores.ROS2_JAZZY)
    found: dict[str, list[int]] = {topic: [] for topic in STREAMS}
    with Reader(bag) as reader:
        for connection, _, raw in reader.messages():
            stamp = types.deserialize_cdr(raw, connection.msgtype).header.stamp
            found[connection.topic].append(stamp.sec * 1_000_000_000 + stamp.nanosec)
    return {topic: np.array(stamps) for topic, stamps in found.items()}


def missing_samples(stamps: np.ndarray) -> int:
    """Return how many samples lack between the first and the last stamp (ns) of a signal."""
    return 0 if stamps.size == 0 else round(np.ptp(stamps) * RATE / 1e9) + 1 - stamps.size


def audit(ledger: Ledger, seconds: float) -> None:
    """Save the buffer of the audited identifier again and again, and count what it lacks."""
    visitor = Visitor(ledger, "auditor")
    published: list[float] = []
    visitor.node.create_subscription(
        DiagnosticArray, "/diagnostics", lambda message: _note(message, published), 1000
    )
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        visitor.spin(_PERIOD)
        published.append(time.time())  # a silence that lasts counts too
        answer = visitor.call(Trigger, f"{AUDITED}/save", Trigger.Request())
        if answer is None or not answer.success:
            ledger.add("unsaved", message=getattr(answer, "message", "no answer"))
            continue
        bag = Path(answer.message)
        for topic, stamps in _stamps(bag).items():
            ledger.add(
                "samples",
                topic=topic,
                first=int(stamps.min(initial=2**62)),
                last=int(stamps.max(initial=0)),
                count=stamps.size,
                missing=missing_samples(stamps),
            )
        shutil.rmtree(bag)
        if len(published) > 1:
            ledger.add("diagnostics", longest=float(np.diff(published).max()))
            del published[:-1]
    visitor.close()


def _note(message: DiagnosticArray, published: list[float]) -> None:
    if any(status.name.startswith(AUDITED) for status in message.status):
        stamp = message.header.stamp
        published.append(stamp.sec + stamp.nanosec / 1e9)
