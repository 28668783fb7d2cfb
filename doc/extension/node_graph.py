# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The topics and services of the nodes, as running nodes offer them."""

import contextlib
import shutil
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from extension.markdown import Entry, definition_list
from extension.meanings import meanings, require_all

__all__ = ["Graph", "graph_as_markdown", "graph_of"]

_PLACE = "/valve"
_TOPICS = ("estimate_topic", "result_topic", "number_topics")
_ASKED = [
    word
    for given in ("history_file:=''", *(f"{name}:=true" for name in _TOPICS))
    for word in ("-p", given)
]
"""What is asked for beside what is there in any case."""
_OF_EVERY_NODE = ("/rosout", "/parameter_events")

Graph = dict[str, dict[str, str]]
"""Type of each name, by ``subscribed``, ``published`` and ``services``."""


def _a_test(folder: Path) -> list[object]:
    """Return the parameters of a player with a test to play."""
    from rclpy.parameter import Parameter

    file = folder / "test.csv"
    file.write_text("time_s,pressure_pa\n0,1e5\n1,1e5\n", encoding="utf-8")
    values = {"file": str(file), "file_maximum": 2e5, "position_maximum": 0.02}
    return [Parameter(name, value=value) for name, value in values.items()]


@contextlib.contextmanager
def _running(node: str) -> Iterator[object]:
    """Provide a node that is not spun, and keeps nothing."""
    import rclpy

    from valve_friction_ros.alerts import AlertSender
    from valve_friction_ros.health import DigestDesk
    from valve_friction_ros.nodes.dashboard import Dashboard
    from valve_friction_ros.nodes.identifier.node import Identifier
    from valve_friction_ros.nodes.identifier.workers import HistoryThread, Workers
    from valve_friction_ros.nodes.plumbing.worker import Worker
    from valve_friction_ros.nodes.pressure_source import PressureSource
    from valve_friction_ros.nodes.simulator import Simulator
    from valve_friction_ros.nodes.stroke_player import StrokePlayer

    some = (Worker(name) for name in ("identify", "files", "evidence"))
    workers = Workers(
        lambda work, *arguments: work(*arguments),
        next(some),
        next(some),
        HistoryThread(),
        next(some),
        AlertSender(),
        DigestDesk(),
    )
    made = {
        "identifier": lambda: Identifier(workers),
        "dashboard": Dashboard,
        "simulator": Simulator,
        "pressure_source": PressureSource,
        "stroke_player": lambda: StrokePlayer(parameter_overrides=_a_test(folder)),
    }
    rclpy.init(args=["--ros-args", "-r", f"__ns:={_PLACE}", *_ASKED])
    folder = Path(tempfile.mkdtemp())
    try:
        created = made[node]()
        yield created
        created.destroy_node()
    finally:
        rclpy.shutdown()
        shutil.rmtree(folder)
        workers.alerts.close()


@cache
def graph_of(node: str) -> Graph:
    """Return what a node subscribes, publishes and offers, with types; ``~`` is its own name."""
    with _running(node) as running:
        own = f"{_PLACE}/{node}"
        awaited = [(topic, [type_]) for topic, type_ in running.awaited.items()]
        found: Graph = {}
        for kind, ask in (
            (
                "subscribed",
                lambda *place: [*running.get_subscriber_names_and_types_by_node(*place), *awaited],
            ),
            ("published", running.get_publisher_names_and_types_by_node),
            ("services", running.get_service_names_and_types_by_node),
        ):
            found[kind] = {}
            if kind == "published":
                for name, type_ in running.offered.items():
                    found[kind][name.replace(own, "~")] = f"{type_.replace('/msg/', '/')}, latched"
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
