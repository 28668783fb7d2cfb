"""A table of numbers: its headers, its rows in blocks, and the row of a bad entry."""

import itertools
import re
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.records.columns import KNOWN_UNITS, Columns
from valve_friction_ros.records.tables.pipes import readable
from valve_friction_ros.records.tables.text_rows import csv_rows, repaired
from valve_friction_ros.records.tables.times import BadTimeError, WrittenTimes, is_iso
from valve_friction_ros.records.tables.workbook_rows import is_workbook, workbook_rows
from valve_friction_ros.records.units import unit_named

__all__ = ["OpenTable", "Table", "open_table", "read_columns"]

_Values = NDArray[np.float64] | NDArray[np.int64]
_Row = tuple[int, list[str]]

_BLOCK = 8192
"""Rows at a time: few megabytes of text."""

_HEADER_WITHIN = 200
"""Rows that are searched for the headers. Chosen: more than any preamble of an export."""

_LONGEST_QUOTE = 40
"""Characters of a bad entry in a message. Chosen: the message stays on one line."""

_MOST_NAMES = 20

_DECIMAL_COMMA = re.compile(r"\s*-?\d+,\d+\s*", re.ASCII)
_DATE = re.compile(r"\s*\d+[./-]\d+[./-]\d+\D+\d+:\d\d.*", re.ASCII)


def _quoted(text: str) -> str:
    text = repaired(text)
    return repr(text if len(text) <= _LONGEST_QUOTE else f"{text[:_LONGEST_QUOTE]}…")


