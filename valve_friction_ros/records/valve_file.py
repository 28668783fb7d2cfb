# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The YAML file that describes a valve: plain, or as the parameters of a node."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import MappingProxyType
from typing import Any

import yaml

from valve_friction_ros.identification.settings import FIXABLE, STATED
from valve_friction_ros.identification.trust.plausible_units import require_valve_units
from valve_friction_ros.model.checks import frozen
from valve_friction_ros.model.valve import KarnoppParameters, Valve
from valve_friction_ros.outside_text import nearest, resembling
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.files import cause_of
from valve_friction_ros.settings import (
    COLUMNS,
    IDENTIFICATION,
    NODE_NAMES,
    SURVEY,
    VALVE,
    VALVE_KEYS,
    Setting,
    identification_from,
    is_known,
)

_LARGEST = 1_000_000
"""Largest file, bytes. Chosen: a valve file has some hundred; PyYAML reads 0.1 MB per second."""


class _StrictLoader(yaml.SafeLoader):
    """Refuses repeated keys; YAML would silently use the last value."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Build a mapping; refuse a repeated key."""
        seen = set()
        keys = (key for key, _ in node.value if isinstance(key, yaml.ScalarNode))
        for key in keys:
            if key.value in seen:
                raise yaml.MarkedYAMLError(
                    problem=f"{key.value[:60]} is given twice", problem_mark=key.start_mark
                )
            seen.add(key.value)
        return super().construct_mapping(node, deep)


def read_yaml(path: Path) -> Any:
    """Read a YAML file; raises ValueError, with file and cause, if this fails."""
    try:
        with path.open("rb") as stream:
            content = stream.read(_LARGEST + 1)
        if len(content) > _LARGEST:
            raise ValueError(f"more than {_LARGEST // 1000} kB: give the file of one valve")
        return yaml.load(content.decode("utf-8-sig"), _StrictLoader)  # noqa: S506 - is safe
    except yaml.YAMLError as error:
        raise ValueError(f"{path}: not YAML: {' '.join(str(error).split())[:300]}") from None
    except RecursionError:
        raise ValueError(f"{path}: not a valve file: its YAML is nested too deeply") from None
    except (OSError, ValueError) as error:
        raise ValueError(f"{path}: cannot be read: {cause_of(error)}") from None


_BLOCK = "ros__parameters"
_OUR_NODE = "identifier"


