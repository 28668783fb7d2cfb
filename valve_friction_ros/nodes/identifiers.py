"""Identifiers of many valves in one process, each in its valve's namespace."""

import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from rclpy.context import Context
from rclpy.node import Node
from rclpy.validate_namespace import validate_namespace

from valve_friction_ros.identification.preparation import compile_methods
from valve_friction_ros.nodes.identifier import parameters
from valve_friction_ros.nodes.identifier.node import Identifier
from valve_friction_ros.nodes.identifier.workers import Workers, running_workers
from valve_friction_ros.nodes.plumbing.parameters import ParameterSpec, declare_parameters
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode
from valve_friction_ros.nodes.plumbing.process_worker import ProcessWorker
from valve_friction_ros.nodes.plumbing.running import join_graph, run_nodes

__all__ = ["PARAMETERS", "identifiers_of_valves", "main"]

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


def identifiers_of_valves(
    workers: Workers, arguments: Sequence[str] | None = None
) -> Iterator[Node]:
    """Create the node `identifiers`, and an identifier for each valve of its parameter.

    Raises
    ------
    ValueError
        If no valve is named, or a valve is named twice, or ROS arguments remap a namespace.
    rclpy.exceptions.InvalidNamespaceException
        If a name cannot be a namespace.
    """
    host = PolledNode("identifiers")
    yield host
    declare_parameters(host, (_VALVES, _PROCESSES))
    valves = [valve for valve in host.get_parameter(_VALVES.name).value if valve]
    if not valves:
        raise ValueError("no valve is named: give the parameter valves, such as [fv_101, fv_102]")
    places = [f"/{valve.strip('/')}" for valve in valves]
    repeated = {place for place in places if places.count(place) > 1}
    if repeated:
        raise ValueError(f"valve {min(repeated)} is named twice: name each valve once")
    for place in places:
        validate_namespace(place)
    if processes := host.get_parameter(_PROCESSES.name).value:
        identify = ProcessWorker("identify", processes, compile_methods)
        workers = workers._replace(identify=identify)
    services = replace(_PARAMETER_SERVICES, default=len(places) <= _MANY)
    declare_parameters(host, (services,))
    context = host.context
    for number, place in enumerate(places):
        if number and number % _TOGETHER == 0:
            context = Context()
            join_graph(arguments, context)
        identifier = Identifier(
            workers,
            place,
            number_topics=len(places) <= _FEW,
            context=context,
            start_parameter_services=host.get_parameter(services.name).value,
        )
        yield identifier
        if identifier.get_namespace() != place:
            raise ValueError(
                f"the namespace {place} is remapped to {identifier.get_namespace()}: start without "
                "__ns, the valves have namespaces of their own"
            )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the nodes."""
    os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(_PROFILE))
    with running_workers() as workers:
        return run_nodes(lambda: identifiers_of_valves(workers, arguments), arguments)


if __name__ == "__main__":
    sys.exit(main())
