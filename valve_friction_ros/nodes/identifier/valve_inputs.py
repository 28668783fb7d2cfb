"""The inputs of one valve: two topics of single samples, or one of blocks."""

import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64MultiArray

from valve_friction_ros.nodes.plumbing.inputs import InputWatch
from valve_friction_ros.nodes.plumbing.messages import rows_of
from valve_friction_ros.nodes.plumbing.qos import blocks, qos_overrides, stream
from valve_friction_ros.nodes.plumbing.raw_samples import RawSamples
from valve_friction_ros.records.bags.topics import StreamNames
from valve_friction_ros.streams import Arrivals

__all__ = ["ValveInputs"]

_BLOCK = 256
"""Messages of the topics that are looked at together, if nobody asks before."""


class ValveInputs:
    """Receives the samples of a valve and hands them on by the block.

    A message of a topic is only kept as it came, serialised. All are decoded once there is a block
    of them, or when `flush` is called.

    Parameters
    ----------
    node : Node
        The node that subscribes.
    joint : str
        Joint of the stem; empty: the first.
    hand_on : callable
        Called with the arrivals.
    """

    def __init__(self, node: Node, joint: str, hand_on: Callable[[Arrivals], None]) -> None:
        self._node = node
        self._hand_on = hand_on
        self._joint = joint
        self._raw = RawSamples(joint)
        self._last_pressure = self._last_stem = 0.0
        self._pressure_watch = self._watch(
            FluidPressure, "actuator_pressure", self._on_pressure, raw=True
        )
        self._stem_watch = self._watch(JointState, "stem_state", self._on_stem, raw=True)
        self._block_watch = self._watch(Float64MultiArray, "~/samples", self._on_block)
        self._bad_block: str | None = None

    def _watch(
        self, kind: type, topic: str, callback: Callable[[Any], None], raw: bool = False
    ) -> InputWatch:
        subscription = self._node.create_subscription(
            kind,
            topic,
            callback,
            stream() if raw else blocks(),
            qos_overriding_options=qos_overrides(),
            raw=raw,
        )
        return InputWatch(self._node, subscription)

    def _on_pressure(self, message: bytes) -> None:
        self._raw.add_pressure(message)
        self._last_pressure = time.monotonic()
        if len(self._raw) >= _BLOCK:
            self.flush()

    def _on_stem(self, message: bytes) -> None:
        self._raw.add_stem(message)
        self._last_stem = time.monotonic()
        if len(self._raw) >= _BLOCK:
            self.flush()

    def _on_block(self, message: Float64MultiArray) -> None:
        self.flush()
        self._block_watch.arrived()
        try:
            arrivals = rows_of(message)
        except ValueError as error:
            self._bad_block = f"a block on {self._node.resolve_topic_name('~/samples')}: {error}"
            self._node.get_logger().warning(self._bad_block, throttle_duration_sec=5.0)
        else:
            self._bad_block = None
            self._hand_on(arrivals)

    @property
    def names(self) -> StreamNames:
        """The topics, fully resolved, and the joint."""
        return StreamNames(self._pressure_watch.topic, self._stem_watch.topic, self._joint)

    def flush(self) -> None:
        """Hand on what has come so far."""
        if not len(self._raw):
            return
        now = time.monotonic()
        if self._last_pressure:
            self._pressure_watch.arrived(now - self._last_pressure)
        if self._last_stem:
            self._stem_watch.arrived(now - self._last_stem)
        self._last_pressure = self._last_stem = 0.0
        self._hand_on(self._raw.take())

    def problems(self, timeout: float) -> list[str]:
        """Say what is wrong with the inputs if nothing has come for `timeout` seconds.

        A valve that is fed by blocks needs no topics, and one that has topics needs no blocks.
        """
        told = [] if self._bad_block is None else [self._bad_block]
        watches: tuple[InputWatch, ...] = (self._pressure_watch, self._stem_watch)
        if self._is_fed_by_blocks():
            watches = (self._block_watch,)
        return told + [found for watch in watches if (found := watch.problem(timeout)) is not None]

    def _is_fed_by_blocks(self) -> bool:
        """Tell whether blocks are what came last, or what is offered while nothing came."""
        since_topics = min(self._pressure_watch.silence(), self._stem_watch.silence())
        return self._block_watch.silence() <= since_topics and self._block_watch.is_used()
