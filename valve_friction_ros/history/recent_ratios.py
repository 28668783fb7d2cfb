"""Ratios of a plant's valves in the history, read from where one has stopped before."""

from typing import NamedTuple

from valve_friction_ros.history.connection import Connection, has_table
from valve_friction_ros.history.reader import History
from valve_friction_ros.history.schema import reading
from valve_friction_ros.history.server.address import HistoryServer

__all__ = ["HistoryMark", "KeptRatio", "history_mark", "ratios_after"]


class KeptRatio(NamedTuple):
    """Friction of a valve over its baseline, and the row, valve's name and time (ns) of it."""

    row: int
    valve: str
    time: int
    ratio: float


class HistoryMark(NamedTuple):
    """Last identification and baseline of a file, and its count of alarms and valves.

    It changes when one of these is added; usage and moves, which are written often, leave it. Where
    it is not `settled`, a row may still come before the last one: several write to a server, and
    one that has begun earlier may end later. `database` tells a server's database from another one.
    """

    identification: int
    baseline: int
    alarms: int
    valves: int
    settled: bool = True
    database: str = ""


def history_mark(file: History) -> HistoryMark:
    """Return the mark of a file as it is now.

    Raises HistoryError if the file cannot be read.
    """
    with reading(file.place) as connection:

        def one(query: str) -> int:
            return int(connection.execute(query).fetchone()[0])

        has_alarms = has_table(connection, "alarm_recording")
        return HistoryMark(
            one("SELECT coalesce(max(id), 0) FROM identification"),
            one("SELECT coalesce(max(id), 0) FROM baseline"),
            one("SELECT count(*) FROM alarm_recording") if has_alarms else 0,
            one("SELECT count(*) FROM valve"),
            *(_state_of_server(connection) if isinstance(file.place, HistoryServer) else ()),
        )


def _state_of_server(connection: Connection) -> tuple[bool, str]:
    """Return whether no change is under way, and the identity of the database."""
    (settled,) = connection.execute(
        "SELECT pg_snapshot_xmin(one) = pg_snapshot_xmax(one) FROM pg_current_snapshot() AS one"
    ).fetchone()
    (identity,) = connection.execute("SELECT value FROM mark WHERE name = 'identity'").fetchone()
    return settled, identity


def ratios_after(file: History, row: int, since: int) -> tuple[KeptRatio, ...]:
    """Return the ratios of all valves in rows after one, made since a time, ns; oldest row first.

    Raises HistoryError if the file cannot be read.
    """
    with reading(file.place) as connection:
        rows = connection.execute(
            "SELECT identification.id, valve.name, time_ns, ratio FROM identification "
            "JOIN valve ON valve.id = valve_id "
            "WHERE identification.id > ? AND time_ns >= ? AND ratio IS NOT NULL "
            "ORDER BY identification.id",
            (row, since),
        ).fetchall()
    return tuple(KeptRatio(*one) for one in rows)
