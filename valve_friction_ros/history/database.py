# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Connections to a history in SQLite or PostgreSQL, each for one transaction."""

import contextlib
import os
import sqlite3
import time
import uuid
from collections.abc import Generator, Iterator
from contextvars import ContextVar
from functools import lru_cache
from pathlib import Path
from typing import Any
from urllib.parse import quote

import sqlalchemy as sa
from sqlalchemy.engine import Connection, Engine
from sqlalchemy.pool import NullPool

from valve_friction_ros.history.place import HistoryError, HistoryServer, Place, RowRefusedError
from valve_friction_ros.history.tables import (
    SCHEMA_VERSION,
    bring_up_to_date,
    mark,
    put,
    show_as_of_now,
)

_APPLICATION = 0x56465248
"""The application_id of the database, "VFRH" in ASCII, by which a history is recognised; on a
server, the number of the lock under which one process at a time changes the tables."""

_PATIENCE = 3.0
"""Longest wait, s, for another writing process. Chosen: a transaction takes milliseconds, and the
caller of a service waits for it too."""

_PATIENCE_WITH_SERVER = 30.0
"""Longest wait, s, for a response of a server. Chosen: a statement takes milliseconds."""

_OF_SERVER = {
    "connect_timeout": "5",
    "application_name": "valve_friction",
    "keepalives_idle": "30",
    "keepalives_interval": "10",
    "keepalives_count": "3",
    "tcp_user_timeout": "30000",
}
"""Defaults that the address may override, by which a lost server or network is detected."""

_INSTALL = "pip install 'SQLAlchemy>=2.0,<3' 'psycopg[binary]>=3.2,<4'"

_ANOTHER = "or use another history_file"
_OWNER = "have the owner of the database run `valve_friction history copy` once"
_TLS = "check sslmode and sslrootcert of the address"
_AWAY = "check that the server runs, and that this machine reaches it"
_REMEDIES_OF_FILE = (
    ("disk is full", "make room on its disk"),
    ("readonly", f"make the file and its folder writable, {_ANOTHER}"),
    ("unable to open", f"check that the folder exists and is writable, {_ANOTHER}"),
    ("disk I/O error", "check the disk, its free space and the process's limits"),
    ("locked", "find the process that locks it, and stop it"),
    (
        "not a database",
        "give the right file, or move this file away: the node then begins a new file",
    ),
    (
        "malformed",
        "move it away: the node then begins a new file; `sqlite3 FILE .recover` may save rows",
    ),
)
_REMEDIES_OF_SERVER = (
    ("password", "check user and password: PGPASSWORD, ~/.pgpass"),
    ("permission denied for schema", _OWNER),
    ("must be owner", _OWNER),
    ("permission denied", "give this role the rights that doc/how_to/history_server.md lists"),
    ("read-only transaction", "give the server that accepts writes, or set target_session_attrs"),
    ("does not exist", "create it, or use another database or role"),
    ("No space left", "make room on the disk of the server"),
    ("no encryption", _TLS),
    ("SSL", _TLS),
    ("certificate", _TLS),
    ("onnect", _AWAY),
    ("timeout", _AWAY),
)
_NOT_NULL, _CHECK = "23502", "23514"
_DATA, _PROGRAM_LIMIT = "22", "54"
"""SQLSTATEs, and classes of SQLSTATEs, for errors of a row rather than of the server."""


@contextlib.contextmanager
def _explained(place: Place) -> Iterator[None]:
    """Turn an error of the database or of the connection into a HistoryError of one line."""
    try:
        yield
    except (sa.exc.DBAPIError, OSError) as error:
        cause = str(error.orig if isinstance(error, sa.exc.DBAPIError) else error)
        is_server = isinstance(place, HistoryServer)
        remedies = _REMEDIES_OF_SERVER if is_server else _REMEDIES_OF_FILE
        if isinstance(place, HistoryServer):
            cause = place.without_secrets(cause.partition("\n")[0] or type(error).__name__)
        remedy = next((remedy for words, remedy in remedies if words in cause), "")
        kind = RowRefusedError if _is_refusal(error) else HistoryError
        raise kind(f"{place}: {cause}{remedy and ': ' + remedy}") from error


def _is_refusal(error: Exception) -> bool:
    state = str(getattr(getattr(error, "orig", None), "sqlstate", None) or "")
    is_of_row = state in (_NOT_NULL, _CHECK) or state[:2] in (_DATA, _PROGRAM_LIMIT)
    return is_of_row or isinstance(error, sa.exc.DataError)


# Files


_uri: ContextVar[str] = ContextVar("uri")
"""URI of the file to be opened next."""


def _opened() -> sqlite3.Connection:
    connection = sqlite3.connect(_uri.get(), uri=True, timeout=_PATIENCE, isolation_level=None)
    connection.execute("PRAGMA foreign_keys = ON")
    # Its own lower() knows only the letters A to Z.
    connection.create_function("lower", 1, str.lower, deterministic=True)
    return connection


