# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""First look at a table, and its layout: signals, times, delimiters and open questions."""

import itertools
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.header_words import Named, known_unit, named, number_and_unit
from valve_friction_ros.records.table_rows import RawTable
from valve_friction_ros.records.written_times import (
    MIDNIGHT,
    TimeForm,
    is_date,
    is_day,
    is_time_of_day,
)

_NAMES = {"\t": "tab", ";": "semicolon", ",": "comma", "|": "vertical bar", " ": "blanks"}
_MOST_LABELS = 6
LONGEST_QUOTE = 40
"""Most characters of a name in a message. Chosen: the message stays on one line."""
OWN = {"time": "time_s", "position": "position_m", "pressure": "pressure_pa", "force": "force_n"}
"""Headers of tables written by this package, in its own units."""


def quoted(text: str) -> str:
    """Return a text in quotes, shortened to fit into a message."""
    return repr(text if len(text) <= LONGEST_QUOTE else f"{text[:LONGEST_QUOTE]}…")


@dataclass(frozen=True)
class TableSignal:
    """Location of a signal in the table `path`: the columns of its values, times and qualities."""

    quantity: str
    """``position``, ``pressure`` or ``force``."""
    name: str
    """The header, or the tag if each row has one value."""
    unit: str
    place: int
    """Column of the values."""
    time: tuple[int, ...]
    """Column of the times, or columns of days and times of day."""
    quality: int | None = None
    """Column of the qualities, if there are any."""
    path: Path = Path()


