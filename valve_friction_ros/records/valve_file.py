"""The YAML file that describes a valve."""

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from types import MappingProxyType
from typing import Any

import yaml

from valve_friction_ros.identification import FIXABLE, require_valve_units
from valve_friction_ros.model import KarnoppParameters, Valve

__all__ = ["ValveFile", "read_valve_file"]

_GEOMETRY = tuple(field.name for field in fields(Valve))


@dataclass(frozen=True)
class ValveFile:
    """A valve, and the nominal parameters in its file.

    Attributes
    ----------
    valve : Valve
        Geometry and sensor range.
    known : mapping of str to float
        Nominal parameters by name: the mass is assumed where a record does not determine it, and
        each can be fixed by its name alone.
    """

    valve: Valve
    known: MappingProxyType[str, float]


class _StrictLoader(yaml.SafeLoader):
    """Refuses a repeated key; YAML would silently take the last value."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Build a mapping; refuse a repeated key."""
        seen = set()
        keys = (key for key, _ in node.value if isinstance(key, yaml.ScalarNode))
        for key in keys:
            if key.value in seen:
                raise yaml.MarkedYAMLError(
                    problem=f"{key.value} is given twice", problem_mark=key.start_mark
                )
            seen.add(key.value)
        return super().construct_mapping(node, deep)


def read_yaml(path: Path) -> Any:
    """Read a YAML file; raises ValueError, with the file and the cause, if that fails."""
    try:
        return yaml.load(path.read_text(encoding="utf-8"), _StrictLoader)  # noqa: S506 - is safe
    except (OSError, UnicodeDecodeError) as error:
        cause = (isinstance(error, OSError) and error.strerror) or error
        raise ValueError(f"{path}: cannot be read: {cause}") from None
    except yaml.YAMLError as error:
        raise ValueError(f"{path}: not YAML: {' '.join(str(error).split())}") from None


def _number(key: str, value: object) -> float:
    """Return a value as a float; YAML reads 2e5 as text and 2.0e+5 as a number."""
    if not isinstance(value, bool):
        try:
            return float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError):
            pass
    raise ValueError(f"{key} must be a number, got {value!r}")


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


def read_valve_file(path: Path) -> ValveFile:
    r"""Read a valve from YAML: ``diaphragm_area`` and further known values, in SI units.

    Raises
    ------
    ValueError
        In one line: the file, the key, and the rule that it breaks.

    Returns
    -------
    ValveFile
        The valve, and the nominal parameters that the file names.

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
    content = read_yaml(path)
    if not isinstance(content, dict):
        raise ValueError(f"{path}: expected lines such as 'diaphragm_area: 0.0445'")
    names = (*_GEOMETRY, *FIXABLE)
    for key in content:
        if key not in names:
            close = difflib.get_close_matches(str(key), names, n=1)
            hint = f"; did you mean {close[0]!r}?" if close else f"; known are {', '.join(names)}"
            raise ValueError(f"{path}: unknown key {key!r}{hint}")
    if "diaphragm_area" not in content:
        raise ValueError(
            f"{path}: diaphragm_area is missing: add a line such as 'diaphragm_area: 0.0445'"
        )
    try:
        numbers = {name: _number(name, value) for name, value in content.items()}
        known = {name: value for name, value in numbers.items() if name in FIXABLE}
        _require_possible(known)
        valve = Valve(**{name: value for name, value in numbers.items() if name in _GEOMETRY})
        require_valve_units(valve, known)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    return ValveFile(valve, MappingProxyType(known))
