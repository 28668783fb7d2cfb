# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The cells of a table: CSV, gzipped or not, or from a pipe; Excel; Parquet; MATLAB.

pandas parses text; it is imported when a table is read.
"""

import atexit
import codecs
import contextlib
import csv
import functools
import gzip
import importlib
import io
import itertools
import math
import re
import shutil
import stat
import sys
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.files import cause_of

if TYPE_CHECKING:
    import pandas as pd

STANDARD_INPUT = Path("-")
_COPIED = 1 << 20


@functools.cache
def _copy(path: Path, most: float) -> Path:
    """Copy a pipe to a file that is removed with the process."""
    folder = tempfile.mkdtemp(prefix="valve_friction_")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    target = Path(folder, "pipe")
    source = sys.stdin.buffer if path == STANDARD_INPUT else path.open("rb")
    size = 0
    with target.open("wb") as whole, source:
        while piece := source.read(_COPIED):
            size += len(piece)
            if size > most * 1e6:
                raise ValueError(
                    f"{path}: more than {most:g} MB: raise maximum_megabytes "
                    "(--maximum-megabytes), or cut it"
                )
            whole.write(piece)
    return target


def readable(path: Path, most: float) -> Path:
    """Return a file with the content of `path`, which may be standard input or a pipe.

    Raises ValueError if a pipe holds more than `most` MB.
    """
    try:
        is_pipe = path == STANDARD_INPUT or stat.S_ISFIFO(path.stat().st_mode)
        return _copy(path, most) if is_pipe else path
    except OSError:
        return path  # opening it later reports the cause


_LONGEST_LINE = 1 << 20
"""Longest line, bytes. Chosen: far beyond any table, but little memory."""

_PIECE = 1 << 16
"""Bytes read at a time."""

BLOCK = 1 << 16
"""Rows converted at a time. Chosen: some megabytes of text."""

PROGRESS: ContextVar[Callable[[float], None] | None] = ContextVar("progress", default=None)
"""Callback that receives the share of a text read so far, block by block."""

LOOKED_AT = 300
"""Rows analysed before a table is read. Chosen: more than any preamble of an export."""

_LOOKED_AT_SIZE, _LEAST_LOOKED_AT = 1 << 18, 40
"""Characters after which fewer rows are analysed, and the least rows. Chosen: a second."""

_MOST_COLUMNS = 16_384
"""Most columns of a text, as of a sheet in a workbook."""

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_FALLBACK = "cp1252"
"""Encoding of bytes that are not UTF-8, as used by Windows in Western Europe and America."""


class _Bounded(io.RawIOBase):
    """The bytes of a file, unpacked if gzipped; refuses too large files and endless lines."""

    def __init__(self, path: Path, most: float) -> None:
        self._most = most
        self._left = most * 1e6
        self._line = self._quoted = 0
        self._file = path.open("rb")
        self._size = max(path.stat().st_size, 1)
        is_packed = self._file.read(2) == b"\x1f\x8b"
        self._file.seek(0)
        self._stream = cast(IO[bytes], self._file)
        if is_packed:
            self._stream = cast(IO[bytes], gzip.GzipFile(fileobj=self._file))

    def readable(self) -> bool:
        """Return True, as io requires."""
        return True

    def close(self) -> None:
        if not self.closed:
            self._stream.close()
            self._file.close()
        super().close()

    @property
    def share(self) -> float:
        """Share of the file read so far."""
        return self._file.tell() / self._size

    def readinto(self, room: Any, /) -> int:
        """Read the next bytes into `room`."""
        piece = self._stream.read(len(memoryview(room)))
        self._left -= len(piece)
        if self._left < 0:
            raise ValueError(
                f"more than {self._most:g} MB, unpacked: raise maximum_megabytes "
                "(--maximum-megabytes), or cut the file"
            )
        end = max(piece.rfind(b"\n"), piece.rfind(b"\r"))
        self._line = len(piece) - end - 1 + (self._line if end < 0 else 0)
        if self._line > _LONGEST_LINE:
            raise ValueError(f"a line has more than {_LONGEST_LINE} bytes: this is not a CSV file")
        self._require_quotes(piece)
        memoryview(room)[: len(piece)] = piece
        return len(piece)

    def _require_quotes(self, piece: bytes) -> None:
        """Refuse an unclosed quote, after which everything would be one cell."""
        is_open = self._quoted > 0
        if count := piece.count(b'"'):
            is_open ^= bool(count % 2)
            self._quoted = len(piece) - piece.rfind(b'"') if is_open else 0
        elif is_open:
            self._quoted += len(piece)
        if self._quoted > _LONGEST_LINE:
            raise ValueError(f"a quote is not closed within {_LONGEST_LINE} bytes")


def encoding_of(start: bytes) -> str:
    """Return the encoding of a text, from its byte order mark or its first bytes."""
    for mark, encoding in _MARKS:
        if start.startswith(mark):
            return encoding
    if len(start) > 1 and 0 in start[:2]:  # UTF-16 without a mark: every other byte is zero
        return "utf-16-be" if start[0] == 0 else "utf-16-le"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(start)
    except UnicodeDecodeError:
        return _FALLBACK
    return "utf-8"


Cells = tuple[NDArray[np.int64], "pd.DataFrame"]
"""Row numbers as in a spreadsheet, and their cells: text, or the types of a typed file."""


@dataclass(frozen=True, eq=False)
class RawTable:
    """The cells of a file before recognition."""

    path: Path
    """The file, as named in messages."""
    form: Columns
    place: Path
    """The file, as it is opened."""
    head: tuple[str, ...] = ()
    cells: Sequence[Sequence[str]] = ()
    """First lines of a text, or first rows of a file of cells; the other is empty."""
    encoding: str = ""

    @property
    def is_text(self) -> bool:
        """Whether the file is text, with delimiters to recognize."""
        return not self.cells

    @property
    def sheets(self) -> list[str]:
        """The sheets of a workbook if none was chosen, else empty."""
        if self.form.sheet or self.is_text or _start(self.place) != _ZIP:
            return []
        with self.place.open("rb") as stream:
            return list(_library("openpyxl").load_workbook(stream, read_only=True).sheetnames)

    def rows(self, delimiter: str) -> list[tuple[int, list[str]]]:
        """Return the first rows split by `delimiter`, each with the number of lines up to it."""
        if not self.is_text:
            return list(enumerate(map(list, self.cells), start=1))
        if delimiter == " ":
            return [(number, line.split()) for number, line in enumerate(self.head, start=1)]
        reader = csv.reader(
            (line.replace("\0", "") for line in self.head),
            delimiter=delimiter,
            skipinitialspace=True,
        )
        with contextlib.suppress(csv.Error):
            return [(reader.line_num, row) for row in reader]
        return [(n, line.split(delimiter)) for n, line in enumerate(self.head, start=1)]

    def blocks(
        self, places: Sequence[int], delimiter: str, first: int, above: int
    ) -> Iterator[Cells]:
        """Yield columns from row `first` on, numbered as in a spreadsheet, block by block.

        `above` is the number of lines above that row. The columns of a block are labelled by their
        places. Raises ValueError, with file and cause, if the file cannot be read to its end.
        """
        with _explained(self.path, self.is_text):
            if self.is_text:
                yield from self._text_blocks(places, delimiter, first, above)
            else:
                yield from self._cell_blocks(places, first)

    def _text_blocks(
        self, places: Sequence[int], delimiter: str, first: int, above: int
    ) -> Iterator[Cells]:
        import pandas as pd  # noqa: PLC0415 - slow to import

        wanted = sorted({0, *places})
        is_strict = bool(self.form.encoding)
        told = PROGRESS.get()
        with _text(self.place, self.form, self.encoding) as text:
            for _ in range(above):
                text.readline()
            quoted = any('"' in line for line in self.head[above:])
            reader = pd.read_csv(
                text,
                sep=r"\s+" if delimiter == " " else delimiter,
                header=None,
                names=range(max(wanted) + 1),
                usecols=wanted,
                dtype=str,
                na_filter=False,
                skip_blank_lines=False,
                skipinitialspace=True,
                quoting=csv.QUOTE_MINIMAL if quoted else csv.QUOTE_NONE,
                encoding_errors="strict" if is_strict else "replace",
                chunksize=BLOCK,
                engine="c",
                index_col=False,
            )
            begin = first
            for block in reader:
                numbers = np.arange(begin, begin + len(block), dtype=np.int64)
                begin += len(block)
                kept = numbers > self.form.skip_rows
                if self.form.comment:
                    kept &= ~block[0].fillna("").str.startswith(self.form.comment).to_numpy()
                yield numbers[kept], block.loc[kept]
                if told is not None:
                    told(cast(Any, text.buffer).raw.share)

    def _cell_blocks(self, places: Sequence[int], first: int) -> Iterator[Cells]:
        begin = 1 + (_start(self.place) != _ZIP)
        for block in _frames(self.place, self.form, places):
            numbers = np.arange(begin, begin + len(block), dtype=np.int64)
            begin += len(block)
            kept = numbers >= first
            yield numbers[kept], block.loc[kept]


_OF_TEXT = (OSError, EOFError, ValueError, csv.Error, zlib.error)


@contextlib.contextmanager
def _explained(path: Path, is_text: bool) -> Iterator[None]:
    try:
        yield
    except Exception as error:
        if is_text and not isinstance(error, _OF_TEXT):
            raise
        cause = " ".join(cause_of(error).split())[:200] or type(error).__name__
        if cause.endswith("and found 0"):  # message of pandas for a block of blank lines
            cause = f"{BLOCK} consecutive blank rows: remove them"
        if isinstance(error, UnicodeError):
            cause = f"{error}: specify its encoding (--encoding)"
        kind = "CSV" if is_text else "a table"
        raise ValueError(f"{path}: cannot be read as {kind}: {cause}") from None


def _text(path: Path, form: Columns, encoding: str) -> io.TextIOWrapper:
    stream = io.BufferedReader(_Bounded(path, form.maximum_megabytes), _PIECE)
    return io.TextIOWrapper(stream, encoding, "strict" if form.encoding else "replace")


_PAGE = re.compile(r"\s*<(\?xml|!doctype|html|table)\b", re.IGNORECASE)
_JSON = re.compile(r'\s*(\{\s*"|\[\s*[\[{])')
_CONTROL = re.compile(r"[\x01-\x08\x0e-\x19]")
"""Control characters that no text needs; zeros fill the end of some loggers' files."""
_MOST_CONTROL, _FEW_CONTROL = 0.01, 8
"""Largest share of these in a text, and the number that any text may have. Chosen."""

