"""Rows as lines of a file: CSV with a header, or JSON lines."""

import csv
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

from valve_friction_ros.fleet.row import COLUMNS, Cell

__all__ = ["RowFormat", "row_format"]


class RowFormat(Protocol):
    """How rows are written as lines that end with a line feed and hold no other."""

    header: bytes
    """What a file begins with."""

    beginning: bytes
    """What every row begins with, by which a torn one is told from another program's line."""

    def encode(self, cells: Mapping[str, Cell]) -> bytes:
        """Write a row; a cell that is not there stays empty."""

    def decode(self, line: bytes) -> Mapping[str, Cell]:
        """Read a row; raises ValueError for a line that is none."""


def _csv_line(cells: list[Cell]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue().encode()


class _Csv:
    header = _csv_line([*COLUMNS])
    beginning = b""

    def encode(self, cells: Mapping[str, Cell]) -> bytes:
        return _csv_line([cells.get(column) for column in COLUMNS])

    def decode(self, line: bytes) -> Mapping[str, Cell]:
        entries = next(csv.reader([line.decode()], strict=True), [])
        return dict(zip(COLUMNS, (entry or None for entry in entries), strict=True))


class _JsonLines:
    header = b""
    beginning = f'{{"{COLUMNS[0]}": '.encode()

    def encode(self, cells: Mapping[str, Cell]) -> bytes:
        row = {column: cells.get(column) for column in COLUMNS}
        return (json.dumps(row, ensure_ascii=False, allow_nan=False) + "\n").encode()

    def decode(self, line: bytes) -> Mapping[str, Cell]:
        row = json.loads(line)
        if not isinstance(row, dict) or (*row,) != COLUMNS:
            raise ValueError("no row of this format")
        return row


_FORMATS: Mapping[str, RowFormat] = {".csv": _Csv(), ".jsonl": _JsonLines()}


def row_format(path: Path) -> RowFormat:
    """Return the format of a file by the ending of its name.

    Raises
    ------
    ValueError
        If it is not known; the message lists what is.
    """
    known = _FORMATS.get(path.suffix.lower())
    if known is None:
        raise ValueError(f"{path}: the output must end in {' or '.join(_FORMATS)}")
    return known
