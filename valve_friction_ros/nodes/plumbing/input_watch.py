"""Watch over an input topic: whether it arrives, and if not, why."""

import time

from rclpy.node import Node
from rclpy.subscription import Subscription

__all__ = ["InputWatch"]

_LEASE = 20.0
"""Time, s, after which the middleware (Fast DDS) forgets a node that has ended without farewell. A
reliable publisher of long queues serves a new node only then."""


class InputWatch:
    """Says what is wrong with one subscribed topic; silence is real time, also with sim time."""

    def __init__(self, node: Node, subscription: Subscription) -> None:
        self._node = node
        self._topic = subscription.topic_name
        package = subscription.msg_type.__module__.split(".")[0]
        self._type = f"{package}/msg/{subscription.msg_type.__name__}"
        self._since = time.monotonic()
        self._has_arrived = False

    @property
    def topic(self) -> str:
        """The topic, fully resolved."""
        return self._topic

    def arrived(self) -> None:
        """Note that a message has come."""
        self._since = time.monotonic()
        self._has_arrived = True

    def silence(self) -> float:
        """Return the time since the last message, or the start, s."""
        return time.monotonic() - self._since

    def is_used(self) -> bool:
        """Return whether a message has ever come, or the topic has a publisher."""
        return self._has_arrived or self._node.count_publishers(self._topic) > 0

    def problem(self, timeout: float) -> str | None:
        """Say what is wrong if nothing has come for `timeout` seconds, else None."""
        silence = self.silence()
        if silence <= timeout:
            return None
        publishers = self._node.get_publishers_info_by_topic(self._topic)
        others = sorted({info.topic_type for info in publishers} - {self._type})
        if not publishers:
            cause = "nobody publishes it"
        elif others:
            cause = f"it is published as {', '.join(others)}, not {self._type}"
        else:
            cause = "its publisher is silent"
            if not self._has_arrived and silence < _LEASE:
                cause += (
                    f", or still waits for a node that was killed, for up to {_LEASE:g} s: wait"
                )
        return f"no data on {self._topic} for {silence:.1f} s: {cause}"
