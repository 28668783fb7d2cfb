"""Connections to a history on a server, which speak as those to a file do."""

import contextlib
import socket
import threading
from collections.abc import Iterator, Sequence
from typing import Any

import psycopg
from psycopg.conninfo import conninfo_to_dict

from valve_friction_ros.history.connection import without_nul
from valve_friction_ros.history.errors import HistoryError, RowRefusedError
from valve_friction_ros.history.server.address import HistoryServer
from valve_friction_ros.history.server.tables import (
    has_tables_of_now,
    make_tables,
    require_readable,
)

__all__ = ["ServerConnection", "ServerRow", "connected", "reading_server"]

_DEFAULTS = {
    "connect_timeout": "5",
    "application_name": "valve_friction",
    "keepalives_idle": "30",
    "keepalives_interval": "10",
    "keepalives_count": "3",
    "tcp_user_timeout": "30000",
}
"""What the address may say otherwise: a server or network that is gone is noticed."""

_SESSION = "SET idle_in_transaction_session_timeout = '60s'; SET extra_float_digits = 1"

_PATIENCE = 30.0
"""Longest wait, s, for an answer. Chosen: a statement takes milliseconds."""

_OWNER = "have the owner of the database run `valve_friction history copy` once"

_TLS = "check sslmode and sslrootcert of the address"

_AWAY = "check that the server runs, and that this machine reaches it"

_REMEDIES = (
    ("password", "check user and password: PGPASSWORD, ~/.pgpass"),
    ("permission denied for schema", _OWNER),
    ("must be owner", _OWNER),
    ("permission denied", "give this role the rights that doc/how_to/history_server.md lists"),
    ("read-only transaction", "name the server that takes writes, or target_session_attrs"),
    ("does not exist", "make it, or name another database or role"),
    ("No space left", "make room on the disk of the server"),
    ("no encryption", _TLS),
    ("SSL", _TLS),
    ("certificate", _TLS),
    ("onnect", _AWAY),
    ("timeout", _AWAY),
)

_REFUSALS = (
    psycopg.DataError,
    psycopg.errors.CheckViolation,
    psycopg.errors.NotNullViolation,
    psycopg.errors.ProgramLimitExceeded,
)
"""Errors of a row, not of the server."""


class ServerRow(Sequence[Any]):
    """A row, whose cells have places and names, as those of `sqlite3.Row`."""

    __slots__ = ("_cells", "_places")

    def __init__(self, cells: Sequence[Any], places: dict[str, int]) -> None:
        self._cells, self._places = tuple(cells), places

    def __getitem__(self, which: Any) -> Any:
        """Return a cell by its place or name, or several by their places."""
        return self._cells[self._places[which] if isinstance(which, str) else which]

    def __len__(self) -> int:
        """Return the number of cells."""
        return len(self._cells)

    def keys(self) -> list[str]:
        """Return the names of the cells."""
        return [*self._places]


def _rows(cursor: "psycopg.Cursor[Any]") -> Any:
    """Make rows with names; of two columns of one name the first counts."""
    columns = cursor.description or ()
    places = {column.name: place for place, column in reversed([*enumerate(columns)])}
    return lambda cells: ServerRow(cells, places)


def _in_postgres(statement: str) -> str:
    return statement.replace(" IS ?", " IS NOT DISTINCT FROM ?").replace("?", "%s")


