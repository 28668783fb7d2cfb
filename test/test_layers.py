"""The rooms of the package: imports point one way, and what is public is there and described."""

import ast
import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = "valve_friction_ros"
SOURCES = Path(__file__).resolve().parents[1] / PACKAGE

# What each room may import of the others.
MAY_IMPORT = {
    "model": set(),
    "identification": {"model"},
    "monitoring": {"identification", "model"},
    "reproduction": {"reports", "plots", "monitoring", "identification", "model"},
    "reports": {"plots", "monitoring", "identification", "model"},
    "plots": {"monitoring", "identification", "model"},
    "fleet": {"monitoring", "identification", "model"},
    "nodes": {"reports", "monitoring", "identification", "model"},
}
ROS_ROOMS = {"nodes", "commands"}
CORE = ["model", "identification", "monitoring", "fleet"]


def rooms():
    return sorted(path.parent.name for path in SOURCES.glob("*/__init__.py"))


def imported(path):
    """Absolute names of all modules that a source file imports, wherever in it."""
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


def test_the_rooms_are_known():
    assert set(rooms()) == {*MAY_IMPORT, "commands"}


@pytest.mark.parametrize("room", MAY_IMPORT)
def test_arrows_run_one_way(room):
    sources = sorted((SOURCES / room).rglob("*.py"))
    assert len(sources) > 1
    for path in sources:
        strangers = imported_rooms(path) - MAY_IMPORT[room] - {room}
        assert not strangers, f"{path.relative_to(SOURCES)} imports {strangers}"


def test_imports_are_seen():
    """The check above has eyes: what is known to be imported is found, relative or not."""
    assert imported_rooms(SOURCES / "identification" / "identify.py") == {
        "identification",
        "model",
    }
    assert any(is_ros(name) for name in imported(SOURCES / "nodes" / "simulator.py"))


def test_only_nodes_and_commands_know_ros():
    for path in sorted(SOURCES.rglob("*.py")):
        if path.relative_to(SOURCES).parts[0] not in ROS_ROOMS:
            ros = {name for name in imported(path) if is_ros(name)}
            assert not ros, f"{path.relative_to(SOURCES)} imports {ros}"


@pytest.mark.parametrize("room", CORE)
def test_importing_the_core_loads_no_ros(room):
    code = f"import sys, {PACKAGE}.{room}; print('\\n'.join(sys.modules))"
    loaded = subprocess.run(
        [sys.executable, "-c", code],
        cwd=SOURCES.parent,
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    ).stdout.split()
    assert f"{PACKAGE}.{room}" in loaded
    assert not [name for name in loaded if is_ros(name)]


def modules():
    for path in sorted(SOURCES.rglob("*.py")):
        parts = path.relative_to(SOURCES.parent).with_suffix("").parts
        if set(parts) & ROS_ROOMS:
            continue  # their libraries may not be installed
        yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@pytest.mark.parametrize("name", list(modules()))
def test_public_names_exist_and_are_described(name):
    module = importlib.import_module(name)
    assert inspect.getdoc(module)
    public = getattr(module, "__all__", [])
    assert len(public) == len(set(public))
    for each in public:
        thing = getattr(module, each)
        if inspect.isclass(thing) or inspect.isroutine(thing):
            # A class without a docstring of its own would show its base's.
            assert (thing.__doc__ or "").strip(), f"{name}.{each} has no docstring"


@pytest.mark.parametrize("room", CORE)
def test_rooms_name_what_is_public(room):
    assert importlib.import_module(f"{PACKAGE}.{room}").__all__
