# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""How a table is read: its signals, times and marks, and what of it is open."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.numbers_in_text import Marks
from valve_friction_ros.records.table_rows import RawTable
from valve_friction_ros.records.written_times import TimeForm

_NAMES = {"\t": "tab", ";": "semicolon", ",": "comma", "|": "bar", " ": "blanks"}
_MOST_LABELS = 6
LONGEST_QUOTE = 40
"""Characters of a name in a message. Chosen: the message stays on one line."""
OWN = {"time": "time_s", "position": "position_m", "pressure": "pressure_pa", "force": "force_n"}
"""Headers of this package, in its own units."""


def quoted(text: str) -> str:
    """Return a text in quotes, and not more of it than a message has room for."""
    return repr(text if len(text) <= LONGEST_QUOTE else f"{text[:LONGEST_QUOTE]}…")


@dataclass(frozen=True)
class TableSignal:
    """A signal of a table: where its values, times and qualities are.

    Attributes
    ----------
    quantity : str
        ``position``, ``pressure`` or ``force``.
    name : str
        Header, or tag where each row is one value.
    unit : str
        Of its numbers.
    place : int
        SeenColumn of its values.
    time : tuple of int
        SeenColumn of its times, or of days and times of the day.
    quality : int or None
        SeenColumn of its qualities.
    tag : str
        Its tag where each row is one value.
    """

    quantity: str
    name: str
    unit: str
    place: int
    time: tuple[int, ...]
    quality: int | None = None
    tag: str = ""


@dataclass(frozen=True, eq=False)
class Layout:
    """How a table is to be read.

    Attributes
    ----------
    raw : RawTable
        Its cells.
    form : Columns
        What was said and what was found: with it the next table is read alike.
    headers : tuple of str
        Names of all columns.
    first, above : int
        Row of the first values as a spreadsheet counts, and the number of lines above it.
    valves : mapping of str to tuple of TableSignal
        The signals of each valve: what drives it, its position, and the opposing pressure if it
        has one. The name of an only valve is empty.
    times : mapping of tuple of int to TimeForm
        How the times of the columns are written.
    tag_place : int or None
        SeenColumn of the tags where each row is one value.
    good : mapping of int to callable
        Tells good qualities by their column.
    marks : Marks
        Decimal and thousands marks.
    texts : tuple of str
        All that stands above the values, and the tags: what may name the valve.
    kinds : mapping of str to str
        What each column was taken for, by its header.
    questions : tuple of str
        What the table leaves open, each with the option that settles it.
    """

    raw: RawTable
    form: Columns
    headers: tuple[str, ...]
    first: int
    above: int
    valves: Mapping[str, tuple[TableSignal, ...]]
    times: Mapping[tuple[int, ...], TimeForm]
    tag_place: int | None
    good: Mapping[int, Callable[[str], bool]]
    marks: Marks
    texts: tuple[str, ...]
    kinds: Mapping[str, str]
    questions: tuple[str, ...] = ()

    @property
    def is_own(self) -> bool:
        """True for a table in the words of this package, of which nothing need be said."""
        names = [signal.name for signals in self.valves.values() for signal in signals]
        return (
            set(names) <= set(OWN.values())
            and self.form.time_column == OWN["time"]
            and self.form.delimiter in ("", ",")
            and not self.form.time_format
        )

    @cached_property
    def words(self) -> str:
        """Return in one line how the table is read."""
        form = self.form
        parts = [_NAMES.get(form.delimiter, repr(form.delimiter))] if self.raw.is_text else []
        if self.raw.is_text:
            parts.append("decimal comma" if form.decimal == "," else "decimal point")
            if self.raw.encoding not in ("utf-8", "utf-8-sig"):
                parts.append({"cp1252": "Windows-1252"}.get(self.raw.encoding, self.raw.encoding))
        if self.tag_place is not None:
            parts.append("one value a row")
        parts += sorted({self._time_words(form_of) for form_of in self.times.values()})
        for name, signals in list(self.valves.items())[:_MOST_LABELS]:
            told = [f"{one.quantity} {quoted(one.name)}" + _in_unit(one.unit) for one in signals]
            parts.append((f"{name}: " if name else "") + ", ".join(told))
        if len(self.valves) > _MOST_LABELS:
            parts.append(f"and {len(self.valves) - _MOST_LABELS} valves more")
        return "read as: " + "; ".join(parts)

    def _time_words(self, form: TimeForm) -> str:
        if form.unit:
            return f"time in {form.unit}" if not form.origin else "time as the days of a clock"
        if not form.formats:
            return "time of the day"
        order = "day first, " if form.formats[0].startswith("%d") else ""
        order = "month first, " if form.formats[0].startswith("%m") else order
        zone = "with their zone" if form.has_zone else form.zone or "UTC, as no zone is stated"
        return f"dates {order}{zone}"


def _in_unit(unit: str) -> str:
    return f" in {'%' if unit == 'percent' else unit}" if unit else ""


class AmbiguousTableError(ValueError):
    """A table leaves something open; the message asks for all of it at once."""
