"""The database of the history: its tables, and how a connection to it is opened."""

import contextlib
import sqlite3
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from urllib.parse import quote

from valve_friction_ros.history.evidence_table import EVIDENCE_TABLE
from valve_friction_ros.history.number_rows import NUMBER_TABLES
from valve_friction_ros.history.service_tables import ALARM_RECORDINGS, ANSWERS, TOLD_LEVEL, USAGE

__all__ = [
    "SCHEMA_VERSION",
    "HistoryError",
    "has_table",
    "is_current",
    "reading",
    "writing",
]

SCHEMA_VERSION = 6
"""The database's user_version.

Version 1 has no published values, version 2 no sliding friction in baselines and ratios,
and no half widths without calibration; version 3 has no records of baselines; version 4 does not
say what a baseline replaced; version 5 knows nothing of the valve in service."""

_APPLICATION = 0x56465248
"""The database's application_id, "VFRH" in ASCII, so that a history is recognised."""

_PATIENCE = 3.0
"""Longest wait, s, for another process that writes. Chosen: one transaction takes milliseconds, and
who has called a service waits for it too."""

_SCHEMA = """
CREATE TABLE valve (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE,
    tag TEXT NOT NULL
);
CREATE TABLE settings (
    id INTEGER PRIMARY KEY,
    content TEXT NOT NULL UNIQUE
);
CREATE TABLE identification (
    id INTEGER PRIMARY KEY,
    valve_id INTEGER NOT NULL REFERENCES valve,
    time_ns INTEGER NOT NULL,
    begin_ns INTEGER,
    end_ns INTEGER,
    method TEXT NOT NULL,
    refusal TEXT,
    fit REAL,
    rms REAL,
    systematic_misfit REAL,
    warnings TEXT NOT NULL,
    level INTEGER NOT NULL CHECK (level BETWEEN 0 AND 2),
    status_signal TEXT NOT NULL,
    message TEXT NOT NULL,
    ratio REAL,
    ratio_low REAL,
    ratio_high REAL,
    ratio_of TEXT,
    ratio_speed REAL,
    baseline REAL,
    baseline_half_width REAL,
    baseline_sliding_friction REAL,
    baseline_sliding_half_width REAL,
    baseline_sliding_speed REAL,
    sliding_speed REAL,
    warn_ratio REAL NOT NULL,
    error_ratio REAL NOT NULL,
    low_ratio REAL NOT NULL,
    settings_id INTEGER NOT NULL REFERENCES settings,
    software_version TEXT NOT NULL
);
CREATE INDEX identification_of_valve ON identification (valve_id, time_ns);
CREATE TABLE parameter (
    identification_id INTEGER NOT NULL REFERENCES identification ON DELETE CASCADE,
    name TEXT NOT NULL,
    value REAL,
    standard_error REAL,
    half_width REAL,
    verdict TEXT NOT NULL,
    reason TEXT NOT NULL,
    published REAL,
    uncalibrated_half_width REAL,
    PRIMARY KEY (identification_id, name)
) WITHOUT ROWID;
"""

_BASELINE = """
CREATE TABLE baseline (
    id INTEGER PRIMARY KEY,
    valve_id INTEGER NOT NULL REFERENCES valve,
    time_ns INTEGER NOT NULL,
    since_ns INTEGER NOT NULL,
    coulomb_friction REAL CHECK (coulomb_friction > 0),
    half_width REAL NOT NULL CHECK (half_width >= 0),
    sliding_friction REAL CHECK (sliding_friction > 0),
    sliding_half_width REAL CHECK (sliding_half_width >= 0),
    sliding_speed REAL CHECK (sliding_speed > 0),
    CHECK (coalesce(coulomb_friction, sliding_friction) IS NOT NULL)
);
CREATE INDEX baseline_of_valve ON baseline (valve_id, id);
CREATE VIEW friction AS
    SELECT
        identification.id AS id,
        strftime('%Y-%m-%dT%H:%M:%SZ', time_ns / 1000000000, 'unixepoch') AS time,
        valve.name AS valve,
        valve.tag AS tag,
        parameter.value AS coulomb_friction,
        parameter.half_width AS half_width,
        parameter.verdict AS verdict,
        sliding.value AS sliding_friction,
        sliding.half_width AS sliding_half_width,
        sliding.verdict AS sliding_verdict,
        identification.sliding_speed AS sliding_speed,
        ratio,
        ratio_of,
        level,
        message,
        refusal
    FROM identification
    JOIN valve ON valve.id = valve_id
    LEFT JOIN parameter
        ON parameter.identification_id = identification.id AND parameter.name = 'coulomb_friction'
    LEFT JOIN parameter AS sliding
        ON sliding.identification_id = identification.id AND sliding.name = 'sliding_friction';
"""

