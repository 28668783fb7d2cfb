# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The valve in service as rows of the history: usage, moves, answers, alarms, notified level.

All functions raise HistoryError if the history cannot be read or written.
"""

import contextlib
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import astuple, fields
from pathlib import Path
from typing import Any

import sqlalchemy as sa
from sqlalchemy.engine import Connection, RowMapping

from valve_friction_ros.evidence import MOST_MOVES, FrictionChange, Move
from valve_friction_ros.health import Reference, SlidingFriction
from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.friction_monitor import MonitorSettings
from valve_friction_ros.health.levels import Level
from valve_friction_ros.history import tables
from valve_friction_ros.history.database import reading, writing
from valve_friction_ros.history.entry import AlarmRecording, KeptValve
from valve_friction_ros.history.history import History, HistoryFile
from valve_friction_ros.history.rows import oldest_kept, valve_id
from valve_friction_ros.history.tables import joined, put
from valve_friction_ros.history.trend import Trend, ValveHistory, trend_of
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.response import StepAnswer, summarised
from valve_friction_ros.usage import Usage, UsedDay, ValveUsage, total

# What is kept, and for how long


def _of_valve(table: sa.Table, valve: str, *order: Any) -> Any:
    """Return what selects the rows of the valve of a name."""
    query = sa.select(table).select_from(joined(table, tables.valve))
    return query.where(tables.valve.c.name == valve).order_by(*order)


def _forget_older(
    connection: Connection, column: sa.Column[Any], row: int, newest: int, days: float
) -> None:
    """Delete the rows of a valve whose stamps are `days` older than one, ns; none for 0."""
    if days > 0:
        table = column.table
        old = column < oldest_kept(newest, days)
        connection.execute(sa.delete(table).where(table.c.valve_id == row, old))


def _forget_beyond(connection: Connection, column: sa.Column[Any], row: int, most: int) -> None:
    """Delete all rows of a valve but the `most` with the largest values of a column."""
    of_valve = column.table.c.valve_id == row
    last = sa.select(column).where(of_valve).order_by(column.desc()).limit(1).offset(most)
    connection.execute(sa.delete(column.table).where(of_valve, column <= last.scalar_subquery()))


# Recordings of alarms, and the level that was notified last


def keep_alarm_recording(
    file: HistoryFile, valve: KeptValve, one: AlarmRecording, days: float = 0.0
) -> None:
    """Keep that an alarm was recorded; delete those of its valve `days` older, none for 0."""
    table = tables.alarm_recording
    with writing(file.path) as connection:
        row = valve_id(connection, valve)
        same_time = (table.c.valve_id == row, table.c.time_ns == one.time)
        connection.execute(sa.delete(table).where(*same_time))
        values = {"level": int(one.level), "path": str(one.path), "message": one.message}
        put(connection, table, [{"valve_id": row, "time_ns": one.time, **values}])
        _forget_older(connection, table.c.time_ns, row, one.time, days)


def alarm_recordings(file: History, valve: str) -> tuple[AlarmRecording, ...]:
    """Return the recordings of the valve of this name, oldest first."""
    table = tables.alarm_recording
    with reading(file.place) as connection:
        rows = connection.execute(_of_valve(table, valve, table.c.time_ns, table.c.path))
        return tuple(
            AlarmRecording(row.time_ns, Level(row.level), Path(row.path), row.message)
            for row in rows
        )


def keep_told_level(file: HistoryFile, valve: KeptValve, level: Level) -> None:
    """Keep the level that was told last."""
    with writing(file.path) as connection:
        row = {"valve_id": valve_id(connection, valve), "level": int(level)}
        put(connection, tables.told_level, [row])


def read_told_level(file: History, valve: str) -> Level | None:
    """Return the level that was told last of the valve of this name, if any."""
    with reading(file.place) as connection:
        row = connection.execute(_of_valve(tables.told_level, valve)).first()
        return None if row is None else Level(row.level)


# Answers to the command

_MOST_ANSWERS = 2000
"""Answers of a valve that are kept, the latest."""

_OF_ANSWER = tuple(field.name for field in fields(StepAnswer))
_FLAGS = frozenset(field.name for field in fields(StepAnswer) if field.type in (bool, "bool"))


def keep_answers(
    file: HistoryFile,
    valve: KeptValve,
    travel: float,
    moves: Sequence[StepAnswer],
    days: float = 0.0,
) -> None:
    """Add answers of a stem with this travel, m, oldest first; keeping them twice changes nothing.

    Those go that are `days` older than the last one, none for 0, and all but the 2000 kept last; a
    stamp ahead of the clock of this machine ages none.
    """
    if not moves:
        return
    table = tables.answer
    with writing(file.path) as connection:
        row = valve_id(connection, valve)
        values = ({name: getattr(one, name) for name in _OF_ANSWER} for one in moves)
        put(connection, table, [{"valve_id": row, "travel": travel, **one} for one in values])
        _forget_older(connection, table.c.stamp, row, moves[-1].stamp, days)
        _forget_beyond(connection, table.c.id, row, _MOST_ANSWERS)


def read_answers(file: History, valve: str, travel: float | None = None) -> tuple[StepAnswer, ...]:
    """Return the answers of the valve of this name, in the order in which they were kept.

    Only those with this travel, m, are returned; None: that of the last answer.
    """
    with reading(file.place) as connection:
        query = _of_valve(tables.answer, valve, tables.answer.c.id)
        rows = connection.execute(query).mappings().all()
        wanted = rows[-1]["travel"] if rows and travel is None else travel
        return tuple(_answer(row) for row in rows if row["travel"] == wanted)


def _answer(row: RowMapping) -> StepAnswer:
    """Build an answer of its columns; SQLite stores nan as NULL."""
    known: dict[str, Any] = {
        name: bool(row[name]) if name in _FLAGS else math.nan if row[name] is None else row[name]
        for name in _OF_ANSWER
    }
    numbers = {name: float(value) for name, value in known.items() if name not in _FLAGS}
    return StepAnswer(**known | numbers | {"stamp": int(row["stamp"])})


# Moves in service, and what they say together

_NUMBERS_OF_MOVE = (
    "start",
    "stop",
    "force",
    "force_rate",
    "speed",
    "onset_force",
    "onset_position",
    "onset_rate",
)


def _actuator(table: sa.Table, built: Valve) -> Any:
    """Return what is true of rows that were computed with this area and pressure reference."""
    area = table.c.diaphragm_area.is_not_distinct_from(built.diaphragm_area)
    return sa.and_(area, table.c.pressure_reference == built.pressure_reference)


def _built(row: int, built: Valve) -> dict[str, Any]:
    return {
        "valve_id": row,
        "diaphragm_area": built.diaphragm_area,
        "pressure_reference": built.pressure_reference,
    }


def keep_moves(
    file: HistoryFile,
    valve: KeptValve,
    built: Valve,
    moves: Sequence[Move],
    days: float = 0.0,
) -> None:
    """Add moves of a valve, oldest first; keeping them twice changes nothing.

    Those go that are `days` older than the last one, none for 0, and all but the newest
    `MOST_MOVES`; a stamp ahead of the clock of this machine ages none.
    """
    if not moves:
        return
    table = tables.move
    with writing(file.path) as connection:
        row = valve_id(connection, valve)
        rows = [
            {
                **_built(row, built),
                "begin_ns": one.begin,
                "end_ns": one.end,
                **{name: getattr(one, name) for name in _NUMBERS_OF_MOVE},
            }
            for one in moves
        ]
        put(connection, table, rows)
        _forget_older(connection, table.c.end_ns, row, moves[-1].end, days)
        _forget_beyond(connection, table.c.end_ns, row, MOST_MOVES)


def forget_moves_after(file: HistoryFile, valve: KeptValve, time: int) -> None:
    """Drop the moves of a valve that end after a time, ns since 1970 (UTC)."""
    table = tables.move
    with writing(file.path) as connection:
        row = valve_id(connection, valve)
        connection.execute(sa.delete(table).where(table.c.valve_id == row, table.c.end_ns > time))


def read_moves(file: History, valve: str, built: Valve) -> tuple[Move, ...]:
    """Return the moves of the valve of this name, oldest first.

    Only those are returned whose forces were computed with the area and the pressure reference in
    force.
    """
    table = tables.move
    with reading(file.place) as connection:
        query = _of_valve(table, valve, table.c.end_ns).where(_actuator(table, built))
        return tuple(
            Move(
                int(row["begin_ns"]),
                int(row["end_ns"]),
                *(math.nan if row[name] is None else row[name] for name in _NUMBERS_OF_MOVE),
            )
            for row in connection.execute(query).mappings()
        )


def keep_reference(file: HistoryFile, valve: KeptValve, built: Valve, reference: Reference) -> None:
    """Keep the first friction by the moves of a valve; a later one with its actuator is none."""
    table, one = tables.evidence_reference, reference.sliding
    with writing(file.path) as connection:
        row = valve_id(connection, valve)
        another = sa.not_(_actuator(table, built))
        connection.execute(sa.delete(table).where(table.c.valve_id == row, another))
        values = {"sliding_friction": one.value, "half_width": one.half_width, "speed": one.speed}
        kept = {**_built(row, built), "time_ns": reference.time, **values}
        put(connection, table, [kept], is_kept=True)


def read_reference(file: History, valve: str, built: Valve) -> Reference | None:
    """Return the first friction by the moves of the valve of this name, with this actuator."""
    table = tables.evidence_reference
    with reading(file.place) as connection:
        row = connection.execute(_of_valve(table, valve).where(_actuator(table, built))).first()
        if row is None:
            return None
        return Reference(
            SlidingFriction(row.sliding_friction, row.half_width, row.speed), row.time_ns
        )


def keep_change(file: HistoryFile, valve: KeptValve, built: Valve, change: FrictionChange) -> None:
    """Keep the last change of friction that the moves of a valve show, in place of another."""
    with writing(file.path) as connection:
        values = dict(zip(_OF_CHANGE, astuple(change), strict=True))
        kept = {**_built(valve_id(connection, valve), built), **values}
        put(connection, tables.evidence_change, [kept])


_OF_CHANGE = ("earliest_ns", "latest_ns", "ratio", "low", "high")


def read_change(file: History, valve: str, built: Valve) -> FrictionChange | None:
    """Return the last change that the moves of the valve, with this actuator, have shown."""
    table = tables.evidence_change
    with reading(file.place) as connection:
        query = _of_valve(table, valve).where(_actuator(table, built))
        row = connection.execute(query).mappings().first()
        return None if row is None else FrictionChange(*(row[name] for name in _OF_CHANGE))


# Usage

_EARLIER_RUNS = ""
"""Run whose rows are the sums of runs that have ended."""

_OPEN_DAYS = 1
"""Days before the newest whose rows stay apart: a run may write about midnight. Chosen."""


def keep_usage(file: HistoryFile, valve: KeptValve, run: str, days: Iterable[UsedDay]) -> None:
    """Keep what a run of an identifier has counted on some days; `run` is a name of its own.

    The usage of a day is that of the whole run: it takes the place of what the run has kept of this
    day before, so that keeping it twice changes nothing. What other runs have kept of days
    before the newest two becomes one row a day: of a valve one run writes at a time.
    """
    with writing(file.path) as connection:
        row = valve_id(connection, valve)
        put(connection, tables.usage, [_used(row, run, one) for one in days])
        _merge(connection, row, run)


def _used(row: int, run: str, one: UsedDay) -> dict[str, Any]:
    day, renewal, usage = one
    return {
        "valve_id": row,
        "renewal_ns": renewal,
        "day": day,
        "run": run,
        "distance": usage.distance,
        "reversals": usage.reversals,
        "breakaways": usage.breakaways,
        "time_watched_ns": usage.time_watched,
        "histogram_ns": json.dumps(usage.histogram),
    }


def _merge(connection: Connection, row: int, run: str) -> None:
    """Add up, for each finished day, the rows of all runs but this one."""
    table = tables.usage
    last = sa.select(sa.func.max(table.c.day)).where(table.c.valve_id == row).scalar_subquery()
    others = (table.c.valve_id == row, table.c.run != run)
    which = (table.c.renewal_ns, table.c.day)
    several = (
        sa.select(*which)
        .where(*others, table.c.day < last - _OPEN_DAYS)
        .group_by(*which)
        .having(sa.func.count() > 1)
    )
    for renewal, day in connection.execute(several).all():
        chosen = (*others, table.c.renewal_ns == renewal, table.c.day == day)
        rows = connection.execute(sa.select(table).where(*chosen)).mappings().all()
        with contextlib.suppress(TypeError, ValueError):  # rows that hold no usage: reading says so
            merged = UsedDay(day, renewal, total(_day(each).usage for each in rows))
            connection.execute(sa.delete(table).where(*chosen))
            put(connection, table, [_used(row, _EARLIER_RUNS, merged)])


def keep_renewal(file: HistoryFile, valve: KeptValve, time: int) -> None:
    """Keep that the packing of a valve was renewed at a time, ns since 1970 (UTC).

    The moves of the packing before go, their reference, and the answers to the command: they say
    nothing of the new one.
    """
    of_packing = (
        tables.move,
        tables.evidence_reference,
        tables.evidence_change,
        tables.answer,
    )
    with writing(file.path) as connection:
        row = valve_id(connection, valve)
        renewal = {"valve_id": row, "time_ns": time}
        put(connection, tables.packing_renewal, [renewal], is_kept=True)
        for table in of_packing:
            connection.execute(sa.delete(table).where(table.c.valve_id == row))


def read_usage(file: History, valve: str) -> ValveUsage:
    """Return the usage of the valve of this name."""
    with reading(file.place) as connection:
        rows = connection.execute(_of_valve(tables.usage, valve)).mappings().all()
        renewals = connection.execute(_of_valve(tables.packing_renewal, valve))
        renewed = max((row.time_ns for row in renewals), default=0)
        return ValveUsage.of(map(_day, rows), renewed)


def _day(row: RowMapping) -> UsedDay:
    usage = Usage(
        row["distance"],
        row["reversals"],
        row["breakaways"],
        tuple(json.loads(row["histogram_ns"])),
    )
    return UsedDay(row["day"], row["renewal_ns"], usage)


# All that is kept of a valve


def valve_histories(
    history: History, valves: tuple[KeptValve, ...], since: int, until: int
) -> tuple[ValveHistory, ...]:
    """Read the histories of some valves from `since` to `until`, ns; empty ones are left out."""
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
