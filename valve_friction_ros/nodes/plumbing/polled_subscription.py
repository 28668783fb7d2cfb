# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Subscriptions whose messages the node takes when it wants them.

An executor that waits for a subscription checks every entity of all its nodes for each message: 0.3
cores for two topics at 1 kHz. An executor that the middleware calls for each message is cheaper,
but in rclpy it is only experimental, and its callbacks run under locks of the middleware, which has
frozen nodes. The streams are therefore emptied about 20 times a second.

An rclpy executor that ignores callback groups delivers the messages one by one, and so does every
executor if `rclpy_private` finds no other way. They are then buffered here until they are taken.
"""

import time
from collections import deque
from typing import Any, NamedTuple

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription

from valve_friction_ros.nodes.plumbing.polled_node import (
    NeverReady,
    PolledNode,
    learns_of_all_topics,
)
from valve_friction_ros.nodes.plumbing.qos import qos_overrides
from valve_friction_ros.nodes.plumbing.rclpy_private import (
    heeds_groups,
    take_messages,
    takes_directly,
)
from valve_friction_ros.streams import LossCounter, Losses

_MOST = 3_000
"""Largest number of messages taken in a turn: about 30 ms of work, so a burst on one valve delays
the others no longer than that. At ten turns a second this is 30 kHz."""


_LEASE = 20.0
"""Time, s, after which the middleware (Fast DDS) drops a node that has ended without notice. A
reliable publisher with long queues serves a new node only then."""


class TakenMessage(NamedTuple):
    """A message and its time of receipt, ns of the system clock."""

    message: Any
    received: int


class InputWatch:
    """Detects problems of a subscribed `topic`; silence is in real time, even with sim time."""

    def __init__(self, node: Node, topic: str, type_name: str) -> None:
        self._node = node
        self.topic, self.type_name = topic, type_name
        self._since = time.monotonic()
        self._has_arrived = False

    def arrived(self) -> None:
        """Record the arrival of a message."""
        self._since = time.monotonic()
        self._has_arrived = True

    def silence(self) -> float:
        """Return the time since the last message, or since the start, s."""
        return time.monotonic() - self._since

    def is_used(self) -> bool:
        """Return whether a message has ever arrived or the topic has a publisher."""
        return self._has_arrived or self._node.count_publishers(self.topic) > 0

    def problem(self, timeout: float) -> str | None:
        """Describe the problem if no message has arrived for `timeout` s, else return None."""
        silence = self.silence()
        if silence <= timeout:
            return None
        publishers = self._node.get_publishers_info_by_topic(self.topic)
        others = sorted({info.topic_type for info in publishers} - {self.type_name})
        if not publishers:
            cause = "it has no publisher"
        elif others:
            cause = f"it is published as {', '.join(others)}, not {self.type_name}"
        else:
            cause = "its publisher is silent"
            if not self._has_arrived and silence < _LEASE:
                cause += (
                    f", or it is still waiting for a node that was killed: wait up to {_LEASE:g} s"
                )
        return f"no data on {self.topic} for {silence:.1f} s: {cause}"


class PolledSubscription(InputWatch):
    """A subscription that no executor waits for, if this can be avoided.

    Parameters ``qos_overrides.…`` can override history, depth and reliability. The depth of
    `quality` must suffice for the messages between two calls of `take`. With `raw`, messages stay
    serialised. With `is_optional`, the subscription joins the graph only once `follow_publishers`
    finds a publisher, if it can; until then its topic is among those `awaited` by the node.

    Attributes
    ----------
    topic : str
        Fully resolved topic.
    type_name : str
        Type of the messages, such as ``sensor_msgs/msg/JointState``.
    has_more : bool
        Whether the last call of `take` may have left messages behind.
    """

    _node: PolledNode

    def __init__(
        self,
        node: PolledNode,
        kind: type,
        topic: str,
        quality: QoSProfile,
        raw: bool = False,
        is_optional: bool = False,
    ) -> None:
        type_name = f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"
        super().__init__(node, node.resolve_topic_name(topic), type_name)
        self._kind, self._raw, self._quality = kind, raw, quality
        self._handed_over: deque[tuple[Any, dict[str, Any]]] = deque(maxlen=quality.depth)
        self._counter = LossCounter()
        self.has_more = False
        self._subscription: Subscription | None = None
        if is_optional and learns_of_all_topics() and not node.count_publishers(self.topic):
            node.awaited[self.topic] = self.type_name
        else:
            self._begin()

    def _begin(self) -> None:
        self._subscription = self._subscribed(self._quality, qos_overrides())
        self._reliability = self._quality.reliability  # as overridden

    def _subscribed(
        self, quality: QoSProfile, overrides: QoSOverridingOptions | None
    ) -> Subscription:
        made = self._node.create_subscription(
            self._kind,
            self.topic,
            self._hand_over,
            quality,
            callback_group=NeverReady(),
            qos_overriding_options=overrides,
            raw=self._raw,
        )
        if not takes_directly(made):
            made.callback_group = ReentrantCallbackGroup()
            made.callback_group.add_entity(made)
        return made

    def _hand_over(self, message: Any) -> None:
        """Buffer a message taken by an executor; beyond the depth the oldest is dropped.

        The callback does not ask for message info, because rclpy's EventsExecutor would fail.
        """
        self._handed_over.append((message, {"received_timestamp": time.time_ns()}))

    @property
    def quality(self) -> QoSProfile:
        """The requested quality of service."""
        return self._quality if self._subscription is None else self._subscription.qos_profile

    def end(self) -> None:
        """Unsubscribe."""
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
            self._subscription = None

    def follow_publishers(self) -> bool:
        """Adapt the reliability to that of the publishers, if any; return whether it changed.

        If any publisher is best effort, the subscription becomes best effort, which receives from
        all of them; else it returns to its first reliability. Messages not yet taken are lost, so
        call this for a silent topic.
        """
        if not self._node.count_publishers(self.topic):
            return False
        if self._subscription is None:
            del self._node.awaited[self.topic]
            self._begin()
        quality = self.quality
        publishers = self._node.get_publishers_info_by_topic(self.topic)
        offered = {info.qos_profile.reliability for info in publishers}
        best_effort = ReliabilityPolicy.BEST_EFFORT in offered
        wanted = ReliabilityPolicy.BEST_EFFORT if best_effort else self._reliability
        if not offered or wanted == quality.reliability:
            return False
        self.end()
        quality.reliability = wanted
        self._subscription = self._subscribed(quality, None)
        self._counter.forget()
        return True

    def take(self, is_all: bool = False) -> list[TakenMessage]:
        """Take the messages that have arrived, oldest first.

        Messages beyond 3,000 wait for the next turn. With `is_all` it takes as many as the queue
        can have held at the time of the call.
        """
        if self._subscription is None:
            return []
        most = max(_MOST, self.quality.depth) if is_all else _MOST
        found: list[tuple[Any, dict[str, Any]]] = []
        while self._handed_over and len(found) < most:
            found.append(self._handed_over.popleft())
        # Where the executor takes them too, the order would be lost.
        if takes_directly(self._subscription) and heeds_groups(self._node.executor):
            found += take_messages(self._subscription, most - len(found))
        taken = [TakenMessage(message, details["received_timestamp"]) for message, details in found]
        numbers = [details.get("publication_sequence_number") for _, details in found]
        if taken:
            now = time.monotonic()
            self._node.last_heard = now
            self.arrived()
            known = [number for number in numbers if number is not None]
            if len(known) == len(numbers):  # not every middleware numbers messages
                self._counter.take(known, now)
        self.has_more = len(taken) == most
        return taken

    @property
    def senders(self) -> int:
        """Number of publishers that have been sending at once for a while, 0 if unknown."""
        return self._counter.senders(time.monotonic())

    @property
    def losses(self) -> Losses:
        """Messages that were published but not taken."""
        return self._counter.losses(time.monotonic())
