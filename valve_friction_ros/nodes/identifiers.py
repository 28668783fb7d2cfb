"""Identifiers of many valves in one process, each in its valve's namespace."""

import sys
from collections.abc import Iterator, Sequence

from rclpy.node import Node
from rclpy.validate_namespace import validate_namespace

from valve_friction_ros.nodes.identifier import parameters
from valve_friction_ros.nodes.identifier.node import Identifier
from valve_friction_ros.nodes.identifier.workers import Workers, running_workers
from valve_friction_ros.nodes.plumbing.parameters import ParameterSpec, declare_parameters
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode
from valve_friction_ros.nodes.plumbing.running import run_nodes

__all__ = ["PARAMETERS", "identifiers_of_valves", "main"]

_VALVES = ParameterSpec(
    "valves", [""], "Namespaces of the valves, an identifier each [-]", read_only=True
)
_FEW = 4
"""Valves up to which each number has a topic of its own. Chosen: some 100 topics, which joining
programs meet within a second or two."""
PARAMETERS = (_VALVES, *parameters.PARAMETERS)
"""Its own, and those of its identifiers."""


def identifiers_of_valves(workers: Workers) -> Iterator[Node]:
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
    declare_parameters(host, (_VALVES,))
    valves = [valve for valve in host.get_parameter(_VALVES.name).value if valve]
    if not valves:
        raise ValueError("no valve is named: give the parameter valves, such as [fv_101, fv_102]")
    places = [f"/{valve.strip('/')}" for valve in valves]
    repeated = {place for place in places if places.count(place) > 1}
    if repeated:
        raise ValueError(f"valve {min(repeated)} is named twice: name each valve once")
    for place in places:
        validate_namespace(place)
    for place in places:
        identifier = Identifier(workers, place, number_topics=len(places) <= _FEW)
        yield identifier
        if identifier.get_namespace() != place:
            raise ValueError(
                f"the namespace {place} is remapped to {identifier.get_namespace()}: start without "
                "__ns, the valves have namespaces of their own"
            )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the nodes."""
    with running_workers() as workers:
        return run_nodes(lambda: identifiers_of_valves(workers), arguments)


if __name__ == "__main__":
    sys.exit(main())
