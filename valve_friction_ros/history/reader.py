"""The history of a plant's valves as it is read: from a file, or from a server."""

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.known_numbers import KnownNumbers
from valve_friction_ros.history.connection import Connection
from valve_friction_ros.history.entry import (
    FrictionPoint,
    HistoryEntry,
    KeptBaseline,
    KeptValve,
    friction_point,
)
from valve_friction_ros.history.errors import HistoryError
from valve_friction_ros.history.number_rows import known_numbers_in, numbers_in
from valve_friction_ros.history.rows import entries_in, frictions_in, kept_baseline_in, record_in
from valve_friction_ros.history.schema import Place, reading
from valve_friction_ros.identification import FORMER_METHODS, SLIDING
from valve_friction_ros.model.valve import Valve

__all__ = ["History"]

_END_OF_TIME = 2**63 - 1
"""Largest integer in both engines."""

_BASELINES = (
    "SELECT baseline.* FROM baseline JOIN valve ON valve.id = valve_id "
    "WHERE name = ? AND time_ns >= ? AND time_ns < ?"
)


@dataclass(frozen=True)
class History:
    """A history, in a file of SQLite or in PostgreSQL on a server.

    Every method raises HistoryError if it cannot be read.

    Attributes
    ----------
    place : Path or HistoryServer
        Where it is.
    """

    place: Place

    def baseline(self, valve: str, until: int = _END_OF_TIME) -> KeptBaseline | None:
        """Return the newest baseline set before `until` (ns) for the valve of this name, if any.

        There is none where the newest one was withdrawn.
        """
        with self._rows() as connection:
            row = connection.execute(
                f"{_BASELINES} ORDER BY baseline.id DESC LIMIT 1", (valve, -_END_OF_TIME, until)
            ).fetchone()
            if row is None or (kept := kept_baseline_in(row)).withdrawn:
                return None
            number = row["id"]
            numbers = numbers_in(connection, "baseline", valve, number, number).get(number, {})
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
                "WHERE name = ? AND refusal IS NULL ORDER BY identification.id DESC LIMIT 1",
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
        with reading(self.place) as connection:
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
        with reading(self.place) as connection:
            rows = connection.execute("SELECT name, tag FROM valve").fetchall()
        return tuple(sorted(KeptValve(*row) for row in rows))

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
    def _rows(self) -> Iterator[Connection]:
        """Read rows by the names of their columns; a row that holds no value is an error."""
        with reading(self.place) as connection:
            try:
                yield connection
            except (LookupError, TypeError, ValueError) as error:
                raise HistoryError(f"{self.place}: a row holds no result: {error}") from None
