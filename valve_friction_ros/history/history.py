# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""History of the valves of a plant: a file shared by several processes, or a server."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import sqlalchemy as sa
from sqlalchemy.engine import Connection

from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.comparison import Ratio
from valve_friction_ros.health.levels import Level, StatusSignal
from valve_friction_ros.health.measured import DatedNumber
from valve_friction_ros.health.valve_diagnosis import KnownNumbers
from valve_friction_ros.history import tables
from valve_friction_ros.history.database import is_ready, marked, reading, writing
from valve_friction_ros.history.entry import HistoryEntry, KeptBaseline, KeptValve
from valve_friction_ros.history.place import HistoryServer, Place
from valve_friction_ros.history.rows import (
    entries_in,
    insert_baseline,
    insert_entry,
    kept_baseline_in,
    known_numbers_in,
    numbers_in,
    oldest_kept,
    points_in,
    ratio_in,
    record_in,
    value_of,
    valve_id,
)
from valve_friction_ros.history.tables import joined, of_valve
from valve_friction_ros.identification.settings import FORMER_METHODS, SLIDING
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams import END_OF_TIME


def _dated(table: sa.Table, valve: str, since: int, until: int = END_OF_TIME) -> Any:
    """Return a query for the rows of a valve from `since` to before `until`, ns."""
    return of_valve(table, valve).where(table.c.time_ns >= since, table.c.time_ns < until)


@dataclass(frozen=True)
class History:
    """A history in an SQLite file, or in PostgreSQL on a server.

    Every method raises HistoryError if the history cannot be read.

    Attributes
    ----------
    place : Path or HistoryServer
        Location of the history.
    """

    place: Place

    def baseline(self, valve: str, until: int = END_OF_TIME) -> KeptBaseline | None:
        """Return the newest baseline set before `until` (ns) for the valve of this name, if any.

        None if the newest baseline was withdrawn.
        """
        query = _dated(tables.baseline, valve, -END_OF_TIME, until)
        newest = query.order_by(tables.baseline.c.id.desc()).limit(1)
        with reading(self.place) as connection:
            row = connection.execute(newest).mappings().first()
            if row is None or (kept := kept_baseline_in(row)).withdrawn:
                return None
            number = row["id"]
            numbers = numbers_in(connection, "baseline", valve, [number]).get(number, {})
            whole = replace(kept.baseline, numbers=numbers)
            return replace(kept, baseline=whole, record=record_in(connection, number))

    def baselines(
        self, valve: str, since: int = -END_OF_TIME, until: int = END_OF_TIME
    ) -> tuple[KeptBaseline, ...]:
        """Return each change of a valve's baseline, oldest first, without records."""
        query = _dated(tables.baseline, valve, since, until).order_by(tables.baseline.c.id)
        with reading(self.place) as connection:
            return tuple(map(kept_baseline_in, connection.execute(query).mappings()))

    def last_success(self, valve: str) -> HistoryEntry | None:
        """Return the last successful identification of a valve, if any."""
        table = tables.identification
        successes = of_valve(table, valve).where(table.c.refusal.is_(None))
        with reading(self.place) as connection:
            row = connection.execute(successes.order_by(table.c.id.desc()).limit(1)).first()
            if row is None:
                return None
            found = entries_in(connection, [valve], row.time_ns, row.time_ns + 1)
            last = next(one for one in reversed(found) if not one.refusal)
            if last.friction is None:
                raise ValueError("a success without coulomb_friction")
        return last

    def known_numbers(self, valve: str, built: Valve, since: int) -> KnownNumbers:
        """Return the newest measurement of each number of a valve since a time, ns.

        Only identifications with the valve parameters `built` are used.
        """
        with reading(self.place) as connection:
            return known_numbers_in(connection, valve, built, since)

    def points(
        self, valve: str, method: str, since: int = 0, baseline: Baseline | None = None
    ) -> tuple[DatedNumber, ...]:
        """Return the frictions of a valve by one method, from `since` on (`friction_point`)."""
        names = (method, *(old for old, new in FORMER_METHODS.items() if new == method))
        table, parameter = tables.identification, tables.parameter
        query = (
            sa.select(table.c.time_ns, table.c.sliding_speed, parameter)
            .select_from(joined(table, tables.valve, parameter))
            .where(
                tables.valve.c.name == valve,
                table.c.method.in_(names),
                table.c.time_ns >= since,
                parameter.c.name.in_((SLIDING, "coulomb_friction", "viscous_friction")),
            )
            .order_by(table.c.time_ns, table.c.id)
        )
        with reading(self.place) as connection:
            rows = connection.execute(query).mappings().all()
            return tuple(filter(None, points_in(connection, valve, rows, baseline)))

    def valves(self) -> tuple[KeptValve, ...]:
        """Return all valves, sorted by name."""
        with reading(self.place) as connection:
            rows = connection.execute(sa.select(tables.valve.c.name, tables.valve.c.tag))
            return tuple(sorted(KeptValve(*row) for row in rows))

    def entries(
        self,
        valves: Sequence[str] | None = None,
        since: int = -END_OF_TIME,
        until: int = END_OF_TIME,
    ) -> tuple[HistoryEntry, ...]:
        """Return the identifications of these valves, or of all, oldest first.

        Their times are from `since` to before `until`, ns since 1970 (UTC).
        """
        with reading(self.place) as connection:
            return entries_in(connection, valves, since, until)


