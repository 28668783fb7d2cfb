"""Identifiers of many valves in one process, each in its valve's namespace."""

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

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.identification.preparation import compile_methods
from valve_friction_ros.nodes.identifier import parameters
from valve_friction_ros.nodes.identifier.node import Identifier
from valve_friction_ros.nodes.identifier.status import stuck_status
from valve_friction_ros.nodes.identifier.workers import Workers, running_workers
from valve_friction_ros.nodes.plumbing.background import InternalError, bugs_reported
from valve_friction_ros.nodes.plumbing.parameters import ParameterSpec, declare_parameters
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode
from valve_friction_ros.nodes.plumbing.process_worker import ProcessWorker
from valve_friction_ros.nodes.plumbing.qos import LATCHED
from valve_friction_ros.nodes.plumbing.running import WRONG_REQUESTS, join_graph, run_nodes

__all__ = ["PARAMETERS", "FaultyValve", "identifiers_of_valves", "main"]

_VALVES = ParameterSpec(
    "valves", [""], "Namespaces of the valves, an identifier each [-]", read_only=True
)
_FEW = 4
"""Valves up to which each number has a topic of its own. Chosen: some 100 topics, which joining
programs meet within a second or two."""
_PROCESSES = ParameterSpec(
    "identification_processes",
    0,
    "Processes beside this one that identify, each on a core of its own [-]; 0: a thread of it",
    (0, 64),
    read_only=True,
)
_PARAMETER_SERVICES = ParameterSpec(
    "parameter_services",
    True,
    "Whether the parameters of the valves can be read and changed while they run [-]; not for more "
    "than 100 valves unless told: it doubles what a process costs at its start",
    read_only=True,
)
_OWN = (_VALVES, _PROCESSES, _PARAMETER_SERVICES)
_MANY = 100
"""Valves up to which parameters have services. Chosen: a start of some seconds."""
_TOGETHER = 50
"""Valves that share a participant of the graph. The middleware compares each reader of a
participant with all its writers, so that the start would take the square of their number; a
participant takes 2 MB and eight threads."""
_PROFILE = Path(__file__).with_name("many_valves.xml")
PARAMETERS = (*_OWN, *parameters.PARAMETERS)
"""Its own, and those of its identifiers."""


class FaultyValve(PolledNode):
    """Stands in for the identifier of a valve that cannot start: it says so, and does no more.

    Parameters
    ----------
    place : str
        Namespace of the valve.
    problem : str
        Why it cannot start.
    context : Context
        The participant of the graph.
    """

    def __init__(self, place: str, problem: str, context: Context) -> None:
        super().__init__(
            "identifier", namespace=place, context=context, start_parameter_services=False
        )
        overrides = getattr(self, "_parameter_overrides", {})  # rclpy offers no other way to them
        given = overrides.get(parameters.VALVE_TAG.name)
        self._tag = str(given.value) if given is not None and given.value else place.strip("/")
        self._problem = f"cannot start, so nobody watches this valve: {problem}"
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_publisher(DiagnosticStatus, "~/estimate", LATCHED).publish(self._status())
        self.create_timer(1.0, self._tell, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def stuck_status(self, problem: str) -> DiagnosticStatus:
        """Return the status of a valve that nobody monitors."""
        name = f"{self.get_fully_qualified_name()}: friction"
        return stuck_status(name, self._tag, problem)

    def _status(self) -> DiagnosticStatus:
        return self.stuck_status(self._problem)

    def _tell(self) -> None:
        message = DiagnosticArray(status=[self._status()])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)


def _places(valves: Sequence[str]) -> list[str]:
    """Return the namespaces of valves by their names."""
    places = [f"/{valve.strip('/')}" for valve in valves if valve]
    if not places:
        raise ValueError("no valve is named: give the parameter valves, such as [fv_101, fv_102]")
    repeated = {place for place in places if places.count(place) > 1}
    if repeated:
        raise ValueError(f"valve {min(repeated)} is named twice: name each valve once")
    for place in places:
        validate_namespace(place)
    return places


def identifiers_of_valves(
    workers: Workers, arguments: Sequence[str] | None = None
) -> Iterator[Node]:
    """Create the node `identifiers`, and an identifier for each valve of its parameter.

    One that cannot start is logged, and a `FaultyValve` stands in for it.

    Raises
    ------
    ValueError
        If no valve is named, or a valve is named twice, or ROS arguments remap a namespace, or no
        valve can start.
    rclpy.exceptions.InvalidNamespaceException
        If a name cannot be a namespace.
    """
    host = PolledNode("identifiers")
    yield host
    declare_parameters(host, (_VALVES, _PROCESSES))
    places = _places(host.get_parameter(_VALVES.name).value)
    if processes := host.get_parameter(_PROCESSES.name).value:
        identify = ProcessWorker("identify", processes, compile_methods)
        workers = workers._replace(identify=identify)
    services = replace(_PARAMETER_SERVICES, default=len(places) <= _MANY)
    declare_parameters(host, (services,))
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
                    number_topics=len(places) <= _FEW,
                    context=context,
                    start_parameter_services=host.get_parameter(services.name).value,
                )
        except (*WRONG_REQUESTS, InternalError, RefusalError) as error:
            faults[place] = " ".join(str(error).split())
            yield FaultyValve(place, faults[place], context)
            continue
        yield identifier
        if identifier.get_namespace() != place:
            raise ValueError(
                f"the namespace {place} is remapped to {identifier.get_namespace()}: start without "
                "__ns, the valves have namespaces of their own"
            )
    lines = [f"{place}/identifier: {problem}" for place, problem in faults.items()]
    if len(faults) == len(places):
        raise ValueError("; ".join(lines))
    for line in lines:
        host.get_logger().error(
            f"cannot start {line}: correct it and start again; the other valves are watched"
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the nodes."""
    os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(_PROFILE))
    with running_workers() as workers:
        return run_nodes(lambda: identifiers_of_valves(workers, arguments), arguments)


if __name__ == "__main__":
    sys.exit(main())
