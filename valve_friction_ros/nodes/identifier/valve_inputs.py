# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The inputs of one valve: two topics of single samples, or one of blocks."""

import math
import time
from collections.abc import Callable, Sequence

from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64MultiArray

from valve_friction_ros.nodes.plumbing.messages import arrivals_of, readable, rows_of
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode
from valve_friction_ros.nodes.plumbing.polled_subscription import PolledSubscription, TakenMessage
from valve_friction_ros.nodes.plumbing.qos import blocks, stream
from valve_friction_ros.records.bags.topics import StreamNames
from valve_friction_ros.streams import Arrivals, Signal
from valve_friction_ros.wording import percentage

_SILENCE = 0.5
"""Time without messages, s, after which the quality of service is suspected."""
_SELDOM = 10.0
"""Time between two searches for blocks while topics arrive, s: each searches the whole graph."""
_PLAYER = "rosbag2_player"
"""Name of the node of `ros2 bag play`."""


_LOSS_LIMIT = 1e-3
"""Share of lost messages that raises a warning. Chosen: single samples are interpolated, and a
network may lose a message now and then."""
_LOSS_IS_OVER = 5.0
"""Time without a loss, s, after which the warning ends."""


class _Input(PolledSubscription):
    """One topic, with messages that may be held back."""

    _held_back: Sequence[TakenMessage] = ()

    def take(self, is_all: bool = False) -> list[TakenMessage]:
        held_back, self._held_back = self._held_back, ()
        return [*held_back, *super().take(is_all)]

    def until(self, taken: list[TakenMessage], received: int) -> list[TakenMessage]:
        """Return the messages received until a time, ns; hold back the rest for the next time."""
        early = [one for one in taken if one.received <= received]
        self._held_back = [one for one in taken if one.received > received]
        return early

    def loss_problem(self) -> str | None:
        """Describe the loss of messages if it deserves a warning, else return None."""
        losses = self.losses
        if losses.silence > _LOSS_IS_OVER or losses.share < _LOSS_LIMIT:
            return None
        published = losses.recently_lost + losses.recently_taken
        return (
            f"{percentage(losses.share)} of the messages on {self.topic} were lost in the "
            f"last minute ({losses.recently_lost} of {published}): they arrive faster than this "
            "process can take them, or the network drops them; publish fewer messages, or blocks "
            "on ~/samples"
        )

    def senders_problem(self) -> str | None:
        """Describe publishers that send at once, else return None: their samples are mixed."""
        if (count := self.senders) < 2:
            return None
        found = self._node.get_publishers_info_by_topic(self.topic)
        nodes = {f"{one.node_namespace.rstrip('/')}/{one.node_name}" for one in found}
        return (
            f"{count} publishers send {self.topic} at the same time, from "
            f"{' and '.join(sorted(nodes))}: stop all but one, or give the others topics of their "
            "own"
        )

    def follow(self) -> None:
        if self.silence() > _SILENCE and self.follow_publishers():
            quality = self.quality.reliability.name.lower()
            self._node.get_logger().info(f"{self.topic} is received as {quality}, as published")


