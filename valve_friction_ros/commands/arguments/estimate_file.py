# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Estimates that `valve_friction identify --json` wrote, read back."""

import json
import math
from pathlib import Path
from typing import Any

from valve_friction_ros.identification import PARAMETER_UNITS
from valve_friction_ros.records.spelling import nearest
from valve_friction_ros.records.whole_file import cause_of

_LARGEST = 10_000_000
"""Most bytes of an estimate. Chosen: `identify --json` writes some ten thousand."""


def _value(path: Path, name: str, entry: Any) -> float:
    if not isinstance(entry, dict) or "value" not in entry:
        raise ValueError(f"{path}: parameters.{name} has no value")
    value = entry["value"]
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(
            f"{path}: parameters.{name}.value must be a number or null, got {value!r:.80}"
        )
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{path}: parameters.{name}.value is too large") from None


def read_estimate(path: Path) -> dict[str, float]:
    """Read the values by name from the JSON of `valve_friction identify`; nan: not identifiable.

    Raises ValueError, one line with the file and what it lacks.
    """
    try:
        with path.open("rb") as stream:
            text = stream.read(_LARGEST + 1)
        if len(text) > _LARGEST:
            raise ValueError(f"more than {_LARGEST // 1_000_000} MB: no estimate is so long")
        content = json.loads(text.decode("utf-8-sig"))
    except (OSError, UnicodeDecodeError) as error:
        cause = cause_of(error)
        raise ValueError(f"{path}: cannot be read: {cause}") from None
    except json.JSONDecodeError as error:
        raise ValueError(f"{path}: not JSON: {error}") from None
    except RecursionError:
        raise ValueError(f"{path}: not JSON of an estimate: it is nested too deeply") from None
    except ValueError as error:  # too large, as a whole or a number of thousands of digits
        raise ValueError(f"{path}: {error}") from None
    if isinstance(content, dict) and "valves" in content:
        raise ValueError(f"{path}: is of several valves: identify the one by --valve-name")
    parameters = content.get("parameters") if isinstance(content, dict) else None
    if not isinstance(parameters, dict):
        raise ValueError(
            f"{path}: there are no parameters: give what `valve_friction identify --json` wrote"
        )
    for name in parameters:
        if name not in PARAMETER_UNITS:
            hint = nearest(name, PARAMETER_UNITS)
            raise ValueError(f"{path}: unknown parameter {name!r:.80}; {hint}")
    return {name: _value(path, name, entry) for name, entry in parameters.items()}