def _names(row: Sequence[str]) -> list[str]:
    """Return the headers in a row; numpy and others put a # before the first."""
    names = [repaired(cell[:1000]).strip() for cell in row]
    return [names[0].lstrip("#").lstrip(), *names[1:]]


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of numbers, and their places in the file.

    Attributes
    ----------
    path : Path
        The file.
    rows : ndarray of int, shape (n,)
        Number of each row, as a spreadsheet counts.
    columns : mapping of str to ndarray, shape (n,) each
        The columns by header: float, and int (ns since 1970) of times that are written as dates.
    notes : tuple of str
        What a reader of the numbers should know of the file.
    """

    path: Path
    rows: NDArray[np.int64] = field(repr=False)
    columns: Mapping[str, _Values] = field(repr=False)
    notes: tuple[str, ...] = ()

    def where(self, wanted: NDArray[np.bool_]) -> "Table":
        """Return the rows where `wanted`, shape (n,), is true."""
        columns = {name: values[wanted] for name, values in self.columns.items()}
        return Table(self.path, self.rows[wanted], columns, self.notes)

    def place(self, sample: int, name: str) -> str:
        """Return file, row and column of an entry."""
        return f"{self.path}: {self.entry(sample, name)}"

    def entry(self, sample: int, name: str) -> str:
        """Return row (as a spreadsheet counts) and column of an entry."""
        return f"row {self.rows[sample]}, column {name!r}"

    def require_finite(self) -> None:
        """Raise ValueError, with file, row and column, for the first entry that is not finite."""
        for name, values in self.columns.items():
            finite = np.isfinite(values)
            if not finite.all():
                sample = int(np.argmin(finite))
                raise ValueError(
                    f"{self.place(sample, name)}: {values[sample]} is not finite: "
                    "use a stretch of the record without it"
                )


def joined(blocks: Sequence[Table]) -> Table:
    """Put blocks of one table together."""
    first = blocks[0]
    columns = {
        name: np.concatenate([block.columns[name] for block in blocks]) for name in first.columns
    }
    return Table(first.path, np.concatenate([each.rows for each in blocks]), columns, first.notes)


class _Column(NamedTuple):
    name: str
    place: int
    convert: Callable[[Sequence[str]], _Values]


@dataclass(frozen=True, eq=False)
class OpenTable:
    """A table whose headers were read."""

    path: Path
    form: Columns
    header: Sequence[str]
    rows: Iterator[_Row]
    notes: tuple[str, ...] = ()

    def _numbers(self, texts: Sequence[str]) -> NDArray[np.float64]:
        together = "".join(texts)
        is_comma = self.form.decimal != "."
        if "_" in together or not together.isascii() or (is_comma and "." in together):
            raise ValueError("Python reads what no file means by a number")
        if is_comma:
            texts = [text.replace(self.form.decimal, ".") for text in texts]
        return np.fromiter(map(float, texts), np.float64, len(texts))

    def _is_number(self, text: str) -> bool:
        try:
            self._numbers([text])
        except ValueError:
            return False
        return True

    def _place(self, name: str) -> int:
        if name not in self.header:
            of = [one for one in KNOWN_UNITS if getattr(self.form, f"{one}_column") == name]
            raise ValueError(self.no_column(repr(name), of))
        if self.header.count(name) > 1:
            raise ValueError(f"{self.path}: two columns are named {name!r}: rename one of them")
        return self.header.index(name)

    def no_column(self, wanted: str, quantities: Sequence[str] = ()) -> str:
        """Return the message for a file without a column, which is one of some quantities."""
        if len(self.header) == 1:
            only = self.header[0]
            return f"{self.path}: no column {wanted}, only {_quoted(only)}: " + _separated(only)
        listed = [name[:_LONGEST_QUOTE] for name in self.header[:_MOST_NAMES]]
        more = ", …" if len(self.header) > _MOST_NAMES else ""
        remedy = "rename one or name the right one"
        for name, quantity in itertools.product(self.header, quantities):
            if (unit := _unit_at_the_end(name, quantity)) and not self._is_named(name):
                option = f"--{quantity}"
                remedy = f"give {option}-column {shlex.quote(name)} {option}-unit {unit}"
                break
        return f"{self.path}: no column {wanted} among {', '.join(listed)}{more}: {remedy}"

    def _is_named(self, header: str) -> bool:
        return any(header == getattr(self.form, f"{one}_column") for one in KNOWN_UNITS)

    def _first_bad(self, rows: Sequence[_Row], columns: Sequence[_Column]) -> ValueError:
        """Find the entry that is not a number, for the message of an error."""
        for number, row in rows:
            for name, place, convert in columns:
                if place >= len(row):
                    return ValueError(
                        f"{self.path}: row {number} has no entry in column {name!r}: complete or "
                        "delete it"
                    )
                if convert == self._numbers and not self._is_number(row[place]):
                    remedy = "correct it or delete the row"
                    if _DECIMAL_COMMA.fullmatch(row[place]) and self.form.delimiter != ",":
                        remedy = 'name its decimal mark, --decimal , (decimal: "," in a valve file)'
                    if name == self.form.time_column and _DATE.fullmatch(row[place]):
                        remedy = "name the form of its dates, --time-format '%d.%m.%Y %H:%M:%S.%f'"
                    cause = f"{_quoted(row[place])} is not a number: {remedy}"
                    return ValueError(f"{self.path}: row {number}, column {name!r}: {cause}")
        return ValueError(f"{self.path}: the table cannot be read")

    def _block(self, rows: Sequence[_Row], columns: Sequence[_Column]) -> Table:
        try:
            entries = [[row[column.place] for _, row in rows] for column in columns]
            values = {
                column.name: column.convert(texts)
                for column, texts in zip(columns, entries, strict=True)
            }
        except BadTimeError as error:
            number, row = rows[error.place]
            time = columns[0]
            raise ValueError(
                f"{self.path}: row {number}, column {time.name!r}: {_quoted(row[time.place])} "
                f"{error}"
            ) from None
        except (ValueError, IndexError):
            raise self._first_bad(rows, columns) from None
        numbers = np.fromiter(map(itemgetter(0), rows), np.int64, len(rows))
        return Table(self.path, numbers, values, self.notes)

    def _has_units(self, row: Sequence[str], names: Mapping[str, str]) -> bool:
        """Return whether the row under the headers holds units; refuse other ones than named."""
        cells = {
            name: row[self._place(name)].strip() for name in names if self._place(name) < len(row)
        }
        if any(self._is_number(cell) or is_iso(cell) for cell in cells.values()):
            return False
        if self.form.time_format and not any(map(_quantity_of, cells.values())):
            return False
        for name, cell in cells.items():
            quantity, unit = names[name], _unit_in(cell)
            named = getattr(self.form, f"{quantity}_unit")
            if unit in KNOWN_UNITS[quantity] and unit != named:
                raise ValueError(
                    f"{self.path}: the row under the headers says that {name!r} is in {unit}, and "
                    f"{named} was named: name it by {quantity}_unit (--{quantity}-unit {unit})"
                )
        return True

    def blocks(self, names: Mapping[str, str], time: str = "") -> Iterator[Table]:
        """Read named columns of numbers, nan and inf among them, in blocks.

        Parameters
        ----------
        names : mapping of str to str
            Headers of the wanted columns, each with its quantity; the first is the time.
        time : str
            Header of the column that may hold dates.

        Raises
        ------
        ValueError
            In one line: the file, the row (as a spreadsheet counts) and what is wrong.
        """
        places = {name: self._place(name) for name in names}
        rows = list(itertools.islice(self.rows, _BLOCK))
        if rows and self._has_units(rows[0][1], names):
            rows = rows[1:] or list(itertools.islice(self.rows, _BLOCK))
        first = rows[0][1] if rows else []
        clock = None
        if time and (
            self.form.time_format or (places[time] < len(first) and is_iso(first[places[time]]))
        ):
            clock = WrittenTimes(self.form.time_zone, self.form.time_format)
        columns = [
            _Column(name, place, clock if clock and name == time else self._numbers)
            for name, place in places.items()
        ]
        while rows:
            yield self._block(rows, columns)
            rows = list(itertools.islice(self.rows, _BLOCK))


def _unit_in(cell: str) -> str:
    return unit_named(cell.strip().strip("[]()").strip())


def _unit_at_the_end(name: str, quantity: str) -> str:
    """Return the unit that ends a header, as in ``stem_mm`` or ``Pressure [bar]``, or nothing."""
    *words, last = re.split(r"[\s_()\[\]]+", name.rstrip(")] "))
    known = {unit.lower(): unit for unit in KNOWN_UNITS[quantity]}
    return known.get(unit_named(last).lower(), "") if any(words) else ""


def _quantity_of(cell: str) -> bool:
    return any(_unit_in(cell) in units for units in KNOWN_UNITS.values())


def _separated(header: str) -> str:
    for mark, name in ((";", "';'"), ("\t", "tab"), ("|", "'|'"), (",", "','")):
        if mark in header:
            return f"name the delimiter of the file (--delimiter {name})"
    return "name the delimiter of the file"


def open_table(path: Path, form: Columns, wanted: Sequence[Sequence[str]]) -> OpenTable:
    """Open a file, and find its headers.

    Parameters
    ----------
    path : Path
        CSV file, gzipped or not, Excel or Parquet; its first bytes decide. ``-`` is standard input.
    form : Columns
        How it is written.
    wanted : sequence of sequences of str
        The headers are the first row that has one name of each; else the first row.

    Raises
    ------
    ValueError
        If it cannot be read, or is empty.
    """
    place = readable(path, form.maximum_megabytes)
    rows = (workbook_rows if is_workbook(place) else csv_rows)(place, form, path)
    looked_at = []
    header = None
    for number, row in itertools.islice(rows, _HEADER_WITHIN):
        looked_at.append((number, row))
        names = _names(row)
        if all(any(name in names for name in either) for either in wanted):
            header, looked_at = names, []
            break
    if header is None:
        if not looked_at:
            raise ValueError(f"{path}: the file is empty")
        header = _names(looked_at[0][1])
    notes: tuple[str, ...] = ()
    if any("\udc80" <= mark <= "\udcff" for mark in "".join(row)):
        notes = (
            "the headers are not UTF-8 and were read as Windows-1252: name the encoding "
            "(--encoding) if they look wrong",
        )
    return OpenTable(path, form, header, itertools.chain(looked_at[1:], rows), notes)


def read_columns(path: Path, names: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    """Read named columns of finite numbers from a CSV file with a header, shape (n,) each.

    Raises ValueError, in one line, if the file cannot be read or holds anything else.
    """
    form = Columns()
    opened = open_table(path, form, [[name] for name in names])
    blocks = []
    for block in opened.blocks(dict.fromkeys(names, "time")):
        blocks.append(block)
        require_room(path, form, sum(each.rows.size for each in blocks))
    if not blocks:
        raise ValueError(f"{path}: there are no rows under the header")
    table = joined(blocks)
    table.require_finite()
    return {name: np.asarray(values, np.float64) for name, values in table.columns.items()}


def require_room(path: Path, form: Columns, rows: int) -> None:
    """Refuse more rows than are to be read."""
    if rows > form.maximum_rows:
        raise ValueError(
            f"{path}: more than {form.maximum_rows} rows: raise maximum_rows (--maximum-rows), or "
            "choose a part by --begin and --end"
        )