@dataclass(frozen=True, eq=False)
class Layout:
    """Instructions for reading the table `raw`."""

    raw: RawTable
    form: Columns
    """Given and recognized format: with it the next table is read in the same way."""
    headers: tuple[str, ...]
    first: int
    above: int
    """Row of the first values, numbered as in a spreadsheet, and the number of lines above it."""
    valves: Mapping[str, tuple[TableSignal, ...]]
    """The signals of each valve: its drive, its position, and the opposing pressure if it has one.
    The name of a single valve is empty."""
    times: Mapping[tuple[int, ...], TimeForm]
    """Formats of the times by their columns."""
    tag_place: int | None
    """Column of the tags if each row has one value."""
    good: Mapping[int, Callable[[str], bool]]
    """Functions that recognize good qualities, by column."""
    decimal: str
    texts: tuple[str, ...]
    """All texts above the values, and the tags: they may name the valve."""
    kinds: Mapping[str, str]
    """Recognized kind of each column, by header."""
    questions: tuple[str, ...] = ()
    """Open questions on the table, each with the option that answers it."""
    unclear: Mapping[str, str] = field(default_factory=dict)
    """Columns that may be a signal, with units, in a file with some signals of a valve."""
    beside: "tuple[Layout, ...]" = ()
    """Layouts of the other files of the valve."""

    @property
    def is_own(self) -> bool:
        """Whether the table has the headers of this package and needs no explanation."""
        names = [signal.name for signals in self.valves.values() for signal in signals]
        return (
            set(names) <= set(OWN.values())
            and not self.beside
            and self.form.time_column == OWN["time"]
            and self.form.delimiter in ("", ",")
            and not self.form.time_format
        )

    @cached_property
    def words(self) -> str:
        """Describe in one line how the table is read."""
        files = (self, *self.beside)
        parts = [f"{len(files)} files of a valve"] if self.beside else []
        parts += dict.fromkeys(word for one in files for word in one._form_words())  # noqa: SLF001
        for name, signals in list(self.valves.items())[:_MOST_LABELS]:
            told = [f"{one.quantity} {quoted(one.name)}" + _in_unit(one.unit) for one in signals]
            parts.append((f"{name}: " if name else "") + ", ".join(told))
        if len(self.valves) > _MOST_LABELS:
            parts.append(f"and {len(self.valves) - _MOST_LABELS} more valves")
        used = {signal.path for signals in self.valves.values() for signal in signals}
        if idle := [one.raw.path.name for one in files if self.valves and one.raw.path not in used]:
            parts.append(f"not needed: {', '.join(idle)}")
        return "read as: " + "; ".join(parts)

    def _form_words(self) -> list[str]:
        form = self.form
        parts = [_NAMES.get(form.delimiter, repr(form.delimiter))] if self.raw.is_text else []
        if self.raw.is_text:
            parts.append("decimal comma" if form.decimal == "," else "decimal point")
            if self.raw.encoding not in ("utf-8", "utf-8-sig"):
                parts.append({"cp1252": "Windows-1252"}.get(self.raw.encoding, self.raw.encoding))
        if self.tag_place is not None:
            parts.append("one value per row")
        return parts + sorted({self._time_words(form_of) for form_of in self.times.values()})

    def _time_words(self, form: TimeForm) -> str:
        if form.unit:
            since = str(np.datetime64(form.origin // 10**9, "s")).removesuffix("T00:00:00")
            since = "the year 0" if since.startswith("-") else since
            zone = form.zone or "UTC"
            return f"time in {form.unit}" + (f" since {since} {zone}" if form.origin else "")
        if not form.formats:
            return "time of the day"
        order = "day first, " if form.formats[0].startswith("%d") else ""
        order = "month first, " if form.formats[0].startswith("%m") else order
        zone = "with their zone" if form.has_zone else form.zone or "UTC, because no zone is stated"
        return f"dates {order}{zone}"


def _in_unit(unit: str) -> str:
    return f" in {'%' if unit == 'percent' else unit}" if unit else ""


_DELIMITERS = ("\t", ";", ",", "|", " ")
_SURE = "\t;|"
"""Delimiters that no number, date or header contains."""
_MOST_HEADER_ROWS = 8
_TYPES = ("#TYPES", "#ROWS", "#datatype", "#group", "#default")
"""Prefixes of rows of Ignition and InfluxDB above the headers, which contain no headers."""
_MOST_NAMES = 20
_GROUPED = re.compile(r"-?\d{1,3}(?:(?:,\d{3})+|(?:\.\d{3})+)")
"""Numbers with thousands, or with three decimals."""
_COMMA_OF_SECONDS = re.compile(r":\d\d,\d")
_UP_TO_999 = re.compile(r"[1-9]\d{0,2}")
_FILE_TIME = 116_444_736_000_000_000
"""Start of 1970 in Windows time, 100 ns since 1601."""


@dataclass
class SeenColumn:
    """A column during recognition."""

    place: int
    name: str
    said: Named
    cells: list[str] = field(default_factory=list)
    kind: str = ""

    @property
    def filled(self) -> list[str]:
        """The entries that are not empty."""
        return [cell for cell in self.cells if cell]


class Look:
    """Analyses the first rows of a table."""

    def __init__(self, raw: RawTable, form: Columns) -> None:
        self.raw, self.form = raw, form
        self.questions: list[str] = []
        self.lacking: dict[str, str] = {}
        self.decimal, self.delimiter = self._found_marks()
        self.rows = [
            (line, [cell.strip() for cell in row]) for line, row in raw.rows(self.delimiter)
        ]
        self.origin = self._top = 0
        self._paired = self._paired_headers()
        self.start = self._start()
        self.columns = self._columns()

    # Delimiter and decimal mark

    def _found_marks(self) -> tuple[str, str]:
        form = self.form
        delimiters = [form.delimiter] if form.delimiter else self._delimiters()
        decimals = [form.decimal] if form.decimal else (".", ",")
        scores: dict[tuple[str, str], int] = {}
        for delimiter in delimiters:
            rows = [row for _, row in self.raw.rows(delimiter)]
            rows = rows[len(rows) // 3 :] if len(rows) > 3 else rows
            for decimal in decimals:
                scores[delimiter, decimal] = sum(
                    _is_value(cell.strip(), decimal) for row in rows for cell in row
                )
        best = max(scores.values(), default=0)
        delimiter, decimal = next(key for key, score in scores.items() if score == best)
        if best == 0 and not form.delimiter and self.raw.is_text:
            delimiter = self._of_headers()
        elif not form.decimal and scores.get((delimiter, ","), -1) == scores[delimiter, "."]:
            decimal = self._decimal_of_even(delimiter)
        return decimal, delimiter

    def _delimiters(self) -> Sequence[str]:
        """Return the marks that may separate cells: blanks only where no line has a surer mark."""
        lines = list(filter(str.strip, self.raw.head))
        lines = lines[len(lines) // 3 :]
        is_sure = any(all(mark in line for line in lines) for mark in _SURE)
        return _DELIMITERS[: -1 if is_sure else None] if self.raw.is_text else ("",)

    def _of_headers(self) -> str:
        """Return the delimiter that splits the first line most often, for rows without values."""
        line = next(filter(str.strip, self.raw.head))
        counts = {mark: line.count(mark) for mark in _DELIMITERS[:-1]}
        return max(counts, key=lambda mark: counts[mark]) if any(counts.values()) else ","

    def _decimal_of_even(self, delimiter: str) -> str:
        """Return the decimal mark if both are possible for every number; ask if it matters.

        Seconds with a decimal comma settle it; those with a point do not, as ISO 8601 has it.

        Thousands are likely where one column has 1.250 and 987: three decimals would give 987.000.
        """
        columns = itertools.zip_longest(
            *(map(str.strip, row) for _, row in self.raw.rows(delimiter)), fillvalue=""
        )
        of_mark: dict[str, list[str]] = {".": [], ",": []}
        is_likely = False
        for cells in columns:
            if any(map(_COMMA_OF_SECONDS.search, cells)):
                return ","
            grouped = [cell for cell in cells if _GROUPED.fullmatch(cell)]
            small = sum(_UP_TO_999.fullmatch(cell) is not None for cell in cells)
            is_likely |= bool(grouped) and small > Columns.maximum_bad_share * len(cells)
            for cell in grouped:
                of_mark["," if "," in cell else "."].append(cell)
        if not (is_likely or of_mark[","]):
            return "."
        if delimiter == ";" and not (is_likely or of_mark["."]):
            return ","
        example = (of_mark[","] or of_mark["."])[0]
        mark = "comma" if "," in example else "point"
        self.questions.append(
            f"whether {quoted(example)} has a decimal {mark} or thousands "
            "(--decimal , or --decimal .)"
        )
        return "."

    # First row of values, and the rows above it

    def _start(self) -> int:
        """Return the index of the first row of values, below all rows without values."""
        rows = [row for _, row in self.rows]
        lower = rows[len(rows) // 2 :] if len(rows) > 3 else rows

        def has_value(row: Sequence[str], place: int) -> bool:
            return place < len(row) and _is_value(row[place], self.decimal)

        counts = Counter(
            place for row in lower for place in range(len(row)) if has_value(row, place)
        )
        least = 0.3 * max(counts.values(), default=0)
        places = [place for place, count in counts.items() if count >= least]
        begin = len(rows)
        for index in range(len(rows) - 1, max(self.form.skip_rows, self._top) - 1, -1):
            row = rows[index]
            comment = self.form.comment and row and row[0].startswith(self.form.comment)
            if not any(row) or comment or row[0].startswith(_TYPES):
                continue
            if not any(has_value(row, place) for place in places):
                if begin < len(rows) or index < len(rows) // 2:
                    break
                continue
            begin = index
        return begin

    def _paired_headers(self) -> list[list[str]]:
        """Return the headers of a table with two columns per channel (TwinCAT Scope), else none.

        The column of the milliseconds of a channel has labels such as ``Name`` and ``Unit`` for the
        entries above its values. The start of the export is given in 100 ns since 1601.
        """
        found: dict[str, list[str]] = {}
        places: list[int] = []
        for place, (_, row) in enumerate(self.rows):
            begin = re.fullmatch(r"Start.*;(\d{18})", ";".join(row[:2]))
            if begin and not found:
                self.origin = (int(begin[1]) - _FILE_TIME) * 100
            cells = row[: len(row) // 2 * 2]
            if len(cells) > 2 and len({*cells[::2]}) == 1 and re.match(r"[A-Za-z]", cells[0]):
                found[cells[0]] = cells[1::2]
                places.append(place)
        if "Name" not in found:
            self.origin = 0
            return []
        for place in places:
            self.rows[place] = (self.rows[place][0], [])
        self._top = places[-1] + 1
        units = [unit.split(" (")[0] for unit in found.get("Unit", [""] * len(found["Name"]))]
        return [
            [one for name in found["Name"] for one in ("time", name)],
            [one for unit in units for one in ("ms", known_unit(unit))],
        ]

    def _header_rows(self) -> list[list[str]]:
        if self._paired:
            return self._paired
        above = [row for _, row in self.rows[self.form.skip_rows : self.start]]
        while above and not any(above[-1]):
            del above[-1]
        given = [value for name, value in vars(self.form).items() if name.endswith("_column")]
        for index, row in enumerate(above):
            names = _names(row)
            if any(one in names for one in filter(None, given)):
                return above[index:]
        kept: list[list[str]] = []
        for row in reversed(above[-_MOST_HEADER_ROWS:]):
            if not any(row):
                break
            if row[0].startswith(_TYPES):
                del kept[: row[0] == "#TYPES"]
            elif kept and sum(map(bool, row)) < 2 and not row[0].startswith("#"):
                break
            else:
                kept.insert(0, row)
        return kept

    def _columns(self) -> list[SeenColumn]:
        header = self._header_rows()
        values = [row for _, row in self.rows[self.start :] if any(row)]
        wide = max(map(len, [*header, *values]), default=0)
        units = next((row for row in header[1:] if _are_units(row)), self._units_of_labview(wide))
        texts = [row for row in header if row is not units]
        if texts:
            texts.sort(key=lambda row: -sum(map(bool, row)))  # a stable order: the uppermost first
            texts = [row for row in texts if sum(map(bool, row)) >= 0.6 * sum(map(bool, texts[0]))]
        names = _names(texts[0]) if texts else [str(place + 1) for place in range(wide)]
        for row in texts[1:]:  # a row of merged cells leaves some columns without a name
            beside = itertools.zip_longest(names, row, fillvalue="")
            names = [name or other for name, other in beside]
        names = _with_groups(names, header[: header.index(texts[0])] if texts else [])
        self._require_headers(names, values)
        names += [""] * (wide - len(names))
        columns: list[SeenColumn] = []
        for place, name in enumerate(names):
            own = [name] + [row[place] for row in texts[1:] if place < len(row)]
            unit = units[place] if place < len(units) else ""
            count = names[: place + 1].count(name) if name and names.count(name) > 1 else 0
            title = f"{name} ({count})" if count else name
            column = SeenColumn(place, title, named(own, unit) if texts else Named(""))
            column.cells = [row[place] if place < len(row) else "" for row in values]
            column.kind = self._kind(column)
            columns.append(column)
        for day, clock in itertools.pairwise(columns):
            are_apart = (day.kind, clock.kind) == ("date", "clock")
            if are_apart and all(one.endswith(MIDNIGHT) for one in day.filled):
                day.kind = "day"
        self.unit_row = {
            column.name: known_unit(units[column.place])
            for column in columns
            if column.place < len(units)
        }
        return columns

    def _units_of_labview(self, wide: int) -> list[str]:
        """Return the row of units in the head of a LabVIEW measurement file, else empty cells."""
        above = [row for _, row in self.rows[: self.start]]
        if ["X_Value"] in (row[:1] for row in above):
            return next((row for row in above if row[:1] == ["Y_Unit_Label"]), [""] * wide)
        return [""] * wide

    def _require_headers(self, names: Sequence[str], values: Sequence[Sequence[str]]) -> None:
        """Ask where rows have more numbers than headers: columns and headers do not correspond."""
        wide = [
            row
            for row in values
            if any(_is_value(cell, self.decimal) for cell in row[len(names) :])
        ]
        if 2 * len(wide) > len(values):
            self.questions.append(
                f"which header each entry has, of {len(wide[0])} entries and {len(names)} headers: "
                "export it with another delimiter if decimal commas split its numbers, otherwise "
                "give each column a header"
            )

    def _kind(self, column: SeenColumn) -> str:
        cells = column.filled
        if not cells:
            return ""
        tests: Mapping[str, Callable[[str], bool]] = {
            "number": lambda cell: number_and_unit(cell, self.decimal) is not None,
            "date": is_date,
            "clock": is_time_of_day,
            "day": is_day,
        }
        counts = {kind: sum(map(test, cells)) for kind, test in tests.items()}
        best = max(counts, key=lambda kind: counts[kind])
        if column.said.quantity == "time" and self.form.time_format and best in ("number", "date"):
            return "date"
        if best == "day" and counts["number"] == counts["day"] and column.said.quantity != "time":
            best = "number"
        return best if counts[best] >= 0.3 * len(cells) else "text"

    @property
    def above(self) -> int:
        """The number of lines above the values."""
        return self.rows[self.start - 1][0] if self.start else 0

    @property
    def preamble(self) -> str:
        """All texts above the values."""
        return " ".join(cell for _, row in self.rows[: self.start] for cell in row)

    @property
    def names(self) -> str:
        """The names of the first columns, for a question."""
        names = [column.name[:LONGEST_QUOTE] or "''" for column in self.columns[:_MOST_NAMES]]
        return ", ".join(names)

    def of_kind(self, kind: str, quantity: str | None = None) -> list[SeenColumn]:
        """Return the columns of a kind, optionally only those whose names denote a quantity."""
        found = [column for column in self.columns if column.kind == kind]
        return [one for one in found if quantity is None or one.said.quantity == quantity]

    def by_name(self, name: str, option: str) -> SeenColumn | None:
        """Return the first column with a given name; note what is lacking."""
        found = [column for column in self.columns if column.name == name]
        if found:
            return found[0]
        self.lacking[option] = name
        return None


def _names(row: Sequence[str]) -> list[str]:
    """Return the headers in a row; numpy and others put a # before the first header."""
    names = [cell.strip()[:1000] for cell in row]
    if names[:1] == ["#"]:
        return names[1:]
    return [names[0].lstrip("#").lstrip(), *names[1:]] if names else []


def _with_groups(names: list[str], above: Sequence[Sequence[str]]) -> list[str]:
    """Prefix repeated names with merged cells above them, such as a valve above its signals."""
    for row in reversed(above):
        groups: list[str] = []
        for cell in row:
            groups.append(cell or (groups[-1] if groups else ""))
        names = [
            f"{group} {name}" if group and names.count(name) > 1 else name
            for name, group in itertools.zip_longest(names, groups, fillvalue="")
        ]
    return names


def _is_value(cell: str, decimal: str) -> bool:
    return bool(cell) and (
        number_and_unit(cell, decimal) is not None or is_date(cell) or is_time_of_day(cell)
    )


def _are_units(row: Sequence[str]) -> bool:
    """Return whether most cells of a row are units, apart from those of times and remarks."""
    cells = [cell for cell in row if cell.strip()]
    known = sum(bool(known_unit(cell)) for cell in cells)
    return known > 0 and 2 * known >= len(cells) - 1
