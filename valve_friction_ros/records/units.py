# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Units of recorded numbers, and parsing of quantities such as a number with its unit."""

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Unit(NamedTuple):
    """Size of a unit as a ratio, so that decimals are converted with only one rounding.

    3.7 mm is 3.7/1000 m to the last bit; 3.7·0.001 m is not.
    """

    multiplier: float
    divisor: float = 1.0
    """The unit is multiplier/divisor SI units."""

    def to_si(self, values: "NDArray[np.float64]") -> "NDArray[np.float64]":
        """Convert values from this unit to the SI unit."""
        return values * self.multiplier / self.divisor


_POUND_FORCE = 4.4482216152605
_KILOGRAM_FORCE = 9.80665
"""Kilogram-force, N. Exact by definition: pound of 0.45359237 kg, standard gravity 9.80665 m/s²."""

PRESSURE_UNITS: Mapping[str, Unit] = {
    "Pa": Unit(1),
    "hPa": Unit(100),
    "kPa": Unit(1e3),
    "MPa": Unit(1e6),
    "mbar": Unit(100),
    "bar": Unit(1e5),
    "psi": Unit(_POUND_FORCE, 6.4516e-4),
    "kgf/cm2": Unit(_KILOGRAM_FORCE, 1e-4),
    "inH2O": Unit(249.08891),
    "inHg": Unit(3386.389),
    "mmHg": Unit(133.322387415),
}

POSITION_UNITS: Mapping[str, Unit] = {
    "m": Unit(1),
    "cm": Unit(1, 100),
    "mm": Unit(1, 1e3),
    "um": Unit(1, 1e6),
    "in": Unit(254, 1e4),
}

PERCENT = "percent"
SHARES: Mapping[str, tuple[float, float]] = {
    PERCENT: (0.0, 100.0),
    "fraction": (0.0, 1.0),
    "mA": (4.0, 20.0),
}
"""Units of a share of the travel or of the range of the pressure sensor, with both ends."""

FORCE_UNITS: Mapping[str, Unit] = {
    "N": Unit(1),
    "kN": Unit(1e3),
    "lbf": Unit(_POUND_FORCE),
    "kgf": Unit(_KILOGRAM_FORCE),
}

NANOSECONDS: Mapping[str, int] = {
    "ns": 1,
    "us": 1_000,
    "ms": 1_000_000,
    "s": 1_000_000_000,
    "min": 60_000_000_000,
    "h": 3_600_000_000_000,
    "d": 86_400_000_000_000,
    "microdays": 86_400_000,
}
"""Units of time in nanoseconds, the unit of all stamps."""

UNITS: Mapping[str, Mapping[str, Unit]] = {
    "time": {name: Unit(size, 1e9) for name, size in NANOSECONDS.items()},
    "position": POSITION_UNITS,
    "pressure": PRESSURE_UNITS,
    "force": FORCE_UNITS,
}
"""Units of signals by quantity."""

_NAMES = {
    PERCENT: "%, pct, prozent, % open, %open, percent open, % travel, % of travel, % of span",
    "fraction": "0-1, 0..1, p.u., pu, ratio",
    "mA": "4-20 mA, 4..20 mA",
    "us": "µs, μs",
    "ms": "millisecond, milliseconds, msec",
    "s": "sec, secs, second, seconds, sek",
    "min": "minute, minutes",
    "h": "hours",
    "d": "days",
    "um": "µm, μm, micron",
    "mm": "millimeter, millimetre",
    "m": "meter, metre",
    "in": '", inch, inches',
    "N": "newton",
    "Pa": "pascal",
    "kPa": "kPag, kPaa",
    "mbar": "mbarg",
    "bar": "barg, bara",
    "psi": "psig, psia",
    "kgf/cm2": "kg/cm2, kg/cm², kgf/cm², kg/cm2g, kg/cm²g",
    "inH2O": "in h2o, inwc, in wc, inch wc, inches h2o",
}
_OTHER_NAMES = {name: unit for unit, names in _NAMES.items() for name in names.split(", ")}

_BRACKETS = str.maketrans("[](){}<>", " " * 8)
_GAUGE_OR_ABSOLUTE = re.compile(r"\s+(?:g|a|abs|gauge|absolute|ü)$", re.IGNORECASE)
"""Suffixes of a unit of pressure; `pressure_reference` of the valve has the same meaning."""


def unit_named(name: str) -> str:
    """Return the name of a unit in this module, in any case; an unknown name is unchanged."""
    plain = _GAUGE_OR_ABSOLUTE.sub("", name.translate(_BRACKETS).strip())
    return _OTHER_NAMES.get(plain) or _BY_CASE.get(plain.casefold(), name)


AREA: Mapping[str, Unit] = {
    "m2": Unit(1),
    "cm2": Unit(1, 1e4),
    "mm2": Unit(1, 1e6),
    "in2": Unit(6.4516, 1e4),
}
MASS: Mapping[str, Unit] = {"kg": Unit(1), "g": Unit(1, 1e3), "lb": Unit(0.45359237)}

KNOWN = {*SHARES}.union(*UNITS.values())
"""Names of all units of signals."""

_BY_CASE = {name.casefold(): name for name in KNOWN} | {
    name.casefold(): known for name, known in _OTHER_NAMES.items()
}

_EXAMPLES = ((AREA, "690 cm2"), (POSITION_UNITS, "28.6 mm"), (MASS, "1.6 kg"))

_NUMBER = r"([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)"
_SINGLE = re.compile(rf"\s*{_NUMBER}\s*(\D.*?)?\s*", re.ASCII)
_SPAN = re.compile(rf"\s*{_NUMBER}\s*(?:\.\.|…|–|-|to)\s*{_NUMBER}\s*(\D.*?)?\s*", re.ASCII)


def _unit(text: str, name: str | None, units: Mapping[str, Unit]) -> Unit:
    plain = unit_named((name or "").replace("²", "2").replace("^2", "2").replace("sq in", "in2"))
    by_name = {known.lower(): size for known, size in units.items()}
    if plain.lower() not in by_name:
        what = f"unknown unit {plain[:20]!r}" if plain else "there is no unit"
        raise ValueError(f"{text[:60]!r}: {what}; known are {', '.join(units)}")
    return units[plain] if plain in units else by_name[plain.lower()]


def _si(number: str, unit: Unit) -> float:
    return float(number.replace(",", ".")) * unit.multiplier / unit.divisor


def quantity(text: str, units: Mapping[str, Unit]) -> float:
    """Convert a number with a unit, such as ``690 cm2``, to its SI unit; raises ValueError."""
    found = _SINGLE.fullmatch(text) if len(text) < 100 else None
    if found is None:
        example = next(each for known, each in _EXAMPLES if known is units)
        raise ValueError(f"{text[:60]!r} is not a number with a unit, such as {example}")
    number, name = found.groups()
    return _si(number, _unit(text, name, units))


def span(text: str, units: Mapping[str, Unit]) -> tuple[float, float]:
    """Convert a range with a unit, such as ``0.2..1.0 bar``, to its SI unit; raises ValueError."""
    found = _SPAN.fullmatch(text) if len(text) < 100 else None
    if found is None:
        raise ValueError(f"{text[:60]!r} is not a range with a unit, such as 0.2..1.0 bar")
    low, high, name = found.groups()
    unit = _unit(text, name, units)
    begin, end = _si(low, unit), _si(high, unit)
    if not begin < end:
        raise ValueError(f"{text[:60]!r}: give the range from low to high")
    return begin, end
