"""Values of a diagnostic status, read by their keys: a name, what it says of it, and a unit."""

import math
import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from valve_friction_ros.outside_text import printable

__all__ = ["Entry", "Quantity", "entries_of", "number", "quantity"]

_KEY = re.compile(r"(?P<name>.*?)(?: \[(?P<unit>[^\]]*)\])?")
_LONGEST = 400


class Entry(NamedTuple):
    """One value as text: its name in words, the value, and its unit where it has one."""

    name: str
    text: str
    unit: str


class Quantity(NamedTuple):
    """A number with its interval.

    Attributes
    ----------
    name : str
        What it is, as in the keys.
    value, half_width : float
        The number, and half the width of its 95 % interval, in `unit`; nan where unknown.
    unit : str
        Its unit; empty for a pure number.
    verdict, reason : str
        Whether the record determines it, and why not; empty where nothing is said.
    """

    name: str
    value: float
    half_width: float = math.nan
    unit: str = ""
    verdict: str = ""
    reason: str = ""

    @property
    def is_known(self) -> bool:
        """Whether there is a value."""
        return math.isfinite(self.value)

    @property
    def if_determined(self) -> "Quantity":
        """The same, without value and width where the record does not determine it."""
        if self.verdict != "not identifiable":
            return self
        return self._replace(value=math.nan, half_width=math.nan)


def number(text: str | None) -> float:
    """Read a number; nan for a text that is none."""
    try:
        return math.nan if text is None else float(text)
    except ValueError:
        return math.nan


def quantity(values: Mapping[str, str], name: str, unit: str) -> Quantity:
    """Return the number of this name and unit with what else is said of it."""
    bracket = f" [{unit}]" if unit else ""
    return Quantity(
        name,
        number(values.get(name + bracket)),
        number(values.get(f"{name} half width{bracket}")),
        unit,
        printable(values.get(f"{name} verdict", ""), _LONGEST),
        printable(values.get(f"{name} reason", ""), _LONGEST),
    )


def entries_of(values: Mapping[str, str], keys: Iterable[str]) -> tuple[Entry, ...]:
    """Return some values as entries, with numbers of four digits."""
    return tuple(_entry(key, values[key]) for key in keys if values[key])


def _entry(key: str, text: str) -> Entry:
    match = _KEY.fullmatch(key)
    name, unit = (match["name"], match["unit"] or "") if match else (key, "")
    value = number(text)
    shown = printable(text, _LONGEST) if math.isnan(value) and text != "nan" else _rounded(value)
    unit = "" if unit in ("date", "time", "1") else unit
    return Entry(printable(name.replace("_", " "), _LONGEST), shown, printable(unit, 40))


def _rounded(value: float) -> str:
    if math.isnan(value):
        return "–"
    if abs(value) < 1e9 and value == round(value):
        return f"{value:.0f}"
    return f"{value:.4g}"