@dataclass(frozen=True)
class HistoryFile(History):
    """A history in an SQLite file.

    Every method opens the file anew, so it may be moved, repaired or missing between two calls.
    Each change is one transaction: a killed process leaves the change complete or absent, and the
    file intact. All methods raise HistoryError if the file cannot be read or written.

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

        This does not wait for a process that is writing the file, unless the file needs an update.
        """
        if not is_ready(self.path):
            with writing(self.path):
                pass

    def add(self, entry: HistoryEntry, days: float = 0.0) -> None:
        """Add an identification; delete rows of its valve more than `days` older (0: none).

        The newest baseline and the last success stay at any age.
        """
        with writing(self.path) as connection:
            valve = valve_id(connection, entry.valve)
            insert_entry(connection, valve, entry)
            if days > 0:
                _forget(connection, valve, oldest_kept(entry.time, days))

    def set_baseline(self, valve: KeptValve, kept: KeptBaseline) -> None:
        """Store a change of the baseline of a valve."""
        with writing(self.path) as connection:
            insert_baseline(connection, valve_id(connection, valve), kept)


def _forget(connection: Connection, valve: int, before: int) -> None:
    """Delete the rows of a valve before a time (ns), and settings that are no longer used."""
    entry, baseline = tables.identification, tables.baseline
    last_success = sa.select(sa.func.max(entry.c.id)).where(
        entry.c.valve_id == valve, entry.c.refusal.is_(None)
    )
    kept = sa.func.coalesce(last_success.scalar_subquery(), 0)
    old = (entry.c.valve_id == valve, entry.c.time_ns < before, entry.c.id != kept)
    if connection.execute(sa.delete(entry).where(*old)).rowcount:
        used = sa.select(entry.c.settings_id)
        settings = tables.settings
        connection.execute(sa.delete(settings).where(settings.c.id.not_in(used)))
    newest = sa.select(sa.func.max(baseline.c.id)).where(baseline.c.valve_id == valve)
    connection.execute(
        sa.delete(baseline).where(
            baseline.c.valve_id == valve,
            baseline.c.time_ns < before,
            baseline.c.id < newest.scalar_subquery(),
        )
    )


# Ratios of the valves of a plant, read on from the last row read


class KeptRatio(NamedTuple):
    """Friction of a valve over its baseline, with row, name of the valve and time (ns)."""

    row: int
    valve: str
    time: int
    ratio: float