@dataclass(frozen=True)
class ValveFile:
    """A valve, and the other content of its file.

    Attributes
    ----------
    valve : Valve
        Geometry and sensor range.
    known : mapping of str to float
        Nominal parameters by name. The mass is assumed if a record does not determine it, and each
        can be fixed by its name alone.
    columns : Columns
        Format of the tables of this valve.
    settings : mapping of str to object
        The given settings of the identification by the names of the node's parameters, such as
        ``timing_uncertainty`` or ``fixed.mass``.
    survey : mapping of str to object
        The given settings of a first survey, such as ``packing``.
    tag : str
        The tag, ``valve_tag``; empty if it is not given.
    assumed : tuple of str
        Fields of the valve that affect forces and that the file does not state.
    """

    valve: Valve
    known: MappingProxyType[str, float]
    columns: Columns = field(default_factory=Columns)
    settings: MappingProxyType[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    assumed: tuple[str, ...] = ()
    survey: MappingProxyType[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    tag: str = ""

    @property
    def stated(self) -> dict[str, float]:
        """Nominal values to compare with a result, without fixed values and an assumed mass.

        Use ``IdentificationSettings(stated=described.stated)`` for the comparison.
        """
        assumed = self.settings.get("assumed_mass")
        return {
            name: self.known[name]
            for name in STATED
            if name in self.known
            and f"fixed.{name}" not in self.settings
            and not (name == "mass" and self.known[name] == assumed)
        }


def _number(key: str, value: object) -> float:
    """Convert a value to float; YAML reads 2e5 as text and 2.0e+5 as a number."""
    if not isinstance(value, bool):
        try:
            return float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError):
            pass
    raise ValueError(f"{key} must be a number, got {value!r:.80}")


def _require_possible(known: Mapping[str, float]) -> None:
    """Apply the rules of the model to the nominal parameters; missing values are neutral."""
    harmless = {
        "mass": 1.0,
        "viscous_friction": 0.0,
        "coulomb_friction": 0.0,
        "static_friction": max(0.0, known.get("coulomb_friction", 0.0)),
        "spring_constant": 0.0,
    }
    KarnoppParameters(**{**harmless, **known})


def _blocks(content: Mapping[Any, Any], place: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the name and the parameters of each node; names may be nested."""
    for key, value in content.items():
        if key == _BLOCK:
            yield place, value
        elif isinstance(value, Mapping):
            yield from _blocks(value, f"{place}/{key}".replace("//", "/"))


def _of_node(content: Mapping[Any, Any], valve: str | None) -> Mapping[Any, Any]:
    """Return the parameters that the identifier of a valve takes from a parameter file."""
    merged: dict[Any, Any] = {}
    own: dict[str, dict[Any, Any]] = {}
    for place, parameters in _blocks(content):
        namespace, _, node = place.rpartition("/")
        if node not in (_OUR_NODE, "*", "**") or not isinstance(parameters, Mapping):
            continue
        if namespace.strip("/*"):
            own.setdefault(namespace.strip("/"), {}).update(parameters)
        else:
            merged.update(parameters)
    if valve is not None:
        chosen = own.get(valve.strip("/"), {})
    elif len(own) > 1:
        raise ValueError(
            f"parameters of several valves ({', '.join(sorted(own))[:200]}): choose one with "
            "--valve-name"
        )
    else:
        chosen = next(iter(own.values()), {})
    return {**merged, **chosen}


def _flat(content: Mapping[Any, Any], is_shared: bool) -> dict[str, Any]:
    """Return all keys with dots between their levels; refuse unknown keys.

    In a file shared with nodes of other packages, only keys that resemble a known key are refused.
    """
    values: dict[str, Any] = {}
    for key, value in content.items():
        nested = (
            {f"{key}.{inner}": each for inner, each in value.items()}
            if isinstance(value, Mapping) and key != COLUMNS
            else {key: value}
        )
        for name, each in nested.items():
            is_other = is_shared and (
                is_known(str(name)) or not resembling(str(name), (*NODE_NAMES, COLUMNS))
            )
            if name not in (*VALVE_KEYS, COLUMNS) and not is_other:
                raise ValueError(
                    f"unknown key {name!r:.80}; {nearest(name, (*VALVE_KEYS, COLUMNS))}"
                )
            values[name] = each
    return values


def _read(setting: Setting, value: object) -> Any:
    """Convert a value to the type of its setting; None if it means "not given"."""
    if setting.choices:
        text = setting.spell(str(value))
        if text not in setting.choices:
            choices = ", ".join(setting.choices)
            raise ValueError(f"{setting.name} {value!r:.60} is unknown: {choices}")
        return text
    number = _number(setting.name, value)
    if isinstance(setting.default, int):
        if not number.is_integer():
            raise ValueError(f"{setting.name} must be a whole number, got {value!r:.60}")
        number = int(number)
    return number if setting.is_given(number) else None


def _described(values: Mapping[str, Any]) -> ValveFile:
    columns = Columns.section(values[COLUMNS]) if COLUMNS in values else Columns()
    there = (each for each in IDENTIFICATION if each.name in values)
    read = {each.name: _read(each, values[each.name]) for each in there}
    settings = {name: value for name, value in read.items() if value is not None}
    known = {name: _number(name, values[name]) for name in FIXABLE if name in values}
    if "assumed_mass" in settings:
        known.setdefault("mass", settings["assumed_mass"])
    fixed = {name: settings[name] for name in settings if name.startswith("fixed.")}
    known.update((name.removeprefix("fixed."), value) for name, value in fixed.items())
    _require_possible(known)
    identification_from(fixed)
    geometry = {each.name: values[each.name] for each in VALVE if each.name in values}
    valve = Valve(**{name: _number(name, value) for name, value in geometry.items()})
    require_valve_units(valve, known)
    assumed = tuple(name for name in ("pressure_reference",) if name not in values)
    survey = {each.name: _read(each, values[each.name]) for each in SURVEY if each.name in values}
    tag = str(values.get("valve_tag") or "")
    return ValveFile(valve, frozen(known), columns, frozen(settings), assumed, frozen(survey), tag)


def read_valve_file(path: str | os.PathLike[str], valve: str | None = None) -> ValveFile:
    r"""Read a valve from YAML: ``diaphragm_area`` and further known values, in SI units.

    A parameter file of ROS 2 nodes also describes a valve, by the parameters for all nodes or for
    ``identifier``.

    Parameters
    ----------
    path : path
        The file.
    valve : str, optional
        Namespace of the valve in a file of several valves.

    Raises
    ------
    ValueError
        In one line: the file, the key, and the violated rule.

    Returns
    -------
    ValveFile
        The valve, and the other content of the file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import valve_friction_ros as vf
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "fv_101.yaml")
    ...     _ = path.write_text("diaphragm_area: 0.0445\nmass: 1.6\n")
    ...     described = vf.read_valve_file(path)
    >>> described.valve.diaphragm_area, described.known["mass"]
    (0.0445, 1.6)
    """
    path = Path(path)
    return valve_file_of(read_yaml(path), path, valve)


def with_columns(text: str, columns: Columns) -> str:
    """Return the text of a valve file with a new section ``columns:``; comments are preserved.

    Raises ValueError if the text is not the YAML of a valve.
    """
    try:
        root = yaml.compose(text, yaml.SafeLoader)
    except yaml.YAMLError as error:
        raise ValueError(f"not YAML: {' '.join(str(error).split())[:300]}") from None
    said = {
        each.name: getattr(columns, each.name)
        for each in fields(columns)
        if getattr(columns, each.name) != each.default and not each.name.startswith("maximum_m")
    }
    section = yaml.safe_dump({COLUMNS: said}, allow_unicode=True, sort_keys=False, width=1000)
    lines = text.splitlines(keepends=True)
    place, indent = len(lines), 0
    for key, value in _pairs(root):
        indent = key.start_mark.column
        if key.value == COLUMNS:
            place = key.start_mark.line
            del lines[place : _last_line(value) + 1]
            break
        place = _last_line(value) + 1
    own = [" " * indent + line for line in section.splitlines(keepends=True)]
    if place and not lines[place - 1].endswith("\n"):
        lines[place - 1] += "\n"
    return "".join([*lines[:place], *own, *lines[place:]])


def _last_line(node: yaml.Node) -> int:
    """Return the last line of a node; the end mark of a block lies beyond it."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return _last_line(last[1] if isinstance(last, tuple) else last)
    return int(node.end_mark.line)


def _pairs(node: yaml.Node | None) -> list[tuple[yaml.Node, yaml.Node]]:
    """Return the keys and values of a valve file, or of the parameters of its first node."""
    if not isinstance(node, yaml.MappingNode):
        raise ValueError("expected lines such as 'diaphragm_area: 0.0445'")
    for key, value in node.value:
        if isinstance(value, yaml.MappingNode) and key.value != COLUMNS:
            inner = _pairs(value)
            if key.value == _BLOCK or any(each.value == _BLOCK for each, _ in value.value):
                return inner
    return list(node.value)


def valve_file_of(content: object, path: Path, valve: str | None = None) -> ValveFile:
    """Build a valve from the content of the YAML file `path`, as `read_valve_file` does."""
    try:
        if not isinstance(content, dict):
            raise ValueError("expected lines such as 'diaphragm_area: 0.0445'")
        is_of_nodes = any(True for _ in _blocks(content))
        values = _flat(_of_node(content, valve) if is_of_nodes else content, is_of_nodes)
        if "diaphragm_area" not in values:
            raise ValueError(
                "diaphragm_area is missing: add a line such as 'diaphragm_area: 0.0445'"
            )
        return _described(values)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path}: {error}") from None
