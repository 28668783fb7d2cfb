# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The parameters of the nodes, as they declare them."""

import math
from pathlib import Path

from extension.markdown import Entry, definition_list, escaped
from valve_friction_ros.settings import NODES, Setting

__all__ = ["parameter_entries", "parameters_as_markdown"]


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


def _facts(spec: Setting, unit: str) -> str:
    """Say the default with its unit, the range or the choices, and when it can be set."""
    value = _default(spec.assumed if spec.default is None else spec.default)
    facts = [f"`{value}`{unit and ' ' + unit}" if value else "empty"]
    if spec.default is None:
        facts = ["not stated" if spec.assumed is None else f"not stated: {facts[0]} is assumed"]
    if spec.limits is not None:
        facts.append(f"{_number(spec.limits[0])} to {_number(spec.limits[1])}")
    if spec.choices:
        facts.append("one of " + ", ".join(f"`{one}`" for one in spec.choices))
    if spec.read_only:
        facts.append("at start only")
    return "; ".join(facts)


def parameter_entries(node: str, *names: str) -> list[Entry]:
    """Return the parameters of a node, or some of them, in the order of their declaration."""
    return [
        Entry(
            spec.name,
            _facts(spec, escaped(spec.unit)),
            escaped(spec.meaning).replace("~/", "\\~/").rstrip(".") + ".",
        )
        for spec in NODES[node]
        if not names or spec.name in names
    ]


def parameters_as_markdown(node: str, *names: str) -> str:
    """Return the parameters of a node, or those of some names, as a list of definitions."""
    return "\n".join(definition_list(parameter_entries(node, *names)))
