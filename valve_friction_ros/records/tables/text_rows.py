"""Rows of a CSV file, gzipped or not, in any encoding, with bounded memory."""

import codecs
import csv
import gzip
import io
import itertools
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, cast

from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.unreadable import cause_of

__all__ = ["csv_rows", "repaired"]

_LONGEST_LINE = 1 << 20
"""Most bytes of a line. Chosen: far beyond any table, and little memory."""

_BLOCK, _PIECE = 1024, 1 << 16
"""Rows, and bytes, at a time."""

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_FALLBACK = "cp1252"
"""Encoding of bytes that are not UTF-8: what Windows writes in Western Europe and America."""


def repaired(text: str) -> str:
    """Return text with the bytes that are not UTF-8 read as `_FALLBACK`."""
    if text.isascii():
        return text
    return "".join(
        bytes([ord(mark) - 0xDC00]).decode(_FALLBACK, "replace")
        if "\udc80" <= mark <= "\udcff"
        else mark
        for mark in text
    )


class _Bounded(io.RawIOBase):
    """The bytes of a file, unpacked where it is gzipped; refuses too many, and endless lines."""

    def __init__(self, path: Path, most: float) -> None:
        self._most = most
        self._left = most * 1e6
        self._line = 0
        with path.open("rb") as stream:
            is_packed = stream.read(2) == b"\x1f\x8b"
        opened = gzip.open if is_packed else open
        self._stream = cast(IO[bytes], opened(path, "rb"))

    def readable(self) -> bool:
        """Return True, as io asks."""
        return True

    def close(self) -> None:
        """Close the file."""
        if not self.closed:
            self._stream.close()
        super().close()

    def readinto(self, room: Any, /) -> int:
        """Read the next bytes."""
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
            raise ValueError(f"a line has more than {_LONGEST_LINE} bytes: it is no CSV file")
        memoryview(room)[: len(piece)] = piece
        return len(piece)


def _encoding(start: bytes) -> str:
    for mark, encoding in _MARKS:
        if start.startswith(mark):
            return encoding
    if len(start) > 1 and 0 in start[:2]:  # UTF-16 without its mark: every other byte is zero
        return "utf-16-be" if start[0] == 0 else "utf-16-le"
    return "utf-8"


def _split(text: Iterator[str], delimiter: str) -> Iterator[list[list[str]]]:
    """Yield rows in blocks; csv, which takes three times as long, from the first quote on."""
    while lines := list(itertools.islice(text, _BLOCK)):
        if '"' in "".join(lines):
            reader = csv.reader(itertools.chain(lines, text), delimiter=delimiter)
            while rows := list(itertools.islice(reader, _BLOCK)):
                yield rows
        else:
            yield [line.rstrip("\r\n").split(delimiter) for line in lines]


def _blocks(path: Path, columns: Columns) -> Iterator[list[tuple[int, list[str]]]]:
    with io.BufferedReader(_Bounded(path, columns.maximum_megabytes), _PIECE) as stream:
        encoding = columns.encoding or _encoding(stream.peek(4)[:4])
        errors = "surrogateescape" if encoding == "utf-8" and not columns.encoding else "strict"
        number, comment = 1, columns.comment
        for rows in _split(
            io.TextIOWrapper(stream, encoding, errors, newline=""), columns.delimiter
        ):
            yield [
                (place, row)
                for place, row in enumerate(rows, number)
                if any(row)
                and place > columns.skip_rows
                and not (comment and row[0].lstrip().startswith(comment))
            ]
            number += len(rows)


def _explained(path: Path, columns: Columns, name: Path) -> Iterator[list[tuple[int, list[str]]]]:
    try:
        yield from _blocks(path, columns)
    except (OSError, EOFError, ValueError, csv.Error, zlib.error) as error:
        cause = cause_of(error)
        if isinstance(error, UnicodeError):
            cause = f"{error}: name its encoding (--encoding)"
        raise ValueError(f"{name}: cannot be read as CSV: {cause}") from None


def csv_rows(
    path: Path, columns: Columns, name: Path | None = None
) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows that hold anything, with their numbers as a spreadsheet counts.

    Bytes that are not UTF-8 come as lone surrogates, see `repaired`. Raises ValueError, with
    `name` or the file and the cause, if it cannot be read to its end.
    """
    return itertools.chain.from_iterable(_explained(path, columns, name or path))
