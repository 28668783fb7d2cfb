# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Format of a table of samples: columns, units and layout."""

import codecs
import math
import zoneinfo
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from valve_friction_ros.outside_text import nearest
from valve_friction_ros.records.units import PRESSURE_UNITS, SHARES, UNITS, span, unit_named

KNOWN_UNITS: Mapping[str, tuple[str, ...]] = {
    quantity: (*units, *(SHARES if quantity in ("position", "pressure") else ()))
    for quantity, units in UNITS.items()
}
"""Names of the permitted units by quantity."""

_DELIMITERS = {"tab": "\t", "\\t": "\t", "comma": ",", "semicolon": ";", "space": " "}
"""Names for characters that are hard to type in a shell."""


def _described(default: Any, text: str, metavar: str = "") -> Any:
    return field(default=default, metadata={"help": text, "metavar": metavar})


def _units(quantity: str) -> str:
    return ", ".join(KNOWN_UNITS[quantity])


@dataclass(frozen=True)
class Columns:
    """Information that a table does not contain itself, by the names of the options.

    The same names are the keys of the section ``columns:`` of a valve file. Empty fields are
    recognized from the table. Units are those of `records.units`. A column that is named here
    without a unit is in its SI unit if its numbers permit this.

    Raises ValueError, which names the field, if a value is impossible.
    """

    time_column: str = _described("", "header of the time column", "HEADER")
    time_unit: str = _described("", f"{_units('time')}; dates are recognized", "UNIT")
    time_zone: str = _described(
        "", "time zone of local times without one, such as Europe/Berlin; default: UTC", "ZONE"
    )
    time_format: str = _described(
        "", "format of the dates, such as '%%d.%%m.%%Y %%H:%%M:%%S.%%f' (strptime)", "FORM"
    )
    position_column: str = _described("", "header or tag of the stem position", "HEADER")
    position_unit: str = _described("", _units("position"), "UNIT")
    inverted_position: bool = _described(
        False,
        "the position falls as the pressure pushes the stem, like the opening of an air-to-close "
        "valve: use the travel (100 %%) minus the position",
    )
    pressure_column: str = _described("", "header or tag of the pressure", "HEADER")
    pressure_unit: str = _described("", _units("pressure"), "UNIT")
    pressure_range: str = _described(
        "", "range of a transmitter in mA or percent, as '0..2.5 bar'", "RANGE"
    )
    opposing_pressure_column: str = _described(
        "", "header of the pressure on the other side of a double-acting actuator", "HEADER"
    )
    opposing_area_ratio: float = _described(
        1.0, "area of the other side (that of the rod) over diaphragm_area", "RATIO"
    )
    force_column: str = _described("", "header or tag of the force", "HEADER")
    force_unit: str = _described("", _units("force"), "UNIT")
    tag_column: str = _described("", "header of the tags, if each row holds one value", "HEADER")
    value_column: str = _described(
        "", "header of the values, if each row holds one value", "HEADER"
    )
    good_quality: str = _described(
        "", "entries of the quality column that mark good values, separated by commas", "WORDS"
    )
    maximum_bad_share: float = _described(
        0.05, "largest share of a signal's values that may be bad; bad values are left out", "SHARE"
    )
    delimiter: str = _described("", "separator between the entries of a row: , ; tab …", "MARK")
    decimal: str = _described("", "decimal mark, . or ,", "MARK")
    encoding: str = _described("", "encoding, such as utf-16 or cp1252", "NAME")
    skip_rows: int = _described(
        0, "rows to skip at the top; rows above the headers are recognized automatically", "N"
    )
    comment: str = _described("", "leave out rows that begin with this mark, such as #", "MARK")
    sheet: str = _described("", "sheet of a workbook; default: the first", "NAME")
    maximum_rows: int = _described(10_000_000, "largest number of rows to read", "N")
    maximum_megabytes: float = _described(2000.0, "largest size of the file, unpacked", "MB")

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "delimiter", _DELIMITERS.get(self.delimiter, self.delimiter))
        for quantity, known in KNOWN_UNITS.items():
            name = f"{quantity}_unit"
            unit = unit_named(getattr(self, name))
            if unit and unit not in known:
                raise ValueError(
                    f"unknown unit of {quantity} {unit[:40]!r}; known are {', '.join(known)}"
                )
            set_(self, name, unit)
        self._require_layout()
        self._require_clock()
        if not (math.isfinite(self.opposing_area_ratio) and 0 < self.opposing_area_ratio <= 2):
            raise ValueError(
                f"opposing_area_ratio must be above 0 and at most 2, got {self.opposing_area_ratio}"
            )
        if self.pressure_range:
            span(self.pressure_range, PRESSURE_UNITS)
        if not 0 <= self.maximum_bad_share < 1:
            raise ValueError(
                f"maximum_bad_share must be from 0 to below 1, got {self.maximum_bad_share:g}"
            )
        if not self.maximum_rows > 0 or not self.maximum_megabytes > 0 or self.skip_rows < 0:
            raise ValueError(
                "maximum_rows and maximum_megabytes must be above zero, and skip_rows not negative"
            )

    def _require_layout(self) -> None:
        mark = self.delimiter
        if mark and (len(mark) != 1 or mark in '"\r\n+-.' or mark.isalnum()):
            raise ValueError(
                f"the delimiter must be one character such as ',', ';' or a tab, got "
                f"{self.delimiter[:40]!r}"
            )
        if self.decimal not in ("", ".", ","):
            raise ValueError(f"the decimal mark must be '.' or ',', got {self.decimal[:40]!r}")
        try:
            if self.encoding:
                "".encode(self.encoding)
                codecs.lookup(self.encoding)
        except (LookupError, ValueError):
            raise ValueError(
                f"unknown encoding {self.encoding[:40]!r}: known are utf-8, utf-16, cp1252, "
                "latin-1 and those of Python"
            ) from None

    def _require_clock(self) -> None:
        try:
            if self.time_zone:
                zoneinfo.ZoneInfo(self.time_zone)
        except (LookupError, ValueError, OSError):
            known = zoneinfo.available_timezones()
            hint = nearest(self.time_zone, sorted(known)) if known else "install tzdata"
            raise ValueError(f"unknown time_zone {self.time_zone[:40]!r}: {hint}") from None

    @classmethod
    def section(cls, content: object) -> "Columns":
        """Build the columns from the section ``columns:`` of a valve file.

        Raises ValueError, which names the key, for an unknown key or an impossible value.
        """
        if not isinstance(content, Mapping):
            raise ValueError("columns must be lines such as 'time_column: Time'")
        known = {each.name: type(each.default) for each in fields(cls)}
        values = {}
        for key, value in content.items():
            if key not in known:
                raise ValueError(f"columns: unknown key {key!r:.60}; {nearest(key, known)}")
            values[key] = _of_kind(key, value, known[key])
        try:
            return cls(**values)
        except ValueError as error:
            raise ValueError(f"columns: {error}") from None


def _of_kind(key: str, value: object, kind: type) -> Any:
    """Convert a YAML value to `kind`; a header may be a number, and a float an integer."""
    if kind is str and isinstance(value, (str, int, float)) and not isinstance(value, bool):
        return str(value)
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if type(value) is kind:
        return value
    words = {str: "a text", bool: "true or false", int: "a whole number", float: "a number"}
    raise ValueError(f"columns: {key} must be {words[kind]}, got {value!r:.60}")
