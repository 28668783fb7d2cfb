"""The parameters of the nodes, as they declare them."""

import math
import re
from importlib import import_module
from pathlib import Path

from extension.markdown import Entry, definition_list, escaped

__all__ = ["NODES", "parameter_entries", "parameters_as_markdown"]

NODES = {
    "identifier": "identifier.parameters",
    "identifiers": "identifiers",
    "simulator": "simulator",
    "pressure_source": "pressure_source",
    "dashboard": "dashboard.parameters",
}
"""Module of each node that has its `PARAMETERS`, below ``valve_friction_ros.nodes``."""

_UNIT = re.compile(r" \[([^\]]+)\]")


def _number(value: float) -> str:
    if math.isnan(value):
        return ".nan"
    return f"{value:g}" if math.isfinite(value) else f"{'-' if value < 0 else ''}.inf"


def _default(value: object) -> str:
    """Write a default as a parameter file has it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        text = repr(value)
        return _number(value) if not math.isfinite(value) or "e" in text else text
    if isinstance(value, list):
        return "[]" if value == [""] else str(value)
    return str(value).replace(str(Path.home()), "~")


def _facts(spec: object, unit: str) -> str:
    """Say the default with its unit, the range or the choices, and when it can be set."""
    value = _default(spec.default)
    facts = [f"`{value}`{unit and ' ' + unit}" if value else "empty"]
    if spec.limits is not None:
        facts.append(f"{_number(spec.limits[0])} to {_number(spec.limits[1])}")
    if spec.choices:
        facts.append("one of " + ", ".join(f"`{one}`" for one in spec.choices))
    if spec.read_only:
        facts.append("at start only")
    return "; ".join(facts)


def parameter_entries(node: str, *names: str) -> list[Entry]:
    """Return the parameters of a node, or some of them, in the order of their declaration."""
    module = import_module(f"valve_friction_ros.nodes.{NODES[node]}")
    found = []
    for spec in module.PARAMETERS:
        match = _UNIT.search(spec.description)
        unit = "" if match is None or match[1] == "-" else match[1]
        description = spec.description if match is None else _UNIT.sub("", spec.description, 1)
        meaning = escaped(description).replace("~/", "\\~/").rstrip(".") + "."
        if not names or spec.name in names:
            found.append(Entry(spec.name, _facts(spec, escaped(unit)), meaning))
    return found


def parameters_as_markdown(node: str, *names: str) -> str:
    """Return the parameters of a node, or those of some names, as a list of definitions."""
    return "\n".join(definition_list(parameter_entries(node, *names)))
