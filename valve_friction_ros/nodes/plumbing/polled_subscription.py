"""Subscriptions whose messages are taken when the node asks for them.

An executor that waits for a subscription looks at every entity of all its nodes for each message:
0.3 cores for two topics at 1 kHz. An executor that the middleware calls for each message is
cheaper, but rclpy has it as an experiment only, and its callbacks run under the middleware's locks,
which has frozen nodes. So the streams are emptied some 20 times a second.

rclpy offers no public method that takes a message. Its own executors and ``wait_for_message`` use
``Subscription.handle.take_message``, and so does this file, and no other. Checked with rclpy 7.1.6.
"""

import time
from typing import Any, NamedTuple

from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription

from valve_friction_ros.nodes.plumbing.polled_node import NeverReady, PolledNode
from valve_friction_ros.nodes.plumbing.qos import qos_overrides
from valve_friction_ros.streams import LossCounter, Losses

__all__ = ["PolledSubscription", "TakenMessage"]


_MOST = 3_000
"""Messages that are taken in a turn: some 30 ms of work, so that a storm on one valve holds up the
others no longer. At ten turns a second that is 30 kHz."""


class TakenMessage(NamedTuple):
    """A message, and when it was received, ns of the system's clock."""

    message: Any
    received: int


class PolledSubscription:
    """A subscription that no executor waits for.

    Its history, depth and reliability can be overridden by ``qos_overrides.…`` parameters. The
    depth of `quality` must hold what arrives between two calls of `take`. With `raw` messages are
    taken as they came, serialised.

    Attributes
    ----------
    has_more : bool
        Whether the last call of `take` may have left some messages.
    """

    def __init__(
        self, node: PolledNode, kind: type, topic: str, quality: QoSProfile, raw: bool = False
    ) -> None:
        self._node = node
        self._kind, self._raw = kind, raw
        self._subscription = self._subscribed(topic, quality, qos_overrides())
        self._reliability = quality.reliability  # as overridden
        self._counter = LossCounter()
        self.has_more = False

    def _subscribed(
        self, topic: str, quality: QoSProfile, overrides: QoSOverridingOptions | None
    ) -> Subscription:
        return self._node.create_subscription(
            self._kind,
            topic,
            self._refuse,
            quality,
            callback_group=NeverReady(),
            qos_overriding_options=overrides,
            raw=self._raw,
        )

    @staticmethod
    def _refuse(message: object) -> None:
        raise NotImplementedError(f"an executor has taken {message} from a polled subscription")

    @property
    def subscription(self) -> Subscription:
        """The subscription of rclpy."""
        return self._subscription

    def follow_publishers(self) -> bool:
        """Ask for what the publishers offer, if they are there; tell if that is something new.

        That is best effort, which hears all of them, if one of them is; else what was asked for
        at first. What has arrived and was not taken is lost, so this is for a silent topic.
        """
        topic, quality = self._subscription.topic_name, self._subscription.qos_profile
        if not self._node.count_publishers(topic):
            return False
        publishers = self._node.get_publishers_info_by_topic(topic)
        offered = {info.qos_profile.reliability for info in publishers}
        best_effort = ReliabilityPolicy.BEST_EFFORT in offered
        wanted = ReliabilityPolicy.BEST_EFFORT if best_effort else self._reliability
        if not offered or wanted == quality.reliability:
            return False
        self._node.destroy_subscription(self._subscription)
        quality.reliability = wanted
        self._subscription = self._subscribed(topic, quality, None)
        self._counter.forget()
        return True

    def take(self, is_all: bool = False) -> list[TakenMessage]:
        """Take what has arrived, oldest first.

        What exceeds 3,000 messages waits for the next turn; with `is_all` all is taken that the
        queue can have held at the call.
        """
        kind, raw = self._subscription.msg_type, self._subscription.raw
        most = max(_MOST, self._subscription.qos_profile.depth) if is_all else _MOST
        taken: list[TakenMessage] = []
        numbers: list[int | None] = []
        handle = self._subscription.handle
        with handle:  # so that nothing destroys it meanwhile
            while len(taken) < most and (found := handle.take_message(kind, raw)) is not None:
                message, details = found
                taken.append(TakenMessage(message, details["received_timestamp"]))
                numbers.append(details.get("publication_sequence_number"))
        if taken:
            now = time.monotonic()
            self._node.last_heard = now
            known = [number for number in numbers if number is not None]
            if len(known) == len(numbers):  # a middleware need not number them
                self._counter.take(known, now)
        self.has_more = len(taken) == most
        return taken

    @property
    def losses(self) -> Losses:
        """The messages that were published and not taken."""
        return self._counter.losses(time.monotonic())
