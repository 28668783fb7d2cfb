# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Times in tables: numbers since an origin, dates in many formats, and times of day."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.records.units import NANOSECONDS
from valve_friction_ros.streams import DAY

if TYPE_CHECKING:
    import pandas as pd

NO_TIME = np.iinfo(np.int64).min
"""Marks a text that is not a time; the value of NaT in ns."""

_MONTHS = {
    "januar": "Jan", "jän": "Jan", "februar": "Feb", "märz": "Mar", "mär": "Mar", "mrz": "Mar",
    "april": "Apr", "mai": "May", "juni": "Jun", "juli": "Jul", "august": "Aug",
    "september": "Sep", "oktober": "Oct", "okt": "Oct", "november": "Nov", "dezember": "Dec",
    "dez": "Dec",
}  # fmt: skip
"""German months with their English abbreviations; others begin as in English."""

_OFFSETS = {"UTC": "+0000", "GMT": "+0000", "CET": "+0100", "MEZ": "+0100", "CEST": "+0200",
            "MESZ": "+0200"}  # fmt: skip
"""Zone names with a unique offset; American names are ambiguous (CST, EST, IST)."""

_JAVA = re.compile(
    r"^[A-Z][a-z]{2} ([A-Z][a-z]{2}) (\d{1,2}) (\d\d:\d\d:\d\d) ([A-Z]{3,4}) (\d{4})$"
)
_DATE = (
    r"(?:(?P<iso>\d{4})(?P<s1>[-/.])\d{1,2}(?P=s1)\d{1,2}"
    r"|(?P<compact>\d{8})"
    r"|(?P<first>\d{1,2})(?P<s2>[-/]|\. ?)(?P<second>\d{1,2})(?P=s2)(?P<year>\d{4}|\d{2})"
    r"|\d{1,2}(?P<s3>[-. ]{1,2})(?P<month>[A-Za-zäÄ]{3,9})(?P<s4>[-. ]{1,2})(?P<year3>\d{4}|\d{2})"
    r"|[A-Z][a-z]{2} \d{1,2}, (?P<american>\d{4}))"
)
_CLOCK = (
    r"(?P<hour>\d{1,2})(?P<colon>[:.]?)\d\d"
    r"(?:(?P=colon)(?P<seconds>\d\d)(?:(?P<mark>[.,:])(?P<fraction>\d{1,9}))?)?"
    r"(?P<gap>\s*)(?P<half>[AaPp]\.?\s?[Mm]\.?)?"
    r"(?P<gap2>\s*)(?P<zone>[Zz]|[+\-]\d\d:?\d\d|[+\-]\d\d|UTC|GMT|CET|MEZ|CEST|MESZ)?"
)
_STAMP = re.compile(rf"{_DATE}(?P<join>[Tt]|,?\s+){_CLOCK}")
_DAY = re.compile(_DATE)
_OF_DAY = re.compile(r"\d{1,2}:\d\d(?::\d\d)?(?:[.,]\d+)?\s*(?:[AaPp][Mm])?")
_POINTS = re.compile(r"(\d{1,2})\.(\d\d)\.(\d\d[.,]\d+)")
"""A time of day with points in place of colons; without a fraction it may be a date."""
_HALF = re.compile(r"[AaPp][Mm]$")
_HOUR = DAY // 24
_DURATION = re.compile(r"(?:\d+ days? )?\d{1,3}:\d\d:\d\d(?:[.,]\d+)?")


_REORDERED = re.compile(
    r"%(?P<first>[dm])(?P<mark>[./-])%[dm](?P=mark)%Y %H:%M:%S(?:(?P<point>[.,])%f)?"
)
"""Formats with the parts of ISO 8601 in another order, if all have two digits."""

MIDNIGHT = " 00:00:00"
"""End of a day in a workbook, where it is a date with a time."""

_HOURS_ONLY = re.compile(r":\d\d(?:\.\d+)?[+\-]\d\d$")


_EXACT = 2.0**53
"""Greatest number of ns that a float holds to the last: 104 days."""

_LEAST_SHORT_YEAR = 10
"""Least year of two digits beside - or /. Chosen: no export is from before 2010."""


def is_date(text: str) -> bool:
    """Return whether a text is a date with a time in a known format."""
    text = _JAVA.sub(r"\2-\1-\5 \3 \4", text.strip())
    return len(text) < 100 and _STAMP.fullmatch(text) is not None


