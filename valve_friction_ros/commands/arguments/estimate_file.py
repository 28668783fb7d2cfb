"""Estimates that `valve_friction identify --json` wrote, read back."""

import json
import math
from pathlib import Path
from typing import Any

from valve_friction_ros.identification import PARAMETER_UNITS

__all__ = ["read_estimate"]


def _value(path: Path, name: str, entry: Any) -> float:
    if not isinstance(entry, dict) or "value" not in entry:
        raise ValueError(f"{path}: parameters.{name} has no value")
    value = entry["value"]
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"{path}: parameters.{name}.value must be a number or null, got {value!r}")
    return float(value)


def read_estimate(path: Path) -> dict[str, float]:
    """Read the values by name from the JSON of `valve_friction identify`; nan: not identifiable.

    Raises ValueError, one line with the file and what it lacks.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        cause = (isinstance(error, OSError) and error.strerror) or error
        raise ValueError(f"{path}: cannot be read: {cause}") from None
    except (json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"{path}: not JSON: {error}") from None
    if isinstance(content, dict) and "valves" in content:
        raise ValueError(f"{path}: is of several valves: identify the one by --valve-name")
    parameters = content.get("parameters") if isinstance(content, dict) else None
    if not isinstance(parameters, dict):
        raise ValueError(
            f"{path}: there are no parameters: give what `valve_friction identify --json` wrote"
        )
    for name in parameters:
        if name not in PARAMETER_UNITS:
            raise ValueError(f"{path}: unknown parameter {name!r}")
    return {name: _value(path, name, entry) for name, entry in parameters.items()}
