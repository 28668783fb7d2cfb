"""Rows without the numbers that one history alone gives them: how they are read and written."""

import hashlib
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from valve_friction_ros.history.connection import Connection, without_nul
from valve_friction_ros.history.copying.parts import Part
from valve_friction_ros.history.rows import settings_id

__all__ = ["CopiedRow", "Key", "row_of_key", "rows_of", "write_rows"]

Key = tuple[Any, ...]
"""Values of the columns of a part's key."""

_MANY = 500
"""Rows that are read or written at once. Chosen: some megabytes."""

_Values = Mapping[str, Any]


@dataclass(frozen=True)
class CopiedRow:
    """A row of a part, with what belongs to it.

    Attributes
    ----------
    key : tuple
        By what it is known among those of its valve.
    values : mapping of str to object
        Its columns, the text of the settings among them.
    children : mapping of str to sequence of mapping
        Columns of the rows that belong to it, by table.
    """

    key: Key
    values: _Values
    children: Mapping[str, Sequence[_Values]] = field(default_factory=dict)

    @property
    def checksum(self) -> bytes:
        """Sum of all that it holds, the same in each history."""
        children = {
            table: sorted(repr(_plain(one)) for one in rows)
            for table, rows in self.children.items()
            if rows
        }
        content = repr((_plain(self.values), sorted(children.items())))
        return hashlib.sha256(content.encode("utf-8", "surrogatepass")).digest()


def _plain(values: _Values) -> list[tuple[str, Any]]:
    """Return columns in one order, with values as both engines hold them."""
    return sorted((name, without_nul(one)) for name, one in values.items())


def _cells(row: Any) -> dict[str, Any]:
    """Return the cells of a row of either engine by their columns."""
    return {name: row[name] for name in row.keys()}  # noqa: SIM118 - a row is no mapping


def _copied(part: Part, row: Any, contents: Mapping[int, str]) -> dict[str, Any]:
    values = _cells(row)
    values.pop("id", None)
    del values["valve_id"]
    if part.table == "identification":
        values["settings"] = contents[values.pop("settings_id")]
    return values


def _settings(connection: Connection, numbers: Sequence[int]) -> dict[int, str]:
    found = {}
    for number in sorted(set(numbers)):
        row = connection.execute("SELECT content FROM settings WHERE id = ?", (number,)).fetchone()
        found[number] = row[0]
    return found


def _children(
    connection: Connection, part: Part, numbers: Sequence[int]
) -> dict[int, dict[str, list[_Values]]]:
    """Return what belongs to the rows of these numbers, by row and table."""
    found: dict[int, dict[str, list[_Values]]] = {
        number: {table: [] for table in part.children} for number in numbers
    }
    marks = ", ".join("?" * len(numbers))
    for table in part.children if numbers else ():
        for row in connection.execute(
            f"SELECT * FROM {table} WHERE {part.parent_column} IN ({marks})",  # noqa: S608
            numbers,
        ):
            values = _cells(row)
            found[values.pop(part.parent_column)][table].append(values)
    return found


def _whole(connection: Connection, part: Part, rows: Sequence[Any]) -> Iterator[CopiedRow]:
    numbers = [row["id"] for row in rows] if part.children else []
    children = _children(connection, part, numbers)
    has_settings = part.table == "identification"
    contents = _settings(connection, [row["settings_id"] for row in rows] if has_settings else [])
    for row in rows:
        key = tuple(row[name] for name in part.key)
        of_row = children[row["id"]] if part.children else {}
        yield CopiedRow(key, _copied(part, row, contents), of_row)