def is_day(text: str) -> bool:
    """Return whether a text is a date without a time."""
    return len(text) < 40 and _DAY.fullmatch(text.strip()) is not None


def is_time_of_day(text: str) -> bool:
    """Return whether a text is a time without a date, or a duration."""
    text = text.strip()
    forms = (_OF_DAY, _POINTS, _DURATION)
    return len(text) < 40 and any(form.fullmatch(text) for form in forms)


def in_one(parts: Sequence[str]) -> str:
    """Join a date, a time of day and milliseconds, of which one of the latter may be missing.

    Seconds since 1970 are joined with their nanoseconds.
    """
    day, clock, *rest = (part.strip() for part in parts)
    if day.isdigit():
        return f"{day}.{clock:0>9}"
    if clock.isdigit():
        return f"{day}.{clock:0>3}"
    return f"{day.removesuffix(MIDNIGHT)} {clock}" + "".join(f".{one:0>3}" for one in rest)


@dataclass(frozen=True)
class TimeForm:
    """Format of times."""

    formats: tuple[str, ...] = ()
    """Formats of dates (strptime), the most frequent first; empty for numbers and durations."""
    zone: str = ""
    """Zone of dates, unless each has its own (`has_zone`), and of numbers in days."""
    unit: str = ""
    origin: int = 0
    """Unit of numbers, and their origin, ns since 1970."""
    has_zone: bool = False
    last: str = "s"
    """Unit of the last part of a time of day with two parts, s or min."""
    is_assumed: bool = False
    """Whether the unit of numbers is neither given nor stated."""


def date_forms(texts: Sequence[str]) -> tuple[list[tuple[str, ...]], bool]:
    """Find the formats that fit all texts, and whether each text has a zone.

    The formats are grouped by their order: day, month or two-digit year first. There is no group if
    a text is not a date with a time.
    """
    day: dict[str, None] = {}
    month: dict[str, None] = {}
    year: dict[str, None] = {}
    has_zone = True
    day_possible = month_possible = year_possible = True
    for raw in texts:
        text = _normal(raw)
        found = _STAMP.fullmatch(text)
        if found is None:
            return [], False
        has_zone &= found["zone"] is not None
        day[_format(found, "%d", "%m")] = None
        if found["first"] is None:
            month_possible = year_possible = False
            continue
        if found["s2"][0] == ".":
            month_possible = year_possible = False
        elif len(found["year"]) == 2 and int(found["year"]) < _LEAST_SHORT_YEAR:
            day_possible = month_possible = False
        year_possible &= len(found["year"]) == 2 and 1 <= int(found["year"]) <= 31
        year_possible &= int(found["first"]) >= _LEAST_SHORT_YEAR and int(found["second"]) <= 12
        day_possible &= int(found["second"]) <= 12
        month_possible &= int(found["first"]) <= 12
        is_american = found["half"] and found["s2"] == "/" and len(found["first"]) == 1
        if is_american and not found["second"].startswith("0") and len(found["second"]) == 1:
            day_possible = False  # 7/1/2026 2:00 PM; with the day first it would be 1/07
        month[_format(found, "%m", "%d")] = None
        year[_format(found, "%y", "%m", "%d")] = None
    groups = ((day, day_possible), (month, month_possible), (year, year_possible))
    orders = [_with_and_without_fraction(forms) for forms, possible in groups if forms and possible]
    return orders, has_zone


def _with_and_without_fraction(forms: Iterable[str]) -> tuple[str, ...]:
    """Add each format with and without fractions, which some programs omit for whole seconds."""
    known = dict.fromkeys(forms)
    for form in list(known):
        known[re.sub(r"[.,:]%f", "", form) if "%f" in form else form.replace("%S", "%S.%f")] = None
    return tuple(known)


def _format(found: re.Match[str], first: str, second: str, third: str = "") -> str:
    """Return the strptime format of a recognized date; its third part is the year by default."""
    if found["iso"]:
        date = f"%Y{found['s1']}%m{found['s1']}%d"
    elif found["compact"]:
        date = "%Y%m%d"
    elif found["first"]:
        year = third or ("%Y" if len(found["year"]) == 4 else "%y")
        date = f"{first}{found['s2']}{second}{found['s2']}{year}"
    elif found["american"]:
        date = "%b %d, %Y"
    else:
        year = "%Y" if len(found["year3"]) == 4 else "%y"
        date = f"%d{found['s3']}%b{found['s4']}{year}"
    clock = ("%I" if found["half"] else "%H") + found["colon"] + "%M"
    if found["seconds"]:
        clock += found["colon"] + "%S"
    if found["fraction"]:
        clock += found["mark"] + "%f"
    clock += found["gap"] + ("%p" if found["half"] else "")
    return date + found["join"] + clock + found["gap2"] + ("%z" if found["zone"] else "")


