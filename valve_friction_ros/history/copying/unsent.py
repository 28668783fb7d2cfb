"""The rows of a file that a server does not have yet: kept in the file, with each change."""

import json
import socket
import sqlite3
import uuid
from pathlib import Path
from typing import NamedTuple

from valve_friction_ros.history.connection import Connection, has_table
from valve_friction_ros.history.copying.copied_rows import Key
from valve_friction_ros.history.copying.parts import PARTS, Part
from valve_friction_ros.history.errors import HistoryError
from valve_friction_ros.history.schema import reading, writing

__all__ = [
    "VALVE",
    "Unsent",
    "UnsentCount",
    "acknowledge",
    "count_unsent",
    "file_name",
    "first_unsent",
    "follow",
    "has_unsent",
    "refuse",
    "send_to",
    "sent_to",
]

VALVE = "valve"
"""The part of a row of the valve itself, of which the tag may have changed."""

_TABLE = """
CREATE TABLE IF NOT EXISTS unsent (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    valve_id INTEGER NOT NULL,
    part TEXT NOT NULL,
    key TEXT NOT NULL,
    since INTEGER NOT NULL,
    refusal TEXT
)
"""
"""A row for each row that was added, changed or deleted, and not sent since. A row that changes
again gets a new number, so that what is acknowledged meanwhile is the change before."""

_NOW = "CAST(strftime('%s', 'now') AS INTEGER)"

_INDEX = "CREATE INDEX IF NOT EXISTS unsent_row ON unsent (valve_id, part, key)"


class Unsent(NamedTuple):
    """A row that waits, by its number among those that wait, with its valve, part and key."""

    number: int
    valve: int
    part: str
    key: Key


class UnsentCount(NamedTuple):
    """How many rows wait, since when (s since 1970, UTC), and how many the server refuses."""

    waiting: int
    since: int | None
    refused: int


def _triggers() -> list[str]:
    """Return the statements by which each change of a row makes it wait."""
    found = [
        _trigger(Part(VALVE, ()), "INSERT", "NEW", "id"),
        _trigger(Part(VALVE, ()), "UPDATE", "NEW", "id"),
    ]
    for part in PARTS:
        found.append(_trigger(part, "INSERT", "NEW"))
        if not part.is_kept:
            found += [_trigger(part, "UPDATE", "NEW"), _trigger(part, "DELETE", "OLD")]
    return found


def _trigger(part: Part, event: str, row: str, valve: str = "valve_id") -> str:
    key = f"json_array({', '.join(f'{row}.{name}' for name in part.key)})"
    same = f"valve_id = {row}.{valve} AND part = '{part.table}' AND key = {key}"
    return (
        f"CREATE TRIGGER IF NOT EXISTS unsent_{part.table}_{event.lower()} "  # noqa: S608
        f"AFTER {event} ON {part.table} BEGIN "
        "INSERT INTO unsent (valve_id, part, key, since) "
        f"SELECT {row}.{valve}, '{part.table}', {key}, "
        f"coalesce((SELECT min(since) FROM unsent WHERE {same}), {_NOW}); "
        f"DELETE FROM unsent WHERE {same} AND number < (SELECT max(number) FROM unsent); END"
    )


def _fill(connection: sqlite3.Connection) -> None:
    """Have all rows wait."""
    connection.execute("DELETE FROM unsent")
    connection.execute(  # no user's text in either statement
        "INSERT INTO unsent (valve_id, part, key, since) "  # noqa: S608
        f"SELECT id, '{VALVE}', '[]', {_NOW} FROM valve"
    )
    for part in PARTS:
        connection.execute(
            "INSERT INTO unsent (valve_id, part, key, since) "  # noqa: S608
            f"SELECT valve_id, '{part.table}', json_array({', '.join(part.key)}), {_NOW} "
            f"FROM {part.table} ORDER BY {part.order}"
        )


def follow(path: Path) -> None:
    """Have all rows, and each change from now on, wait for a server, unless that is so already.

    Raises HistoryError if the file cannot be written.
    """
    try:
        with reading(path) as connection:
            if has_table(connection, "unsent"):
                return
    except HistoryError:
        pass  # writing says what is wrong, or makes the file
    with writing(path) as file:
        for statement in (_TABLE, _INDEX, *_triggers()):
            file.execute(statement)
        file.execute("INSERT OR IGNORE INTO mark VALUES ('identity', ?)", (uuid.uuid4().hex,))
        _fill(file)


def file_name(path: Path) -> str:
    """Return by what a server knows a followed file: a copy on another machine is another one."""
    with reading(path) as connection:
        row = connection.execute("SELECT value FROM mark WHERE name = 'identity'").fetchone()
    return f"{row[0] if row else ''}@{socket.gethostname()}"


def sent_to(path: Path) -> str | None:
    """Return the identity of the server that has got the rows of a file, if any."""
    with reading(path) as connection:
        row = connection.execute("SELECT value FROM mark WHERE name = 'sent_to'").fetchone()
    return None if row is None else str(row[0])


def send_to(path: Path, identity: str) -> None:
    """Note which server gets the rows; all wait for it where another one has got them so far."""
    with writing(path) as connection:
        if connection.execute("SELECT 1 FROM mark WHERE name = 'sent_to'").fetchone():
            _fill(connection)
        connection.execute("INSERT OR REPLACE INTO mark VALUES ('sent_to', ?)", (identity,))


def count_unsent(path: Path) -> UnsentCount:
    """Count the rows that wait; there are none in a file that is not followed."""
    with reading(path) as connection:
        if not has_table(connection, "unsent"):
            return UnsentCount(0, None, 0)
        waiting, since, refused = connection.execute(
            "SELECT count(*), min(since), count(refusal) FROM unsent"
        ).fetchone()
    return UnsentCount(waiting - refused, since, refused)


def has_unsent(connection: Connection, valve: str) -> bool:
    """Return whether rows of the valve of this name wait."""
    found = connection.execute(
        "SELECT 1 FROM unsent JOIN valve ON valve.id = valve_id WHERE name = ? AND part != ? "
        "LIMIT 1",
        (valve, VALVE),
    )
    return found.fetchone() is not None


def first_unsent(connection: Connection, most: int, after: int) -> list[Unsent]:
    """Return the first rows that wait, and are not refused, of numbers after one."""
    return [
        Unsent(number, valve, part, tuple(json.loads(key)))
        for number, valve, part, key in connection.execute(
            "SELECT number, valve_id, part, key FROM unsent "
            "WHERE number > ? AND refusal IS NULL ORDER BY number LIMIT ?",
            (after, most),
        )
    ]


def acknowledge(path: Path, numbers: list[int]) -> None:
    """Let rows go that were sent; one that has changed since has another number, and stays."""
    with writing(path) as connection:
        connection.executemany("DELETE FROM unsent WHERE number = ?", [(one,) for one in numbers])


def refuse(path: Path, number: int, reason: str) -> None:
    """Keep that the server refuses a row, so that those after it are sent."""
    with writing(path) as connection:
        connection.execute("UPDATE unsent SET refusal = ? WHERE number = ?", (reason, number))