_FILES = sa.create_engine("sqlite://", creator=_opened, poolclass=NullPool, future=True)
"""Engine that opens a file anew for each connection, and caches statements across files."""


def _name(path: Path, mode: str) -> str:
    return f"file:{quote(str(path.absolute()))}?{mode}"


@contextlib.contextmanager
def _file(path: Path, mode: str) -> Iterator[Connection]:
    """Open a file with the `mode` of its URI, and close it at the end."""
    _uri.set(_name(path, mode))
    with _explained(path), _FILES.connect() as connection:
        yield connection


def _pragma(connection: Connection, name: str) -> int:
    return int(connection.exec_driver_sql(f"PRAGMA {name}").scalar() or 0)


def _version_of_file(path: Path, connection: Connection) -> int:
    """Return the version of a history, 0 for an empty file; refuse any other file.

    It reads in the caller's transaction, since another process may just be creating the tables.
    """
    application, version = (_pragma(connection, n) for n in ("application_id", "user_version"))
    if application != _APPLICATION:
        tables = connection.exec_driver_sql("SELECT count(*) FROM sqlite_master").scalar()
        if application or version or tables:
            raise HistoryError(f"{path}: the database of another program: use another history_file")
        return 0
    if version > SCHEMA_VERSION:
        raise HistoryError(
            f"{path}: written by a newer version of this package (schema {version}, this "
            f"version knows {SCHEMA_VERSION}): update the package, {_ANOTHER}"
        )
    return version


@contextlib.contextmanager
def _writing_file(path: Path) -> Iterator[Connection]:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        cause = "its folder is a file" if isinstance(error, FileExistsError) else error.strerror
        raise HistoryError(f"{path}: {cause}: check the folder, {_ANOTHER}") from None
    with _file(path, "mode=rwc") as connection:
        connection.exec_driver_sql("BEGIN")
        _version_of_file(path, connection)
        connection.exec_driver_sql("COMMIT")
        # The write-ahead journal if the file system allows it, else the older, slower journal. With
        # either, a finished transaction is on disk before the next statement.
        with contextlib.suppress(sa.exc.OperationalError):
            connection.exec_driver_sql("PRAGMA journal_mode = WAL")
        connection.exec_driver_sql("PRAGMA synchronous = FULL")
        connection.exec_driver_sql("BEGIN IMMEDIATE")
        if (version := _version_of_file(path, connection)) < SCHEMA_VERSION:
            bring_up_to_date(connection, version)
            connection.exec_driver_sql(f"PRAGMA application_id = {_APPLICATION}")
            connection.exec_driver_sql(f"PRAGMA user_version = {SCHEMA_VERSION}")
        yield connection
        connection.commit()


def _reading_mode(path: Path) -> str:
    """Return the mode in which a file can be read.

    The write-ahead journal needs files beside the database. If they cannot be created, no process
    writes. Without a remaining journal, the database file alone holds all rows.
    """
    try:
        _uri.set(_name(path, "mode=ro"))
        with contextlib.closing(_opened()) as connection:
            connection.execute("PRAGMA user_version")
    except sqlite3.Error:
        if not path.with_name(path.name + "-wal").exists():
            return "mode=ro&immutable=1"
    return "mode=ro"


@contextlib.contextmanager
def _reading_file(path: Path) -> Iterator[tuple[Connection, int]]:
    """Open an existing file to read one state of it; also yield the version of its tables."""
    try:
        is_there = path.is_file()
    except OSError as error:
        raise HistoryError(f"{path}: {error.strerror}: check the folder") from None
    if not is_there:
        raise HistoryError(f"{path}: there is no such file: check its name")
    with _file(path, _reading_mode(path)) as connection:
        connection.exec_driver_sql("BEGIN")
        if not (version := _version_of_file(path, connection)):
            raise HistoryError(f"{path}: the file is empty: no identification has been stored")
        yield connection, version


def is_current(path: Path) -> bool:
    """Return whether a file is a readable history of this version of the schema."""
    try:
        with _reading_file(path) as (_, version):
            return version == SCHEMA_VERSION
    except HistoryError:
        return False


def is_ready(path: Path) -> bool:
    """Return, without waiting, whether a file is a writable history of this version."""
    return is_current(path) and all(os.access(one, os.W_OK) for one in (path, path.parent))


def back_up(path: Path, copy: Path) -> None:
    """Copy a file unchanged to another file."""
    with _reading_file(path) as (old, _), contextlib.closing(sqlite3.connect(copy)) as new:
        file: Any = old.connection
        file.backup(new)


# Servers


def _in_time(
    steps: Generator[Any, Any, Any], patience: float, end: Any
) -> Generator[Any, Any, Any]:
    """Run the `steps` of a wait for a server, which resumes every tenth of a second.

    If the response takes too long, call `end` and raise TimeoutError: a server may hang.
    """
    deadline, ready = time.monotonic() + patience, None
    while True:
        try:
            wanted = steps.send(ready)
        except StopIteration as done:
            return done.value
        ready = yield wanted
        if time.monotonic() > deadline:
            end()
            raise TimeoutError(f"timeout: no answer for {patience:g} s")


