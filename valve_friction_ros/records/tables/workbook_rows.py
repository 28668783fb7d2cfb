"""Rows of Excel workbooks and Parquet files, as text; their readers are an extra."""

import importlib
import zipfile
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

from valve_friction_ros.records.columns import Columns

__all__ = ["is_workbook", "workbook_rows"]

_ZIP, _PARQUET, _OLD_EXCEL = b"PK\x03\x04", b"PAR1", b"\xd0\xcf\x11\xe0"
_BATCH = 4096
"""Rows of Parquet at a time."""


def is_workbook(path: Path) -> bool:
    """Return whether a file is a workbook or Parquet, by its first bytes."""
    try:
        with path.open("rb") as stream:
            return stream.read(4) in (_ZIP, _PARQUET, _OLD_EXCEL)
    except OSError:
        return False


def _library(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise ValueError(
            "Excel and Parquet need libraries that are not installed: pip install openpyxl pandas "
            "pyarrow (the extra `tables`), or export the table as CSV"
        ) from None


def _text(cell: object, decimal: str) -> str:
    """Return a cell as a CSV file would hold it."""
    if cell is None:
        return ""
    if isinstance(cell, datetime):  # pandas' time stamps too, to the nanosecond
        return cell.isoformat()
    if isinstance(cell, float):
        return repr(float(cell)).replace(".", decimal)
    return str(cell)


def _excel(path: Path, columns: Columns) -> Iterator[tuple[Any, ...]]:
    openpyxl = _library("openpyxl")
    with zipfile.ZipFile(path) as packed:
        size = sum(each.file_size for each in packed.infolist()) / 1e6
    if size > columns.maximum_megabytes:
        raise ValueError(
            f"{size:.4g} MB, unpacked: raise maximum_megabytes (--maximum-megabytes), or cut it"
        )
    with path.open("rb") as stream:  # a name without .xlsx would be refused
        book = openpyxl.load_workbook(stream, read_only=True, data_only=True)
        if columns.sheet and columns.sheet not in book.sheetnames:
            raise ValueError(f"no sheet {columns.sheet!r} among {', '.join(book.sheetnames)}")
        sheet = book[columns.sheet] if columns.sheet else book.worksheets[0]
        yield from sheet.iter_rows(values_only=True)


def _parquet(path: Path, columns: Columns) -> Iterator[tuple[Any, ...]]:
    _library("pandas")  # which keeps nanoseconds
    table = _library("pyarrow.parquet").ParquetFile(path)
    yield tuple(table.schema_arrow.names)
    wanted = {value for name, value in vars(columns).items() if name.endswith("_column") and value}
    names = [name for name in table.schema_arrow.names if name in wanted]
    places = [table.schema_arrow.names.index(name) for name in names]
    row: list[Any] = [None] * len(table.schema_arrow.names)
    for batch in table.iter_batches(batch_size=_BATCH, columns=names):
        for cells in zip(*(batch.column(name).to_pylist() for name in names), strict=True):
            for place, cell in zip(places, cells, strict=True):
                row[place] = cell
            yield tuple(row)


def workbook_rows(
    path: Path, columns: Columns, name: Path | None = None
) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows that hold anything, with their numbers from 1, the headers among them.

    Raises ValueError, with `name` or the file and the cause, if it cannot be read.
    """
    try:
        with path.open("rb") as stream:
            kind = stream.read(4)
        if kind == _OLD_EXCEL:
            raise ValueError("a workbook of Excel before 2007: save it as .xlsx or CSV")
        rows = _parquet(path, columns) if kind == _PARQUET else _excel(path, columns)
        for number, cells in enumerate(rows, start=1):
            row = [_text(cell, columns.decimal) for cell in cells]
            if number > columns.skip_rows and any(row):
                yield number, row
    except Exception as error:  # noqa: BLE001 - damaged files: the readers raise whatever they meet
        cause = " ".join(str(error).split())[:200] or type(error).__name__
        raise ValueError(f"{name or path}: cannot be read as a table: {cause}") from None
