"""Rows of what else was measured of a valve: with an identification, and with a baseline."""

import sqlite3
from collections import defaultdict
from collections.abc import Mapping

from valve_friction_ros.health.measured import Measured

__all__ = ["NUMBER_TABLES", "insert_numbers", "numbers_in"]

NUMBER_TABLES = "".join(
    f"""
CREATE TABLE {owner}_number (
    {owner}_id INTEGER NOT NULL REFERENCES {owner} ON DELETE CASCADE,
    name TEXT NOT NULL,
    value REAL NOT NULL,
    half_width REAL NOT NULL,
    PRIMARY KEY ({owner}_id, name)
) WITHOUT ROWID;
"""
    for owner in ("baseline", "identification")
)
"""The tables `baseline_number` and `identification_number`."""


def insert_numbers(
    connection: sqlite3.Connection, owner: str, row: int, numbers: Mapping[str, Measured]
) -> None:
    """Add the numbers of a row of the table `owner`, ``baseline`` or ``identification``."""
    connection.executemany(
        f"INSERT INTO {owner}_number VALUES (?, ?, ?, ?)",  # noqa: S608 - no user's text
        [(row, name, *number) for name, number in numbers.items()],
    )


def numbers_in(
    connection: sqlite3.Connection, owner: str, first: int, last: int
) -> dict[int, dict[str, Measured]]:
    """Return the numbers of the rows `first` to `last` of the table `owner`, by row.

    There are none in a file of an older version.
    """
    found: defaultdict[int, dict[str, Measured]] = defaultdict(dict)
    table = f"{owner}_number"
    if connection.execute("SELECT 1 FROM sqlite_master WHERE name = ?", (table,)).fetchone():
        for row, name, value, width in connection.execute(
            f"SELECT * FROM {table} WHERE {owner}_id BETWEEN ? AND ?",  # noqa: S608
            (first, last),
        ):
            found[row][name] = Measured(value, width)
    return found
