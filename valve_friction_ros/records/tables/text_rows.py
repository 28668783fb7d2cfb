"""Rows of a CSV file, gzipped or not, in any encoding, with bounded memory."""

import codecs
import csv
import gzip
import io
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, cast

from valve_friction_ros.records.columns import Columns

__all__ = ["csv_rows", "repaired"]

_LONGEST_LINE = 1 << 20
"""Most characters of a line. Chosen: far beyond any table, and little memory."""

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


def _unpacked(path: Path) -> IO[bytes]:
    with path.open("rb") as stream:
        is_packed = stream.read(2) == b"\x1f\x8b"
    return cast(IO[bytes], gzip.open(path)) if is_packed else path.open("rb")


def _encoding(start: bytes) -> str:
    for mark, encoding in _MARKS:
        if start.startswith(mark):
            return encoding
    if len(start) > 1 and 0 in start[:2]:  # UTF-16 without its mark: every other byte is zero
        return "utf-16-be" if start[0] == 0 else "utf-16-le"
    return "utf-8"


def _lines(stream: IO[str], columns: Columns) -> Iterator[str]:
    """Yield the lines; refuse endless ones, and those beyond the most that is to be read."""
    most = columns.maximum_megabytes * 1e6
    read = 0
    while line := stream.readline(_LONGEST_LINE):
        read += len(line)
        if read > most:
            raise ValueError(
                f"more than {columns.maximum_megabytes:g} MB, unpacked: raise maximum_megabytes "
                "(--maximum-megabytes), or cut the file"
            )
        if len(line) == _LONGEST_LINE:
            raise ValueError(f"a line has more than {_LONGEST_LINE} characters: it is no CSV file")
        yield line


def _rows(path: Path, columns: Columns) -> Iterator[tuple[int, list[str]]]:
    with _unpacked(path) as packed, io.BufferedReader(cast(io.RawIOBase, packed)) as stream:
        encoding = columns.encoding or _encoding(stream.peek(4)[:4])
        errors = "surrogateescape" if encoding == "utf-8" and not columns.encoding else "strict"
        text = io.TextIOWrapper(stream, encoding, errors, newline="")
        reader = csv.reader(_lines(text, columns), delimiter=columns.delimiter)
        for number, row in enumerate(reader, start=1):
            if number <= columns.skip_rows or not any(row):
                continue
            if columns.comment and row[0].lstrip().startswith(columns.comment):
                continue
            yield number, row


def csv_rows(
    path: Path, columns: Columns, name: Path | None = None
) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows that hold anything, with their numbers as a spreadsheet counts.

    Bytes that are not UTF-8 come as lone surrogates, see `repaired`. Raises ValueError, with
    `name` or the file and the cause, if it cannot be read to its end.
    """
    try:
        yield from _rows(path, columns)
    except (OSError, EOFError, ValueError, csv.Error, zlib.error) as error:
        cause = (isinstance(error, OSError) and error.strerror) or error
        if isinstance(error, UnicodeError):
            cause = f"{error}: name its encoding (--encoding)"
        raise ValueError(f"{name or path}: cannot be read as CSV: {cause}") from None
