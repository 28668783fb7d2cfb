"""The usage of valves in the history: a row a day, and the renewals of the packing."""

import contextlib
import json
import sqlite3
from collections.abc import Iterable
from typing import Any

from valve_friction_ros.history.answer_rows import forget_answers
from valve_friction_ros.history.connection import has_table
from valve_friction_ros.history.entry import KeptValve
from valve_friction_ros.history.evidence_rows import forget_evidence
from valve_friction_ros.history.file import HistoryFile
from valve_friction_ros.history.reader import History
from valve_friction_ros.history.rows import valve_id
from valve_friction_ros.history.schema import HistoryError, reading, writing
from valve_friction_ros.usage import Usage, UsedDay, ValveUsage, total

__all__ = ["keep_renewal", "keep_usage", "read_usage"]

_EARLIER_RUNS = ""
"""Run whose rows are the sums of runs that have ended."""

_OPEN_DAYS = 1
"""Days before the newest whose rows stay apart: a run may write about midnight. Chosen."""


def keep_usage(file: HistoryFile, valve: KeptValve, run: str, days: Iterable[UsedDay]) -> None:
    """Keep what a run of an identifier has counted on some days; `run` is a name of its own.

    The usage of a day is that of the whole run: it takes the place of what the run has kept of this
    day before, so that keeping it twice changes nothing. What other runs have kept of days
    before the newest two becomes one row a day: of a valve one run writes at a time. Raises
    HistoryError if it cannot be written.
    """
    with writing(file.path) as connection:
        row = valve_id(connection, valve)
        for one in days:
            _write(connection, row, run, one)
        _merge(connection, row, run)


def _write(connection: sqlite3.Connection, row: int, run: str, one: UsedDay) -> None:
    day, renewal, usage = one
    connection.execute(
        "INSERT OR REPLACE INTO usage (valve_id, renewal_ns, day, run, distance, reversals, "
        "breakaways, time_watched_ns, histogram_ns) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
        (
            row,
            renewal,
            day,
            run,
            usage.distance,
            usage.reversals,
            usage.breakaways,
            usage.time_watched,
            json.dumps(usage.histogram),
        ),
    )


def _merge(connection: sqlite3.Connection, row: int, run: str) -> None:
    """Add up, for each finished day, the rows of all runs but this one."""
    several = connection.execute(
        "SELECT renewal_ns, day FROM usage WHERE valve_id = :row AND run != :run AND day < "
        "(SELECT max(day) FROM usage WHERE valve_id = :row) - :open "
        "GROUP BY renewal_ns, day HAVING count(*) > 1",
        {"row": row, "run": run, "open": _OPEN_DAYS},
    ).fetchall()
    chosen = "FROM usage WHERE valve_id = ? AND run != ? AND renewal_ns = ? AND day = ?"
    for renewal, day in several:
        which = (row, run, renewal, day)
        cursor = connection.cursor()
        cursor.row_factory = sqlite3.Row
        rows = cursor.execute(f"SELECT * {chosen}", which).fetchall()
        with contextlib.suppress(TypeError, ValueError):  # rows that hold no usage: reading says so
            merged = UsedDay(day, renewal, total(_day(each).usage for each in rows))
            connection.execute(f"DELETE {chosen}", which)
            _write(connection, row, _EARLIER_RUNS, merged)


def keep_renewal(file: HistoryFile, valve: KeptValve, time: int) -> None:
    """Keep that the packing of a valve was renewed at a time, ns since 1970 (UTC).

    The moves of the packing before go, their reference, and the answers to the command: they say
    nothing of the new one.
    Raises HistoryError if it cannot be written.
    """
    with writing(file.path) as connection:
        row = valve_id(connection, valve)
        connection.execute(
            "INSERT OR IGNORE INTO packing_renewal (valve_id, time_ns) VALUES (?, ?)", (row, time)
        )
        forget_evidence(connection, row)
        forget_answers(connection, row)


def read_usage(file: History, valve: str) -> ValveUsage:
    """Return the usage of the valve of this name; an older file holds none.

    Raises HistoryError if the file cannot be read.
    """
    with reading(file.place) as connection:
        if not has_table(connection, "usage"):
            return ValveUsage()
        rows = connection.execute(
            "SELECT usage.* FROM usage JOIN valve ON valve.id = valve_id WHERE name = ?", (valve,)
        ).fetchall()
        (renewal,) = connection.execute(
            "SELECT max(time_ns) FROM packing_renewal JOIN valve ON valve.id = valve_id "
            "WHERE name = ?",
            (valve,),
        ).fetchone()
    try:
        return ValveUsage.of(map(_day, rows), renewal or 0)
    except (TypeError, ValueError) as error:
        raise HistoryError(f"{file.place}: a row holds no usage: {error}") from None


def _day(row: Any) -> UsedDay:
    usage = Usage(
        row["distance"],
        row["reversals"],
        row["breakaways"],
        tuple(json.loads(row["histogram_ns"])),
    )
    return UsedDay(row["day"], row["renewal_ns"], usage)
