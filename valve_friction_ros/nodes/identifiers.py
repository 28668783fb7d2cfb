"""Identifiers of many valves in one process, each in its valve's namespace."""

import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

from rclpy.node import Node

from valve_friction_ros.nodes.identifier import PAUSE, Identifier, identification_worker
from valve_friction_ros.nodes.parameters import ParameterSpec, declare_parameters
from valve_friction_ros.nodes.running import run_nodes

__all__ = ["identifiers_of_valves", "main"]

_VALVES = ParameterSpec(
    "valves", [""], "Namespaces of the valves, an identifier each [-]", read_only=True
)


def identifiers_of_valves(worker: ThreadPoolExecutor) -> Iterator[Node]:
    """Create the node `identifiers`, and an identifier for each valve of its parameter.

    Raises
    ------
    ValueError
        If no valve is named, or two identifiers would have the same name.
    """
    host = Node("identifiers")
    yield host
    declare_parameters(host, (_VALVES,))
    valves = [valve for valve in host.get_parameter(_VALVES.name).value if valve]
    if not valves:
        raise ValueError("no valve is named: give the parameter valves, such as [fv_101, fv_102]")
    names: set[str] = set()
    for valve in valves:
        identifier = Identifier(worker, valve)
        yield identifier
        name = identifier.get_fully_qualified_name()
        if name in names:
            raise ValueError(
                f"two identifiers would be {name}: name each valve once, and do not remap __ns"
            )
        names.add(name)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the nodes."""
    with identification_worker() as worker:
        return run_nodes(lambda: identifiers_of_valves(worker), arguments, pause=PAUSE)


if __name__ == "__main__":
    sys.exit(main())
