# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Identifiers of many valves in one process, each in its valve's namespace."""

import contextlib
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.clock import Clock, ClockType
from rclpy.context import Context
from rclpy.node import Node
from rclpy.validate_namespace import validate_namespace

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.nodes.identifier.node import Identifier
from valve_friction_ros.nodes.identifier.status import EstimateTopic, stuck_status
from valve_friction_ros.nodes.identifier.workers import running_workers
from valve_friction_ros.nodes.plumbing.parameters import declare_parameters
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode
from valve_friction_ros.nodes.plumbing.rclpy_private import PROFILES, parameter_overrides
from valve_friction_ros.nodes.plumbing.running import WRONG_REQUESTS, join_graph, run_nodes
from valve_friction_ros.nodes.plumbing.worker import InternalError, bugs_reported
from valve_friction_ros.settings import HOST

_FEW = 20
"""Number of valves up to which parameters have services. These and the alarm services are 25 of the
43 endpoints of a valve. Chosen: a host that joins some hundred valves already discovers thousands
of endpoints."""
_TOGETHER = 50
"""Number of valves that share a participant of the graph. The middleware compares each reader of a
participant with all its writers, so the time to start grows with the square of this number. A
participant takes 2 MB and eight threads."""
_PROFILE = Path(__file__).with_name("many_valves.xml")


class _FaultyValve(PolledNode):
    """Replaces the identifier of a valve that cannot start, and only publishes this problem."""

    def __init__(self, place: str, problem: str, context: Context) -> None:
        super().__init__(
            "identifier",
            namespace=place,
            context=context,
            start_parameter_services=False,
            start_type_description_service=False,
        )
        overrides = parameter_overrides(self)
        given, is_asked = overrides.get("valve_tag"), overrides.get("estimate_topic")
        self._tag = str(given.value) if given is not None and given.value else place.strip("/")
        self._problem = f"cannot start, so this valve is not monitored: {problem}"
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._estimate = EstimateTopic(self, is_asked is None or is_asked.value)
        self.create_timer(1.0, self._tell, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def stuck_status(self, problem: str) -> DiagnosticStatus:
        """Return the status of a valve that is not monitored."""
        name = f"{self.get_fully_qualified_name()}: friction"
        return stuck_status(name, self._tag, problem)

    def _tell(self) -> None:
        message = DiagnosticArray(status=[self.stuck_status(self._problem)])
        self._estimate.publish(message.status[0])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)


def _places(valves: Sequence[str]) -> list[str]:
    places = [f"/{valve.strip('/')}" for valve in valves if valve]
    if not places:
        raise ValueError("no valve is named: set the parameter valves, such as [fv_101, fv_102]")
    repeated = {place for place in places if places.count(place) > 1}
    if repeated:
        raise ValueError(f"valve {min(repeated)} is named twice: name each valve once")
    for place in places:
        validate_namespace(place)
    return places


def _identifiers_of_valves(
    opened: contextlib.ExitStack, arguments: Sequence[str] | None = None
) -> Iterator[Node]:
    """Create the node `identifiers`, and an identifier for each valve in its parameter.

    An identifier that cannot start is logged and replaced by a `_FaultyValve`. Shared resources are
    closed with `opened`. Raises ValueError if no valve is named, a valve is named twice, ROS
    arguments remap a namespace, or no valve can start; InvalidNamespaceException if a name is not a
    valid namespace.
    """
    host = PolledNode("identifiers")
    yield host
    *of_plant, services = HOST
    declare_parameters(host, of_plant)
    places = _places(host.get_parameter("valves").value)
    processes = host.get_parameter("identification_processes").value
    workers = opened.enter_context(running_workers(processes))
    declare_parameters(host, [replace(services, initial=len(places) <= _FEW)])
    context, faults = host.context, dict[str, str]()
    for number, place in enumerate(places):
        if number and number % _TOGETHER == 0:
            context = Context()
            join_graph(arguments, context)
        try:
            with bugs_reported(host, *WRONG_REQUESTS):
                identifier = Identifier(
                    workers,
                    place,
                    context=context,
                    start_parameter_services=(tells := host.get_parameter(services.name).value),
                    start_type_description_service=tells,
                )
        except (*WRONG_REQUESTS, InternalError, RefusalError) as error:
            faults[place] = " ".join(str(error).split())
            yield _FaultyValve(place, faults[place], context)
            continue
        yield identifier
        if identifier.get_namespace() != place:
            raise ValueError(
                f"the namespace {place} is remapped to {identifier.get_namespace()}: start "
                "without __ns, because each valve has its own namespace"
            )
    lines = [f"{place}/identifier: {problem}" for place, problem in faults.items()]
    if len(faults) == len(places):
        raise ValueError("; ".join(lines))
    for line in lines:
        host.get_logger().error(
            f"cannot start {line}: correct it and start again; the other valves are monitored"
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the nodes."""
    if "FASTRTPS_DEFAULT_PROFILES_FILE" not in os.environ:  # Kilted still reads it
        os.environ.setdefault(PROFILES, str(_PROFILE))
    with contextlib.ExitStack() as opened:
        return run_nodes(lambda: _identifiers_of_valves(opened, arguments), arguments)


if __name__ == "__main__":
    sys.exit(main())
