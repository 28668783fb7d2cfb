# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Interpretation of headers, tags and cells: quantity, unit and valve; number and unit."""

import re
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.records.units import KNOWN, SHARES, UNITS, unit_named

_WORDS = {
    "time": "time zeit timestamp stamp datetime date datum uhrzeit zeitstempel tstamp elapsed "
    "horodatage heure temps fecha hora tiempo ora tempo tijd",
    "position": "position pos stem travel lift hub stellung weg opening öffnung oeffnung feedback "
    "readback rückmeldung displacement stroke ventilstellung stellweg stemposition "
    "course tige ouverture posición posicion carrera vástago posizione corsa posição curso "
    "klepstand abertura stellungsrückmeldung stellungsrueckmeldung",
    "pressure": "pressure druck press air luft stelldruck actuator diaphragm antriebsdruck p "
    "ventildruck pression presión presion pressione pressão pressao",
    "force": "force kraft load",
    "command": "setpoint sp op output out command cmd demand sollwert soll cv request target "
    "stellsignal stellgröße mv",
    "quality": "quality status qstatus confidence güte qualität qualitätscode qualitaet valid "
    "questionable annotated good stat q dataintegrity qualité qualite calidad qualità qualidade "
    "kwaliteit kvalita jakość",
    "tag": "tag tagname tagid tagpath variablenname logname signalname parameter name point "
    "pointname signal series variable messstelle kanal sensor metric "
    "item id kks channel tags field varname",
    "value": "value wert val messwert vtq y varvalue floatvalue valeur valor valore",
    "unit": "unit units einheit eu uom engunits",
}
_QUANTITY = {word: name for name, words in _WORDS.items() for word in words.split()}
_OTHER_WORDS = (
    "supply inlet outlet upstream downstream line process differential dp zuluft vordruck "
    "nachdruck flow durchfluss temperature temperatur level speed p1 p2"
)
_STRONG_WORDS = "actuator diaphragm stelldruck antriebsdruck stem valve actual ist ventil"
_OTHER = frozenset(_OTHER_WORDS.split())
"""Words for signals that belong neither to the actuator nor to the stem."""
_STRONG = frozenset(_STRONG_WORDS.split())
"""Words that refer directly to the actuator or the stem."""
_ISA = re.compile(r"(?P<unit>\d*)(?P<letters>pi?t|pi|zi?t|zi|gi?t)(?P<loop>\d+[a-z]?)?")
"""Instrument letters of ISA 5.1: pressure, position (Z), position gauge (G)."""
_CAMEL = re.compile(r"(?<=[a-zäöü])(?=[A-ZÄÖÜ])|(?<=[A-Z])(?=[A-Z][a-zäöü])")
_BRACKETS = re.compile(r"[\[({<]([^\])}>]*)[\])}>]")
_LAST = re.compile(r"(?P<mark>\s+in\s+|\s*/\s*|_|[\s,:]+)(?P<unit>[^\s_/,:]+)\s*$")
_VAGUE = frozenset(("in", "h", "d", "m", "s", "n", "pu"))
"""Units that may mean something else as the last word of a header, without a mark before them."""
_IDLE = frozenset(["pv", "x", "t", "state", "fluid", "msg", "data"])
"""Words that denote neither a quantity nor a valve."""


class Named(NamedTuple):
    """Meaning of a header or a tag."""

    quantity: str
    """``time``, ``position``, ``pressure``, ``force``, ``command``, ``quality``, ``tag``,
    ``value``, ``unit``, ``other``, or empty."""
    unit: str = ""
    """Name of the unit in `records.units`, or empty."""
    label: str = ""
    """Rest of the name: the valve."""
    is_strong: bool = False
    """Whether it refers directly to the actuator or the stem."""


def plain_name(text: str) -> str:
    """Return the letters and digits of a name in lower case."""
    return "".join(filter(str.isalnum, text.casefold()))


def known_unit(text: str) -> str:
    """Return the unit named by a text, or ''."""
    unit = unit_named(text)
    return unit if unit in KNOWN else ""