@lru_cache(maxsize=64)
def server_engine(server: HistoryServer) -> Engine:
    """Return the engine for a server; it replaces connections that have ended."""
    try:
        import psycopg  # noqa: PLC0415 - an extra
        from psycopg.conninfo import conninfo_to_dict  # noqa: PLC0415
    except ImportError:
        raise HistoryError(f"{server}: psycopg is missing: {_INSTALL}") from None
    try:
        given = conninfo_to_dict(server.url)
    except psycopg.ProgrammingError:
        raise HistoryError(
            f"{server}: PostgreSQL cannot read the address: check its parameters, and encode "
            "special characters"
        ) from None
    chosen: dict[str, Any] = {name: one for name, one in _OF_SERVER.items() if name not in given}

    class Patient(psycopg.Connection[Any]):
        """A connection that ends if a response does not arrive in time."""

        def wait(self, gen: Any, *arguments: Any, **options: Any) -> Any:
            steps = _in_time(gen, _PATIENCE_WITH_SERVER, self.pgconn.finish)
            try:
                return super().wait(steps, *arguments, **options)
            except TimeoutError as error:
                raise psycopg.OperationalError(str(error)) from None

    def connected() -> Any:
        connection = Patient.connect(
            server.url,
            autocommit=True,
            prepare_threshold=None,  # a pooler may sit in between
            client_encoding="utf8",
            **chosen,
        )
        connection.execute("SET idle_in_transaction_session_timeout = '60s'")
        connection.autocommit = False
        return connection

    try:
        return sa.create_engine(
            "postgresql+psycopg://",
            creator=connected,
            pool_size=2,
            max_overflow=-1,
            pool_pre_ping=True,
            use_native_hstore=False,
            future=True,
        )
    except sa.exc.NoSuchModuleError:
        raise HistoryError(f"{server}: SQLAlchemy 2 is missing: {_INSTALL}") from None


def _version_on_server(connection: Connection, server: HistoryServer) -> int:
    """Return the version of the tables, 0 without tables; refuse tables of a newer version."""
    if connection.scalar(sa.select(sa.func.to_regclass(mark.name))) is None:
        return 0
    version = int(marked(connection, "schema") or 0)
    if version > SCHEMA_VERSION:
        raise HistoryError(
            f"{server}: its tables are of a newer version of this package (schema {version}, this "
            f"version knows {SCHEMA_VERSION}): update the package"
        )
    return version


def marked(connection: Connection, name: str) -> str | None:
    """Return the mark of a database under a name, or None."""
    found = connection.scalar(sa.select(mark.c.value).where(mark.c.name == name))
    return None if found is None else str(found)


def set_mark(connection: Connection, name: str, value: str, *, is_kept: bool = False) -> None:
    """Store a mark in a database; with `is_kept`, only if there is none."""
    put(connection, mark, [{"name": name, "value": value}], is_kept=is_kept)


@contextlib.contextmanager
def _writing_server(server: HistoryServer) -> Iterator[Connection]:
    with _explained(server), server_engine(server).begin() as connection:
        # Get a transaction number at the start, so that a reader knows that it is in progress.
        connection.execute(sa.select(sa.func.pg_current_xact_id()))
        if _version_on_server(connection, server) < SCHEMA_VERSION:
            connection.execute(sa.select(sa.func.pg_advisory_xact_lock(_APPLICATION)))
            version = _version_on_server(connection, server)
            bring_up_to_date(connection, version)
            set_mark(connection, "identity", uuid.uuid4().hex, is_kept=True)
            set_mark(connection, "schema", str(SCHEMA_VERSION))
        yield connection


@contextlib.contextmanager
def _reading_server(server: HistoryServer) -> Iterator[tuple[Connection, int]]:
    with _explained(server), server_engine(server).connect() as connection:
        connection.execution_options(isolation_level="REPEATABLE READ")
        if not (version := _version_on_server(connection, server)):
            raise HistoryError(
                f"{server}: contains no history: `valve_friction history copy` creates its tables"
            )
        yield connection, version


# Both


def writing(place: Place) -> contextlib.AbstractContextManager[Connection]:
    """Open a history for one transaction; create missing tables and update old tables.

    Raises HistoryError if the history cannot be written; then no part of the transaction is.
    """
    return _writing_server(place) if isinstance(place, HistoryServer) else _writing_file(place)


@contextlib.contextmanager
def reading(place: Place) -> Iterator[Connection]:
    """Open an existing history to read one state of it.

    A history of an older version appears like one of this version. Raises HistoryError if the
    history is missing or cannot be read, or if a row holds invalid values.
    """
    opened = _reading_server(place) if isinstance(place, HistoryServer) else _reading_file(place)
    with opened as (connection, version):
        if version < SCHEMA_VERSION:
            show_as_of_now(connection)
        try:
            yield connection
        except (LookupError, TypeError, ValueError) as error:
            raise HistoryError(f"{place}: a row holds no result: {error}") from None