_RECORD = """
CREATE TABLE baseline_record (
    baseline_id INTEGER PRIMARY KEY REFERENCES baseline ON DELETE CASCADE,
    sample_period REAL NOT NULL,
    driven_by TEXT NOT NULL,
    drive BLOB NOT NULL,
    position BLOB NOT NULL
)
"""
"""Samples of the record of a baseline, single precision, the least significant byte first."""

_REPLACED = """
ALTER TABLE baseline ADD COLUMN set_by TEXT NOT NULL DEFAULT 'set_baseline';
ALTER TABLE baseline ADD COLUMN level INTEGER;
ALTER TABLE baseline ADD COLUMN withdrawn INTEGER NOT NULL DEFAULT 0;
ALTER TABLE baseline ADD COLUMN replaced_coulomb_friction REAL;
ALTER TABLE baseline ADD COLUMN replaced_half_width REAL;
ALTER TABLE baseline ADD COLUMN replaced_sliding_friction REAL;
ALTER TABLE baseline ADD COLUMN replaced_sliding_half_width REAL;
ALTER TABLE baseline ADD COLUMN replaced_sliding_speed REAL;
UPDATE baseline SET
    (replaced_coulomb_friction, replaced_half_width, replaced_sliding_friction,
     replaced_sliding_half_width, replaced_sliding_speed)
    = (SELECT coulomb_friction, half_width, sliding_friction, sliding_half_width, sliding_speed
       FROM baseline AS former
       WHERE former.valve_id = baseline.valve_id AND former.id < baseline.id
       ORDER BY former.id DESC LIMIT 1);
"""
"""Who set a baseline, at which level, and what it replaced: in an older file the row before it."""

_SERVICE = ";".join((NUMBER_TABLES, USAGE, ALARM_RECORDINGS, TOLD_LEVEL, EVIDENCE_TABLE, ANSWERS))
"""The tables of the valve in service."""

_ADDED = {
    "ratio_of": "TEXT",
    "ratio_speed": "REAL",
    "baseline_sliding_friction": "REAL",
    "baseline_sliding_half_width": "REAL",
    "baseline_sliding_speed": "REAL",
    "sliding_speed": "REAL",
}
"""Columns of the identifications that version 3 adds."""

_STEPS = {
    1: ("ALTER TABLE parameter ADD COLUMN published REAL",),
    2: (
        *(f"ALTER TABLE identification ADD COLUMN {name} {kind}" for name, kind in _ADDED.items()),
        "ALTER TABLE parameter ADD COLUMN uncalibrated_half_width REAL",
        "DROP VIEW friction",
        "DROP INDEX baseline_of_valve",
        "ALTER TABLE baseline RENAME TO former_baseline",
        *_BASELINE.split(";"),
        "INSERT INTO baseline (id, valve_id, time_ns, since_ns, coulomb_friction, half_width) "
        "SELECT id, valve_id, time_ns, since_ns, coulomb_friction, half_width FROM former_baseline",
        "DROP TABLE former_baseline",
    ),
    3: (_RECORD,),
    4: tuple(_REPLACED.split(";")),
    5: tuple(_SERVICE.split(";")),
}
"""What leads from a version to the next one."""

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


class HistoryError(Exception):
    """The history cannot be read or written; the message names the file, the cause and a remedy."""


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


def has_table(connection: sqlite3.Connection, name: str) -> bool:
    """Return whether a file has a table, which one of an older version may lack."""
    query = "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?"
    return connection.execute(query, (name,)).fetchone() is not None


def _set_journal(connection: sqlite3.Connection) -> None:
    """Use the write-ahead journal where the file system allows it, else the older, slower journal.

    With both a finished transaction is on the disk before the next statement.
    """
    with contextlib.suppress(sqlite3.OperationalError):
        connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA synchronous = FULL")


def _make_tables(connection: sqlite3.Connection) -> None:
    """Create the tables of a new file, and add to those of an older one what they lack."""
    version = _pragma(connection, "user_version")
    steps = (_STEPS[one] for one in range(version, SCHEMA_VERSION) if version)
    tables = (_SCHEMA, _BASELINE, _RECORD, _REPLACED, _SERVICE)
    statements = chain(*steps) if version else ";".join(tables).split(";")
    for statement in filter(str.strip, statements):
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


@contextlib.contextmanager
def reading(path: Path) -> Iterator[sqlite3.Connection]:
    """Open an existing history, to read one state of it.

    Raises HistoryError if it is missing, or cannot be read.
    """
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
        with reading(path) as connection:
            return _pragma(connection, "user_version") == SCHEMA_VERSION
    except HistoryError:
        return False
