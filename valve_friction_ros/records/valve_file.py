"""The YAML file that describes a valve: plain, or as a node's parameters."""

import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from valve_friction_ros.identification import (
    FIXABLE,
    METHODS,
    STATED,
    IdentificationSettings,
    require_valve_units,
)
from valve_friction_ros.model import KarnoppParameters, Valve
from valve_friction_ros.model.frozen import frozen
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.spelling import nearest, resembling
from valve_friction_ros.records.valve_keys import (
    COLUMNS,
    GEOMETRY,
    NODE_NAMES,
    SETTINGS,
    VALVE_KEYS,
    is_known,
)
from valve_friction_ros.records.yaml_file import read_yaml

__all__ = ["ValveFile", "read_valve_file", "valve_file_of"]

_BLOCK = "ros__parameters"
_OUR_NODE = "identifier"
_WHOLE = ("derivative_window", "polynomial_order")


@dataclass(frozen=True)
class ValveFile:
    """A valve, and what else its file says.

    Attributes
    ----------
    valve : Valve
        Geometry and sensor range.
    known : mapping of str to float
        Nominal parameters by name: the mass is assumed where a record does not determine it, and
        each can be fixed by its name alone.
    columns : Columns
        How the tables of this valve are written.
    settings : mapping of str to object
        Settings of the identification by the names of the node's parameters, as
        ``timing_uncertainty`` or ``fixed.mass``; without those that are not given.
    """

    valve: Valve
    known: MappingProxyType[str, float]
    columns: Columns = field(default_factory=Columns)
    settings: MappingProxyType[str, Any] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def stated(self) -> dict[str, float]:
        """What can be compared with a result: neither fixed values nor an assumed mass.

        ``IdentificationSettings(stated=described.stated)`` does.
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
    """Return a value as a float; YAML reads 2e5 as text and 2.0e+5 as a number."""
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
    """Yield each node's place and its parameters; places may be nested."""
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
            f"parameters of several valves ({', '.join(sorted(own))[:200]}): choose one by "
            "--valve-name"
        )
    else:
        chosen = next(iter(own.values()), {})
    return {**merged, **chosen}


def _is_of_nodes(content: Mapping[Any, Any]) -> bool:
    return any(True for _ in _blocks(content))


def _flat(content: Mapping[Any, Any], is_shared: bool) -> dict[str, Any]:
    """Return all keys with dots between their levels; refuse unknown ones.

    In a file that is shared with nodes of other packages, only those that resemble a known one.
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


def _settings(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings that are given: nan and a window of 0 stand for none."""
    settings: dict[str, Any] = {}
    for name in SETTINGS:
        if name not in values:
            continue
        if name == "method":
            if values[name] not in METHODS:
                raise ValueError(f"method {values[name]!r:.60} is unknown: {', '.join(METHODS)}")
            settings[name] = values[name]
            continue
        number = _number(name, values[name])
        if name in _WHOLE and not number.is_integer():
            raise ValueError(f"{name} must be a whole number, got {values[name]!r:.60}")
        if not math.isnan(number) and (name != "derivative_window" or number):
            settings[name] = int(number) if name in _WHOLE else number
    return settings


def _described(values: Mapping[str, Any]) -> ValveFile:
    columns = Columns.section(values[COLUMNS]) if COLUMNS in values else Columns()
    settings = _settings(values)
    known = {name: _number(name, values[name]) for name in FIXABLE if name in values}
    if "assumed_mass" in settings:
        known.setdefault("mass", settings["assumed_mass"])
    known.update(
        (name, settings[f"fixed.{name}"]) for name in FIXABLE if f"fixed.{name}" in settings
    )
    _require_possible(known)
    IdentificationSettings(
        fixed={name: known[name] for name in FIXABLE if f"fixed.{name}" in settings}
    )
    valve = Valve(**{name: _number(name, values[name]) for name in GEOMETRY if name in values})
    require_valve_units(valve, known)
    return ValveFile(valve, frozen(known), columns, frozen(settings))


def read_valve_file(path: str | os.PathLike[str], valve: str | None = None) -> ValveFile:
    r"""Read a valve from YAML: ``diaphragm_area`` and further known values, in SI units.

    A file of parameters of ROS 2 nodes describes a valve too: what it gives to every node, or to
    ``identifier``.

    Parameters
    ----------
    path : path
        The file.
    valve : str, optional
        Namespace of the valve in a file of several.

    Raises
    ------
    ValueError
        In one line: the file, the key, and the rule that it breaks.

    Returns
    -------
    ValveFile
        The valve, and what else the file names.

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


def valve_file_of(content: object, path: Path, valve: str | None = None) -> ValveFile:
    """Build a valve from the content of the YAML file `path`, as `read_valve_file` does."""
    try:
        if not isinstance(content, dict):
            raise ValueError("expected lines such as 'diaphragm_area: 0.0445'")
        if _is_of_nodes(content):
            values = _flat(_of_node(content, valve), is_shared=True)
        else:
            values = _flat(content, is_shared=False)
        if "diaphragm_area" not in values:
            raise ValueError(
                "diaphragm_area is missing: add a line such as 'diaphragm_area: 0.0445'"
            )
        return _described(values)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path}: {error}") from None
