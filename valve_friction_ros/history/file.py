"""The history of a plant's valves: one file that several processes write at once."""

import contextlib
import os
import sqlite3
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.known_numbers import KnownNumbers
from valve_friction_ros.history.entry import (
    FrictionPoint,
    HistoryEntry,
    KeptBaseline,
    KeptValve,
    friction_point,
)
from valve_friction_ros.history.number_rows import known_numbers_in, numbers_in
from valve_friction_ros.history.rows import (
    entries_in,
    frictions_in,
    insert_baseline,
    insert_entry,
    kept_baseline_in,
    record_in,
    valve_id,
)
from valve_friction_ros.history.schema import HistoryError, is_current, reading, writing
from valve_friction_ros.identification import FORMER_METHODS, SLIDING
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams import DAY

__all__ = ["HistoryError", "HistoryFile"]

"""Nanoseconds of a day."""

_END_OF_TIME = 2**63 - 1
"""Largest integer in SQLite."""

_BASELINES = (
    "SELECT baseline.* FROM baseline JOIN valve ON valve.id = valve_id "
    "WHERE name = ? AND time_ns >= ? AND time_ns < ?"
)


@dataclass(frozen=True)
class HistoryFile:
    """A history in SQLite.

    Every method opens the file, so it may be moved, repaired or missing between two calls. Each
    change is one transaction: a killed process leaves the change complete or absent, and
    the file intact. All methods raise HistoryError if the file cannot be read or written.

    Attributes
    ----------
    path : Path
        The file. All processes that write to it must run on one machine.
    """

    path: Path

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
                _forget(connection, valve, entry.time - round(days * DAY))

    def set_baseline(self, valve: KeptValve, kept: KeptBaseline) -> None:
        """Make this the baseline of a valve."""
        with writing(self.path) as connection:
            insert_baseline(connection, valve_id(connection, valve), kept)

    def baseline(self, valve: str, until: int = _END_OF_TIME) -> KeptBaseline | None:
        """Return the newest baseline set before `until` (ns) for the valve of this name, if any.

        There is none where the newest one was withdrawn.
        """
        with self._rows() as connection:
            row = connection.execute(
                f"{_BASELINES} ORDER BY baseline.id DESC", (valve, -_END_OF_TIME, until)
            ).fetchone()
            if row is None or (kept := kept_baseline_in(row)).withdrawn:
                return None
            number = row["id"]
            numbers = numbers_in(connection, "baseline", number, number).get(number, {})
            whole = replace(kept.baseline, numbers=numbers)
            return replace(kept, baseline=whole, record=record_in(connection, number))

    def baselines(
        self, valve: str, since: int = -_END_OF_TIME, until: int = _END_OF_TIME
    ) -> tuple[KeptBaseline, ...]:
        """Return each change of a valve's baseline, oldest first, without records."""
        with self._rows() as connection:
            rows = connection.execute(f"{_BASELINES} ORDER BY baseline.id", (valve, since, until))
            return tuple(map(kept_baseline_in, rows))

    def last_success(self, valve: str) -> HistoryEntry | None:
        """Return the identification that a valve's diagnosis was last made by, if any."""
        with self._rows() as connection:
            row = connection.execute(
                "SELECT time_ns FROM identification JOIN valve ON valve.id = valve_id "
                "WHERE name = ? AND refusal IS NULL ORDER BY identification.id DESC",
                (valve,),
            ).fetchone()
            if row is None:
                return None
            found = entries_in(connection, [valve], row["time_ns"], row["time_ns"] + 1)
            last = next(one for one in reversed(found) if not one.refusal)
            if last.friction is None:
                raise ValueError("a success without coulomb_friction")
        return last

    def known_numbers(self, valve: str, built: Valve, since: int) -> KnownNumbers:
        """Return the newest measurement of each number of a valve since a time, ns.

        Only identifications with the parameters `built` of the valve count.
        """
        with self._rows() as connection:
            return known_numbers_in(connection, valve, built, since)

    def points(
        self, valve: str, method: str, since: int = 0, baseline: Baseline | None = None
    ) -> tuple[FrictionPoint, ...]:
        """Return a valve's frictions of one method, from `since` on (`friction_point`)."""
        former = next((old for old, new in FORMER_METHODS.items() if new == method), method)
        names = (SLIDING, "coulomb_friction", "viscous_friction")
        with reading(self.path) as connection:
            connection.row_factory = sqlite3.Row
            rows = connection.execute(
                "SELECT identification.*, parameter.* FROM identification "
                "JOIN valve ON valve.id = valve_id "
                "JOIN parameter ON identification_id = identification.id "
                "WHERE valve.name = ? AND method IN (?, ?) AND time_ns >= ? "
                "AND parameter.name IN (?, ?, ?) "
                "ORDER BY time_ns, identification.id",
                (valve, method, former, since, *names),
            ).fetchall()
        points = (
            friction_point(time, parameters, speed, baseline)
            for time, parameters, speed in frictions_in(rows)
        )
        return tuple(point for point in points if point is not None)

    def valves(self) -> tuple[KeptValve, ...]:
        """Return all valves, by name."""
        with reading(self.path) as connection:
            rows = connection.execute("SELECT name, tag FROM valve ORDER BY name").fetchall()
        return tuple(KeptValve(*row) for row in rows)

    def entries(
        self,
        valves: Sequence[str] | None = None,
        since: int = -_END_OF_TIME,
        until: int = _END_OF_TIME,
    ) -> tuple[HistoryEntry, ...]:
        """Return identifications, oldest first, of these valves or of all.

        They lie from `since` on and before `until`, ns since 1970 (UTC).
        """
        with self._rows() as connection:
            return entries_in(connection, valves, since, until)

    @contextlib.contextmanager
    def _rows(self) -> Iterator[sqlite3.Connection]:
        """Read rows by the names of their columns; a row that holds no value is an error."""
        with reading(self.path) as connection:
            connection.row_factory = sqlite3.Row
            try:
                yield connection
            except (LookupError, TypeError, ValueError) as error:
                raise HistoryError(f"{self.path}: a row holds no result: {error}") from None


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
