# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Verified copy of one history to another, with rows in a form common to both."""

import contextlib
import hashlib
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import sqlalchemy as sa
from sqlalchemy.engine import Connection, RowMapping

from valve_friction_ros.history import tables
from valve_friction_ros.history.database import back_up, is_current, reading, writing
from valve_friction_ros.history.entry import KeptValve
from valve_friction_ros.history.place import HistoryError, HistoryServer, Place
from valve_friction_ros.history.rows import settings_id, valve_id
from valve_friction_ros.history.tables import joined, key_of, put, without_nul

_MANY = 500
"""Rows read together, or written in one transaction. Chosen: some megabytes."""

_OWN = frozenset({"id", "valve_id", "settings_id"})
"""Columns with numbers that are valid within one history only."""

Key = tuple[Any, ...]
"""Values that distinguish the rows of one valve in a table, the same in each history."""

PARTS = (
    tables.identification,
    tables.baseline,
    tables.packing_renewal,
    tables.usage,
    tables.alarm_recording,
    tables.told_level,
    tables.alarm_event,
    tables.move,
    tables.evidence_reference,
    tables.evidence_change,
    tables.answer,
)
"""The tables with rows per valve, in the order of copying."""

_CHILDREN = {
    tables.identification: (tables.parameter, tables.identification_number),
    tables.baseline: (tables.baseline_number, tables.baseline_record),
}
"""Tables whose rows belong to a row of another table, and are written with it."""

KEPT = frozenset(
    {tables.identification, tables.baseline, tables.packing_renewal, tables.alarm_event}
)
"""Tables whose rows never change once written, so that they are never sent again."""


def key_columns(part: sa.Table) -> list[sa.Column[Any]]:
    """Return the columns of the `Key` of a part."""
    return [part.c[name] for name in key_of(part)[1:]]


def storage_order(part: sa.Table) -> list[sa.Column[Any]]:
    """Return the columns that sort the rows of a part in the order of storage, or else by key."""
    return [part.c[name] for name in (("id",) if "id" in part.c else key_of(part))]


def among(part: sa.Table, keys: Iterable[tuple[int, Key]]) -> Any:
    """Return the condition for rows with given keys, each with the row of its valve."""
    columns = [part.c[name] for name in key_of(part)]
    return sa.tuple_(*columns).in_([(valve, *key) for valve, key in keys])


class CopiedRow(NamedTuple):
    """A row of a part: key, columns with the text of the settings, and children by table."""

    key: Key
    values: Mapping[str, Any]
    children: Mapping[str, Sequence[Mapping[str, Any]]]

    @property
    def checksum(self) -> bytes:
        """Checksum of its whole content, the same in each history."""
        children = {
            table: sorted(repr(_plain(one)) for one in rows)
            for table, rows in self.children.items()
            if rows
        }
        content = repr((_plain(self.values), sorted(children.items())))
        return hashlib.sha256(content.encode("utf-8", "surrogatepass")).digest()