def rows_of(connection: Connection, part: Part, valve: int) -> Iterator[CopiedRow]:
    """Read the rows of a part, of the valve of this row, in the order in which they were kept."""
    if not part.children:
        rows = connection.execute(
            f"SELECT * FROM {part.table} WHERE valve_id = ? ORDER BY {part.order}",  # noqa: S608
            (valve,),
        ).fetchall()
        yield from _whole(connection, part, rows)
        return
    last = 0
    while rows := connection.execute(
        f"SELECT * FROM {part.table} WHERE valve_id = ? AND id > ? ORDER BY id LIMIT ?",  # noqa: S608
        (valve, last, _MANY),
    ).fetchall():
        yield from _whole(connection, part, rows)
        last = rows[-1]["id"]


def row_of_key(connection: Connection, part: Part, valve: int, key: Key) -> CopiedRow | None:
    """Read the row of a part by its key, of the valve of this row; None if it is gone."""
    condition = "".join(f" AND {name} = ?" for name in part.key)
    rows = connection.execute(
        f"SELECT * FROM {part.table} WHERE valve_id = ?{condition}",  # noqa: S608
        (valve, *key),
    ).fetchall()
    return next(_whole(connection, part, rows), None)


def write_rows(connection: Connection, part: Part, rows: Sequence[tuple[int, CopiedRow]]) -> None:
    """Write rows, each with its valve's row in this history; writing them twice changes nothing.

    A row that is kept stays as it is there; any other is replaced.
    """
    columns = _columns(connection, rows)
    by_columns: defaultdict[tuple[str, ...], list[tuple[Any, ...]]] = defaultdict(list)
    for valve, values in columns:
        names = ("valve_id", *values)
        by_columns[names].append((valve, *values.values()))
    for names, cells in by_columns.items():
        connection.executemany(_insertion(part, names), cells)
    if part.children:
        _write_children(connection, part, rows)


def _columns(
    connection: Connection, rows: Sequence[tuple[int, CopiedRow]]
) -> list[tuple[int, dict[str, Any]]]:
    """Return valve and values of rows, with the numbers that settings have here."""
    contents = sorted({str(row.values["settings"]) for _, row in rows if "settings" in row.values})
    numbers = {content: settings_id(connection, content) for content in contents}
    found = []
    for valve, row in rows:
        values = dict(row.values)
        if "settings" in values:
            values["settings_id"] = numbers[values.pop("settings")]
        found.append((valve, values))
    return found


def _insertion(part: Part, names: Sequence[str]) -> str:
    marks, listed = ", ".join("?" * len(names)), ", ".join(names)
    changed = ", ".join(f"{one} = excluded.{one}" for one in names[1:] if one not in part.key)
    conflict = ", ".join(("valve_id", *part.key))
    action = "NOTHING" if part.is_kept or not changed else f"UPDATE SET {changed}"
    return (
        f"INSERT INTO {part.table} ({listed}) VALUES ({marks}) "  # noqa: S608 - no user's text
        f"ON CONFLICT ({conflict}) DO {action}"
    )


def _write_children(
    connection: Connection, part: Part, rows: Sequence[tuple[int, CopiedRow]]
) -> None:
    by_valve: defaultdict[int, list[CopiedRow]] = defaultdict(list)
    for valve, row in rows:
        by_valve[valve].append(row)
    cells: defaultdict[tuple[str, tuple[str, ...]], list[tuple[Any, ...]]] = defaultdict(list)
    for valve, some in by_valve.items():
        marks = ", ".join("?" * len(some))
        numbers = {
            key: number
            for number, key in connection.execute(
                f"SELECT id, {part.key[0]} FROM {part.table} "  # noqa: S608 - no user's text
                f"WHERE valve_id = ? AND {part.key[0]} IN ({marks})",
                (valve, *(row.key[0] for row in some)),
            )
        }
        for row in some:
            for table, children in row.children.items():
                for values in children:
                    names = (part.parent_column, *values)
                    cells[table, names].append((numbers[row.key[0]], *values.values()))
    for (table, names), found in cells.items():
        marks = ", ".join("?" * len(names))
        connection.executemany(
            f"INSERT INTO {table} ({', '.join(names)}) VALUES ({marks}) "  # noqa: S608
            "ON CONFLICT DO NOTHING",
            found,
        )
