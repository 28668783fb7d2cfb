"""Signals of the valves whose pages are open."""

import threading
from dataclasses import dataclass, field

import numpy as np
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import FluidPressure, JointState

from valve_friction_ros.dashboard.live_strip import LiveStrip
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode
from valve_friction_ros.nodes.plumbing.polled_subscription import PolledSubscription
from valve_friction_ros.nodes.plumbing.raw_samples import (
    positions_in,
    pressures_in,
    readable,
)

__all__ = ["WatchedSignals"]

_SPAN = 60.0
"""Seconds of signal that are shown."""


def _quality() -> QoSProfile:
    """Take what is published either way, without holding a publisher up."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=5000,
        reliability=ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.VOLATILE,
    )


@dataclass
class _Watch:
    strip: LiveStrip
    lookers: int = 0
    streams: list[PolledSubscription] = field(default_factory=list)


class WatchedSignals:
    """Subscribes to what an identifier subscribes to, as long as somebody looks.

    Pages count in and out from any thread; the node's thread subscribes.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._watches: dict[str, _Watch] = {}
        self._dropped: list[_Watch] = []

    def watch(self, node: str) -> LiveStrip:
        """Count a page in; return where its samples go."""
        with self._lock:
            watch = self._watches.setdefault(node, _Watch(LiveStrip(_SPAN)))
            watch.lookers += 1
            return watch.strip

    def unwatch(self, node: str) -> None:
        """Count a page out."""
        with self._lock:
            watch = self._watches.get(node)
            if watch is None:
                return
            watch.lookers -= 1
            if watch.lookers <= 0:
                self._dropped.append(self._watches.pop(node))

    def step(self, node: PolledNode) -> None:
        """Subscribe, take and unsubscribe; in the node's thread."""
        with self._lock:
            watches, dropped = dict(self._watches), self._dropped
            self._dropped = []
        for watch in dropped:
            for stream in watch.streams:
                node.destroy_subscription(stream.subscription)
        for name, watch in watches.items():
            if not watch.streams:
                watch.streams = _subscribed(node, name)
            _take(watch)


def _subscribed(node: PolledNode, identifier: str) -> list[PolledSubscription]:
    """Subscribe to the pressure and the stem of an identifier; to none until both are known."""
    namespace, _, name = identifier.rpartition("/")
    try:
        topics = node.get_subscriber_names_and_types_by_node(name, namespace or "/")
    except Exception:  # noqa: BLE001 - rclpy's NodeNameNonExistentError and kin: it is not there
        return []
    found = {}
    for topic, kinds in topics:
        for kind, type_name in (
            (FluidPressure, "sensor_msgs/msg/FluidPressure"),
            (JointState, "sensor_msgs/msg/JointState"),
        ):
            if type_name in kinds:
                found.setdefault(kind, topic)
    if len(found) < 2:
        return []
    return [
        PolledSubscription(node, kind, found[kind], _quality(), raw=True)
        for kind in (FluidPressure, JointState)
    ]


def _take(watch: _Watch) -> None:
    """Hand over what has arrived; what is no such message is left out."""
    if not watch.streams:
        return
    pressures, stems = (
        readable(stream.take(), kind)
        for stream, kind in zip(watch.streams, (FluidPressure, JointState), strict=True)
    )
    if pressures:
        watch.strip.add(0, *pressures_in([one.message for one in pressures]))
    if stems:
        found = positions_in([one.message for one in stems], "")
        known = np.isfinite(found.values)
        watch.strip.add(1, found.stamps[known], found.values[known])
