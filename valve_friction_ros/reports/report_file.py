"""Files that reports are written to."""

import tempfile
from pathlib import Path

from valve_friction_ros.records.whole_file import write_whole
from valve_friction_ros.reports.page import Page, render

__all__ = ["require_report_file", "write_report"]

_ENDINGS = (".html", ".htm")


def require_report_file(path: Path) -> None:
    """Refuse a file that a report cannot be written to, before the work begins.

    Raises ValueError if the ending is not .html, or the folder does not exist or cannot be written;
    the message names it.
    """
    if path.suffix.lower() not in _ENDINGS:
        raise ValueError(f"{path}: a report is an HTML page: give it a name that ends in .html")
    if not path.parent.is_dir():
        raise ValueError(f"{path}: there is no folder {path.parent}: create it, or name another")
    if path.is_dir():
        raise ValueError(f"{path}: this is a folder: give the report another name")
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        cause = error.strerror or error
        raise ValueError(f"{path}: cannot write into {path.parent}: {cause}") from None


def write_report(page: Page, path: Path) -> None:
    """Write a page as one HTML file, at once: a reader never finds part of it.

    Raises OSError if it cannot be written; an existing file stays unchanged.
    """
    write_whole(path, render(page).encode())
