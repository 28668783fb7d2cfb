# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The identifier in its obvious form: typed subscriptions and rclpy's default executor."""

import sys
from collections.abc import Callable

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import FluidPressure, JointState

from valve_friction_ros.nodes.identifier import node as identifier
from valve_friction_ros.nodes.identifier.workers import running_workers
from valve_friction_ros.nodes.plumbing.messages import position_of, stamp_of
from valve_friction_ros.nodes.plumbing.polled_subscription import InputWatch
from valve_friction_ros.nodes.plumbing.qos import qos_overrides, stream
from valve_friction_ros.records.bags.topics import StreamNames
from valve_friction_ros.streams import RecordBuffer


class TypedInputs:
    """Both topics, with each message deserialised by rclpy and processed separately."""

    def __init__(self, node: Node, joint: str, hand_on: Callable, _: Callable) -> None:
        self._buffer: RecordBuffer = hand_on.__self__._monitor.buffer  # noqa: SLF001
        self._joint = joint
        self._watches = []
        for kind, topic, callback in (
            (FluidPressure, "actuator_pressure", self._on_pressure),
            (JointState, "stem_state", self._on_stem),
        ):
            made = node.create_subscription(
                kind, topic, callback, stream(), qos_overriding_options=qos_overrides()
            )
            type_name = f"sensor_msgs/msg/{kind.__name__}"
            self._watches.append(InputWatch(node, made.topic_name, type_name))

    def _on_pressure(self, message: FluidPressure) -> None:
        self._watches[0].arrived()
        self._buffer.add_pressure(stamp_of(message.header.stamp), message.fluid_pressure)

    def _on_stem(self, message: JointState) -> None:
        self._watches[1].arrived()
        stamp = stamp_of(message.header.stamp)
        self._buffer.add_position(stamp, position_of(message, self._joint))

    @property
    def names(self) -> StreamNames:
        """Fully resolved topics, and the joint."""
        return StreamNames(*(watch.topic for watch in self._watches), self._joint)

    def follow_publishers(self) -> None:
        """Do nothing: the publishers of the benchmark are reliable."""

    def take(self, is_all: bool = False) -> None:
        """Do nothing: every message has been processed."""

    def values(self) -> dict[str, str]:
        """Return nothing: samples are not counted."""
        return {}

    def problems(self, timeout: float) -> list[str]:
        """Return the problems of the inputs."""
        return [told for watch in self._watches if (told := watch.problem(timeout))]


def main() -> int:
    """Run the node in the default executor until interrupted."""
    identifier.ValveInputs = TypedInputs
    for create in ("create_publisher", "create_subscription"):  # with their event callbacks
        setattr(identifier.Identifier, create, getattr(Node, create))
    rclpy.init()
    with running_workers() as workers:
        node = identifier.Identifier(workers)
        try:
            rclpy.spin(node)
        except (KeyboardInterrupt, ExternalShutdownException):
            pass
        finally:
            node.destroy_node()
            rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
