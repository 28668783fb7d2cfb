# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The rooms of the package: imports point one way, and what is public is there and described."""

import ast
import importlib
import inspect
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from processes import printed

PACKAGE = "valve_friction_ros"
SOURCES = Path(__file__).resolve().parents[1] / PACKAGE

# What each room may import of the others; each holds what the rooms below it may import too.
_CORE = {"model", "signals", "held_signals", "identification"}
_FILES = {*_CORE, "streams", "records"}
_VALVES = {*_CORE, "streams", "usage", "evidence", "health"}
_PAGES = {*_VALVES, "response", "history", "records"}
_PICTURES = {*_PAGES, "planning"}
MAY_IMPORT = {
    "model": set(),
    "signals": {"model"},
    "held_signals": {"model", "signals"},
    "identification": {"model", "signals", "held_signals"},
    "streams": _CORE,
    "planning": _CORE,
    "usage": {*_CORE, "streams"},
    "records": {*_CORE, "streams"},
    "evidence": {*_CORE, "streams"},
    "health": {*_CORE, "streams", "evidence"},
    "alerts": {*_CORE, "health"},
    "response": _VALVES,
    "history": {*_VALVES, "response"},
    "figures": _PICTURES,
    "reports": {*_PICTURES, "figures"},
    "fleet": {*_PICTURES, "figures", "reports"},
    "dashboard": _PAGES,
    "nodes": {*_FILES, *_PAGES, "planning", "reports", "alerts", "dashboard"},
}
# What each inner room may import of its siblings. The files beside inner rooms hold their shared
# words and what joins them, so both may import each other; no two files do, directly or around.
INNER = {
    "identification.trust": set(),
    "identification.published": {"trust"},
    "identification.steps": {"trust"},
    "identification.engine": {"trust", "published"},
    "identification.signature": {"trust", "published", "steps"},
    "records.bags": set(),
    "dashboard.pages": set(),
    "nodes.plumbing": set(),
    "nodes.identifier": {"plumbing"},
    "commands.arguments": set(),
    "commands.demo": set(),
}
# The front door, and what every room may import.
BESIDE = {"__init__", "__main__", "front_door", "on_demand", "outside_text", "settings", "wording"}
ROS_ROOMS = ("nodes", "commands/demo")

# The one arrow up: a result draws itself, and loads the figures when it is asked to.
UPWARD = {"identification/result.py": {"figures"}}
CORE = [
    "model",
    "signals",
    "held_signals",
    "identification",
    "planning",
    "streams",
    "usage",
    "records",
    "evidence",
    "health",
    "response",
    "history",
    "alerts",
    "fleet",
    "dashboard",
]


def rooms():
    """Names of the rooms: folders, or single files."""
    folders = {path.parent.name for path in SOURCES.glob("*/__init__.py")}
    return sorted(folders | {path.stem for path in SOURCES.glob("*.py")} - BESIDE)


def sources_of(room):
    return sorted((SOURCES / room).rglob("*.py")) or [SOURCES / f"{room}.py"]


@cache
def imported(path):
    """Absolute names of all modules that a source file imports, wherever in it."""
    return tuple(_imported(path))


def _imported(path):
    for statement in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(statement, ast.Import):
            yield from (alias.name for alias in statement.names)
        elif isinstance(statement, ast.ImportFrom):
            if statement.level:
                folders = path.relative_to(SOURCES.parent).parts[: -statement.level]
                module = ".".join([*folders, *filter(None, [statement.module])])
            else:
                module = statement.module
            yield module
            yield from (f"{module}.{alias.name}" for alias in statement.names)


def imported_rooms(path):
    names = (name.split(".") for name in imported(path))
    return {parts[1] for parts in names if parts[0] == PACKAGE and len(parts) > 1} & set(rooms())


def is_ros(module):
    top = module.split(".")[0]
    return top.startswith(("rclpy", "rcl_", "rosidl", "ament", "launch")) or top.endswith(
        ("_msgs", "_srvs", "_interfaces")
    )


def inner_rooms():
    return {".".join(path.parent.parts[-2:]) for path in SOURCES.glob("*/*/__init__.py")}