def _unit_and_rest(text: str) -> tuple[str, str]:
    for found in reversed(list(_BRACKETS.finditer(text))):
        if unit := known_unit(found[1]):
            return unit, text[: found.start()] + " " + text[found.end() :]
    last = _LAST.search(text)
    unit = known_unit(last["unit"]) if last is not None else ""
    if last is not None and unit:
        is_marked = last["mark"].strip() in ("_", "/", "in")
        if is_marked or last["unit"].casefold() not in _VAGUE:
            return unit, text[: last.start()]
    if text.endswith("%"):
        return "percent", text[:-1]
    return "", text


_PROVIDER = re.compile(r"^\[\w+\](?=[\w -]+/)")
"""Provider before the path of a tag of Ignition."""

_PRESSURE_MESSAGE = re.compile(r"(?:/.*[/.])?fluid_pressure")
_JOINT_MESSAGE = re.compile(r"/.*/position(?:[/.\[]\w+\]?)?|/.*state.*[/.]position")


def _of_message(name: str) -> str:
    """Return the SI unit of a field of a ROS message, whose name begins with a topic, or ''."""
    if _PRESSURE_MESSAGE.fullmatch(name):
        return "Pa"
    return "m" if _JOINT_MESSAGE.fullmatch(name) else ""


def named(texts: Sequence[str], unit_cell: str = "") -> Named:
    """Interpret the header of a column from all rows of the header and its row of units."""
    texts = [_PROVIDER.sub("", text) for text in texts]
    unit, rest = _of_message(texts[0]), []
    for text in texts:
        own, without = _unit_and_rest(text.strip())
        unit = unit or own
        rest.append(without)
    unit = known_unit(unit_cell) or unit
    if texts[0].strip().casefold() == "x_value":  # seconds of LabVIEW
        return Named("time", unit or "s")
    words = [
        word.casefold() for word in re.split(r"[^\w]+|_", _CAMEL.sub(" ", " ".join(rest))) if word
    ]
    found: list[str] = []
    label: list[str] = []
    is_strong = False
    for place, word in enumerate(words):
        isa = _ISA.fullmatch(word)
        quantity = _QUANTITY.get(word, "")
        is_strong |= word in _STRONG
        if word in _OTHER or (word, words[place + 1 : place + 2]) == ("instrument", ["air"]):
            found.append("other")
        elif isa and (
            isa["loop"]
            or isa["letters"] in ("pt", "zt", "pit", "zit", "gt")
            or (words[place + 1 : place + 2] and words[place + 1][0].isdigit())
        ):
            found.append("pressure" if isa["letters"].startswith("p") else "position")
            label += filter(None, (isa["unit"], isa["loop"]))
        elif quantity == "command" and words[place - 1 : place] == ["pv"]:
            continue  # the value of a process variable: PV.CV, PV_Out
        elif quantity:
            found.append(quantity)
        elif word not in _STRONG and word not in _IDLE:
            label.append(word)
        elif word == "t" and len(words) == 1:
            found.append("time")
    return Named(_quantity(found, unit, words), unit, " ".join(label), is_strong)


def _quantity(found: Sequence[str], unit: str, words: Sequence[str]) -> str:
    """Choose the quantity: by the unit if only one quantity has it, else by the words."""
    of_unit = next((name for name, units in UNITS.items() if unit in units), "")
    for name in ("other", "quality", "command"):
        if name in found and not (name == "quality" and unit):
            return name
    if of_unit and (of_unit != "time" or not set(found) - {"time"}):
        return of_unit
    ranked = [name for name in ("force", "position", "pressure") if name in found]
    if "position" in ranked and "pressure" in ranked:
        weak = {"actuator", "diaphragm", "air", "p", "luft"}
        firm = [one for one in words if _QUANTITY.get(one) == "pressure" and one not in weak]
        return "" if firm else "position"
    if ranked:
        return ranked[0]
    for name in ("time", "tag", "value", "unit"):
        if name in found:
            return name
    return ""


_LONGEST = 60
"""Most characters of a number with its unit. Chosen: beyond any real one."""


@lru_cache
def _pattern(decimal: str) -> re.Pattern[str]:
    other = "," if decimal == "." else r"\."
    point = re.escape(decimal)
    groups = rf"[1-9]\d{{0,2}}(?:(?:{other}\d{{3}})+|(?:['’\u00a0\u202f ]\d{{3}})+)"
    whole = rf"(?:{groups}|\d+|(?={point}\d))"
    return re.compile(
        rf"(?P<number>[+\-−]?{whole}(?:{point}\d*)?(?:[eE][+\-]?\d+)?)\s*(?P<unit>[^\d\s].{{0,11}})?",
        re.ASCII,
    )


