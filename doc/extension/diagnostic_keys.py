# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The keys of an identifier's diagnostics, found in the code that writes them."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from extension.markdown import Entry, definition_list
from extension.meanings import meanings, require_all

__all__ = ["declared_keys", "entries", "is_explained", "keys_as_markdown", "pattern_of"]

_WRITERS = {
    "identifier/node.py": ("values", "_data_values"),
    "identifier/status.py": (
        "estimate_status",
        "friction_status",
        "stuck_status",
    ),
    "../history/status_values.py": (
        "ratio_values",
        "result_values",
        "baseline_values",
        "trend_values",
        "alarm_values",
    ),
    "identifier/baseline_in_force.py": ("values",),
    "identifier/evidence_watch.py": ("values", "_numbers"),
    "identifier/usage_watch.py": ("values",),
    "identifier/response_watch.py": ("values", "_deviation_values", "_move_values"),
    "identifier/alarm_board.py": ("values",),
    "identifier/recordings.py": ("values",),
    "identifier/alerts.py": ("_mark",),
    "identifier/history_writer.py": ("values",),
    "identifier/valve_inputs.py": ("values",),
    "identifier/workers.py": ("values",),
    "plumbing/worker.py": ("values",),
}
"""Functions that write keys, by file below ``valve_friction_ros/nodes``."""


def _text(node: ast.expr) -> str | None:
    """Return a text as it stands, with ``<what>`` where something is put in; None for no text."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else None
    if isinstance(node, ast.JoinedStr):
        parts = (
            str(one.value)
            if isinstance(one, ast.Constant)
            else f"<{ast.unparse(one.value).rpartition('.')[2]}>"
            for one in node.values
        )
        return "".join(parts)
    if isinstance(node, ast.BinOp):
        sides = (
            f"<{one.id}>" if isinstance(one, ast.Name) else "" for one in (node.left, node.right)
        )
        return "".join(sides)
    return None


def _keys(function: ast.FunctionDef) -> Iterator[str]:
    """Find the keys that a function puts into a mapping."""
    for node in ast.walk(function):
        keys: list[ast.expr | None] = []
        if isinstance(node, ast.Dict):
            keys = node.keys
        elif isinstance(node, ast.Assign):
            keys = [one.slice for one in node.targets if isinstance(one, ast.Subscript)]
        for key in keys:
            if key is not None and (text := _text(key)) is not None:
                yield text


def declared_keys() -> set[str]:
    """Return all keys, with ``<what>`` for what is put in."""
    import valve_friction_ros

    nodes = Path(valve_friction_ros.__file__).parent / "nodes"
    found: set[str] = set()
    for file, functions in _WRITERS.items():
        tree = ast.parse((nodes / file).read_text(encoding="utf-8"))
        written: dict[str, set[str]] = {}
        for each in ast.walk(tree):
            if isinstance(each, ast.FunctionDef):
                written.setdefault(each.name, set()).update(_keys(each))
        for name in functions:
            found |= written[name]
    return found


def entries() -> dict[str, list[Entry]]:
    """Return the keys with their meanings, by section; each declared key has one, or several."""
    found: dict[str, list[Entry]] = {}
    written: set[str] = set()
    for section, keys in meanings()["keys"].items():
        found[section] = []
        for key, said in keys.items():
            is_part = isinstance(said, dict)
            written.add(said["of"] if is_part else key)
            found[section].append(Entry(key, "", (said["text"] if is_part else said).strip()))
    require_all("keys of diagnostics", declared_keys(), written)
    return found


def pattern_of(key: str) -> re.Pattern[str]:
    """Return what the keys that an entry stands for look like."""
    from valve_friction_ros.health.measured import DIFFERENCES, RATIOS
    from valve_friction_ros.identification import PARAMETER_UNITS

    parts = {
        "parameter": "|".join(PARAMETER_UNITS),
        "number": "|".join((*RATIOS, *DIFFERENCES)),
        "figure": "dead_time|T63|T86|overshoot|steady_error",
        "which": "dead_time|T86|deviation",
    }
    pieces = re.split(r"<([^>]+)>", key)
    pieces[::2] = map(re.escape, pieces[::2])
    pieces[1::2] = (f"(?:{parts.get(part, '[^]]+')})" for part in pieces[1::2])
    return re.compile("".join(pieces))


@cache
def _patterns() -> tuple[re.Pattern[str], ...]:
    return tuple(pattern_of(entry.term) for some in entries().values() for entry in some)


@cache
def is_explained(key: str) -> bool:
    """Return whether an entry stands for a key."""
    return any(pattern.fullmatch(key) for pattern in _patterns())


def keys_as_markdown(section: str) -> str:
    """Return the keys of a section of the meanings as a list of definitions."""
    return "\n".join(definition_list(entries()[section]))
