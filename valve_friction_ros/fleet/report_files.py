"""Reports of valves: made where a recording is identified, written where the results are."""

import hashlib
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from valve_friction_ros.fleet.row import Cell
from valve_friction_ros.records.whole_file import write_whole

__all__ = ["PAGE", "report_name", "with_reports_written"]

PAGE = "page"
"""What a row holds beside its columns until its report is written: the text of the page."""

_STRANGE = re.compile(r"[^A-Za-z0-9.-]+")
_LONGEST = 100
"""Characters of a report's name before its digest."""


def report_name(recording: str, valve: str) -> str:
    """Return the name of a report: readable, and no other valve's."""
    name = f"{recording} {valve}".strip()
    digest = hashlib.blake2b(name.encode(), digest_size=4).hexdigest()
    return f"{_STRANGE.sub('_', name).strip('_')[:_LONGEST]}_{digest}.html"


def with_reports_written(
    rows: Iterable[Mapping[str, Cell]], beside: Path
) -> list[Mapping[str, Cell]]:
    """Write the pages of rows under their names in the folder `beside`, and return the rows.

    A page that cannot be written is a warning of its row, as the numbers are there.
    """
    written: list[Mapping[str, Cell]] = []
    for row in rows:
        cells = dict(row)
        page = cells.pop(PAGE, None)
        if page is not None:
            try:
                write_whole(beside / str(row["report"]), str(page).encode())
            except OSError as error:
                cells["report"] = None
                told = f"no report: {error.filename}: {error.strerror}"
                cells["warnings"] = "; ".join(filter(None, (str(row["warnings"] or ""), told)))
        written.append(cells)
    return written