class ServerConnection:
    """A connection to a server; an answer that does not come in time breaks it.

    Parameters
    ----------
    server : HistoryServer
        The server.
    patience : float
        Longest wait for an answer, s.
    """

    def __init__(self, server: HistoryServer, patience: float = _PATIENCE) -> None:
        self.server, self._patience = server, patience
        self._late = False
        with self.explained():
            try:
                given = conninfo_to_dict(server.url)
            except psycopg.ProgrammingError:
                raise HistoryError(
                    f"{server}: PostgreSQL cannot read the address: check its parameters, and "
                    "encode special characters"
                ) from None
            chosen = {name: one for name, one in _DEFAULTS.items() if name not in given}
            self._connection = psycopg.connect(
                server.url,
                autocommit=True,
                prepare_threshold=None,  # a pooler may stand between
                row_factory=_rows,
                client_encoding="utf8",
                **chosen,  # type: ignore[arg-type]
            )
            self.execute(_SESSION)

    @contextlib.contextmanager
    def explained(self) -> Iterator[None]:
        """Raise HistoryError in place of an error of the server or of the way to it."""
        try:
            yield
        except (psycopg.Error, OSError) as error:
            cause = str(error).partition("\n")[0] or type(error).__name__
            if self._late:
                cause = f"timeout: no answer for {self._patience:g} s"
            cause = self.server.without_secrets(cause)
            remedy = next((remedy for words, remedy in _REMEDIES if words in cause), "")
            kind = RowRefusedError if isinstance(error, _REFUSALS) else HistoryError
            raise kind(f"{self.server}: {cause}{remedy and ': ' + remedy}") from error

    @contextlib.contextmanager
    def _in_time(self) -> Iterator[None]:
        """Break the connection where the answer is late: a server may stand still."""
        timer = threading.Timer(self._patience, self._break)
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()

    def _break(self) -> None:
        self._late = True
        with contextlib.suppress(OSError, psycopg.Error):
            connection = socket.socket(fileno=socket.dup(self._connection.fileno()))
            with connection:
                connection.shutdown(socket.SHUT_RDWR)

    def execute(self, statement: str, values: Sequence[Any] = (), /) -> Any:
        """Do a statement, with values in the places of its ``?``."""
        with self._in_time():
            if not values:
                return self._connection.execute(statement.encode())
            return self._connection.execute(
                _in_postgres(statement).encode(), [*map(without_nul, values)]
            )

    def executemany(self, statement: str, rows: Sequence[Sequence[Any]], /) -> object:
        """Do a statement once for each row of values."""
        if not rows:
            return None
        with self._in_time(), self._connection.cursor() as cursor:
            cursor.executemany(
                _in_postgres(statement).encode(), [[*map(without_nul, row)] for row in rows]
            )
        return None

    def close(self) -> None:
        """End the connection."""
        with contextlib.suppress(psycopg.Error, OSError):
            self._connection.close()

    @contextlib.contextmanager
    def transaction(self) -> Iterator["ServerConnection"]:
        """Make all that is done meanwhile one change; an error undoes it.

        It has a number from its beginning on, by which a reader knows that it is under way.
        """
        with self.explained():
            self.execute("BEGIN; SELECT pg_current_xact_id()")
            try:
                yield self
                self.execute("COMMIT")
            except BaseException:
                with contextlib.suppress(psycopg.Error, OSError):
                    self.execute("ROLLBACK")
                raise


@contextlib.contextmanager
def connected(server: HistoryServer, patience: float = _PATIENCE) -> Iterator[ServerConnection]:
    """Connect to a server to write, with the tables of this version; close it at the end.

    Raises HistoryError if it cannot be reached, or lacks the tables and the right to make them.
    """
    connection = ServerConnection(server, patience)
    with contextlib.closing(connection), connection.explained():
        if not has_tables_of_now(connection):
            with connection.transaction():
                make_tables(connection, server)
        yield connection


_idle: dict[HistoryServer, list[ServerConnection]] = {}
_MOST_IDLE = 2
_BEGIN = "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY"


def _begun(server: HistoryServer) -> ServerConnection:
    """Return a connection that has begun to read; one that was left open may have ended since."""
    kept = _idle.setdefault(server, [])
    while kept:
        connection = kept.pop()
        try:
            with connection.explained():
                connection.execute(_BEGIN)
        except HistoryError:
            connection.close()
        else:
            return connection
    connection = ServerConnection(server)
    with connection.explained():
        connection.execute(_BEGIN)
    return connection


@contextlib.contextmanager
def reading_server(server: HistoryServer) -> Iterator[ServerConnection]:
    """Read one state of a history on a server; the connection stays open for what is read next.

    Raises HistoryError if it cannot be read.
    """
    connection = _begun(server)
    try:
        with connection.explained():
            require_readable(connection, server)
            yield connection
            connection.execute("COMMIT")
    except BaseException:
        connection.close()
        raise
    kept = _idle.setdefault(server, [])
    if len(kept) < _MOST_IDLE:
        kept.append(connection)
    else:
        connection.close()
