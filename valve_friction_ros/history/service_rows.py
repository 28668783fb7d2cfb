# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The valve in service as rows of the history: usage, moves, responses, alarms, notified level.

All functions raise HistoryError if the history cannot be read or written.
"""

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import sqlalchemy as sa
from sqlalchemy.engine import Connection

from valve_friction_ros.evidence.estimate import MOST_MOVES, FrictionChange
from valve_friction_ros.evidence.moves import Move
from valve_friction_ros.health.baseline import Baseline, SlidingFriction
from valve_friction_ros.health.by_evidence import Reference
from valve_friction_ros.health.friction_monitor import MonitorSettings
from valve_friction_ros.health.levels import Level
from valve_friction_ros.history import tables
from valve_friction_ros.history.database import reading, writing
from valve_friction_ros.history.entry import AlarmRecording, KeptValve
from valve_friction_ros.history.history import History, HistoryFile
from valve_friction_ros.history.rows import T, columns_of, oldest_kept, value_of, valve_id
from valve_friction_ros.history.tables import of_valve, put
from valve_friction_ros.history.trend import Trend, ValveHistory, trend_of
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.response import StepAnswer, summarised
from valve_friction_ros.usage import Usage, UsedDay, ValveUsage, total


def _all_of(kind: Callable[..., T], file: History, query: Any) -> tuple[T, ...]:
    with reading(file.place) as connection:
        return tuple(value_of(kind, row) for row in connection.execute(query).mappings())


class _Rows(NamedTuple):
    """The rows of a valve within one transaction."""

    connection: Connection
    valve: int

    def put(self, table: sa.Table, *rows: dict[str, Any], is_kept: bool = False) -> None:
        put(self.connection, table, [{"valve_id": self.valve} | r for r in rows], is_kept=is_kept)

    def drop(self, table: sa.Table, *which: Any) -> None:
        of_valve = table.c.valve_id == self.valve
        self.connection.execute(sa.delete(table).where(of_valve, *which))

    def drop_older(self, stamp: sa.Column[Any], newest: int, days: float) -> None:
        """Drop the rows whose stamps are more than `days` older than `newest`, ns (0: none)."""
        if days > 0:
            self.drop(stamp.table, stamp < oldest_kept(newest, days))

    def drop_beyond(self, column: sa.Column[Any], most: int) -> None:
        """Drop all rows except the `most` with the largest values of a column."""
        of_valve = column.table.c.valve_id == self.valve
        last = sa.select(column).where(of_valve).order_by(column.desc()).limit(1).offset(most)
        self.drop(column.table, column <= last.scalar_subquery())


@contextlib.contextmanager
def _rows_of(file: HistoryFile, valve: KeptValve) -> Iterator[_Rows]:
    with writing(file.path) as connection:
        yield _Rows(connection, valve_id(connection, valve))


# Alarm recordings, and the level that was notified last


def keep_alarm_recording(
    file: HistoryFile, valve: KeptValve, one: AlarmRecording, days: float = 0.0
) -> None:
    """Store an alarm recording; delete those of its valve more than `days` older (0: none)."""
    table = tables.alarm_recording
    with _rows_of(file, valve) as rows:
        rows.drop(table, table.c.time_ns == one.time)
        rows.put(table, columns_of(one))
        rows.drop_older(table.c.time_ns, one.time, days)


def alarm_recordings(file: History, valve: str) -> tuple[AlarmRecording, ...]:
    """Return the recordings of the valve of this name, oldest first."""
    table = tables.alarm_recording
    query = of_valve(table, valve).order_by(table.c.time_ns, table.c.path)
    return _all_of(AlarmRecording, file, query)


def keep_told_level(file: HistoryFile, valve: KeptValve, level: Level) -> None:
    """Store the level that was last notified."""
    with _rows_of(file, valve) as rows:
        rows.put(tables.told_level, {"level": int(level)})


def read_told_level(file: History, valve: str) -> Level | None:
    """Return the last notified level of the valve of this name, if any."""
    with reading(file.place) as connection:
        row = connection.execute(of_valve(tables.told_level, valve)).first()
        return None if row is None else Level(row.level)


# Responses to the command

_MOST_ANSWERS = 2000
"""Number of latest responses that are stored per valve."""


def keep_answers(
    file: HistoryFile,
    valve: KeptValve,
    travel: float,
    moves: Sequence[StepAnswer],
    days: float = 0.0,
) -> None:
    """Add responses of a stem with this travel, m, oldest first; a repetition changes nothing.

    Responses more than `days` older than the last are deleted (0: none), and so are all but the
    latest 2000. A stamp ahead of the clock of this machine deletes no more than the clock does.
    """
    if not moves:
        return
    table = tables.answer
    with _rows_of(file, valve) as rows:
        rows.put(table, *({"travel": travel, **columns_of(one)} for one in moves))
        rows.drop_older(table.c.stamp, moves[-1].stamp, days)
        rows.drop_beyond(table.c.id, _MOST_ANSWERS)


def read_answers(file: History, valve: str, travel: float | None = None) -> tuple[StepAnswer, ...]:
    """Return the responses of the valve of this name, in the order of storage.

    Only responses with this travel, m, are returned; None means the travel of the last response.
    """
    with reading(file.place) as connection:
        query = of_valve(tables.answer, valve).order_by(tables.answer.c.id)
        rows = connection.execute(query).mappings().all()
        wanted = rows[-1]["travel"] if rows and travel is None else travel
        return tuple(value_of(StepAnswer, row) for row in rows if row["travel"] == wanted)


# Moves in service, and their combined result


def _actuator(table: sa.Table, built: Valve) -> Any:
    """Return the condition for rows computed with this area and pressure reference."""
    area = table.c.diaphragm_area.is_not_distinct_from(built.diaphragm_area)
    return sa.and_(area, table.c.pressure_reference == built.pressure_reference)


def _with(built: Valve, one: Any) -> dict[str, Any]:
    names = ("diaphragm_area", "pressure_reference")
    return {**{name: getattr(built, name) for name in names}, **columns_of(one)}


def keep_moves(
    file: HistoryFile, valve: KeptValve, built: Valve, moves: Sequence[Move], days: float = 0.0
) -> None:
    """Add moves of a valve, oldest first; a repetition changes nothing.

    Moves more than `days` older than the last are deleted (0: none), and so are all but the newest
    `MOST_MOVES`. A stamp ahead of the clock of this machine deletes no more than the clock does.
    """
    if not moves:
        return
    table = tables.move
    with _rows_of(file, valve) as rows:
        rows.put(table, *(_with(built, one) for one in moves))
        rows.drop_older(table.c.end_ns, moves[-1].end, days)
        rows.drop_beyond(table.c.end_ns, MOST_MOVES)


def forget_moves_after(file: HistoryFile, valve: KeptValve, time: int) -> None:
    """Drop the moves of a valve that end after a time, ns since 1970 (UTC)."""
    with _rows_of(file, valve) as rows:
        rows.drop(tables.move, tables.move.c.end_ns > time)


def read_moves(file: History, valve: str, built: Valve) -> tuple[Move, ...]:
    """Return the moves of the valve of this name, oldest first.

    Only moves whose forces were computed with the present area and pressure reference are returned.
    """
    table = tables.move
    query = of_valve(table, valve).where(_actuator(table, built)).order_by(table.c.end_ns)
    return _all_of(Move, file, query)


def keep_reference(file: HistoryFile, valve: KeptValve, built: Valve, reference: Reference) -> None:
    """Store the first friction from the moves of a valve; ignore later ones for this actuator."""
    table = tables.evidence_reference
    with _rows_of(file, valve) as rows:
        rows.drop(table, sa.not_(_actuator(table, built)))
        kept = {"time_ns": reference.time, **_with(built, reference.sliding)}
        rows.put(table, kept, is_kept=True)


def read_reference(file: History, valve: str, built: Valve) -> Reference | None:
    """Return the first friction from the moves of the valve of this name, with this actuator."""
    table = tables.evidence_reference
    with reading(file.place) as connection:
        query = of_valve(table, valve).where(_actuator(table, built))
        row = connection.execute(query).mappings().first()
        return None if row is None else Reference(value_of(SlidingFriction, row), row["time_ns"])


def keep_change(file: HistoryFile, valve: KeptValve, built: Valve, change: FrictionChange) -> None:
    """Store the last change of friction from the moves of a valve; it replaces the previous."""
    with _rows_of(file, valve) as rows:
        rows.put(tables.evidence_change, _with(built, change))


def read_change(file: History, valve: str, built: Valve) -> FrictionChange | None:
    """Return the last change of friction from the moves of the valve, with this actuator."""
    table = tables.evidence_change
    query = of_valve(table, valve).where(_actuator(table, built))
    return next(iter(_all_of(FrictionChange, file, query)), None)


# Usage

_EARLIER_RUNS = ""
"""Name of the run whose rows are the sums of ended runs."""

_OPEN_DAYS = 1
"""Days before the newest whose rows stay separate: a run may write around midnight. Chosen."""


def keep_usage(file: HistoryFile, valve: KeptValve, run: str, days: Iterable[UsedDay]) -> None:
    """Store the usage that a run of an identifier has counted per day; `run` is a unique name.

    The usage of a day covers the whole run. It replaces the previous usage of that day and run, so
    a repetition changes nothing. The usage of other runs, before the newest two days, is summed to
    one row per day, since only one run at a time writes for a valve.
    """
    with _rows_of(file, valve) as rows:
        rows.put(tables.usage, *(_used(run, one) for one in days))
        _merge(rows, run)


def _used(run: str, one: UsedDay) -> dict[str, Any]:
    own = {"renewal_ns": one.renewal, "day": one.day, "run": run}
    return {**own, "time_watched_ns": one.usage.time_watched, **columns_of(one.usage)}


def _merge(rows: _Rows, run: str) -> None:
    """Sum, for each finished day, the rows of all runs except this run."""
    table, connection = tables.usage, rows.connection
    of_valve, another = table.c.valve_id == rows.valve, table.c.run != run
    last = sa.select(sa.func.max(table.c.day)).where(of_valve).scalar_subquery()
    which = (table.c.renewal_ns, table.c.day)
    several = (
        sa.select(*which)
        .where(of_valve, another, table.c.day < last - _OPEN_DAYS)
        .group_by(*which)
        .having(sa.func.count() > 1)
    )
    for renewal, day in connection.execute(several).all():
        chosen = (another, table.c.renewal_ns == renewal, table.c.day == day)
        found = connection.execute(sa.select(table).where(of_valve, *chosen)).mappings().all()
        with contextlib.suppress(TypeError, ValueError):  # reading reports rows without usage
            merged = UsedDay(day, renewal, total(value_of(Usage, each) for each in found))
            rows.drop(table, *chosen)
            rows.put(table, _used(_EARLIER_RUNS, merged))


def keep_renewal(file: HistoryFile, valve: KeptValve, time: int) -> None:
    """Store that the packing of a valve was renewed at a time, ns since 1970 (UTC).

    Moves with the old packing, their reference and change, and responses to the command are
    deleted: they do not apply to the new packing.
    """
    with _rows_of(file, valve) as rows:
        rows.put(tables.packing_renewal, {"time_ns": time}, is_kept=True)
        rows.drop(tables.move)
        rows.drop(tables.evidence_reference)
        rows.drop(tables.evidence_change)
        rows.drop(tables.answer)


def read_usage(file: History, valve: str) -> ValveUsage:
    """Return the usage of the valve of this name."""
    with reading(file.place) as connection:
        rows = connection.execute(of_valve(tables.usage, valve)).mappings().all()
        renewals = connection.execute(of_valve(tables.packing_renewal, valve))
        renewed = max((row.time_ns for row in renewals), default=0)
        days = (UsedDay(row["day"], row["renewal_ns"], value_of(Usage, row)) for row in rows)
        return ValveUsage.of(days, renewed)


# The complete history of a valve


def valve_histories(
    history: History, valves: tuple[KeptValve, ...], since: int, until: int
) -> tuple[ValveHistory, ...]:
    """Read the histories of several valves from `since` to `until`, ns, without empty ones."""
    found = []
    for valve in valves:
        entries = history.entries([valve.name], since, until)
        if not entries:
            continue
        kept = history.baseline(valve.name, until)
        baselines = history.baselines(valve.name, since, until)
        begin = since if kept is None else max(since, kept.since)
        last = entries[-1]
        same = (one for one in entries if one.time >= begin and one.method == last.method)
        points = [point for one in same if (point := one.point(last.baseline)) is not None]
        trend = trend_of(points, last.baseline, last.limits)
        usage = read_usage(history, valve.name)
        recorded = alarm_recordings(history, valve.name)
        alarms = tuple(one for one in recorded if since <= one.time < until)
        answers = read_answers(history, valve.name)
        response = summarised([one for one in answers if since <= one.stamp < until])
        found.append(ValveHistory(valve, entries, kept, trend, baselines, usage, alarms, response))
    return tuple(found)


def current_trend(
    history: History, valve: str, baseline: Baseline | None, settings: MonitorSettings
) -> Trend | None:
    """Return the trend of a valve since its baseline was last set, by the method in force."""
    kept = history.baseline(valve)
    points = history.points(valve, settings.method, kept.since if kept else 0, baseline)
    return trend_of(points, baseline, settings.limits)
