# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Alarm events as rows of the history: written step by step, listed and filtered.

Each step is one transaction that begins by reading the alarms from the file. Two processes
therefore never make a step twice, and a killed process makes a step completely or not at all. All
functions raise HistoryError if the history cannot be read or written.
"""

import math
import threading
import uuid
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import sqlalchemy as sa
from sqlalchemy.engine import Connection, RowMapping

from valve_friction_ros.health.alarms import (
    TRANSITIONS,
    Alarm,
    AlarmAction,
    AlarmError,
    AlarmEvent,
    AlarmKind,
    AlarmRequest,
    AlarmState,
    Condition,
    all_followed,
    all_requested,
    requested,
)
from valve_friction_ros.health.levels import Level, StatusSignal
from valve_friction_ros.history import tables
from valve_friction_ros.history.database import reading, writing
from valve_friction_ros.history.entry import KeptValve
from valve_friction_ros.history.history import History
from valve_friction_ros.history.place import file_state
from valve_friction_ros.history.rows import oldest_kept, valve_id
from valve_friction_ros.history.tables import joined, put
from valve_friction_ros.outside_text import csv_text
from valve_friction_ros.streams import END_OF_TIME, utc_second

_EVENT = tables.alarm_event


class KeptAlarmEvent(NamedTuple):
    """An alarm event and its valve."""

    valve: KeptValve
    event: AlarmEvent

    @property
    def area(self) -> str:
        """Area of the valve: the parent of its namespace.

        ``/unit_3/fv_101/identifier`` is in the area ``/unit_3``, ``/fv_101/identifier`` in ``/``.
        """
        return self.valve.name.rsplit("/", 2)[0] or "/"


# Steps


def _row(valve: int, event: AlarmEvent) -> dict[str, Any]:
    alarm = event.alarm
    return {
        "valve_id": valve,
        "uid": uuid.uuid4().hex,
        "time_ns": event.time,
        "kind": alarm.kind.value,
        "action": event.action.name,
        "state_before": event.before.name,
        "state": alarm.state.name,
        "level": int(alarm.condition.level),
        "status_signal": alarm.condition.status_signal.value,
        "message": alarm.message,
        "raised_ns": alarm.raised,
        "until_ns": alarm.until,
        "who": event.who,
        "text": event.text,
    }


def _event(row: RowMapping) -> AlarmEvent:
    message, level = row["message"], Level(row["level"])
    shown = Condition(level, StatusSignal(row["status_signal"]), message if level else "")
    alarm = Alarm(
        AlarmKind(row["kind"]),
        AlarmState[row["state"]],
        shown,
        row["raised_ns"],
        row["until_ns"],
        message,
    )
    before = AlarmState[row["state_before"]]
    return AlarmEvent(
        row["time_ns"], AlarmAction[row["action"]], before, alarm, row["who"], row["text"]
    )


def _newest(*of_valve: Any) -> Any:
    """Return a query for the id of the last event of each alarm."""
    newest = sa.func.max(_EVENT.c.id)
    return sa.select(newest).where(*of_valve).group_by(_EVENT.c.valve_id, _EVENT.c.kind)


def _alarms(connection: Connection, valves: Iterable[int]) -> dict[tuple[int, AlarmKind], Alarm]:
    """Return the alarms of several valves, given by their rows."""
    newest = _newest(_EVENT.c.valve_id.in_(valves))
    rows = connection.execute(sa.select(_EVENT).where(_EVENT.c.id.in_(newest))).mappings()
    found = ((row["valve_id"], _event(row).alarm) for row in rows)
    return {(valve, alarm.kind): alarm for valve, alarm in found}


def _alarms_of(connection: Connection, valve: int) -> dict[AlarmKind, Alarm]:
    return {kind: alarm for (_, kind), alarm in _alarms(connection, [valve]).items()}


class AlarmSteps(NamedTuple):
    """Result of a transaction on the alarms of a valve: its events and the present alarms."""

    events: tuple[AlarmEvent, ...]
    alarms: Mapping[AlarmKind, Alarm]


def _unkept(connection: Connection, valves: Collection[int]) -> set[int]:
    """Return the valves whose alarms no file keeps, locked on a server against other writers.

    For other valves the server holds only a copy; a step made there would not reach their file.
    """
    if connection.dialect.name != "postgresql":
        return {*valves}
    row, keeper = tables.valve.c.id, tables.keeper.c.valve_id
    connection.execute(sa.select(row).where(row.in_(valves)).order_by(row).with_for_update())
    return {*valves} - {*connection.scalars(sa.select(keeper).where(keeper.in_(valves)))}


def _kept(
    history: History,
    valve: KeptValve,
    days: float,
    steps: Callable[[Mapping[AlarmKind, Alarm]], tuple[AlarmEvent, ...]],
) -> AlarmSteps:
    with writing(history.place) as connection:
        number = valve_id(connection, valve)
        if number not in _unkept(connection, [number]):
            raise AlarmError(f"a file keeps the alarms of {valve.name}: ask its identifier")
        alarms = _alarms_of(connection, number)
        events = steps(alarms)
        put(connection, _EVENT, [_row(number, one) for one in events], is_kept=True)
        if events and days > 0:
            of_valve = _EVENT.c.valve_id == number
            old = (of_valve, _EVENT.c.time_ns < oldest_kept(events[-1].time, days))
            connection.execute(sa.delete(_EVENT).where(*old, _EVENT.c.id.not_in(_newest(of_valve))))
    return AlarmSteps(events, alarms | {one.alarm.kind: one.alarm for one in events})


def follow_alarms(
    history: History,
    valve: KeptValve,
    conditions: Mapping[AlarmKind, Condition],
    time: int,
    days: float = 0.0,
) -> AlarmSteps:
    """Store the events of the valve and the clock on its alarms at a time, ns (`all_followed`).

    Events more than `days` older are deleted (0: none), except the last event of each alarm.
    """
    return _kept(history, valve, days, lambda alarms: all_followed(alarms, conditions, time))


def request_alarms(
    history: History,
    valve: KeptValve,
    kind: AlarmKind | None,
    request: AlarmRequest,
    time: int,
    days: float = 0.0,
) -> AlarmSteps:
    """Store a person's request to one alarm of a valve, or to all (`all_requested`).

    Raises AlarmError, and stores nothing, if the alarm does not allow the action now, or if the
    server only holds a copy of alarms that an identifier keeps in its file.
    """
    return _kept(history, valve, days, lambda alarms: all_requested(alarms, kind, request, time))


def request_many(
    history: History, asked: Sequence[tuple[KeptValve, AlarmKind]], request: AlarmRequest, time: int
) -> int:
    """Store a person's request to many alarms in one transaction; return the number of events.

    Alarms that do not allow the action now are skipped, and so are alarms that `request_alarms`
    refuses on a server. Running identifiers see the events through `AlarmFeed`.
    """
    with writing(history.place) as connection:
        numbers = {valve: valve_id(connection, valve) for valve in {one for one, _ in asked}}
        unkept = _unkept(connection, numbers.values())
        alarms = _alarms(connection, unkept)
        written = []
        for valve, kind in dict.fromkeys(asked):
            alarm = alarms.get((numbers[valve], kind), Alarm(kind))
            if numbers[valve] in unkept and (alarm.state, request.action) in TRANSITIONS:
                written.append(_row(numbers[valve], requested(alarm, request, time)))
        put(connection, _EVENT, written, is_kept=True)
    return len(written)


class AlarmFeed:
    """New alarm events in a file, for all identifiers of a process together.

    Parameters
    ----------
    path : Path
        The file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._lock = threading.Lock()
        self._seen: object = None
        self._last: int | None = None
        self._looked = -math.inf
        self._news: defaultdict[str, dict[AlarmKind, Alarm]] = defaultdict(dict)

    def is_due(self, now: float) -> bool:
        """Return True once when a look is due at `now`, s of a monotonic clock."""
        with self._lock:
            if now - self._looked < _FEED_PERIOD:
                return False
            self._looked = now
            return True

    def look(self) -> None:
        """Read new events, in any thread; the first look finds none.

        Raises HistoryError if the file cannot be read.
        """
        state = file_state(self._path)
        if state == self._seen:
            return
        newest = sa.select(sa.func.max(_EVENT.c.id))
        query = (
            sa.select(_EVENT, tables.valve.c.name)
            .select_from(joined(_EVENT, tables.valve))
            .order_by(_EVENT.c.id)
        )
        with reading(self._path) as connection:
            if self._last is None:
                self._last = int(connection.scalar(newest) or 0)
            rows = connection.execute(query.where(_EVENT.c.id > self._last)).mappings().all()
        with self._lock:
            for row in rows:
                alarm = _event(row).alarm
                self._news[row["name"]][alarm.kind] = alarm
                self._last = row["id"]
        self._seen = state

    def take(self, valve: str) -> dict[AlarmKind, Alarm]:
        """Return the alarms of a valve that have changed since the last call."""
        with self._lock:
            return self._news.pop(valve, {})