_ZIP = b"PK\x03\x04"


def _start(path: Path) -> bytes:
    """Return the first bytes of a file, which determine its reader."""
    with path.open("rb") as stream:
        return stream.read(4)


def open_raw(path: Path, form: Columns) -> RawTable:
    """Open a file and read its first rows.

    Raises ValueError, with file and cause, if it cannot be read or is empty.
    """
    place = readable(path, form.maximum_megabytes)
    try:
        start = _start(place)
    except OSError as error:
        raise ValueError(f"{path}: cannot be read as CSV: {cause_of(error)}") from None
    with _explained(path, is_text=start not in _READERS and start not in _UNREAD):
        if start in _UNREAD:
            raise ValueError(_UNREAD[start])
        if start in _READERS:
            table = _looked_at(path, form, place)
        else:
            with io.BufferedReader(_Bounded(place, form.maximum_megabytes), _PIECE) as stream:
                encoding = form.encoding or encoding_of(stream.peek(_PIECE)[:_PIECE])
            with _text(place, form, encoding) as text:
                head = _head(text)
            _require_table(head)
            table = RawTable(path, form, place, head, encoding=encoding)
    if not any(line.strip() for line in table.head) and not any(map(any, table.cells)):
        raise ValueError(f"{path}: the file is empty")
    return table


