"""The moves of valves in the history: the evidence that a restart must not lose."""

import math
import sqlite3
from collections.abc import Sequence
from dataclasses import astuple
from typing import Any

from valve_friction_ros.evidence import MOST_MOVES, Change, Move
from valve_friction_ros.health import Reference, SlidingFriction
from valve_friction_ros.history.connection import has_table
from valve_friction_ros.history.entry import KeptValve
from valve_friction_ros.history.file import HistoryFile
from valve_friction_ros.history.reader import History
from valve_friction_ros.history.retention import forget_beyond, forget_older
from valve_friction_ros.history.rows import valve_id
from valve_friction_ros.history.schema import HistoryError, reading, writing
from valve_friction_ros.model.valve import Valve

__all__ = [
    "forget_evidence",
    "forget_moves_after",
    "keep_change",
    "keep_moves",
    "keep_reference",
    "read_change",
    "read_moves",
    "read_reference",
]

_OF_MOVE = (
    "begin_ns",
    "end_ns",
    "start",
    "stop",
    "force",
    "force_rate",
    "speed",
    "onset_force",
    "onset_position",
    "onset_rate",
)


def keep_moves(
    file: HistoryFile, valve: KeptValve, built: Valve, moves: Sequence[Move], days: float = 0.0
) -> None:
    """Add moves of a valve, oldest first; keeping them twice changes nothing.

    Those go that are `days` older than the last one, none for 0, and all but the newest
    `MOST_MOVES`; a stamp ahead of the clock of this machine ages none. Raises HistoryError if they
    cannot be written.
    """
    if not moves:
        return
    with writing(file.path) as connection:
        row = valve_id(connection, valve)
        columns = ("valve_id", "diaphragm_area", "pressure_reference", *_OF_MOVE)
        marks = ", ".join("?" * len(columns))
        connection.executemany(
            f"INSERT OR REPLACE INTO move ({', '.join(columns)}) VALUES ({marks})",  # noqa: S608
            [(row, built.diaphragm_area, built.pressure_reference, *_row(one)) for one in moves],
        )
        forget_older(connection, "move", "end_ns", row, moves[-1].end, days)
        forget_beyond(connection, "move", "end_ns", row, MOST_MOVES)


def forget_moves_after(file: HistoryFile, valve: KeptValve, time: int) -> None:
    """Drop the moves of a valve that end after a time, ns since 1970 (UTC).

    Raises HistoryError if the file cannot be written.
    """
    with writing(file.path) as connection:
        row = valve_id(connection, valve)
        connection.execute("DELETE FROM move WHERE valve_id = ? AND end_ns > ?", (row, time))


def _row(move: Move) -> tuple[float, ...]:
    """Return the columns of a move; SQLite stores nan as NULL."""
    return (
        move.begin,
        move.end,
        move.start,
        move.stop,
        move.force,
        move.force_rate,
        move.speed,
        move.onset_force,
        move.onset_position,
        move.onset_rate,
    )


def read_moves(file: History, valve: str, built: Valve) -> tuple[Move, ...]:
    """Return the moves of the valve of this name, oldest first.

    Only those are returned whose forces were computed with the area and the pressure reference in
    force. Raises HistoryError if the file cannot be read; one of an older version holds no moves.
    """
    with reading(file.place) as connection:
        if not has_table(connection, "move"):
            return ()
        rows = connection.execute(
            f"SELECT {', '.join(_OF_MOVE)} FROM move JOIN valve ON valve.id = valve_id "  # noqa: S608
            "WHERE name = ? AND diaphragm_area IS ? AND pressure_reference = ? ORDER BY end_ns",
            (valve, built.diaphragm_area, built.pressure_reference),
        ).fetchall()
    try:
        return tuple(_move(row) for row in rows)
    except (TypeError, ValueError) as error:
        raise HistoryError(f"{file.place}: a row holds no move: {error}") from None


def _move(row: Sequence[float | None]) -> Move:
    begin, end, *numbers = row
    values = [math.nan if one is None else one for one in numbers]
    return Move(int(begin or 0), int(end or 0), *values)


def keep_reference(file: HistoryFile, valve: KeptValve, built: Valve, reference: Reference) -> None:
    """Keep the first friction by the moves of a valve; a later one for the same actuator is none.

    Raises HistoryError if it cannot be written.
    """
    actuator, one = (built.diaphragm_area, built.pressure_reference), reference.sliding
    with writing(file.path) as connection:
        row = valve_id(connection, valve)
        connection.execute(
            "DELETE FROM evidence_reference WHERE valve_id = ? "
            "AND NOT (diaphragm_area IS ? AND pressure_reference = ?)",
            (row, *actuator),
        )
        connection.execute(
            "INSERT OR IGNORE INTO evidence_reference VALUES (?, ?, ?, ?, ?, ?, ?)",
            (row, reference.time, *actuator, one.value, one.half_width, one.speed),
        )


def read_reference(file: History, valve: str, built: Valve) -> Reference | None:
    """Return the first friction by the moves of the valve of this name, with this actuator.

    Raises HistoryError if the file cannot be read; one of an older version holds none.
    """
    columns = ("time_ns", "sliding_friction", "half_width", "speed")
    row = _row_of(file, "evidence_reference", columns, valve, built)
    return None if row is None else Reference(SlidingFriction(*row[1:]), row[0])


def keep_change(file: HistoryFile, valve: KeptValve, built: Valve, change: Change) -> None:
    """Keep the last change of friction that the moves of a valve show, in place of the one before.

    Raises HistoryError if it cannot be written.
    """
    with writing(file.path) as connection:
        connection.execute(
            "INSERT OR REPLACE INTO evidence_change VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
            (
                valve_id(connection, valve),
                built.diaphragm_area,
                built.pressure_reference,
                *astuple(change),
            ),
        )


def read_change(file: History, valve: str, built: Valve) -> Change | None:
    """Return the last change that the moves of the valve of this name, with this actuator, showed.

    Raises HistoryError if the file cannot be read; an older one holds none.
    """
    columns = ("earliest_ns", "latest_ns", "ratio", "low", "high")
    row = _row_of(file, "evidence_change", columns, valve, built)
    return None if row is None else Change(*row)


def _row_of(
    file: History, table: str, columns: Sequence[str], valve: str, built: Valve
) -> tuple[Any, ...] | None:
    """Return the row of a table for the valve of this name, with this actuator, if it is there."""
    with reading(file.place) as connection:
        if not has_table(connection, table):
            return None
        found: tuple[Any, ...] | None = connection.execute(
            f"SELECT {', '.join(columns)} FROM {table} "  # noqa: S608
            "JOIN valve ON valve.id = valve_id "
            "WHERE name = ? AND diaphragm_area IS ? AND pressure_reference = ?",
            (valve, built.diaphragm_area, built.pressure_reference),
        ).fetchone()
    return found


def forget_evidence(connection: sqlite3.Connection, row: int) -> None:
    """Drop moves, reference and change of the valve of this row: its packing was renewed."""
    for table in ("move", "evidence_reference", "evidence_change"):
        connection.execute(f"DELETE FROM {table} WHERE valve_id = ?", (row,))  # noqa: S608
