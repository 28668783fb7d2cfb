"""Rows of what else was measured of a valve: with an identification, and with a baseline."""

import json
import sqlite3
from collections import defaultdict
from collections.abc import Mapping

from valve_friction_ros.health.known_numbers import KnownNumbers
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.valve_changes import DIFFERENCES, RATIOS
from valve_friction_ros.history.connection import Connection, has_table
from valve_friction_ros.identification import plain
from valve_friction_ros.model.valve import Valve

__all__ = ["NUMBER_TABLES", "insert_numbers", "known_numbers_in", "numbers_in"]

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
    connection: Connection, owner: str, valve: str, first: int, last: int
) -> dict[int, dict[str, Measured]]:
    """Return the numbers of a valve's rows `first` to `last` of the table `owner`, by row.

    There are none in a file of an older version.
    """
    found: defaultdict[int, dict[str, Measured]] = defaultdict(dict)
    table = f"{owner}_number"
    if has_table(connection, table):
        for row, name, value, width in connection.execute(
            f"SELECT {table}.* FROM {table} JOIN {owner} ON {owner}.id = {owner}_id "  # noqa: S608
            "JOIN valve ON valve.id = valve_id "
            f"WHERE valve.name = ? AND {owner}.id BETWEEN ? AND ?",
            (valve, first, last),
        ):
            found[row][name] = Measured(value, width)
    return found


_FARTHEST = {
    "lowest_position": ("lower_stop", "value"),
    "highest_position": ("upper_stop", "value DESC"),
}
"""Ends of the stem's motion: the stop beside each, and the order that begins with the farthest."""


def known_numbers_in(connection: Connection, name: str, valve: Valve, since: int) -> KnownNumbers:
    """Return what the identifications of a valve since a time (ns) say of it (`KnownNumbers`).

    Those made with other parameters of the valve do not count. There is nothing in a file of an
    older version.
    """
    if not has_table(connection, "identification_number"):
        return KnownNumbers()
    same = json.dumps(plain(vars(valve)), sort_keys=True)
    settings = [
        row
        for row, content in connection.execute("SELECT id, content FROM settings")
        if json.dumps(json.loads(content).get("valve"), sort_keys=True) == same
    ]
    marks = ", ".join("?" * len(settings))
    condition = (
        "FROM identification JOIN identification_number ON identification_id = identification.id "  # noqa: S608
        "WHERE valve_id = (SELECT id FROM valve WHERE name = ?) AND time_ns >= ? "
        f"AND settings_id IN ({marks}) AND identification_number.name = ?"
    )

    def first(number: str, since: int, order: str) -> tuple[int, str, Measured] | None:
        row = connection.execute(
            f"SELECT time_ns, value, half_width {condition} ORDER BY {order} LIMIT 1",
            (name, since, *settings, number),
        ).fetchone()
        return None if row is None else (row[0], number, Measured(*row[1:]))

    newest = "time_ns DESC, identification.id DESC"
    found = [first(number, since, newest) for number in (*RATIOS, *DIFFERENCES)]
    times = {one[1]: one[0] for one in found if one is not None}
    for end, (stop, farthest) in _FARTHEST.items():
        found.append(first(end, times.get(stop, since), f"{farthest}, {newest}"))
    records: defaultdict[int, dict[str, Measured]] = defaultdict(dict)
    for time, number, measured in filter(None, found):
        records[time][number] = measured
    known = KnownNumbers()
    for time in sorted(records):
        known = known.followed_by(records[time], time)
    return known