def _plain(values: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Return columns in a fixed order, with values as both databases hold them."""
    return sorted((name, without_nul(one)) for name, one in values.items())


def rows_of(connection: Connection, part: sa.Table, chosen: Any) -> Iterator[tuple[int, CopiedRow]]:
    """Read the rows of a part that meet a condition, in the order of storage.

    Each comes with the row of its valve.
    """
    query = sa.select(part).where(chosen).order_by(*storage_order(part))
    if "settings_id" in part.c:
        content = tables.settings.c.content.label("settings")
        query = query.add_columns(content).select_from(joined(part, tables.settings))
    names = [column.name for column in key_columns(part)]
    for rows in connection.execute(query).mappings().partitions(_MANY):
        children = _children(connection, part, rows)
        for row in rows:
            values = {name: one for name, one in row.items() if name not in _OWN}
            of_row = children[row["id"]] if part in _CHILDREN else {}
            yield row["valve_id"], CopiedRow(tuple(row[name] for name in names), values, of_row)


def _children(
    connection: Connection, part: sa.Table, rows: Sequence[RowMapping]
) -> dict[int, dict[str, list[dict[str, Any]]]]:
    some, owner = _CHILDREN.get(part, ()), f"{part.name}_id"
    found: defaultdict[int, dict[str, list[dict[str, Any]]]] = defaultdict(
        lambda: {table.name: [] for table in some}
    )
    for table in some:
        of_rows = table.c[owner].in_([row["id"] for row in rows])
        for row in connection.execute(sa.select(table).where(of_rows)).mappings():
            values = dict(row)
            found[values.pop(owner)][table.name].append(values)
    return found


def write_rows(
    connection: Connection, part: sa.Table, rows: Sequence[tuple[int, CopiedRow]]
) -> None:
    """Write rows, each with its valve's row in this history; writing them twice changes nothing.

    An existing row is replaced, except in a part that is kept.
    """
    if not rows:
        return
    contents = {str(row.values["settings"]) for _, row in rows if "settings" in row.values}
    settings = {content: settings_id(connection, content) for content in sorted(contents)}
    written = []
    for valve, row in rows:
        values = {"valve_id": valve, **row.values}
        if "settings" in values:
            values["settings_id"] = settings[values.pop("settings")]
        written.append(values)
    put(connection, part, written, is_kept=part in KEPT)
    if part not in _CHILDREN:
        return
    (key,) = key_columns(part)
    query = sa.select(part.c.id, part.c.valve_id, key).where(
        part.c.valve_id.in_({valve for valve, _ in rows}), key.in_([row.key[0] for _, row in rows])
    )
    ids = {(valve, key): number for number, valve, key in connection.execute(query)}
    for child in _CHILDREN[part]:
        of_rows = [
            {f"{part.name}_id": ids[valve, row.key[0]], **values}
            for valve, row in rows
            for values in row.children[child.name]
        ]
        put(connection, child, of_rows, is_kept=True)


class CopiedPart(NamedTuple):
    """Rows of a table after a copy.

    Attributes
    ----------
    table : str
        The table; children are included in its rows.
    rows : int
        Number of rows of the copied valves in the source.
    written : int
        Number of rows that were missing or different in the target.
    same : int
        Number of rows that now have the same checksum in the target.
    checksum : str
        Checksum over all rows of the source; `copied` is that over the same rows of the target.
    """

    table: str
    rows: int
    written: int
    same: int
    checksum: str
    copied: str

    @property
    def is_same(self) -> bool:
        """Whether the target holds each row of the source unchanged."""
        return self.rows == self.same and self.checksum == self.copied


@contextlib.contextmanager
def _source(place: Place) -> Iterator[Place]:
    """Yield a history of this version; a file of an older version is converted in a copy.

    The rows get the same keys each time.
    """
    if isinstance(place, HistoryServer) or is_current(place):
        yield place
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "history.sqlite"
        back_up(place, path)
        with writing(path):
            pass
        yield path


def copied(
    source: Place, target: Place, valves: Sequence[str] | None = None
) -> tuple[CopiedPart, ...]:
    """Copy all or some valves of a history to another history, and compare the two.

    Only rows that are missing or different in the target are written, so an interrupted copy can be
    resumed. Other rows in the target stay, of other valves and of the same valves.

    Parameters
    ----------
    source, target : Path or HistoryServer
        The two histories.
    valves : sequence of str, optional
        Names of identifiers.

    Returns
    -------
    tuple of CopiedPart
        One item per table.

    Raises
    ------
    HistoryError
        If a history cannot be read, or the target cannot be written.
    """
    if source == target:
        raise HistoryError(f"{target}: is both source and target of the copy: give another one")
    with _source(source) as place, reading(place) as old:
        wanted = sorted(
            (KeptValve(row.name, row.tag), row.id)
            for row in old.execute(sa.select(tables.valve))
            if valves is None or row.name in valves
        )
        with writing(target) as new:
            pairs = [(here, valve_id(new, one)) for one, here in wanted]
        return tuple(_copied(old, target, part, pairs) for part in PARTS)


def _copied(
    old: Connection, target: Place, part: sa.Table, pairs: Sequence[tuple[int, int]]
) -> CopiedPart:
    """Copy the rows of valves, each given by its row in either history."""
    before, sums = _sums(target, part, pairs), dict[tuple[int, Key], bytes]()
    written, waiting = 0, list[tuple[int, CopiedRow]]()

    def write() -> None:
        nonlocal written
        with writing(target) as new:
            write_rows(new, part, waiting)
        written += len(waiting)
        waiting.clear()

    for here, there in pairs:
        for _, row in rows_of(old, part, part.c.valve_id == here):
            sums[there, row.key] = row.checksum
            if before.get((there, row.key)) != row.checksum:
                waiting.append((there, row))
            if len(waiting) >= _MANY:
                write()
    if waiting:
        write()
    after = _sums(target, part, pairs) if written else before
    found = {key: after[key] for key in sums if key in after}
    same = sum(found.get(key) == one for key, one in sums.items())
    checksums = (_total(sums.values()), _total(found.values()))
    return CopiedPart(part.name, len(sums), written, same, *checksums)


def _sums(
    place: Place, part: sa.Table, pairs: Sequence[tuple[int, int]]
) -> dict[tuple[int, Key], bytes]:
    """Return the checksums of the rows in the target of a copy, by valve and key."""
    with reading(place) as new:
        return {
            (there, row.key): row.checksum
            for _, there in pairs
            for _, row in rows_of(new, part, part.c.valve_id == there)
        }


def _total(sums: Iterable[bytes]) -> str:
    return hashlib.sha256(b"".join(sorted(sums))).hexdigest()
