"""What goes between a file and a server: rows that wait, and those of a valve that moves here."""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from valve_friction_ros.history.connection import Connection
from valve_friction_ros.history.copying.copied_rows import (
    CopiedRow,
    row_of_key,
    rows_of,
    write_rows,
)
from valve_friction_ros.history.copying.parts import PARTS, part_named
from valve_friction_ros.history.copying.unsent import (
    VALVE,
    Unsent,
    acknowledge,
    file_name,
    first_unsent,
    has_unsent,
    refuse,
    send_to,
    sent_to,
)
from valve_friction_ros.history.entry import KeptValve
from valve_friction_ros.history.errors import HistoryError, RowRefusedError
from valve_friction_ros.history.rows import valve_id
from valve_friction_ros.history.schema import reading, server_connection, writing
from valve_friction_ros.history.server.address import HistoryServer

if TYPE_CHECKING:
    from valve_friction_ros.history.server.connection import ServerConnection

__all__ = ["Delivery"]

_MANY = 500
"""Rows of a transaction."""

_Rows = dict[int, CopiedRow | None]
"""Rows by their numbers among those that wait; None for one that is gone."""


class Delivery:
    """The way from a followed file to a server, and back; for one thread.

    All methods raise HistoryError if file or server cannot be read or written; then the connection
    is closed, and the next call opens another one.

    Parameters
    ----------
    path : Path
        The file.
    server : HistoryServer
        The server.
    """

    def __init__(self, path: Path, server: HistoryServer) -> None:
        self._path, self._server = path, server
        self._open = contextlib.ExitStack()
        self._connection: ServerConnection | None = None
        self._numbers: dict[KeptValve, int] = {}

    def close(self) -> None:
        """End the connection."""
        self._connection = None
        self._numbers.clear()
        self._open.close()

    def send(self, is_over: Callable[[], bool]) -> None:
        """Send the rows that wait, some at least, until `is_over`; sent twice is sent once."""
        if self._connection is None:
            self._tried(lambda: None)
        after = 0
        while True:
            waiting, rows, valves = self._waiting(after)
            if not waiting:
                return
            try:
                self._tried(partial(self._send, waiting, rows, valves))
            except RowRefusedError:
                self._send_one_by_one(waiting, rows, valves)
            after = waiting[-1].number
            if is_over():
                return

    def take(self, valve: KeptValve, is_over: Callable[[], bool]) -> None:
        """Take the rows of a valve from the server, where another file has kept it since.

        Nothing is taken if rows of it wait here, or once `is_over`.
        """
        self._tried(lambda: self._take(valve, is_over))

    def _tried(self, work: Callable[[], None]) -> None:
        """Do some work; once more where the connection was open, and may have ended since."""
        was_open = self._connection is not None
        try:
            try:
                self._connect()
                work()
            except RowRefusedError:
                raise
            except HistoryError:
                if not was_open:
                    raise
                self.close()
                self._connect()
                work()
        except BaseException:
            self.close()
            raise

    def _connect(self) -> "ServerConnection":
        if self._connection is None:
            connection = self._open.enter_context(server_connection(self._server))
            with connection.transaction() as new:
                (identity,) = new.execute(
                    "SELECT value FROM mark WHERE name = 'identity'"
                ).fetchone()
            if sent_to(self._path) != identity:
                send_to(self._path, identity)
            self._connection = connection
        return self._connection

    def _waiting(self, after: int) -> tuple[list[Unsent], _Rows, dict[int, KeptValve]]:
        """Read the first rows that wait, as they are now, and their valves, by their numbers."""
        with reading(self._path) as file:
            waiting = first_unsent(file, _MANY, after)
            rows = {
                one.number: row_of_key(file, part_named(one.part), one.valve, one.key)
                for one in waiting
                if one.part != VALVE
            }
            valves = {}
            for number in {one.valve for one in waiting}:
                found = file.execute(
                    "SELECT name, tag FROM valve WHERE id = ?", (number,)
                ).fetchone()
                valves[number] = KeptValve(*found)
        return waiting, rows, valves

    def _send(
        self, waiting: Sequence[Unsent], rows: _Rows, valves: Mapping[int, KeptValve]
    ) -> None:
        numbers = dict(self._numbers)
        with self._connect().transaction() as new:
            for valve in sorted(valves.values()):
                if valve not in numbers:
                    numbers[valve] = valve_id(new, valve)
            there = {here: numbers[valve] for here, valve in valves.items()}
            for part in PARTS:
                of_part = [one for one in waiting if one.part == part.table]
                found = [(there[one.valve], rows[one.number]) for one in of_part]
                write_rows(new, part, [(valve, row) for valve, row in found if row is not None])
                if not part.is_kept:
                    condition = "".join(f" AND {name} = ?" for name in part.key)
                    gone = [
                        (there[one.valve], *one.key) for one in of_part if rows[one.number] is None
                    ]
                    new.executemany(
                        f"DELETE FROM {part.table} WHERE valve_id = ?{condition}",  # noqa: S608
                        gone,
                    )
        self._numbers = numbers
        acknowledge(self._path, [one.number for one in waiting])

    def _send_one_by_one(
        self, waiting: Sequence[Unsent], rows: _Rows, valves: Mapping[int, KeptValve]
    ) -> None:
        """Send what can be sent of rows among which the server refuses some."""
        for one in waiting:
            try:
                self._tried(partial(self._send, [one], rows, {one.valve: valves[one.valve]}))
            except RowRefusedError as error:  # noqa: PERF203 - each is tried
                refuse(self._path, one.number, str(error))

    def _take(self, valve: KeptValve, is_over: Callable[[], bool]) -> None:
        name = file_name(self._path)
        with self._connect().transaction() as server:
            number = valve_id(server, valve)
            keeper = server.execute(
                "SELECT file FROM keeper WHERE valve_id = ?", (number,)
            ).fetchone()
            if keeper is not None and keeper[0] == name:
                return
            if keeper is not None and not self._put(server, number, valve, is_over):
                return
            server.execute(
                "INSERT INTO keeper (valve_id, file) VALUES (?, ?) "
                "ON CONFLICT (valve_id) DO UPDATE SET file = excluded.file",
                (number, name),
            )

    def _put(
        self, server: Connection, number: int, valve: KeptValve, is_over: Callable[[], bool]
    ) -> bool:
        """Put the rows of a valve into the file in one transaction; tell whether that was done."""
        taken = {part: [*rows_of(server, part, number)] for part in PARTS}
        with writing(self._path) as file:
            if is_over() or has_unsent(file, valve.name):
                return False
            here = valve_id(file, valve)
            for part, rows in taken.items():
                if not part.is_kept:
                    file.execute(f"DELETE FROM {part.table} WHERE valve_id = ?", (here,))  # noqa: S608
                write_rows(file, part, [(here, row) for row in rows])
            file.execute("DELETE FROM unsent WHERE valve_id = ?", (here,))
        return True
