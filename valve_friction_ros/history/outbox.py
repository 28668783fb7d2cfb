# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Transfer from a file to a server: rows wait in the file until the server has them.

Triggers queue each row that is added, changed or deleted, within the same transaction. One thread
in one process per machine sends the rows. Sending a row twice has no effect.
"""

import contextlib
import json
import queue
import socket
import threading
import time
import uuid
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import sqlalchemy as sa
from sqlalchemy.engine import Connection

from valve_friction_ros.history import tables
from valve_friction_ros.history.copying import (
    KEPT,
    PARTS,
    CopiedRow,
    Key,
    among,
    key_columns,
    rows_of,
    storage_order,
    write_rows,
)
from valve_friction_ros.history.database import marked, reading, server_engine, set_mark, writing
from valve_friction_ros.history.entry import KeptValve
from valve_friction_ros.history.place import (
    Claim,
    HistoryError,
    HistoryServer,
    RowRefusedError,
    file_state,
)
from valve_friction_ros.history.rows import valve_id
from valve_friction_ros.history.tables import FILE_METADATA, has_table, put, unsent

_FOLLOWED = (tables.valve, *PARTS)
"""Tables whose changes are queued; a row of the valve table itself may get another tag."""

_NOW = "CAST(strftime('%s', 'now') AS INTEGER)"

_MANY = 500
"""Rows per transaction."""


class Unsent(NamedTuple):
    """A waiting row: number in the queue, valve, table, key, and present state (None: deleted)."""

    number: int
    valve: KeptValve
    part: str
    key: Key
    row: CopiedRow | None


class UnsentCount(NamedTuple):
    """Number of waiting rows, since when (s since 1970, UTC), and number of refused rows."""

    waiting: int
    since: int | None
    refused: int


_NONE_WAIT = UnsentCount(0, None, 0)

# The queue in a file


def _owner(table: sa.Table) -> sa.Column[Any]:
    """Return the column with the row of the valve."""
    return table.c.id if table is tables.valve else table.c.valve_id


def _triggers() -> Iterator[str]:
    """Yield the statements that create the triggers, which queue each change of a row."""
    for table in _FOLLOWED:
        yield _trigger(table, "INSERT", "NEW")
        if table not in KEPT:
            yield _trigger(table, "UPDATE", "NEW")
        if table not in KEPT and table is not tables.valve:
            yield _trigger(table, "DELETE", "OLD")


def _trigger(table: sa.Table, event: str, row: str) -> str:
    valve = f"{row}.{_owner(table).name}"
    keys = f"json_array({', '.join(f'{row}.{one.name}' for one in key_columns(table))})"
    same = f"valve_id = {valve} AND part = '{table.name}' AND key = {keys}"
    return (
        f"CREATE TRIGGER IF NOT EXISTS unsent_{table.name}_{event.lower()} "  # noqa: S608
        f"AFTER {event} ON {table.name} BEGIN "
        "INSERT INTO unsent (valve_id, part, key, since) "
        f"SELECT {valve}, '{table.name}', {keys}, "
        f"coalesce((SELECT min(since) FROM unsent WHERE {same}), {_NOW}); "
        f"DELETE FROM unsent WHERE {same} AND number < (SELECT max(number) FROM unsent); END"
    )


def _queue(file: Connection, some: Iterable[sa.Table]) -> None:
    now: Any = sa.literal_column(_NOW)
    for table in some:
        key = sa.func.json_array(*key_columns(table))
        rows = sa.select(_owner(table), sa.literal(table.name), key, now)
        rows = rows.order_by(*storage_order(table))
        file.execute(unsent.insert().from_select(("valve_id", "part", "key", "since"), rows))


def _not_followed(file: Connection) -> list[sa.Table]:
    """Return the tables without triggers: all, or those that a newer version has added."""
    query = "SELECT name FROM sqlite_master WHERE type = 'trigger'"
    there = {name for (name,) in file.exec_driver_sql(query)}
    return [table for table in _FOLLOWED if f"unsent_{table.name}_insert" not in there]


def follow(path: Path) -> None:
    """Queue all rows and each later change for a server, unless this is set up already.

    Raises HistoryError if the file cannot be written.
    """
    with contextlib.suppress(HistoryError), reading(path) as file:  # writing reports the error
        if not _not_followed(file):
            return
    with writing(path) as file:
        added = _not_followed(file)
        FILE_METADATA.create_all(file)
        for statement in _triggers():
            file.exec_driver_sql(statement)
        set_mark(file, "identity", uuid.uuid4().hex, is_kept=True)
        _queue(file, added)


def count_unsent(path: Path) -> UnsentCount:
    """Count the waiting rows; none in a file that is not followed."""
    counted = sa.select(
        sa.func.count(), sa.func.min(unsent.c.since), sa.func.count(unsent.c.refusal)
    )
    with reading(path) as file:
        if not has_table(file, unsent):
            return _NONE_WAIT
        waiting, since, refused = file.execute(counted.select_from(unsent)).one()
    return UnsentCount(waiting - refused, since, refused)


# Between file and server


def _batch(path: Path, after: int) -> list[Unsent]:
    """Read the first waiting rows with numbers beyond `after`, without refused rows."""
    first = (
        sa.select(unsent, tables.valve.c.name, tables.valve.c.tag)
        .join_from(unsent, tables.valve, tables.valve.c.id == unsent.c.valve_id)
        .where(unsent.c.number > after, unsent.c.refusal.is_(None))
        .order_by(unsent.c.number)
        .limit(_MANY)
    )
    with reading(path) as file:
        waiting = [(row, tuple(json.loads(row.key))) for row in file.execute(first)]
        states: dict[tuple[str, int, Key], CopiedRow] = {}
        for part in PARTS:
            keys = [(row.valve_id, key) for row, key in waiting if row.part == part.name]
            for valve, found in rows_of(file, part, among(part, keys)) if keys else ():
                states[part.name, valve, found.key] = found
    return [
        Unsent(
            row.number,
            KeptValve(row.name, row.tag),
            row.part,
            key,
            states.get((row.part, row.valve_id, key)),
        )
        for row, key in waiting
    ]


def send(path: Path, server: HistoryServer, is_over: Callable[[], bool]) -> None:
    """Send the waiting rows of a followed file, at least one batch, until `is_over`.

    Raises HistoryError if file or server cannot be read or written.
    """
    with writing(server) as new:
        identity = marked(new, "identity") or ""
    _send_to(path, identity)
    after = 0
    while batch := _batch(path, after):
        try:
            _deliver(path, server, batch)
        except RowRefusedError:
            _deliver_one_by_one(path, server, batch)
        after = batch[-1].number
        if is_over() or len(batch) < _MANY:  # the next look sends newer rows
            return


def _send_to(path: Path, identity: str) -> None:
    """Note which server gets the rows; queue all rows if another server got them before."""
    with reading(path) as file:
        noted = marked(file, "sent_to")
    if noted != identity:
        with writing(path) as file:
            if noted is not None:
                file.execute(sa.delete(unsent))
                _queue(file, _FOLLOWED)
            set_mark(file, "sent_to", identity)


def _deliver(path: Path, server: HistoryServer, batch: Sequence[Unsent]) -> None:
    with writing(server) as new:
        there = _rows_of_valves(new, {one.valve for one in batch})
        for part in PARTS:
            of_part = [one for one in batch if one.part == part.name]
            found = [(there[one.valve], one.row) for one in of_part if one.row is not None]
            write_rows(new, part, found)
            gone = [(there[one.valve], one.key) for one in of_part if one.row is None]
            if gone and part not in KEPT:
                new.execute(sa.delete(part).where(among(part, gone)))
    sent = [one.number for one in batch]
    with writing(path) as file:  # a row changed since then has another number, and stays
        file.execute(sa.delete(unsent).where(unsent.c.number.in_(sent)))


def _rows_of_valves(new: Connection, valves: set[KeptValve]) -> dict[KeptValve, int]:
    named = sa.select(tables.valve).where(tables.valve.c.name.in_([one.name for one in valves]))
    known = {KeptValve(row.name, row.tag): row.id for row in new.execute(named)}
    return known | {one: valve_id(new, one) for one in sorted(valves - known.keys())}


def _deliver_one_by_one(path: Path, server: HistoryServer, batch: Sequence[Unsent]) -> None:
    """Send rows one by one, and note which rows the server refuses."""
    for one in batch:
        try:
            _deliver(path, server, [one])
        except RowRefusedError as error:  # noqa: PERF203 - each is tried
            refused = sa.update(unsent).where(unsent.c.number == one.number)
            with writing(path) as file:
                file.execute(refused.values(refusal=str(error)))


def take(path: Path, server: HistoryServer, valve: KeptValve, is_over: Callable[[], bool]) -> None:
    """Take the rows of a valve from the server if another file has kept the valve since.

    Nothing is taken if rows of the valve wait here, or once `is_over`. Raises HistoryError if file
    or server cannot be read or written.
    """
    with reading(path) as file:  # a copy on another machine is another file
        name = f"{marked(file, 'identity') or ''}@{socket.gethostname()}"
    keeper = tables.keeper
    with writing(server) as there:
        number = valve_id(there, valve)
        kept_by = there.scalar(sa.select(keeper.c.file).where(keeper.c.valve_id == number))
        if kept_by == name:
            return
        if kept_by is None or _put_into(path, valve, there, number, is_over):
            put(there, keeper, [{"valve_id": number, "file": name}])


def _put_into(
    path: Path, valve: KeptValve, there: Connection, number: int, is_over: Callable[[], bool]
) -> bool:
    """Put the rows of a valve into the file in one transaction; return whether this was done."""
    taken = [(one, [*rows_of(there, one, one.c.valve_id == number)]) for one in PARTS]
    with writing(path) as file:
        here = valve_id(file, valve)
        waits = sa.and_(unsent.c.valve_id == here, unsent.c.part != tables.valve.name)
        if is_over() or file.execute(sa.select(unsent).where(waits).limit(1)).first():
            return False
        for part, rows in taken:
            if part not in KEPT:
                file.execute(sa.delete(part).where(part.c.valve_id == here))
            write_rows(file, part, [(here, row) for _, row in rows])
        file.execute(sa.delete(unsent).where(unsent.c.valve_id == here))
    return True


# The thread

_PAUSE = 1.0
"""Time, s, between two looks at the file. Chosen: nobody waits for a row."""

_LONGEST_PAUSE = 30.0
"""Longest time, s, between two attempts. Chosen: a server that returns is not overloaded."""

_TAKING = 10.0
"""Time, s, that all nodes of a process together wait for the server at their start. Chosen."""

_ENDING = 2.0
"""Time, s, that the end of a node waits for rows being sent. Chosen: the rest is in the file."""

_PLACE = "sender"
"""Name of the claim that decides which process of a machine sends."""


@dataclass(frozen=True)
class SentState:
    """State of a sender: waiting rows, why they are not sent (None if they are).

    `is_sending` says that this process sends the rows of the file; else another process does.
    """

    count: UnsentCount = _NONE_WAIT
    problem: str | None = None
    is_sending: bool = False


class Sender:
    """Sends new rows of a file to a server, and takes rows of valves from the server.

    Unsent rows wait in the file, so nothing is lost if a process, server or network fails. One
    process per machine sends the rows of a file.

    Parameters
    ----------
    path : Path
        The file.
    server : HistoryServer
        The server.

    Attributes
    ----------
    state : SentState
        The present state.
    users : int
        Number of nodes that use it.
    """

    def __init__(self, path: Path, server: HistoryServer) -> None:
        self._path, self.server = path, server
        self._claim = Claim(path, _PLACE)
        self._pulls: queue.SimpleQueue[tuple[KeptValve, Future[None]]] = queue.SimpleQueue()
        self._wake, self._ends = threading.Event(), threading.Event()
        self._begun = time.monotonic()
        self._told: str | None = None
        self.users = 0
        self.state = SentState()
        self._thread = threading.Thread(target=self._run, name="history sender", daemon=True)
        self._thread.start()

    def take(self, valve: KeptValve) -> str | None:
        """Take the rows of a valve from the server if another file has kept the valve since.

        Returns the cause of a failure, or None. It waits some seconds at most, for all valves of a
        process together.
        """
        done: Future[None] = Future()
        patience = max(_PAUSE, self._begun + _TAKING - time.monotonic())
        if self.state.problem is not None:
            return self.state.problem
        self._pulls.put((valve, done))
        self._wake.set()
        try:
            done.result(patience)
        except TimeoutError:
            done.cancel()
            return f"{self.server}: no answer for {patience:.0f} s"
        except HistoryError as error:
            return str(error)
        return None

    def news(self) -> str | None:
        """Return, once, a message about a change in the transfer to the server, or None."""
        problem = self.state.problem
        if problem == self._told:
            return None
        before, self._told = self._told, problem
        if problem is None:
            return None if before is None else f"{self.server}: the history is being sent again"
        return f"the history waits in {self._path}: {problem}"

    def end(self) -> None:
        """Release the sender; the last node to do so sends what it can at once and stops it."""
        with _lock:
            self.users -= 1
            if self.users > 0:
                return
            _senders.pop((self._path, self.server), None)
        self._ends.set()
        self._wake.set()
        self._thread.join(_ENDING)

    def _run(self) -> None:
        failures, looked, seen, ends = 0, -_LONGEST_PAUSE, None, False
        while not ends:
            ends = self._ends.is_set()
            state, now = file_state(self._path), time.monotonic()
            is_due = ends or self._has_work or state != seen or now - looked >= _LONGEST_PAUSE
            if is_due:
                seen, looked = state, now
                failures = failures + 1 if self._problem_of_cycle() else 0
            if not ends:
                self._wake.wait(min(_PAUSE * 2 ** max(0, failures - 1), _LONGEST_PAUSE))
                self._wake.clear()
        with contextlib.suppress(HistoryError):
            server_engine(self.server).dispose()
        self._claim.release()

    @property
    def _has_work(self) -> bool:
        state = self.state
        waits = state.count.waiting > 0 or not self._pulls.empty()
        return waits or state.problem is not None or not state.is_sending

    def _problem_of_cycle(self) -> str | None:
        """Send and take rows, and note the state; return the cause of a failure, or None."""
        problem, count = None, self.state.count
        try:
            self._cycle()
        except HistoryError as error:
            problem = str(error)
        except Exception as bug:  # noqa: BLE001 - the thread lives on, and says what is wrong
            problem = f"internal error: {type(bug).__name__}: {bug}"
        try:
            count = count_unsent(self._path)
        except HistoryError as error:
            problem = problem or str(error)
        self.state = SentState(count, problem, self._claim.is_granted)
        while problem is not None and not self._pulls.empty():
            _, done = self._pulls.get()
            if done.set_running_or_notify_cancel():
                done.set_exception(HistoryError(problem))
        return problem

    def _cycle(self) -> None:
        follow(self._path)
        if self._claim.ask():
            send(self._path, self.server, self._ends.is_set)
        while not self._pulls.empty():
            valve, done = self._pulls.get()
            try:
                take(self._path, self.server, valve, done.cancelled)
            except HistoryError as error:
                if done.set_running_or_notify_cancel():
                    done.set_exception(error)
                raise
            if done.set_running_or_notify_cancel():
                done.set_result(None)


_senders: dict[tuple[Path, HistoryServer], Sender] = {}
_lock = threading.Lock()


def sender_of(path: Path, server: HistoryServer) -> Sender:
    """Return the sender that all nodes of a process share for a file; each node calls `end`."""
    with _lock:
        key = (path.absolute(), server)
        one = _senders.get(key)
        if one is None:
            one = _senders[key] = Sender(*key)
        one.users += 1
        return one
