"""The rows that `identify-folder` has on the disk while it runs."""

import contextlib
import shutil
import sqlite3


def kept(output):
    """Number of rows that are on the disk, whatever a running or killed process does with it."""
    copy = output.parent / "copy"
    shutil.rmtree(copy, ignore_errors=True)
    copy.mkdir()
    for file in output.parent.glob(f"{output.stem}.sqlite*"):
        with contextlib.suppress(FileNotFoundError):  # a journal is there for a moment only
            shutil.copy(file, copy)
    try:
        with contextlib.closing(sqlite3.connect(copy / f"{output.stem}.sqlite")) as database:
            return database.execute("SELECT count(*) FROM result").fetchone()[0]
    except sqlite3.Error:
        return 0