_FEED_PERIOD = 1.0
_feeds: dict[Path, AlarmFeed] = {}


def alarm_feed(path: Path) -> AlarmFeed:
    """Return the feed of a file, which all identifiers of the process share."""
    return _feeds.setdefault(path.absolute(), AlarmFeed(path))


def read_alarms(file: History, valve: str) -> dict[AlarmKind, Alarm]:
    """Return the alarms of the valve of this name, without alarms that were never raised."""
    number = sa.select(tables.valve.c.id).where(tables.valve.c.name == valve)
    with reading(file.place) as connection:
        found = connection.scalar(number)
        return {} if found is None else _alarms_of(connection, found)


def suppression_ends(history: History) -> dict[KeptValve, int]:
    """Return when the next shelving or time out of service of each valve ends, ns."""
    valve, until = tables.valve.c, sa.func.min(_EVENT.c.until_ns)
    query = (
        sa.select(valve.name, valve.tag, until)
        .select_from(joined(_EVENT, tables.valve))
        .where(_EVENT.c.id.in_(_newest()), _EVENT.c.until_ns.is_not(None))
        .group_by(valve.name, valve.tag)
    )
    with reading(history.place) as connection:
        return {KeptValve(name, tag): end for name, tag, end in connection.execute(query)}


# Lists


