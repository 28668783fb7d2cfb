"""Times of a table: ISO 8601, dates of a named form, and numbers."""

import re
from collections.abc import Sequence
from datetime import datetime, timedelta, timezone
from functools import lru_cache
from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import NDArray

__all__ = ["BadTimeError", "WrittenTimes", "is_iso"]

_ISO = re.compile(
    r"\s*(\d{4})-?(\d\d)-?(\d\d)(?:[Tt]|\s+)(\d\d):?(\d\d)(?::?(\d\d)(?:[.,](\d+))?)?"
    r"\s*([Zz]|UTC|[+\-−]\d\d(?::?\d\d)?)?\s*",
    re.ASCII,
)
"""Python 3.10 reads neither Z, nor a comma, nor nanoseconds."""

_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
_MINUTE = timedelta(minutes=1)


class BadTimeError(ValueError):
    """A text that is no time; `place` is its number in the list."""

    def __init__(self, place: int, cause: str) -> None:
        super().__init__(cause)
        self.place = place


def is_iso(text: str) -> bool:
    """Return whether a text is a date and time as ISO 8601 has them."""
    return len(text) < 100 and _ISO.fullmatch(text) is not None


@lru_cache(maxsize=1024)
def _zone(text: str, local: str) -> timezone | ZoneInfo:
    if not text:
        return ZoneInfo(local) if local else timezone.utc
    if text in ("Z", "z", "UTC"):
        return timezone.utc
    sign = 1 if text[0] == "+" else -1
    digits = text[1:].replace(":", "").ljust(4, "0")
    return timezone(sign * timedelta(hours=int(digits[:2]), minutes=int(digits[2:])))


@lru_cache(maxsize=4096)
def _minutes(minute: tuple[int, ...], zone: timezone | ZoneInfo) -> tuple[int, int]:
    """Return minutes since 1970 of a local minute, in summer and in winter where it comes twice."""
    year, month, day, hour, within = minute
    first = datetime(year, month, day, hour, within, tzinfo=zone)
    second = first.replace(fold=1)
    for local in (first, second):
        if local.astimezone(timezone.utc).astimezone(zone).replace(fold=0) == first.replace(fold=0):
            break
    else:
        raise ValueError(f"does not exist in {zone}: clocks were put forward")
    return (first - _EPOCH) // _MINUTE, (second - _EPOCH) // _MINUTE


class WrittenTimes:
    """Reads the times of a column in their order, ns since 1970.

    A local time that comes twice, when clocks are put back, is the second where the times would
    otherwise go back.
    """

    def __init__(self, zone: str, form: str = "") -> None:
        self._zone = zone
        self._form = form
        self._before = -(1 << 62)

    def _nanoseconds(self, text: str) -> int:
        if self._form:
            local = datetime.strptime(text.strip(), self._form)
            zone = local.tzinfo or _zone("", self._zone)
            second, rest = local.second, 1000 * local.microsecond
            minute: tuple[int, ...] = local.timetuple()[:5]
        else:
            found = _ISO.fullmatch(text) if len(text) < 100 else None
            if found is None:
                raise ValueError("is no time as ISO 8601 has it: correct it or delete the row")
            *date, seconds, fraction, offset = found.groups()
            zone = _zone(offset or "", self._zone)
            minute = tuple(map(int, date))
            second, rest = int(seconds or 0), int((fraction or "")[:9].ljust(9, "0"))
        if second > 60:
            raise ValueError("has more than 60 seconds")
        early, late = _minutes(minute, zone)
        within = second * 1_000_000_000 + rest
        time = early * 60_000_000_000 + within
        if late != early and time <= self._before:
            time = late * 60_000_000_000 + within
        self._before = time
        return time

    def __call__(self, texts: Sequence[str]) -> NDArray[np.int64]:
        """Convert texts; raises BadTimeError for the first that is none."""
        times = np.empty(len(texts), dtype=np.int64)
        place = 0
        try:
            for place, text in enumerate(texts):
                times[place] = self._nanoseconds(text)
        except (ValueError, OverflowError) as error:
            raise BadTimeError(place, str(error)) from None
        return times