def _normal(text: str) -> str:
    """Return a date in terms that strptime knows: English months, offsets."""
    text = _JAVA.sub(r"\2-\1-\5 \3 \4", text.strip())
    if text.isascii() and not any(map(str.isalpha, text)):
        return text
    for name, offset in _OFFSETS.items():
        if text.upper().endswith(f" {name}"):
            text = text[: -len(name)] + offset
    return re.sub(
        r"[A-Za-zäÄ]{3,9}",
        lambda word: _MONTHS.get(word[0].casefold(), word[0][:3].title()),
        re.sub(r"([AaPp])\.?\s?([Mm])\.?", r"\1\2", text),
    )


def _ns(times: "pd.DatetimeIndex | pd.TimedeltaIndex") -> NDArray[np.int64]:
    return np.asarray(times.as_unit("ns").asi8, np.int64)


class WrittenTimes:
    """Reads the times of a column in order, ns.

    A local time that occurs twice, when clocks are set back, is taken as the second occurrence if
    the times would otherwise go back. Other texts become `NO_TIME`.
    """

    def __init__(self, form: TimeForm) -> None:
        self._form = form
        self._is_summer = True
        self._before = NO_TIME
        self._days = 0

    def __call__(self, cells: "pd.Series[Any]", numbers: NDArray[np.float64]) -> NDArray[np.int64]:
        """Convert the cells of a block; `numbers` are the values of those that are numbers."""
        import pandas as pd  # noqa: PLC0415 - slow to import

        if self._form.unit:
            stamps = self._stamps(numbers)
            return self._localized(pd.DatetimeIndex(stamps)) if self._form.zone else stamps
        if pd.api.types.is_datetime64_any_dtype(cells.dtype):
            times = pd.DatetimeIndex(cells)
            if times.tz is not None:
                return _ns(times.tz_convert("UTC").tz_localize(None))
            return self._localized(times.as_unit("ns"))
        texts = cells.fillna("").str.strip()
        if not self._form.formats:
            return self._durations(texts)
        times = self._dates(texts)
        return _ns(times) if self._form.has_zone else self._localized(times)

    def _stamps(self, numbers: NDArray[np.float64]) -> NDArray[np.int64]:
        """Convert numbers, in whole ns; of a date, the ns are the rounding of the number."""
        size = NANOSECONDS[self._form.unit]
        origin, later = divmod(self._form.origin, size)
        floor = np.floor(numbers)
        with np.errstate(over="ignore"):
            known = np.abs((floor + origin) * size) < 9e18
        whole = np.where(known, floor + origin, 0).astype(np.int64) * size
        rest = np.rint(np.where(known, numbers - floor, 0) * size).astype(np.int64)
        stamps = whole + rest + later
        is_rounded = np.abs(numbers) > _EXACT / size
        return np.where(known, np.where(is_rounded, (stamps + 500) // 1000 * 1000, stamps), NO_TIME)

    def _durations(self, texts: "pd.Series[str]") -> NDArray[np.int64]:
        import pandas as pd  # noqa: PLC0415 - slow to import

        plain = texts.str.replace(_POINTS, r"\1:\2:\3", regex=True)
        plain = plain.str.replace(",", ".", regex=False)
        half = plain.str[-2:].str.casefold() if _HALF.search("".join(plain.iloc[:1])) else None
        plain = plain if half is None else plain.str[:-2].str.strip()
        short = plain.str.count(":") == 1
        if short.any():
            is_minutes = self._form.last == "min" or half is not None
            plain = plain.where(~short, plain + ":00" if is_minutes else "00:" + plain)
        times = _ns(pd.TimedeltaIndex(pd.to_timedelta(plain, errors="coerce")))
        if half is not None:
            later = np.where((half == "pm").to_numpy(), DAY // 2, 0)
            times = np.where(times == NO_TIME, NO_TIME, times % (DAY // 2) + later)
        return self._over_midnight(times)

    def _over_midnight(self, times: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return times of day that continue after midnight."""
        known = times != NO_TIME
        if not known.any():
            return times
        own = times[known]
        before = np.concatenate([own[:1] if self._before == NO_TIME else [self._before], own[:-1]])
        days = self._days + np.cumsum((before - own > DAY - _HOUR) & (before < DAY))
        self._before, self._days = int(own[-1]), int(days[-1])
        found = times.copy()
        found[known] = own + days * DAY
        return found

    def _dates(self, texts: "pd.Series[str]") -> "pd.DatetimeIndex":
        import pandas as pd  # noqa: PLC0415 - slow to import

        is_utc = self._form.has_zone
        sample = "".join(texts.iloc[:1])
        if any(map(str.isalpha, sample.replace("T", "").replace("Z", ""))):
            texts = texts.map(_normal)
        if is_utc and _HOURS_ONLY.search(sample):
            texts = texts + "00"
        found = self._in_iso(texts)
        for form in self._form.formats:
            left = texts[found.isna()]
            if not len(left):
                break
            found = found.fillna(pd.to_datetime(left, format=form, errors="coerce", utc=is_utc))
        times = pd.DatetimeIndex(found).as_unit("ns")
        return times.tz_localize(None) if is_utc else times

    def _in_iso(self, texts: "pd.Series[str]") -> "pd.Series[Any]":
        """Convert dates of the first format; pandas reads ISO 8601 ten times faster than others."""
        import pandas as pd  # noqa: PLC0415 - slow to import

        form = self._form.formats[0]
        if (found := _REORDERED.fullmatch(form)) is not None:
            marks, point = 2 * found["mark"], found["point"] or ""
            first, second = slice(0, 2), slice(3, 5)
            day, month = (first, second) if found["first"] == "d" else (second, first)
            iso = [
                f"{one[6:10]}-{one[month]}-{one[day]} {one[11:19]}{point and '.'}{one[20:]}"
                if one[2:6:3] == marks and one[10:11] == " " and one[19:20] == point
                else ""
                for one in texts
            ]
            texts = pd.Series(iso, texts.index)
            form = "%Y-%m-%d %H:%M:%S" + (".%f" if point else "")
        return pd.to_datetime(texts, format=form, errors="coerce", utc=self._form.has_zone)

    def _localized(self, times: "pd.DatetimeIndex") -> NDArray[np.int64]:
        naive = _ns(times)
        if not self._form.zone:
            return naive
        known = naive != NO_TIME
        if not known.any():
            return naive
        local = times[known]
        summer = np.ones(len(local), np.bool_)
        as_summer, as_winter = (
            _ns(local.tz_localize(self._form.zone, ambiguous=each, nonexistent="NaT"))
            for each in (summer, ~summer)
        )
        before = np.concatenate([[self._before], as_summer[:-1]])
        comes_twice = as_summer != as_winter
        is_back = comes_twice & (as_summer < before)
        is_summer = self._is_summer & (np.cumsum(is_back) == 0)
        self._is_summer = bool(is_summer[-1]) or not comes_twice[-1]
        self._before = int(as_summer[-1])
        utc = naive.copy()
        utc[known] = np.where(is_summer, as_summer, as_winter)
        return utc


_LEAST_YEAR, _MOST_YEAR = 1990, 2060
_EPOCHS: tuple[tuple[str, float], ...] = (
    ("s", 0.0),
    ("ms", 0.0),
    ("us", 0.0),
    ("ns", 0.0),
    ("d", -25_569.0),  # spreadsheets: days since 1899-12-30
    ("microdays", -25_569e6),  # WinCC: millionths of them
    ("d", -719_529.0),  # MATLAB: days since the year 0
    ("s", -2_082_844_800.0),  # LabVIEW: seconds since 1904
)
"""Numeric clocks: unit, and origin relative to 1970 in this unit."""

_FINEST, _COARSEST = 1e-5, 30.0
"""Range of sampling periods, s, for a clock without a stated unit. Chosen: beyond any record."""


def clock_of(first: float, step: float) -> tuple[str, int] | None:
    """Find the clock for which `first` is a present-day date and `step` a sampling period.

    Return its unit and its origin, ns since 1970; None for a time that starts with the record.
    """
    for unit, since in _EPOCHS:
        size = NANOSECONDS[unit] / 1e9
        seconds = (first + since) * size
        if not _COARSEST >= step * size >= _FINEST or not 0 < seconds < 4e9:
            continue
        if _LEAST_YEAR <= datetime.fromtimestamp(seconds, timezone.utc).year <= _MOST_YEAR:
            return unit, round(since * NANOSECONDS[unit])
    return None