class LastState(NamedTuple):
    """Last successful identification of a valve, as a list of valves shows it.

    Attributes
    ----------
    valve : KeptValve
        The valve.
    time : int
        Time of the identification, ns since 1970 (UTC).
    level, status_signal : Level, StatusSignal
        Level and NE 107 status signal of its diagnosis.
    message : str
        Message of its diagnosis.
    ratio : Ratio or None
        Friction over baseline.
    frictions : tuple of Parameter
        Its Coulomb and sliding friction.
    """

    valve: KeptValve
    time: int
    level: Level
    status_signal: StatusSignal
    message: str
    ratio: Ratio | None
    frictions: tuple[Parameter, ...]


def last_states(file: History) -> tuple[LastState, ...]:
    """Return the last successful identification of each valve.

    Raises HistoryError if the history cannot be read.
    """
    table, parameter = tables.identification, tables.parameter
    newest = (
        sa.select(sa.func.max(table.c.id))
        .where(table.c.refusal.is_(None))
        .group_by(table.c.valve_id)
    )
    query = (
        sa.select(table, tables.valve.c.name.label("valve_name"), tables.valve.c.tag)
        .select_from(joined(table, tables.valve))
        .where(table.c.id.in_(newest))
    )
    of_entries = sa.select(parameter).where(
        parameter.c.identification_id.in_(newest),
        parameter.c.name.in_(("coulomb_friction", SLIDING)),
    )
    frictions: defaultdict[int, list[Parameter]] = defaultdict(list)
    with reading(file.place) as connection:
        for row in connection.execute(of_entries).mappings():
            frictions[row["identification_id"]].append(value_of(Parameter, row))
        return tuple(
            LastState(
                KeptValve(row["valve_name"], row["tag"]),
                row["time_ns"],
                Level(row["level"]),
                StatusSignal(row["status_signal"]),
                row["message"],
                ratio_in(row),
                tuple(frictions[row["id"]]),
            )
            for row in connection.execute(query).mappings()
        )


class HistoryMark(NamedTuple):
    """Mark of the content of a history: its last rows, and numbers of recordings and valves.

    The last rows are those of identification, baseline and alarm event. The mark changes when any
    of these is added, but not with usage and moves, which are written often. If it is not
    `settled`, rows may still appear before the last row: a transaction on a server may begin
    earlier and end later than another. `database` identifies the database of a server.
    """

    identification: int
    baseline: int
    alarms: int
    valves: int
    alarm_event: int = 0
    settled: bool = True
    database: str = ""


def history_mark(file: History) -> HistoryMark:
    """Return the present mark of a history.

    Raises HistoryError if it cannot be read.
    """
    with reading(file.place) as connection:

        def one(what: Any, table: sa.Table) -> int:
            return int(connection.scalar(sa.select(what).select_from(table)) or 0)

        found = HistoryMark(
            one(sa.func.max(tables.identification.c.id), tables.identification),
            one(sa.func.max(tables.baseline.c.id), tables.baseline),
            one(sa.func.count(), tables.alarm_recording),
            one(sa.func.count(), tables.valve),
            one(sa.func.max(tables.alarm_event.c.id), tables.alarm_event),
        )
        if not isinstance(file.place, HistoryServer):
            return found
        now = sa.func.pg_current_snapshot()
        under_way = sa.func.pg_snapshot_xmin(now) != sa.func.pg_snapshot_xmax(now)
        return found._replace(
            settled=not connection.scalar(sa.select(under_way)),
            database=marked(connection, "identity") or "",
        )


def ratios_after(file: History, row: int, since: int) -> tuple[KeptRatio, ...]:
    """Return the ratios of all valves after a row and since a time, ns; oldest row first.

    Raises HistoryError if the history cannot be read.
    """
    table = tables.identification
    query = (
        sa.select(table.c.id, tables.valve.c.name, table.c.time_ns, table.c.ratio)
        .select_from(joined(table, tables.valve))
        .where(table.c.id > row, table.c.time_ns >= since, table.c.ratio.is_not(None))
        .order_by(table.c.id)
    )
    with reading(file.place) as connection:
        return tuple(KeptRatio(*one) for one in connection.execute(query))
