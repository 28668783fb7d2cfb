"""The history of a plant's valves: one file that several processes write at once."""

import os
import sqlite3
from dataclasses import dataclass
from pathlib import Path

from valve_friction_ros.history.entry import HistoryEntry, KeptBaseline, KeptValve
from valve_friction_ros.history.errors import HistoryError
from valve_friction_ros.history.reader import History
from valve_friction_ros.history.retention import oldest_kept
from valve_friction_ros.history.rows import insert_baseline, insert_entry, valve_id
from valve_friction_ros.history.schema import is_current, writing

__all__ = ["HistoryError", "HistoryFile"]


@dataclass(frozen=True)
class HistoryFile(History):
    """A history in SQLite.

    Every method opens the file, so it may be moved, repaired or missing between two calls. Each
    change is one transaction: a killed process leaves the change complete or absent, and
    the file intact. All methods raise HistoryError if the file cannot be read or written.

    Attributes
    ----------
    place : Path
        The file. All processes that write to it must run on one machine.
    """

    place: Path

    @property
    def path(self) -> Path:
        """The file."""
        return self.place

    def prepare(self) -> None:
        """Create the file if it is missing, and check that it can be written.

        A file that another process is writing at the moment is not waited for, unless it is older.
        """
        if is_current(self.path) and all(
            os.access(place, os.W_OK) for place in (self.path, self.path.parent)
        ):
            return
        with writing(self.path):
            pass

    def add(self, entry: HistoryEntry, days: float = 0.0) -> None:
        """Add an identification; delete those of its valve that are `days` older, none for 0.

        The newest baseline and the last success stay, at any age.
        """
        with writing(self.path) as connection:
            valve = valve_id(connection, entry.valve)
            insert_entry(connection, valve, entry)
            if days > 0:
                _forget(connection, valve, oldest_kept(entry.time, days))

    def set_baseline(self, valve: KeptValve, kept: KeptBaseline) -> None:
        """Make this the baseline of a valve."""
        with writing(self.path) as connection:
            insert_baseline(connection, valve_id(connection, valve), kept)


def _forget(connection: sqlite3.Connection, valve: int, before: int) -> None:
    """Delete the rows of a valve from before a time (ns), and settings without a reference."""
    done = connection.execute(
        "DELETE FROM identification WHERE valve_id = ? AND time_ns < ? AND id != coalesce("
        "(SELECT max(id) FROM identification WHERE valve_id = ? AND refusal IS NULL), 0)",
        (valve, before, valve),
    )
    if done.rowcount:
        connection.execute(
            "DELETE FROM settings WHERE id NOT IN (SELECT settings_id FROM identification)"
        )
    connection.execute(
        "DELETE FROM baseline WHERE valve_id = ? AND time_ns < ? "
        "AND id < (SELECT max(id) FROM baseline WHERE valve_id = ?)",
        (valve, before, valve),
    )