def name_of(path):
    parts = path.relative_to(SOURCES.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def test_the_rooms_are_known():
    assert set(rooms()) == {*MAY_IMPORT, "commands"}
    assert inner_rooms() == set(INNER)


@pytest.mark.parametrize("room", INNER)
def test_arrows_between_inner_rooms_run_one_way(room):
    outer, inner = room.split(".")
    siblings = {each.split(".")[1] for each in INNER if each.startswith(f"{outer}.")}
    for path in sorted((SOURCES / outer / inner).glob("*.py")):
        parts = [name.split(".") for name in imported(path)]
        used = {part[2] for part in parts if part[:2] == [PACKAGE, outer] and len(part) > 2}
        strangers = used & siblings - INNER[room] - {inner}
        assert not strangers, f"{path.relative_to(SOURCES)} imports {strangers}"


def test_no_two_files_need_each_other():
    sources = {name_of(path): path for path in SOURCES.rglob("*.py") if path.stem != "__init__"}
    needed = {name: set(imported(path)) & set(sources) for name, path in sources.items()}
    assert any(needed.values())
    TopologicalSorter(needed).prepare()  # raises CycleError


@pytest.mark.parametrize("room", MAY_IMPORT)
def test_arrows_run_one_way(room):
    for path in sources_of(room):
        upward = UPWARD.get(path.relative_to(SOURCES).as_posix(), set())
        strangers = imported_rooms(path) - MAY_IMPORT[room] - {room} - upward
        assert not strangers, f"{path.relative_to(SOURCES)} imports {strangers}"


def test_imports_are_seen():
    """The check above has eyes: what is known to be imported is found, relative or not."""
    assert imported_rooms(SOURCES / "identification" / "published" / "identify.py") == {
        "identification",
        "model",
        "signals",
    }
    assert any(is_ros(name) for name in imported(SOURCES / "nodes" / "simulator.py"))


def knows_ros(path):
    return path.relative_to(SOURCES).as_posix().startswith(ROS_ROOMS)


def test_only_nodes_and_the_demo_know_ros():
    for path in sorted(SOURCES.rglob("*.py")):
        if not knows_ros(path):
            ros = {name for name in imported(path) if is_ros(name)}
            assert not ros, f"{path.relative_to(SOURCES)} imports {ros}"


def test_importing_the_core_loads_no_ros():
    """One process loads room after room, and says what it has loaded after each."""
    code = f"import sys, importlib\nfor room in {CORE}:\n"
    code += f"    importlib.import_module('{PACKAGE}.' + room); print(room, *sys.modules)"
    lines = printed("-c", code, cwd=SOURCES.parent).splitlines()
    loaded = {line.split()[0]: line.split()[1:] for line in lines}
    assert [*loaded] == CORE
    for room, names in loaded.items():
        assert f"{PACKAGE}.{room}" in names
        assert not [name for name in names if is_ros(name)], room


def modules():
    for path in sorted(SOURCES.rglob("*.py")):
        parts = path.relative_to(SOURCES.parent).with_suffix("").parts
        if knows_ros(path):
            continue  # their libraries may not be installed
        yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@pytest.mark.parametrize("name", list(modules()))
def test_public_names_exist_and_are_described(name):
    if name.startswith(f"{PACKAGE}.dashboard."):
        pytest.importorskip("nicegui", reason="run `make venv-dashboard`")
    module = importlib.import_module(name)
    assert inspect.getdoc(module)
    for each, thing in vars(module).items():
        if each.startswith("_") or getattr(thing, "__module__", "") != name:
            continue
        if inspect.isclass(thing) or inspect.isroutine(thing):
            # A class without a docstring of its own would show its base's.
            assert (thing.__doc__ or "").strip(), f"{name}.{each} has no docstring"


@pytest.mark.parametrize("room", [room for room in CORE if (SOURCES / room).is_dir()])
def test_a_room_s_face_imports_its_names_as_themselves(room):
    """So a type checker takes them for public; each can be had."""
    face = importlib.import_module(f"{PACKAGE}.{room}")
    imports = [
        alias
        for statement in ast.walk(ast.parse((SOURCES / room / "__init__.py").read_text()))
        if isinstance(statement, ast.ImportFrom)
        and statement.module.startswith(f"{PACKAGE}.{room}.")
        for alias in statement.names
    ]
    assert imports
    assert all(alias.asname == alias.name and hasattr(face, alias.name) for alias in imports)


@pytest.mark.parametrize("path", sorted(SOURCES.rglob("__init__.py")), ids=name_of)
def test_no_name_on_demand_is_called_like_a_module(path):
    """Whoever imported the module first would get it in place of the name."""
    if "names_on_demand(__name__)" in path.read_text(encoding="utf-8"):
        inside = {each.stem for each in path.parent.iterdir()}
        assert not inside & set(importlib.import_module(name_of(path)).__all__)


def test_an_unknown_name_on_demand():
    with pytest.raises(AttributeError, match=r"module '\w+\.model' has no attribute 'nothing'"):
        importlib.import_module(f"{PACKAGE}.model").nothing  # noqa: B018


def test_no_file_lists_its_names_twice():
    """A room's face imports each as itself; elsewhere a leading underscore says what is private."""
    assert not [path for path in SOURCES.rglob("*.py") if "\n__all__" in path.read_text()]