class ValveInputs:
    """Takes the samples of a valve from its topics and passes them on in blocks.

    An empty `joint` means the first joint of a message. `drop` is called for malformed messages on
    the topic of a signal.
    """

    def __init__(
        self,
        node: PolledNode,
        joint: str,
        hand_on: Callable[[Arrivals], None],
        drop: Callable[[Signal, int], None],
    ) -> None:
        self._node, self._joint = node, joint
        self._hand_on, self._drop = hand_on, drop
        self._pressure = _Input(node, FluidPressure, "actuator_pressure", stream(), raw=True)
        self._stem = _Input(node, JointState, "stem_state", stream(), raw=True)
        self._blocks = _Input(node, Float64MultiArray, "~/samples", blocks(), is_optional=True)
        self._inputs = (self._pressure, self._stem, self._blocks)
        self._looked = -math.inf
        self._bad_block: str | None = None

    @property
    def names(self) -> StreamNames:
        """The fully resolved topics, and the joint."""
        return StreamNames(self._pressure.topic, self._stem.topic, self._joint)

    def values(self) -> dict[str, str]:
        """Return the values of the diagnostic: sources and losses of the samples."""
        pressure, stem, joint = self.names
        values = {"pressure_topic": pressure, "stem_topic": stem, "stem_joint": joint}
        for name, one in zip(("pressures", "positions", "blocks"), self._inputs, strict=True):
            if (losses := one.losses).lost:
                values[f"{name} lost [messages]"] = str(losses.lost)
                values[f"{name} lost [%]"] = f"{100 * losses.share:.3g}"
        return values

    def take(self, is_all: bool = False) -> None:
        """Take the samples that have arrived: a fair share per turn, or all with `is_all`.

        If one signal exceeds its share, the other waits for it.
        """
        pressures, stems = self._pressure.take(is_all), self._stem.take(is_all)
        taken = ((self._pressure, pressures), (self._stem, stems))
        full = [messages[-1].received for one, messages in taken if one.has_more and messages]
        if full and not is_all:
            pressures, stems = (one.until(messages, min(full)) for one, messages in taken)
        if pressures or stems:
            try:
                arrivals = arrivals_of(pressures, stems, self._joint)
            except RuntimeError:
                pressures = self._readable(Signal.PRESSURE, pressures, FluidPressure)
                stems = self._readable(Signal.POSITION, stems, JointState)
                arrivals = arrivals_of(pressures, stems, self._joint)
            self._hand_on(arrivals)
        if blocks := [taken.message for taken in self._blocks.take(is_all)]:
            self._take_blocks(blocks)

    def _readable(
        self, signal: Signal, taken: Sequence[TakenMessage], kind: type
    ) -> list[TakenMessage]:
        found = readable(taken, kind)
        if len(found) < len(taken):
            self._drop(signal, len(taken) - len(found))
        return found

    def follow_publishers(self) -> None:
        """Adapt to best-effort and reliable publishers; call this periodically.

        While blocks arrive the other topics are not checked, because each check searches the whole
        graph.
        """
        if self._blocks.silence() <= _SILENCE:
            return
        for one in (self._pressure, self._stem):
            one.follow()
        now = time.monotonic()
        silence = min(self._pressure.silence(), self._stem.silence())
        if silence > _SILENCE or now - self._looked > _SELDOM:
            self._looked = now
            self._blocks.follow()

    def is_played(self) -> bool:
        """Return whether a recording is replayed on the topics in use, from the middleware."""
        return any(
            publisher.node_name == _PLAYER
            for one in self._used()
            for publisher in self._node.get_publishers_info_by_topic(one.topic)
        )

    def _take_blocks(self, blocks: Sequence[Float64MultiArray]) -> None:
        """Pass on all blocks together: each call costs as much as a thousand samples."""
        try:
            arrivals = rows_of(blocks)
        except ValueError as error:
            if len(blocks) > 1:
                for block in blocks:
                    self._take_blocks([block])
                return
            self._bad_block = f"a block on {self._blocks.topic}: {error}"
        else:
            self._bad_block = None
            self._hand_on(arrivals)

    def problems(self, timeout: float) -> list[str]:
        """Describe the problems of the inputs, such as silence for `timeout` seconds.

        A valve needs either blocks or the two topics of samples, not both.
        """
        found = [] if self._bad_block is None else [self._bad_block]
        problems = [one.problem(timeout) for one in self._used()]
        problems += [one.senders_problem() for one in self._inputs]
        problems += [one.loss_problem() for one in self._inputs]
        return found + [problem for problem in problems if problem is not None]

    def _used(self) -> tuple[_Input, ...]:
        """Return the blocks if the last samples came in blocks or only blocks are offered."""
        topics, blocks = (self._pressure, self._stem), self._blocks
        since_topics = min(one.silence() for one in topics)
        return (blocks,) if blocks.silence() <= since_topics and blocks.is_used() else topics
