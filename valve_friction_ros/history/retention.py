"""Which rows of a valve leave the history: those that are old, and those beyond a number."""

import sqlite3
import time

from valve_friction_ros.streams import DAY

__all__ = ["forget_beyond", "forget_older", "oldest_kept"]


def oldest_kept(newest: int, days: float) -> int:
    """Return the time, ns, before which rows leave that are `days` older than the newest one.

    A newest row that is ahead of the clock of this machine ages none.
    """
    return min(newest, time.time_ns()) - round(days * DAY)


def forget_older(
    connection: sqlite3.Connection, table: str, column: str, row: int, newest: int, days: float
) -> None:
    """Delete the rows of a valve that are `days` older than a stamp, ns; none for 0.

    The stamps are in `column`.
    """
    if days > 0:
        connection.execute(
            f"DELETE FROM {table} WHERE valve_id = ? AND {column} < ?",  # noqa: S608
            (row, oldest_kept(newest, days)),
        )


def forget_beyond(
    connection: sqlite3.Connection, table: str, column: str, row: int, most: int
) -> None:
    """Delete all rows of a valve but the `most` with the largest values of `column`."""
    connection.execute(
        f"DELETE FROM {table} WHERE valve_id = ? AND {column} <= ("  # noqa: S608
        f"SELECT {column} FROM {table} WHERE valve_id = ? "
        f"ORDER BY {column} DESC LIMIT 1 OFFSET ?)",
        (row, row, most),
    )