@lru_cache(maxsize=4096)
def number_and_unit(text: str, decimal: str) -> tuple[float, str] | None:
    """Read a number with an optional unit; return None if the text is not a number.

    Of comma and point, the one that is not the `decimal` mark separates thousands.
    """
    text = text.strip()
    if len(text) > _LONGEST:
        return None
    found = _pattern(decimal).fullmatch(text)
    if found is None:
        return None
    unit = known_unit(found["unit"] or "")
    if found["unit"] and not unit:
        return None
    thousands = "," if decimal == "." else "."
    plain = re.sub(r"['’\u00a0\u202f ]", "", found["number"]).replace(thousands, "")
    value = float(plain.replace("−", "-").replace(decimal, "."))
    return (value, unit) if np.isfinite(value) else None


def numbers(texts: Sequence[str], decimal: str, unit: str) -> NDArray[np.float64]:
    """Read numbers in `unit`, shape (n,); other texts become nan."""
    together = "".join(texts)
    plain = texts
    if decimal == "," and "." not in together:
        plain = [text.replace(",", ".") for text in texts]
    if together.isascii() and "_" not in together and (decimal == "." or "." not in together):
        try:
            found = np.fromiter(map(float, plain), np.float64, len(plain))
            return np.where(np.isfinite(found), found, np.nan)
        except ValueError:
            pass
    return np.fromiter((_converted(text, decimal, unit) for text in texts), np.float64, len(texts))


def _converted(text: str, decimal: str, unit: str) -> float:
    read = number_and_unit(text, decimal)
    if read is None:
        return np.nan
    value, own = read
    if not own or own == unit:
        return value
    if own in SHARES and unit in SHARES:
        (low, high), (begin, end) = SHARES[own], SHARES[unit]
        return begin + (value - low) / (high - low) * (end - begin)
    for known in UNITS.values():
        if own in known and unit in known:
            one, other = known[own], known[unit]
            return value * one.multiplier / one.divisor * other.divisor / other.multiplier
    return np.nan


_GOOD = re.compile(
    r"(good|ok|gut|valid|true|g|yes|ja|gültig|bon(ne)?|buen[ao]?|buon[ao]?|boa|goed)\b.*"
    r"|\(?good\b.*",
    re.IGNORECASE,
)
_OPC_UA_GOOD = re.compile("0x[0-3][0-9a-f]{7}", re.IGNORECASE)
"""Status codes of OPC UA whose upper two bits are 0."""
_DOUBT = re.compile("questionable|substituted|bad|invalid", re.IGNORECASE)
_TRUE_OR_FALSE = re.compile("true|false|0|1", re.IGNORECASE)
_OPC_GOOD, _OPC_MOST, _CERTAIN = 192, 255, 100
"""Range of good OPC qualities, and the confidence of a historian in a measured value."""


def told_good(
    name: str, cells: Sequence[str], decimal: str, given: str
) -> Callable[[str], bool] | None:
    """Return how to tell good qualities in a column, by the `given` words or its cells.

    None if these do not say which are good.
    """
    read = [number_and_unit(cell, decimal) for cell in cells]
    numbers = [one[0] for one in read if one is not None]
    if not given and _DOUBT.search(name) and all(map(_TRUE_OR_FALSE.fullmatch, cells)):
        given = "false,0"
    if given:
        words = {word.strip().casefold() for word in given.split(",")}
        return lambda cell: cell.strip().casefold() in words
    if len(numbers) == len(cells):
        is_opc = any(_OPC_GOOD <= value <= _OPC_MOST for value in numbers)
        least = _OPC_GOOD if is_opc else max(numbers)
        if is_opc or least == _CERTAIN:
            return lambda cell: bool(number_and_unit(cell, ".")) and float(cell) >= least
        if len(set(numbers)) == 1:  # of a code, a greater number is not a better one
            return lambda cell: bool(number_and_unit(cell, ".")) and float(cell) == least
    known = next((one for one in (_OPC_UA_GOOD, _GOOD) if any(map(one.fullmatch, cells))), None)
    if known:
        return lambda cell: known.fullmatch(cell.strip()) is not None
    return (lambda cell: cell.strip() == cells[0]) if len(set(cells)) == 1 else None
