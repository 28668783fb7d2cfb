# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Questions about an actuator, and the valve file built from the answers."""

import json
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, NamedTuple

from valve_friction_ros.records.units import (
    AREA,
    MASS,
    POSITION_UNITS,
    PRESSURE_UNITS,
    quantity,
    span,
)

_ATMOSPHERE = 101_325.0


class ActuatorQuestion(NamedTuple):
    """Text of a question, parser of the answer and default; None: an answer is required."""

    name: str
    words: str
    example: str
    read: Callable[[str], Any]
    default: str | None = ""


def _choice(name: str, words: str, *choices: str) -> ActuatorQuestion:
    """Return a question for one of several words or its beginning; the first is the default."""

    def chosen(text: str) -> str:
        close = [word for word in choices if text and word.startswith(text.strip().lower())]
        if len(close) != 1:
            raise ValueError(f"{text[:40]!r}: choose {' or '.join(choices)}")
        return close[0]

    return ActuatorQuestion(name, words, ", ".join(choices), chosen, choices[0])


_area, _length = partial(quantity, units=AREA), partial(quantity, units=POSITION_UNITS)
_mass, _pressures = partial(quantity, units=MASS), partial(span, units=PRESSURE_UNITS)

QUESTIONS = (
    ActuatorQuestion("tag", "tag of the valve", "FV-101", str),
    ActuatorQuestion(
        "area", "effective area of the diaphragm or piston", "690 cm2, 107 in2", _area, None
    ),
    ActuatorQuestion("travel", "travel of the stem", "28.6 mm, 1.125 in", _length, None),
    _choice("acting", "acting", "single", "double"),
    ActuatorQuestion("opposing_area", "area of the other side, that of the rod", "650 cm2", _area),
    ActuatorQuestion(
        "spring_range", "spring range (bench set)", "0.2..1.0 bar, 3..15 psi", _pressures
    ),
    _choice("air_to", "more air on the actuator will", "open", "close"),
    _choice(
        "position",
        "the position is that of the plug (0: closed), or of the stem (rising with the pressure)",
        "plug",
        "stem",
    ),
    _choice("sensor", "pressure sensor", "gauge", "absolute"),
    ActuatorQuestion("sensor_range", "range of the sensor", "0..7 bar", _pressures),
    ActuatorQuestion("mass", "mass of the moving parts", "1.6 kg", _mass),
)

_Entry = tuple[str, Any, str]
"""Key, value and comment of a line in the file."""


def _valve(answers: Mapping[str, Any]) -> Iterator[_Entry]:
    area, travel = answers["area"], answers["travel"]
    if answers.get("tag"):
        yield "valve_tag", answers["tag"], ""
    yield "diaphragm_area", area, f"m², {area * 1e4:.4g} cm²"
    sensor = answers["sensor"]
    reference = _ATMOSPHERE if sensor == "absolute" else 0.0
    yield "pressure_reference", reference, f"Pa, {sensor} sensor"
    yield "travel", travel, f"m, {travel * 1e3:.6g} mm"
    if answers["air_to"] == "close":
        yield "air_to", "close", "which end of the travel is the seat"
    if answers.get("sensor_range") is not None:
        low, high = answers["sensor_range"]
        yield "pressure_minimum", low, f"Pa, {low / 1e5:.4g} bar: range of the sensor"
        yield "pressure_maximum", high, f"Pa, {high / 1e5:.4g} bar"
    if answers.get("mass") is not None:
        yield "assumed_mass", answers["mass"], "kg, if a record does not determine it"
    if answers.get("spring_range") is not None:
        low, high = answers["spring_range"]
        words = f"of the spring range {low / 1e5:.4g} to {high / 1e5:.4g} bar"
        yield "spring_constant", area * (high - low) / travel, f"N/m, {words}"
        yield "spring_preload", area * low, f"N, {words}"
    elif answers["acting"] == "double":
        yield "fixed.spring_constant", 0.0, "N/m, assumed: no spring range was given"


def _columns(answers: Mapping[str, Any], given: Mapping[str, Any]) -> Iterator[_Entry]:
    """Yield the given entries on the tables, then those that follow from the actuator."""
    yield from ((name, value, "") for name, value in given.items())
    found: list[_Entry] = []
    if answers["air_to"] == "close" and answers["position"] == "plug":
        found.append(("inverted_position", True, ""))
    if answers["acting"] == "double":
        words = "assumed: the header of the other side's pressure"
        found.append(("opposing_pressure_column", "opposing_pressure_pa", words))
        other, words = answers["opposing_area"], ""
        if other is None:
            other, words = answers["area"], "assumed: both sides have the same area"
        found.append(("opposing_area_ratio", other / answers["area"], words))
    yield from (each for each in found if each[0] not in given)


def valve_description(answers: Mapping[str, Any], columns: Mapping[str, Any]) -> str:
    """Return the text of a valve file.

    Parameters
    ----------
    answers : mapping of str to object
        Answers by the names of `QUESTIONS`, in SI units; None means no answer. Only area, travel
        and questions with a choice are required.
    columns : mapping of str to object
        Format of the tables of the valve, by the names of `Columns`.
    """
    lines = [
        "# A valve for `valve_friction ... --valve`, and for nodes by --params-file; commands",
        "# read it with or without the first two lines, which ROS 2 needs. SI units.",
        f"# Air to {answers['air_to']}, {answers['acting']}-acting.",
        "/**:",
        "  ros__parameters:",
        *(_line(*each) for each in _valve(answers)),
    ]
    if of_tables := [f"  {_line(*each)}" for each in _columns(answers, columns)]:
        lines += ["", "    columns:  # format of its tables", *of_tables]
    return "\n".join(lines) + "\n"


def _line(name: str, value: object, comment: str) -> str:
    if isinstance(value, float):
        shown = repr(float(f"{value:.9g}"))
        mantissa, mark, power = shown.partition("e")
        shown = mantissa + (".0" if "." not in mantissa else "") + mark + power
    else:
        shown = json.dumps(value)  # JSON is valid YAML
    return f"    {name}: {shown}" + (f"  # {comment}" if comment else "")