@dataclass(frozen=True)
class AlarmFilter:
    """Filter of the listed alarm events.

    Attributes
    ----------
    since : int
        Earliest time, ns since 1970 (UTC).
    area : str
        Area of the valves, including its subareas; ``/`` for the whole plant.
    valve : str
        Name of the identifier; empty for all.
    states : frozenset of AlarmState
        States of the alarms after the event; empty for all.
    kinds : frozenset of AlarmKind
        Kinds of the alarms; empty for all.
    words : str
        Words that must all occur in tag, name, message, person or text.
    """

    since: int = -END_OF_TIME
    area: str = "/"
    valve: str = ""
    states: frozenset[AlarmState] = frozenset()
    kinds: frozenset[AlarmKind] = frozenset()
    words: str = ""

    def conditions(self) -> Iterable[Any]:
        """Yield the conditions for the rows of events joined with their valves."""
        name = tables.valve.c.name
        yield _EVENT.c.time_ns >= self.since
        if area := self.area.strip("/"):
            yield name.startswith(f"/{area}/", autoescape=True)
        if self.valve:
            yield name == self.valve
        if self.states:
            yield _EVENT.c.state.in_([one.name for one in self.states])
        if self.kinds:
            yield _EVENT.c.kind.in_([one.value for one in self.kinds])
        searched = (tables.valve.c.tag, name, _EVENT.c.message, _EVENT.c.who, _EVENT.c.text)
        for word in self.words.split():
            escaped = word.replace("/", "//").replace("%", "/%").replace("_", "/_")
            pattern = sa.func.lower(f"%{escaped}%")
            yield sa.or_(*(sa.func.lower(one).like(pattern, escape="/") for one in searched))


def alarm_events(
    history: History,
    chosen: AlarmFilter | None = None,
    most: int = 100_000,
    *,
    is_standing: bool = False,
) -> tuple[KeptAlarmEvent, ...]:
    """Return at most `most` alarm events, newest first.

    With `is_standing`, only the last event of each alarm is returned, unless the alarm is normal.
    """
    # Columns are named as in the events; only name and tag come from the valve.
    query = (
        sa.select(_EVENT, tables.valve.c.name.label("valve_name"), tables.valve.c.tag)
        .select_from(joined(_EVENT, tables.valve))
        .where(*(chosen or AlarmFilter()).conditions())
        .order_by(_EVENT.c.time_ns.desc(), _EVENT.c.id.desc())
        .limit(most)
    )
    if is_standing:
        is_normal = _EVENT.c.state == AlarmState.NORMAL.name
        query = query.where(_EVENT.c.id.in_(_newest()), sa.not_(is_normal))
    with reading(history.place) as connection:
        rows = connection.execute(query).mappings()
        return tuple(
            KeptAlarmEvent(KeptValve(row["valve_name"], row["tag"]), _event(row)) for row in rows
        )


_CSV: dict[str, Callable[[KeptAlarmEvent], object]] = {
    "time": lambda one: _iso(one.event.time),
    "area": lambda one: one.area,
    "valve": lambda one: one.valve.name,
    "tag": lambda one: one.valve.tag,
    "alarm": lambda one: one.event.alarm.kind.value,
    "event": lambda one: one.event.action.value,
    "state": lambda one: one.event.alarm.state.value,
    "level": lambda one: one.event.alarm.condition.level.name,
    "ne_107": lambda one: one.event.alarm.condition.status_signal.value,
    "raised": lambda one: _iso(one.event.alarm.raised),
    "until": lambda one: _iso(one.event.alarm.until),
    "who": lambda one: one.event.who,
    "text": lambda one: one.event.text,
    "message": lambda one: one.event.alarm.message,
}
"""Content of each column of the CSV, from an event."""


def alarms_as_csv(events: Iterable[KeptAlarmEvent]) -> str:
    """Return events as CSV, one line per event, with times in ISO 8601 (UTC)."""
    rows = ({name: cell(one) for name, cell in _CSV.items()} for one in events)
    return csv_text([*_CSV], rows)


def _iso(time: int | None) -> str:
    return "" if time is None else utc_second(time)
