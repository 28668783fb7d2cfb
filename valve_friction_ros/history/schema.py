"""The database of the history: how a connection to it is opened, and its tables made."""

import contextlib
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING
from urllib.parse import quote

from valve_friction_ros.history.connection import Connection, has_table
from valve_friction_ros.history.errors import HistoryError
from valve_friction_ros.history.server.address import INSTALL, HistoryServer
from valve_friction_ros.history.tables import ADDED_LATE, SCHEMA_VERSION, statements_from

if TYPE_CHECKING:
    from valve_friction_ros.history.server.connection import ServerConnection

__all__ = [
    "SCHEMA_VERSION",
    "HistoryError",
    "Place",
    "has_table",
    "is_current",
    "reading",
    "server_connection",
    "writing",
]

_APPLICATION = 0x56465248
"""The database's application_id, "VFRH" in ASCII, so that a history is recognised."""

_PATIENCE = 3.0
"""Longest wait, s, for another process that writes. Chosen: one transaction takes milliseconds, and
who has called a service waits for it too."""

_REMEDIES = (
    ("disk is full", "make room on its disk"),
    ("readonly", "make the file and its folder writable, or name another history_file"),
    (
        "unable to open",
        "check that the folder is there and writable, or name another history_file",
    ),
    ("disk I/O error", "check the disk, its free space and the process's limits"),
    ("locked", "find the process that holds it, and end it"),
    (
        "not a database",
        "name the right file, or move this file away: the node then begins a new file",
    ),
    (
        "malformed",
        "move it away: the node then begins a new file; `sqlite3 FILE .recover` may save rows",
    ),
)


Place = Path | HistoryServer
"""Where a history is: a file, or a server."""


def _explained(path: Path, error: sqlite3.Error) -> HistoryError:
    cause = str(error)
    remedy = next((remedy for words, remedy in _REMEDIES if words in cause), "")
    return HistoryError(f"{path}: {cause}{remedy and ': ' + remedy}")


@contextlib.contextmanager
def _connection(path: Path, mode: str) -> Iterator[sqlite3.Connection]:
    """Open a file by a URI's `mode`, and close it at the end; errors name cause and remedy."""
    try:
        connection = sqlite3.connect(
            f"file:{quote(str(path.absolute()))}?{mode}",
            uri=True,
            timeout=_PATIENCE,
            isolation_level=None,
        )
        with contextlib.closing(connection):
            connection.execute("PRAGMA foreign_keys = ON")
            yield connection
    except sqlite3.Error as error:
        raise _explained(path, error) from error


def _pragma(connection: sqlite3.Connection, name: str) -> int:
    (value,) = connection.execute(f"PRAGMA {name}").fetchone()
    return int(value)


def _is_new(path: Path, connection: sqlite3.Connection) -> bool:
    """Return whether a database is empty; refuse any other that is not a history of this schema."""
    application, version = (_pragma(connection, n) for n in ("application_id", "user_version"))
    if application != _APPLICATION:
        (tables,) = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        if application or version or tables:
            raise HistoryError(
                f"{path}: the database of another program: name another history_file"
            )
        return True
    if version > SCHEMA_VERSION:
        raise HistoryError(
            f"{path}: written by a newer version of this package (schema {version}, this "
            f"version knows {SCHEMA_VERSION}): update the package, or name another history_file"
        )
    return False


def _set_journal(connection: sqlite3.Connection) -> None:
    """Use the write-ahead journal where the file system allows it, else the older, slower journal.

    With both a finished transaction is on the disk before the next statement.
    """
    with contextlib.suppress(sqlite3.OperationalError):
        connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA synchronous = FULL")


def _make_tables(connection: sqlite3.Connection) -> None:
    """Create the tables of a new file, and add to those of an older one what they lack."""
    for statement in statements_from(_pragma(connection, "user_version")):
        connection.execute(statement)
    connection.execute(f"PRAGMA application_id = {_APPLICATION}")
    connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")


@contextlib.contextmanager
def writing(path: Path) -> Iterator[sqlite3.Connection]:
    """Open a history for one transaction, and create it if it is missing.

    Raises HistoryError if it cannot be written; then no part of the transaction is.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        cause = "its folder is a file" if isinstance(error, FileExistsError) else error.strerror
        raise HistoryError(
            f"{path}: {cause}: check the folder, or name another history_file"
        ) from None
    with _connection(path, "mode=rwc") as connection:
        _is_new(path, connection)
        _set_journal(connection)
        connection.execute("BEGIN IMMEDIATE")
        try:
            if _is_new(path, connection) or _pragma(connection, "user_version") < SCHEMA_VERSION:
                _make_tables(connection)
            for statement in ADDED_LATE:
                connection.execute(statement)
            yield connection
            connection.execute("COMMIT")
        finally:
            if connection.in_transaction:
                connection.execute("ROLLBACK")


def _reading_mode(path: Path) -> str:
    """Return the mode in which a file can be read.

    The write-ahead journal needs files beside the database. Where they cannot be created, no
    process writes; without a remaining journal the database file alone holds all rows.
    """
    try:
        with _connection(path, "mode=ro") as connection:
            _pragma(connection, "user_version")
    except HistoryError:
        if not path.with_name(path.name + "-wal").exists():
            return "mode=ro&immutable=1"
    return "mode=ro"


def _connections(server: HistoryServer) -> ModuleType:
    """Load what speaks to servers, which a node without one does without."""
    try:
        from valve_friction_ros.history.server import connection  # noqa: PLC0415 - an extra
    except ImportError:
        raise HistoryError(f"{server}: {INSTALL}") from None
    return connection


@contextlib.contextmanager
def server_connection(server: HistoryServer) -> Iterator["ServerConnection"]:
    """Connect to a server to write; its tables are made if they are missing, or old.

    Raises HistoryError if it cannot be reached, or the tables lack and the right to make them.
    """
    with _connections(server).connected(server) as connection:
        yield connection


@contextlib.contextmanager
def reading(place: Place) -> Iterator[Connection]:
    """Open an existing history, to read one state of it; rows have their columns' names.

    Raises HistoryError if it is missing, or cannot be read.
    """
    if isinstance(place, HistoryServer):
        with _connections(place).reading_server(place) as connection:
            yield connection
        return
    with _reading_file(place) as file:
        file.row_factory = sqlite3.Row
        yield file


@contextlib.contextmanager
def _reading_file(path: Path) -> Iterator[sqlite3.Connection]:
    try:
        is_there = path.is_file()
    except OSError as error:
        raise HistoryError(f"{path}: {error.strerror}: check the folder") from None
    if not is_there:
        raise HistoryError(f"{path}: there is no such file: check its name")
    with _connection(path, _reading_mode(path)) as connection:
        if _is_new(path, connection):
            raise HistoryError(f"{path}: the file is empty: no identification has been stored")
        connection.execute("BEGIN")
        yield connection


def is_current(path: Path) -> bool:
    """Return whether a file is a readable history of this version of the schema."""
    try:
        with _reading_file(path) as connection:
            return _pragma(connection, "user_version") == SCHEMA_VERSION
    except HistoryError:
        return False
