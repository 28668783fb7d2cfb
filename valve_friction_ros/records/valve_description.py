# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The data of an actuator, and the valve file that they make."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

_ATMOSPHERE = 101_325.0


@dataclass(frozen=True)
class ActuatorData:
    """What the data sheet of an actuator says, SI units.

    Attributes
    ----------
    area, travel : float
        Effective area, m², and travel, m.
    spring_range : tuple of float, optional
        Gauge pressures at which the stem begins and ends its travel without friction (bench set),
        Pa.
    is_absolute : bool
        The sensor reads absolute pressure.
    sensor_range : tuple of float, optional
        What the sensor reads, Pa.
    is_air_to_close : bool
        More pressure closes the valve.
    position_is_opening : bool
        The position is that of the plug, 0 where it is closed; else it rises with the pressure.
    opposing_area : float, optional
        Area of the other side of a double-acting actuator, m².
    opposing_area_is_assumed : bool
        That area is a guess, which the file says.
    mass : float, optional
        Mass of the moving parts, kg.
    tag : str
        Tag of the valve.
    columns : mapping of str to object
        How its tables are written, by the names of `Columns`.
    """

    area: float
    travel: float
    spring_range: tuple[float, float] | None = None
    is_absolute: bool = False
    sensor_range: tuple[float, float] | None = None
    is_air_to_close: bool = False
    position_is_opening: bool = True
    opposing_area: float | None = None
    opposing_area_is_assumed: bool = False
    mass: float | None = None
    tag: str = ""
    columns: Mapping[str, Any] = field(default_factory=dict)

    def _valve(self) -> Iterator[tuple[str, Any, str]]:
        if self.tag:
            yield "valve_tag", self.tag, ""
        yield "diaphragm_area", self.area, f"m², {self.area * 1e4:.4g} cm²"
        yield (
            "pressure_reference",
            _ATMOSPHERE if self.is_absolute else 0.0,
            f"Pa, {'absolute' if self.is_absolute else 'gauge'} sensor",
        )
        yield "travel", self.travel, f"m, {self.travel * 1e3:.6g} mm"
        if self.is_air_to_close:
            yield "air_to", "close", "which end of the travel is the seat"
        if self.sensor_range is not None:
            low, high = self.sensor_range
            yield "pressure_minimum", low, f"Pa, {low / 1e5:.4g} bar: range of the sensor"
            yield "pressure_maximum", high, f"Pa, {high / 1e5:.4g} bar"
        if self.mass is not None:
            yield "assumed_mass", self.mass, "kg, where a record does not tell it"

    def _spring(self) -> Iterator[tuple[str, Any, str]]:
        if self.spring_range is not None:
            low, high = self.spring_range
            words = f"of the spring range {low / 1e5:.4g} to {high / 1e5:.4g} bar"
            yield "spring_constant", self.area * (high - low) / self.travel, f"N/m, {words}"
            yield "spring_preload", self.area * low, f"N, {words}"
        elif self.opposing_area is not None:
            yield "fixed.spring_constant", 0.0, "N/m, assumed: no spring range was given"

    def _columns(self) -> dict[str, Any]:
        columns = dict(self.columns)
        if self.is_air_to_close and self.position_is_opening:
            columns.setdefault("inverted_position", True)
        if self.opposing_area is not None:
            columns.setdefault("opposing_pressure_column", "opposing_pressure_pa")
            columns.setdefault("opposing_area_ratio", self.opposing_area / self.area)
        return columns

    def _assumed(self) -> dict[str, str]:
        """Return the comments on what nobody said."""
        if self.opposing_area is None:
            return {}
        assumed = {"opposing_pressure_column": "assumed: the header of the other side's pressure"}
        if self.opposing_area_is_assumed:
            assumed["opposing_area_ratio"] = "assumed: both sides have the same area"
        return {name: words for name, words in assumed.items() if name not in self.columns}

    def text(self) -> str:
        """Return the valve file."""
        lines = [
            "# A valve for `valve_friction ... --valve`, and for nodes by --params-file; commands",
            "# read it with or without the first two lines, which ROS 2 wants. SI units.",
            f"# Air to {'close' if self.is_air_to_close else 'open'}, "
            f"{'single' if self.opposing_area is None else 'double'}-acting.",
            "/**:",
            "  ros__parameters:",
        ]
        for name, value, comment in (*self._valve(), *self._spring()):
            lines.append(_line(name, value, comment))
        if columns := self._columns():
            lines += ["", "    columns:  # how its tables are written"]
            assumed = self._assumed()
            lines += [
                f"  {_line(name, value, assumed.get(name, ''))}" for name, value in columns.items()
            ]
        return "\n".join(lines) + "\n"


def _line(name: str, value: object, comment: str) -> str:
    if isinstance(value, float):
        shown = repr(float(f"{value:.9g}"))
        mantissa, mark, power = shown.partition("e")
        shown = mantissa + (".0" if "." not in mantissa else "") + mark + power
    else:
        shown = json.dumps(value)  # YAML reads JSON
    return f"    {name}: {shown}" + (f"  # {comment}" if comment else "")
