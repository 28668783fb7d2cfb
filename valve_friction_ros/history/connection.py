"""What the two engines of the history have in common: statements with ``?``, and rows."""

import sqlite3
from collections.abc import Iterator, Sequence
from typing import Any, Protocol

__all__ = ["Connection", "Cursor", "has_table", "without_nul"]


class Cursor(Protocol):
    """What a statement has found; a row has its cells by place and by name of their column."""

    def fetchone(self) -> Any:
        """Return the next row, or None."""

    def fetchall(self) -> list[Any]:
        """Return all rows that are left."""

    def __iter__(self) -> Iterator[Any]: ...


class Connection(Protocol):
    """A connection to a file of SQLite, or to a server."""

    def execute(self, statement: str, values: Sequence[Any] = ..., /) -> Cursor:
        """Do a statement, with values in the places of its ``?``."""

    def executemany(self, statement: str, rows: Sequence[Sequence[Any]], /) -> object:
        """Do a statement once for each row of values."""


def without_nul(value: Any) -> Any:
    """Return a value as both engines hold it: no text of PostgreSQL has a NUL."""
    return value.replace("\0", "\u2400") if isinstance(value, str) else value


def has_table(connection: Connection, name: str) -> bool:
    """Return whether a history has a table, which a file of an older version may lack."""
    if not isinstance(connection, sqlite3.Connection):
        return True  # a server has had all of them since its first version
    query = "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?"
    return connection.execute(query, (name,)).fetchone() is not None
