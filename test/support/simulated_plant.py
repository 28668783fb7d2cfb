# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Diagnostics of many made-up valves, as identifiers publish them; also a process of its own."""

import math
import os
import random
import signal
import time
from datetime import datetime, timezone

KINDS = ("good", "good", "good", "good", "grown", "excessive", "leaking", "new", "check")
_BEGIN = time.time()
_LEVELS = {"good": 0, "grown": 1, "excessive": 2, "leaking": 2, "new": 0, "check": 1}
_SIGNALS = {"good": "", "grown": "M", "excessive": "F", "leaking": "S", "new": "", "check": "C"}
_RATIOS = {"good": 1.02, "grown": 1.44, "excessive": 2.31, "leaking": 0.41, "check": 1.05}
_SENTENCES = {
    "good": "friction normal: {r} times the baseline; the stem ignores reversals smaller than "
    "{d} % of its travel",
    "grown": "friction has grown to {r} times the baseline: plan work on the packing",
    "excessive": "excessive friction: {r} times the baseline: work on the packing now",
    "leaking": "friction has collapsed to {r} times the baseline: check the packing for leakage",
    "new": "no baseline: friction 642 ± 12 N; call ~/set_baseline on the healthy valve",
    "check": "no messages on {n}/stem_state: start its publisher; friction normal: {r} times",
}


def values_of_valve(index, beat=0, tag=None):
    """(name, level, hardware_id, message, values) of a valve at a beat, the same in each run."""
    chance = random.Random(index)
    kind = KINDS[index % len(KINDS)]
    node = f"/area_{1 + index // 40}/fv_{101 + index}"
    friction = chance.uniform(150, 900)
    factor = _RATIOS.get(kind, 1.0) * chance.uniform(0.96, 1.05)
    now, half = friction * factor, friction * chance.uniform(0.01, 0.06)
    stiffness = chance.uniform(1.5e5, 2.6e5)
    dead = 100 * 2 * now / stiffness / 0.028575
    made = _BEGIN - chance.uniform(60, 86400 * 9)
    stamp = datetime.fromtimestamp(made, timezone.utc)
    values = {
        "estimate_valid": "true",
        "reason": "",
        "NE 107": _SIGNALS[kind],
        "estimate_time": f"{stamp:%Y-%m-%dT%H:%M:%S.%fZ}",
        "estimate_from": "this run",
    }
    for name, unit, value, width, verdict, reason in (
        ("mass", "kg", 1.6, 0.0, "fixed", "assumed"),
        ("viscous_friction", "N·s/m", 5300.0, 410.0, "identified", ""),
        ("coulomb_friction", "N", now, half, "identified", ""),
        ("static_friction", "N", math.nan, math.nan, "not identifiable", "no slip jump was seen"),
        ("spring_constant", "N/m", stiffness, 900.0, "identified", ""),
        ("spring_preload", "N", 231.0, 14.0, "weak", "the record holds few strokes"),
        ("sliding_friction", "N", now + 9.0, half, "identified", ""),
    ):
        values[f"{name} [{unit}]"] = f"{value:.9g}"
        values[f"{name} half width [{unit}]"] = f"{width:.9g}"
        values[f"{name} verdict"] = verdict
        if reason:
            values[f"{name} reason"] = reason
    values |= {
        "sliding_speed [m/s]": "0.0042",
        "dead_band [%]": f"{dead:.9g}",
        "dead_band half width [%]": f"{dead * half / now:.9g}",
        "fit [%]": "98.7",
        "rms [µm]": "31.2",
        "method": "plant",
        "fixed": "mass",
        "warnings": "",
    }
    if kind != "new":
        values |= {
            "baseline_coulomb_friction [N]": f"{friction:.9g}",
            "baseline half width [N]": f"{half:.9g}",
            "friction_ratio": f"{factor:.9g}",
            "friction_ratio low": f"{factor * 0.93:.9g}",
            "friction_ratio high": f"{factor * 1.08:.9g}",
            "friction_ratio of": "coulomb_friction",
        }
    if kind == "grown":
        values |= {
            "friction_drift [N/month]": "21.4",
            "friction_drift half width [N/month]": "4.2",
            "friction_drift of": "Coulomb friction",
            "limit_expected": "error_ratio",
            "limit_expected [date]": "2027-02-11",
            "limit_expected earliest [date]": "2027-01-03",
            "limit_expected latest [date]": "2027-04-02",
        }
    values |= {
        "estimate_age [s]": f"{time.time() - made:.3f}",
        "evidence moves": str(40 + beat % 7),
        "travelled_distance [m]": f"{812.4 + 0.01 * beat:.9g}",
        "reversals": str(15210 + beat),
        "breakaways": str(9120 + beat),
        "time_watched [s]": str(860000 + beat),
        "buffered_samples": str(2 * (600 + beat % 3)),
        "buffered_pressures": str(600 + beat % 3),
        "buffered_positions": str(600 + beat % 3),
    }
    words = _SENTENCES[kind].format(r=f"{factor:.2f}", d=f"{dead:.1f}", n=node)
    tag = f"FV-{101 + index}" if tag is None else tag
    return f"{node}/identifier: friction", _LEVELS[kind], tag, words, values


def status_of(index, beat=0, tag=None):
    """The same as a message of ROS."""
    from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

    name, level, hardware, words, values = values_of_valve(index, beat, tag)
    return DiagnosticStatus(
        level=bytes([level]),
        name=name,
        hardware_id=hardware,
        message=words,
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )


def hear(plant, status, at):
    """Have the store of a plant hear a status."""
    from valve_friction_ros.dashboard import Unread

    plant.hear(Unread(status.name, lambda: status), at)


def publish_until_stopped(count):
    """Publish the diagnostics of `count` valves, each at 1 Hz, an array each, spread evenly."""
    import rclpy
    from diagnostic_msgs.msg import DiagnosticArray
    from rclpy.qos import QoSProfile
    from rclpy.serialization import serialize_message
    from rclpy.signals import SignalHandlerOptions

    stopped = []
    for request in (signal.SIGINT, signal.SIGTERM):
        signal.signal(request, lambda *_: stopped.append(True))
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("simulated_plant", enable_rosout=False)
    publisher = node.create_publisher(DiagnosticArray, "/diagnostics", QoSProfile(depth=1000))
    messages = [
        [serialize_message(DiagnosticArray(status=[status_of(index, beat)])) for beat in (0, 1)]
        for index in range(count)
    ]
    begin, beat = time.monotonic(), 0
    while not stopped:
        for index in range(count):
            due = begin + beat + index / count
            if (wait := due - time.monotonic()) > 0.005:
                time.sleep(wait)
            publisher.publish(messages[index][beat % 2])
        beat += 1
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    publish_until_stopped(int(os.environ.get("VALVES", "9")))
