"""Quantities as people write them: a number or a range, and its unit."""

import re
from collections.abc import Mapping

from valve_friction_ros.records.units import POSITION_UNITS, PRESSURE_UNITS, Unit, unit_named

__all__ = ["AREA", "LENGTH", "MASS", "PRESSURE", "quantity", "span"]

AREA: Mapping[str, Unit] = {
    "m2": Unit(1),
    "cm2": Unit(1, 1e4),
    "mm2": Unit(1, 1e6),
    "in2": Unit(6.4516, 1e4),
}
LENGTH, PRESSURE = POSITION_UNITS, PRESSURE_UNITS
MASS: Mapping[str, Unit] = {"kg": Unit(1), "g": Unit(1, 1e3), "lb": Unit(0.45359237)}

_EXAMPLES = ((AREA, "690 cm2"), (LENGTH, "28.6 mm"), (MASS, "1.6 kg"))

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
    import numpy as np  # noqa: PLC0415 - slow to import

    return float(unit.to_si(np.array([float(number.replace(",", "."))]))[0])


def quantity(text: str, units: Mapping[str, Unit]) -> float:
    """Read a number with its unit, as ``690 cm2``, in its SI unit; raises ValueError."""
    found = _SINGLE.fullmatch(text) if len(text) < 100 else None
    if found is None:
        example = next(each for known, each in _EXAMPLES if known is units)
        raise ValueError(f"{text[:60]!r} is no number with its unit, as {example}")
    number, name = found.groups()
    return _si(number, _unit(text, name, units))


def span(text: str, units: Mapping[str, Unit]) -> tuple[float, float]:
    """Read a range with its unit, as ``0.2..1.0 bar``, in its SI unit; raises ValueError."""
    found = _SPAN.fullmatch(text) if len(text) < 100 else None
    if found is None:
        raise ValueError(f"{text[:60]!r} is no range with its unit, as 0.2..1.0 bar")
    low, high, name = found.groups()
    unit = _unit(text, name, units)
    begin, end = _si(low, unit), _si(high, unit)
    if not begin < end:
        raise ValueError(f"{text[:60]!r}: the range must rise")
    return begin, end