def _head(text: Iterable[str]) -> tuple[str, ...]:
    """Return the first lines of a text; of wide lines fewer."""
    head: list[str] = []
    size = 0
    for line in itertools.islice(text, LOOKED_AT):
        head.append(line)
        size += len(line)
        if size > _LOOKED_AT_SIZE and len(head) >= _LEAST_LOOKED_AT:
            break
    return tuple(head)


def _require_table(head: Sequence[str]) -> None:
    """Refuse the first lines of a file that is text in another form, or no text."""
    start = "".join(head)[:_PIECE]
    if _PAGE.match(start):
        raise ValueError("a page in HTML or XML: save it from a spreadsheet as .xlsx or CSV")
    if _JSON.match(start):
        raise ValueError("JSON: save it as CSV, one row for each time")
    entries = max((line.count(mark) for line in head for mark in "\t;,|"), default=0) + 1
    if entries > _MOST_COLUMNS:
        raise ValueError(f"{entries} columns, more than a spreadsheet has: keep those of the valve")
    if len(_CONTROL.findall(start)) > max(_FEW_CONTROL, _MOST_CONTROL * len(start)):
        raise ValueError("a binary file: export it as CSV, .xlsx, Parquet or MAT (version 7)")


def _looked_at(path: Path, form: Columns, place: Path) -> RawTable:
    block = next(_frames(place, form, None), None)
    if block is None:
        return RawTable(path, form, place)
    rows = [[_shown(cell) for cell in row] for row in block.head(LOOKED_AT).itertuples(index=False)]
    if _start(place) != _ZIP:
        rows.insert(0, [str(name) for name in block.columns])
    return RawTable(path, form, place, cells=rows)


