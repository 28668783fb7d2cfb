"""The formats of the output: CSV, JSON lines, and a page for people."""

import csv
import io
import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from valve_friction_ros.fleet.page import page_text
from valve_friction_ros.fleet.row import COLUMNS, Cell
from valve_friction_ros.outside_text import harmless

__all__ = ["is_page", "writer_of"]

_Rows = Iterable[Mapping[str, Cell]]


def _csv(rows: _Rows, _: Path) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows([harmless(row[column]) for column in COLUMNS] for row in rows)
    return text.getvalue()


def _json_lines(rows: _Rows, _: Path) -> str:
    shown = ({column: row[column] for column in COLUMNS} for row in rows)
    return "".join(json.dumps(row, ensure_ascii=False, allow_nan=False) + "\n" for row in shown)


def _page(rows: _Rows, output: Path) -> str:
    return page_text(rows, output.stem)


_WRITERS = {".csv": _csv, ".jsonl": _json_lines, ".html": _page}


def is_page(output: Path) -> bool:
    """Return whether an output is the page for people."""
    return output.suffix.lower() == ".html"


def writer_of(output: Path) -> Callable[[_Rows, Path], str]:
    """Return what writes rows in the format that the name of the output ends in.

    It takes the rows and the output, and returns the text. Raises ValueError if the ending is not
    known; the message lists the known ones.
    """
    known = _WRITERS.get(output.suffix.lower())
    if known is None:
        raise ValueError(f"{output}: the output must end in {', '.join(_WRITERS)}")
    return known
