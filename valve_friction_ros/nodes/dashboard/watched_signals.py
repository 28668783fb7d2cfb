# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Signals of the valves whose pages are open."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from sensor_msgs.msg import FluidPressure, JointState

from valve_friction_ros.dashboard.live_state import Sources
from valve_friction_ros.dashboard.live_strip import LiveStrip
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode
from valve_friction_ros.nodes.plumbing.polled_subscription import PolledSubscription
from valve_friction_ros.nodes.plumbing.qos import watched
from valve_friction_ros.nodes.plumbing.raw_samples import (
    positions_in,
    pressures_in,
    readable,
)
from valve_friction_ros.outside_text import printable

_SPAN = 60.0
"""Seconds of signal that are shown."""


@dataclass
class _Watch:
    strip: LiveStrip
    lookers: int = 0
    sources: Sources = field(default_factory=Sources)
    streams: tuple[PolledSubscription, ...] = ()

    def follow(self, node: PolledNode, sources: Sources) -> None:
        """Subscribe to the topics of the valve, anew where they have changed."""
        if sources != self.sources:
            self.end()
            self.sources, self.strip.trouble = sources, ""
            if sources.pressure_topic and sources.stem_topic:
                self._begin(node)

    def _begin(self, node: PolledNode) -> None:
        """Subscribe to both topics or to none: their names come from outside."""
        topics = (self.sources.pressure_topic, self.sources.stem_topic)
        for kind, topic in zip((FluidPressure, JointState), topics, strict=True):
            try:
                made = PolledSubscription(node, kind, topic, watched(), raw=True)
            except Exception as error:  # noqa: BLE001 - rclpy's, where the name is none of a topic
                self._destroy()
                about = printable(str(error).partition("\n")[0], 200)
                self.strip.trouble = f"{printable(topic, 100)!r} cannot be subscribed to: {about}"
                return
            self.streams += (made,)

    def _destroy(self) -> None:
        for stream in self.streams:
            stream.end()
        self.streams = ()

    def end(self) -> None:
        """End the subscriptions."""
        self._destroy()
        self.sources = Sources()

    def take(self) -> None:
        """Hand over what has arrived; what is no such message is left out."""
        if not self.streams:
            return
        pressures, stems = (
            readable(stream.take(), kind)
            for stream, kind in zip(self.streams, (FluidPressure, JointState), strict=True)
        )
        if pressures:
            self.strip.add(0, *pressures_in([one.message for one in pressures]))
        if stems:
            found = positions_in([one.message for one in stems], self.sources.joint)
            known = np.isfinite(found.values)
            self.strip.add(1, found.stamps[known], found.values[known])


class WatchedSignals:
    """Subscribes to what an identifier subscribes to, as long as somebody looks.

    Pages count in and out from any thread; the node's thread subscribes.

    Parameters
    ----------
    sources_of : callable
        Returns the topics of a valve, by the name of its identifier.
    """

    def __init__(self, sources_of: Callable[[str], Sources]) -> None:
        self._sources_of = sources_of
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

    def rest(self) -> None:
        """Unsubscribe from all, until the next step; in the node's thread."""
        with self._lock:
            watches = [*self._watches.values()]
        for watch in watches:
            watch.end()

    def step(self, node: PolledNode) -> None:
        """Subscribe, take and unsubscribe; in the node's thread."""
        with self._lock:
            watches, dropped = dict(self._watches), self._dropped
            self._dropped = []
        for watch in dropped:
            watch.end()
        for name, watch in watches.items():
            watch.follow(node, self._sources_of(name))
            watch.take()
