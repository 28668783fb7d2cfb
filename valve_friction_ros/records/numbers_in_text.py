# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Numbers as people and programs write them: decimal commas, thousands, a unit behind them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.records.header_words import UNITS, known_unit
from valve_friction_ros.records.units import (
    FORCE_UNITS,
    NANOSECONDS,
    POSITION_UNITS,
    PRESSURE_UNITS,
    SHARES,
    Unit,
)

_SIZES = {**PRESSURE_UNITS, **POSITION_UNITS, **FORCE_UNITS}
_SIZES |= {name: Unit(size, 1e9) for name, size in NANOSECONDS.items()}
_LONGEST = 60
"""Characters of a number with its unit. Chosen: beyond any."""


@dataclass(frozen=True)
class Marks:
    """The decimal mark of numbers; the other one of comma and point separates thousands."""

    decimal: str = "."

    @property
    def thousands(self) -> str:
        """Return what separates thousands."""
        return "," if self.decimal == "." else "."


@lru_cache
def _pattern(decimal: str) -> re.Pattern[str]:
    other = "," if decimal == "." else r"\."
    point = re.escape(decimal)
    groups = rf"[1-9]\d{{0,2}}(?:(?:{other}\d{{3}})+|(?:['’\u00a0\u202f]\d{{3}})+)"
    whole = rf"(?:{groups}|\d+|(?={point}\d))"
    return re.compile(
        rf"(?P<number>[+\-−]?{whole}(?:{point}\d*)?(?:[eE][+\-]?\d+)?)\s*(?P<unit>[^\d\s].{{0,11}})?",
        re.ASCII,
    )


@lru_cache(maxsize=4096)
def number_and_unit(text: str, marks: Marks) -> tuple[float, str] | None:
    """Read a number, with its unit if there is one; None if it is none."""
    text = text.strip()
    if len(text) > _LONGEST:
        return None
    found = _pattern(marks.decimal).fullmatch(text)
    if found is None:
        return None
    unit = known_unit(found["unit"] or "")
    if found["unit"] and not unit:
        return None
    plain = re.sub(r"['’\u00a0\u202f]", "", found["number"]).replace(marks.thousands, "")
    value = float(plain.replace("−", "-").replace(marks.decimal, "."))
    return (value, unit) if np.isfinite(value) else None


def is_number(text: str) -> bool:
    """Return whether a text is a plain number."""
    return number_and_unit(text, Marks()) is not None


def numbers(texts: Sequence[str], marks: Marks, unit: str) -> NDArray[np.float64]:
    """Read numbers in `unit`, shape (n,); nan stands for what is none."""
    together = "".join(texts)
    plain = texts
    if marks.decimal == "," and "." not in together:
        plain = [text.replace(",", ".") for text in texts]
    if together.isascii() and "_" not in together and (marks.decimal == "." or "." not in together):
        try:
            found = np.fromiter(map(float, plain), np.float64, len(plain))
            return np.where(np.isfinite(found), found, np.nan)
        except ValueError:
            pass
    return np.fromiter((_in_unit(text, marks, unit) for text in texts), np.float64, len(texts))


def _in_unit(text: str, marks: Marks, unit: str) -> float:
    read = number_and_unit(text, marks)
    if read is None:
        return np.nan
    value, own = read
    if not own or own == unit:
        return value
    if own in SHARES and unit in SHARES:
        (low, high), (begin, end) = SHARES[own], SHARES[unit]
        return begin + (value - low) / (high - low) * (end - begin)
    if any(own in known and unit in known for known in UNITS.values()):
        one, other = _SIZES[own], _SIZES[unit]
        return value * one.multiplier / one.divisor * other.divisor / other.multiplier
    return np.nan
