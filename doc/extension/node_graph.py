"""The topics and services of the nodes, as running nodes offer them."""

import contextlib
from collections import defaultdict
from collections.abc import Iterator
from functools import cache

from extension.markdown import Entry, definition_list
from extension.meanings import meanings, require_all

__all__ = ["Graph", "graph_as_markdown", "graph_of"]

_PLACE = "/valve"
_OF_EVERY_NODE = ("/rosout", "/parameter_events")

Graph = dict[str, dict[str, str]]
"""Type of each name, by ``subscribed``, ``published`` and ``services``."""


@contextlib.contextmanager
def _running(node: str) -> Iterator[object]:
    """Provide a node that is not spun, and keeps nothing."""
    import rclpy

    from valve_friction_ros.alerts import AlertSender
    from valve_friction_ros.nodes.dashboard.node import Dashboard
    from valve_friction_ros.nodes.identifier.node import Identifier
    from valve_friction_ros.nodes.identifier.workers import Workers
    from valve_friction_ros.nodes.plumbing.worker import Worker
    from valve_friction_ros.nodes.pressure_source import PressureSource
    from valve_friction_ros.nodes.simulator import Simulator

    workers = Workers(Worker("identify"), Worker("files"), Worker("evidence"), AlertSender())
    made = {
        "identifier": lambda: Identifier(workers),
        "dashboard": Dashboard,
        "simulator": Simulator,
        "pressure_source": PressureSource,
    }
    rclpy.init(args=["--ros-args", "-r", f"__ns:={_PLACE}", "-p", "history_file:=''"])
    try:
        created = made[node]()
        yield created
        created.destroy_node()
    finally:
        rclpy.shutdown()
        workers.alerts.close()


@cache
def graph_of(node: str) -> Graph:
    """Return what a node subscribes, publishes and offers, with types; ``~`` is its own name."""
    with _running(node) as running:
        own = f"{_PLACE}/{node}"
        found: Graph = {}
        for kind, ask in (
            ("subscribed", running.get_subscriber_names_and_types_by_node),
            ("published", running.get_publisher_names_and_types_by_node),
            ("services", running.get_service_names_and_types_by_node),
        ):
            found[kind] = {}
            for name, (type_, *_) in ask(node, _PLACE):
                if name in _OF_EVERY_NODE or "rcl_interfaces" in type_ or "type_desc" in type_:
                    continue
                short = name.replace(own, "~").removeprefix(f"{_PLACE}/")
                latched = [
                    "latched"
                    for one in running.get_publishers_info_by_topic(name)
                    if one.qos_profile.durability.name == "TRANSIENT_LOCAL"
                ]
                found[kind][short] = ", ".join(
                    [type_.replace("/msg/", "/").replace("/srv/", "/"), *latched[:1]]
                )
    return found


def _families(names: dict[str, str]) -> dict[str, tuple[str, list[str]]]:
    """Gather topics of one folder: type and names by ``~/folder/<name>``."""
    found: dict[str, tuple[str, list[str]]] = defaultdict(lambda: ("", []))
    for name, type_ in sorted(names.items()):
        folder, _, last = name.rpartition("/")
        is_one_of_many = folder.count("/") > 0
        key = f"{folder}/<name>" if is_one_of_many else name
        found[key] = type_, [*found[key][1], *([last] if is_one_of_many else [])]
    return found


def graph_as_markdown(node: str, kind: str) -> str:
    """Return one kind of a node's topics and services as a list of definitions."""
    said = meanings()["graph"][node].get(kind, {})
    found = _families(graph_of(node)[kind])
    require_all(f"{kind} of {node}", found, said)
    return "\n".join(
        definition_list(
            Entry(name, found[name][0], said[name].strip() + _list_of(found[name][1]))
            for name in said
        )
    )


def _list_of(names: list[str]) -> str:
    return f" Names: {', '.join(f'`{one}`' for one in names)}." if names else ""
