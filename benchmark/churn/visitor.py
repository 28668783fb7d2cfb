# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A participant that comes, asks and listens for some seconds, and goes: politely or not."""

import os
import random
import time
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.client import Client
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from benchmark.churn.ledger import Ledger
from benchmark.churn.places import AUDITED, IDENTIFIERS, NODES, SERVICES, STREAMS

__all__ = ["ANSWER_LIMIT", "Visitor", "visit"]

ANSWER_LIMIT = 5.0
"""Time, s, within which a call is to be answered."""
_HANG = 30.0
"""Time, s, after which a call will not be answered any more."""
_DISCOVERY = 30.0
_LONGEST_LISTENING = 2.0
_MOST_ACTS = 6


class Visitor:
    """A node in a context of its own.

    Parameters
    ----------
    ledger : Ledger
        Where each call is noted.
    name : str
        Name of the node.
    """

    def __init__(self, ledger: Ledger, name: str) -> None:
        self._ledger = ledger
        self._context = rclpy.Context()
        rclpy.init(args=[], context=self._context)
        self.node = rclpy.create_node(name, context=self._context, enable_rosout=False)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)

    def close(self) -> None:
        """Leave politely."""
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def spin(self, seconds: float) -> None:
        """Listen for a while."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)

    def call(self, kind: type, name: str, request: Any) -> Any:
        """Call a service, and note how it answered; return the answer, None without one."""
        client: Client = self.node.create_client(kind, name)
        try:
            begin = time.monotonic()
            if not client.wait_for_service(_DISCOVERY):
                self._ledger.add("undiscovered", service=name)
                return None
            found = time.monotonic()
            answer = self._answer(client, request)
            self._ledger.add(
                "call",
                service=name,
                discovery=found - begin,
                seconds=None if answer is None else time.monotonic() - found,
                success=getattr(answer, "success", None),
                message=getattr(answer, "message", ""),
            )
            since = time.time()
            if answer is None and self._answer(client, request) is None:
                self._ledger.add("unanswered twice", service=name, since=since)
            return answer
        finally:
            self.node.destroy_client(client)

    def _answer(self, client: Client, request: Any) -> Any:
        future = client.call_async(request)
        self._executor.spin_until_future_complete(future, _HANG)
        return future.result() if future.done() else None


def _trigger(visitor: Visitor, chance: random.Random) -> None:
    identifier = chance.choice(IDENTIFIERS)
    (name,) = chance.choices([*SERVICES], [*SERVICES.values()])
    if not (name == "clear" and identifier == AUDITED):
        visitor.call(Trigger, f"{identifier}/{name}", Trigger.Request())


def _parameters(visitor: Visitor, chance: random.Random) -> None:
    node = chance.choice(NODES)
    listed = visitor.call(ListParameters, f"{node}/list_parameters", ListParameters.Request())
    if listed is None:
        return
    names = chance.sample(listed.result.names, 3)
    visitor.call(GetParameters, f"{node}/get_parameters", GetParameters.Request(names=names))
    describe = DescribeParameters.Request(names=names)
    visitor.call(DescribeParameters, f"{node}/describe_parameters", describe)
    # Accepted by the identifiers, refused by the others.
    value = ParameterValue(
        type=ParameterType.PARAMETER_DOUBLE, double_value=chance.uniform(1.1, 1.5)
    )
    change = SetParameters.Request(parameters=[Parameter(name="warn_ratio", value=value)])
    visitor.call(SetParameters, f"{node}/set_parameters", change)


def _listen(visitor: Visitor, chance: random.Random) -> None:
    kinds = [(DiagnosticArray, "/diagnostics"), (FluidPressure, STREAMS[0])]
    kinds += [(JointState, STREAMS[1]), (Float64, f"{AUDITED}/friction/coulomb_friction")]
    subscriptions = [
        visitor.node.create_subscription(
            kind,
            topic,
            lambda _: None,
            QoSProfile(depth=chance.choice((1, 100, 5000)), reliability=chance.choice(_RELIABLE)),
            raw=chance.random() < 0.5,
        )
        for kind, topic in chance.sample(kinds, chance.randint(1, len(kinds)))
    ]
    visitor.spin(chance.uniform(0.05, _LONGEST_LISTENING))
    for subscription in subscriptions:
        visitor.node.destroy_subscription(subscription)


_RELIABLE = (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT)


def _look_around(visitor: Visitor, chance: random.Random) -> None:
    visitor.spin(chance.uniform(0.0, 0.5))
    for name, _ in visitor.node.get_topic_names_and_types():
        visitor.node.get_publishers_info_by_topic(name)
    visitor.node.get_service_names_and_types()
    visitor.node.get_node_names_and_namespaces()


def _publish_elsewhere(visitor: Visitor, chance: random.Random) -> None:
    publishers = [
        visitor.node.create_publisher(FluidPressure, f"/fv_{chance.randint(900, 910)}/pressure", 10)
        for _ in range(chance.randint(1, 5))
    ]
    for publisher in publishers:
        publisher.publish(FluidPressure(fluid_pressure=1e5))
    visitor.spin(chance.uniform(0.0, 0.5))
    for publisher in publishers:
        visitor.node.destroy_publisher(publisher)


_ACTS = {_trigger: 4, _parameters: 1, _listen: 2, _look_around: 1, _publish_elsewhere: 1}


def visit(ledger: Ledger, number: int, chance: random.Random) -> None:
    """Come, act some times, and go; one in four leaves without a word to the others."""
    visitor = Visitor(ledger, f"visitor_{number}")
    for _ in range(chance.randint(1, _MOST_ACTS)):
        (act,) = chance.choices([*_ACTS], [*_ACTS.values()])
        act(visitor, chance)
    if chance.random() < 0.25:
        os._exit(0)
    visitor.close()