def _library(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise ValueError(
            "Excel and Parquet need libraries that are not installed: pip install openpyxl "
            "pyarrow (the extra `tables`), or export the table as CSV"
        ) from None


def _shown(cell: object) -> str:
    """Return a cell as text, as in a CSV file, but a number without a decimal mark.

    So it is read alike beside texts with decimal commas and with decimal points.
    """
    if isinstance(cell, datetime):  # includes pandas' time stamps, to the nanosecond; NaT is empty
        return cell.isoformat(sep=" ") if cell == cell else ""  # noqa: PLR0124
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return ""
    if not isinstance(cell, (float, np.floating)) or not math.isfinite(cell):
        return str(cell)
    mantissa, _, power = repr(float(cell)).partition("e")
    whole, _, rest = mantissa.removesuffix(".0").partition(".")
    power = str(int(power or "0") - len(rest))
    return whole + rest + ("" if power == "0" else f"e{power}")


def _frames(path: Path, form: Columns, places: Sequence[int] | None) -> Iterator["pd.DataFrame"]:
    """Yield the columns at `places` of a file of cells, labelled by place; by default all."""
    for frame in _READERS[_start(path)](path, form, places):
        yield frame if places is None else frame.set_axis(list(places), axis="columns")


def _excel(path: Path, form: Columns, places: Sequence[int] | None) -> Iterator["pd.DataFrame"]:
    import pandas as pd  # noqa: PLC0415 - slow to import

    with zipfile.ZipFile(path) as packed:
        if "[Content_Types].xml" not in packed.namelist():
            raise ValueError(
                "an archive, but not an Excel workbook: unpack it, or save it as .xlsx"
            )
        size = sum(each.file_size for each in packed.infolist()) / 1e6
    openpyxl = _library("openpyxl")
    if size > form.maximum_megabytes:
        raise ValueError(
            f"{size:.4g} MB, unpacked: raise maximum_megabytes (--maximum-megabytes), or cut it"
        )
    with path.open("rb") as stream:  # a path not ending in .xlsx would be refused
        book = openpyxl.load_workbook(stream, read_only=True, data_only=True)
        if form.sheet and form.sheet not in book.sheetnames:
            raise ValueError(f"no sheet {form.sheet!r} among {', '.join(book.sheetnames)}")
        sheet = book[form.sheet] if form.sheet else book.worksheets[0]
        rows = sheet.iter_rows(values_only=True)
        while block := list(itertools.islice(rows, BLOCK if places else LOOKED_AT)):
            wide = max(map(len, block))
            chosen = range(wide) if places is None else places
            yield pd.DataFrame(
                {
                    place: [_shown(row[place]) if place < len(row) else "" for row in block]
                    for place in chosen
                }
            )


def _parquet(path: Path, _: Columns, places: Sequence[int] | None) -> Iterator["pd.DataFrame"]:
    table = _library("pyarrow.parquet").ParquetFile(path)
    size = table.metadata.num_rows
    names = table.schema_arrow.names
    wanted = names if places is None else [names[place] for place in places]
    for batch in table.iter_batches(min(BLOCK, max(size, 1)), columns=wanted):
        yield batch.to_pandas(integer_object_nulls=True, ignore_metadata=True)[wanted]


def _matlab(path: Path, form: Columns, places: Sequence[int] | None) -> Iterator["pd.DataFrame"]:
    import pandas as pd  # noqa: PLC0415 - slow to import
    from scipy.io import loadmat, whosmat  # noqa: PLC0415

    try:
        sizes = [math.prod(shape) for _, shape, _ in whosmat(path)]
        if 8 * sum(sizes) > 1e6 * form.maximum_megabytes:
            raise ValueError(
                f"{8e-6 * sum(sizes):.4g} MB, unpacked: raise maximum_megabytes "
                "(--maximum-megabytes), or save the signals of the valve only"
            )
        found = loadmat(path, squeeze_me=True)
    except NotImplementedError:
        raise ValueError(
            "a MAT-file of version 7.3: save it with -v7, or with writetable"
        ) from None
    vectors = {
        name: np.asarray(values, np.float64)
        for name, values in found.items()
        if isinstance(values, np.ndarray) and values.ndim == 1 and values.dtype.kind in "fiu"
    }
    longest = max((each.size for each in vectors.values()), default=0)
    if not longest:
        others = ", ".join(name for name in found if not name.startswith("__")) or "nothing"
        raise ValueError(f"no numeric vectors, but {others}: save each signal as a vector")
    frame = pd.DataFrame({name: v for name, v in vectors.items() if v.size == longest})
    yield frame if places is None else frame.iloc[:, list(places)]


_READERS: Mapping[bytes, Callable[..., Iterator["pd.DataFrame"]]] = {
    _ZIP: _excel,
    b"PAR1": _parquet,
    b"MATL": _matlab,
}
"""Readers of files of cells, by their first bytes."""
_UNREAD = {
    b"\xd0\xcf\x11\xe0": "an Excel workbook from before 2007: save it as .xlsx or CSV",
    b"\x89HDF": "an HDF5 file: save it as Parquet or CSV",
    b"ARRO": "a Feather file: save it as Parquet or CSV",
    b"TDSm": "a LabVIEW TDMS file: export it as .lvm or CSV",
}
"""Files that cannot be read, by their first bytes."""
