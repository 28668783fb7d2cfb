"""Tables of numbers in CSV files, gzipped or not, and the row of a bad entry."""

import contextlib
import csv
import gzip
import itertools
import warnings
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

__all__ = ["CsvLayout", "CsvTable", "no_column", "read_columns", "read_header", "read_table"]

_FIRST_ROW = 2
"""Number of the first row of data: a spreadsheet counts from 1, and the header is row 1."""

_LONGEST_QUOTE = 40
"""Characters of a bad entry in a message. Chosen: the message stays on one line."""


@dataclass(frozen=True)
class CsvLayout:
    """Delimiter of the entries of a row, and decimal mark within them.

    Raises ValueError if one of them is not a single usable character.
    """

    delimiter: str = ","
    decimal: str = "."

    def __post_init__(self) -> None:
        """Refuse characters that csv and numpy cannot use."""
        if len(self.delimiter) != 1 or self.delimiter in '"\r\n+-.' or self.delimiter.isalnum():
            raise ValueError(
                f"the delimiter must be one character such as ',', ';' or a tab, got "
                f"{self.delimiter!r}"
            )
        if self.decimal not in (".", ","):
            raise ValueError(f"the decimal mark must be '.' or ',', got {self.decimal!r}")
        if self.decimal == self.delimiter:
            raise ValueError(f"delimiter and decimal mark are both {self.decimal!r}")

    def number(self, text: str) -> str:
        """Return an entry with a point as its decimal mark."""
        return text if self.decimal == "." else text.replace(self.decimal, ".")


def _is_gzipped(path: Path) -> bool:
    with path.open("rb") as stream:
        return stream.read(2) == b"\x1f\x8b"


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[IO[str]]:
    """Open a file, gzipped or not; raise ValueError if it cannot be read to its end."""
    try:
        if _is_gzipped(path):
            with gzip.open(path, "rt", encoding="utf-8-sig", newline="") as stream:
                yield stream
        else:
            with path.open(encoding="utf-8-sig", newline="") as stream:
                yield stream
    except (OSError, EOFError, UnicodeDecodeError, csv.Error, zlib.error) as error:
        cause = (isinstance(error, OSError) and error.strerror) or error
        raise ValueError(f"{path}: cannot be read as CSV: {cause}") from None


def read_header(path: Path, layout: CsvLayout = CsvLayout()) -> list[str]:
    """Read the headers of the columns.

    Raises ValueError if the file cannot be read or has no headers.
    """
    with _opened(path) as stream:
        header = next(csv.reader(stream, delimiter=layout.delimiter), None)
    if header is None:
        raise ValueError(f"{path}: the file is empty")
    if not header:
        raise ValueError(f"{path}: row 1 is blank; it must hold the column headers")
    return [name.strip() for name in header]


def _is_number(text: str) -> bool:
    """Return whether numpy reads a number; Python also accepts underscores and other digits."""
    try:
        float(text)
    except ValueError:
        return False
    return text.isascii() and "_" not in text


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST_QUOTE else f"{text[:_LONGEST_QUOTE]}…"


def _rows(stream: IO[str], layout: CsvLayout) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows under the header that are not blank, with their numbers."""
    rows = csv.reader(stream, delimiter=layout.delimiter)
    next(rows)
    return ((number, row) for number, row in enumerate(rows, start=_FIRST_ROW) if row)


def _first_bad_entry(path: Path, wanted: Mapping[str, int], layout: CsvLayout) -> str:
    """Find the entry that is not a number, for the message of an error."""
    with _opened(path) as stream:
        for number, row in _rows(stream, layout):
            for name, index in wanted.items():
                if index >= len(row):
                    return f"row {number} has no entry in column {name!r}: complete or delete it"
                if not _is_number(layout.number(row[index])):
                    return (
                        f"row {number}, column {name!r}: {_shortened(row[index])!r} is not a "
                        "number: correct it or delete the row"
                    )
    return "the table cannot be read"


@dataclass(frozen=True, eq=False)
class CsvTable:
    """Columns of numbers, and their places in the file.

    Attributes
    ----------
    path : Path
        The file.
    layout : CsvLayout
        Delimiter and decimal mark.
    columns : mapping of str to ndarray of float, shape (n,) each
        The columns by name.
    samples : ndarray of int, shape (n,)
        Number of each row among the rows of the file that are not blank, from 0.
    """

    path: Path
    layout: CsvLayout
    columns: Mapping[str, NDArray[np.float64]] = field(repr=False)
    samples: NDArray[np.intp] = field(repr=False)

    def where(self, wanted: NDArray[np.bool_]) -> "CsvTable":
        """Return the rows where `wanted`, shape (n,), is true."""
        columns = {name: values[wanted] for name, values in self.columns.items()}
        return CsvTable(self.path, self.layout, columns, self.samples[wanted])

    def place(self, sample: int, name: str) -> str:
        """Return file, row and column of an entry."""
        return f"{self.path}: {self.entry(sample, name)}"

    def entry(self, sample: int, name: str) -> str:
        """Return row (as a spreadsheet counts) and column of an entry."""
        with _opened(self.path) as stream:
            rows = _rows(stream, self.layout)
            row, _ = next(itertools.islice(rows, int(self.samples[sample]), None))
        return f"row {row}, column {name!r}"

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


def no_column(path: Path, wanted: str, header: Sequence[str]) -> str:
    """Return the message for a file without a column."""
    if len(header) == 1:
        only = _shortened(header[0])
        return f"{path}: no column {wanted}, only {only!r}: name the delimiter of the file"
    return f"{path}: no column {wanted} among {', '.join(header)}: rename one or name the right one"


def read_table(
    path: Path,
    names: Sequence[str],
    layout: CsvLayout = CsvLayout(),
) -> CsvTable:
    """Read named columns of numbers, nan and inf among them, from a CSV file with a header.

    Parameters
    ----------
    path : Path
        The file, gzipped or not; its first bytes decide.
    names : sequence of str
        Headers of the wanted columns; others are ignored.
    layout : CsvLayout
        Delimiter and decimal mark.

    Raises
    ------
    ValueError
        In one line: the file, the row (as a spreadsheet counts) and what is wrong.
    """
    header = read_header(path, layout)
    for name in names:
        if name not in header:
            raise ValueError(no_column(path, repr(name), header))
        if header.count(name) > 1:
            raise ValueError(f"{path}: two columns are named {name!r}: rename one of them")
    wanted = {name: header.index(name) for name in names}
    try:
        with _opened(path) as stream, warnings.catch_warnings():
            warnings.filterwarnings("ignore", "loadtxt: input contained no data")
            table = np.loadtxt(
                map(layout.number, stream),
                delimiter=layout.delimiter,
                skiprows=1,
                usecols=list(wanted.values()),
                comments=None,
                quotechar='"',
                ndmin=2,
            )
    except (ValueError, IndexError):
        raise ValueError(f"{path}: {_first_bad_entry(path, wanted, layout)}") from None
    if table.size == 0:
        raise ValueError(f"{path}: there are no rows under the header")
    columns = {name: table[:, index] for index, name in enumerate(wanted)}
    return CsvTable(path, layout, columns, np.arange(table.shape[0]))


def read_columns(path: Path, names: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    """Read named columns of finite numbers from a CSV file with a header, shape (n,) each.

    Parameters and errors are those of `read_table`; an entry that is not finite is refused too.
    """
    table = read_table(path, names)
    table.require_finite()
    return dict(table.columns)
