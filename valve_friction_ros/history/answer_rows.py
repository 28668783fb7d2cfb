"""The answers of valves to their commands in the history."""

import math
import sqlite3
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from valve_friction_ros.history.connection import has_table
from valve_friction_ros.history.entry import KeptValve
from valve_friction_ros.history.file import HistoryFile
from valve_friction_ros.history.reader import History
from valve_friction_ros.history.retention import forget_beyond, forget_older
from valve_friction_ros.history.rows import valve_id
from valve_friction_ros.history.schema import HistoryError, reading, writing
from valve_friction_ros.response import Move

__all__ = ["forget_answers", "keep_answers", "read_answers"]

_MOST = 2000
"""Answers of a valve that are kept, the latest."""

_COLUMNS = tuple(field.name for field in fields(Move))
_FLAGS = frozenset(field.name for field in fields(Move) if field.type in (bool, "bool"))


def keep_answers(
    file: HistoryFile, valve: KeptValve, travel: float, moves: Sequence[Move], days: float = 0.0
) -> None:
    """Add answers of a stem with this travel, m, oldest first; keeping them twice changes nothing.

    Those go that are `days` older than the last one, none for 0, and all but the 2000 kept last; a
    stamp ahead of the clock of this machine ages none. Raises HistoryError if they cannot be
    written.
    """
    if not moves:
        return
    names = ("valve_id", "travel", *_COLUMNS)
    marks = ", ".join("?" * len(names))
    with writing(file.path) as connection:
        row = valve_id(connection, valve)
        connection.executemany(
            f"INSERT OR REPLACE INTO answer ({', '.join(names)}) VALUES ({marks})",  # noqa: S608
            [(row, travel, *(getattr(one, name) for name in _COLUMNS)) for one in moves],
        )
        forget_older(connection, "answer", "stamp", row, moves[-1].stamp, days)
        forget_beyond(connection, "answer", "id", row, _MOST)


def read_answers(file: History, valve: str, travel: float | None = None) -> tuple[Move, ...]:
    """Return the answers of the valve of this name, in the order in which they were kept.

    Only those with this travel, m, are returned; None: that of the last answer. Raises HistoryError
    if the file cannot be read; an older one holds none.
    """
    with reading(file.place) as connection:
        if not has_table(connection, "answer"):
            return ()
        rows = connection.execute(
            f"SELECT travel, {', '.join(_COLUMNS)} FROM answer "  # noqa: S608
            "JOIN valve ON valve.id = valve_id WHERE name = ? ORDER BY answer.id",
            (valve,),
        ).fetchall()
    if not rows:
        return ()
    wanted = rows[-1][0] if travel is None else travel
    try:
        return tuple(_move(row[1:]) for row in rows if row[0] == wanted)
    except (TypeError, ValueError) as error:
        raise HistoryError(f"{file.place}: a row holds no answer: {error}") from None


def forget_answers(connection: sqlite3.Connection, row: int) -> None:
    """Drop the answers of the valve of this row: its packing was renewed."""
    connection.execute("DELETE FROM answer WHERE valve_id = ?", (row,))


def _move(row: Sequence[float | None]) -> Move:
    """Build a move of its columns; SQLite stores nan as NULL."""
    values = dict(zip(_COLUMNS, row, strict=True))
    stamp = values.pop("stamp") or 0
    known: dict[str, Any] = {
        name: bool(value) if name in _FLAGS else math.nan if value is None else float(value)
        for name, value in values.items()
    }
    return Move(stamp=int(stamp), **known)
