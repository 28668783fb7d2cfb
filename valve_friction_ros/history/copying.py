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
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
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
"""Values of the key columns of a part."""


@dataclass(frozen=True)
class Part:
    """A table with rows per valve.

    Attributes
    ----------
    table : Table
        The table.
    is_kept : bool
        Whether a row never changes once written, so that it is never sent again.
    children : tuple of Table
        Tables whose rows belong to a row of this table, and are written with it.
    """

    table: sa.Table
    is_kept: bool = False
    children: tuple[sa.Table, ...] = ()

    @property
    def name(self) -> str:
        """Name of the table."""
        return self.table.name

    @property
    def key(self) -> tuple[str, ...]:
        """Columns that distinguish the rows of one valve, the same in each history."""
        return key_of(self.table)[1:]

    @property
    def order(self) -> list[sa.Column[Any]]:
        """Columns that sort its rows in the order of storage, or else by key."""
        names = ("id",) if "id" in self.table.c else key_of(self.table)
        return [self.table.c[name] for name in names]

    @property
    def owner(self) -> str:
        """Column by which the children refer to their row."""
        return f"{self.name}_id"

    def among(self, keys: Iterable[tuple[int, Key]]) -> Any:
        """Return the condition for rows with given keys, each with the row of its valve."""
        columns = [self.table.c[name] for name in key_of(self.table)]
        return sa.tuple_(*columns).in_([(valve, *key) for valve, key in keys])


PARTS = (
    Part(tables.identification, True, (tables.parameter, tables.identification_number)),
    Part(tables.baseline, True, (tables.baseline_number, tables.baseline_record)),
    Part(tables.packing_renewal, True),
    Part(tables.usage),
    Part(tables.alarm_recording),
    Part(tables.told_level),
    Part(tables.alarm_event, True),
    Part(tables.move),
    Part(tables.evidence_reference),
    Part(tables.evidence_change),
    Part(tables.answer),
)
"""All parts, in the order of copying."""


@dataclass(frozen=True)
class CopiedRow:
    """A row of a part, with its children.

    Attributes
    ----------
    key : tuple
        Key of the row among the rows of its valve.
    values : mapping of str to object
        Its columns, including the text of the settings.
    children : mapping of str to sequence of mapping
        Columns of the rows that belong to it, by table.
    """

    key: Key
    values: Mapping[str, Any]
    children: Mapping[str, Sequence[Mapping[str, Any]]] = field(default_factory=dict)

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


def rows_of(connection: Connection, part: Part, chosen: Any) -> Iterator[tuple[int, CopiedRow]]:
    """Read the rows of a part that meet a condition, in the order of storage.

    Each comes with the row of its valve.
    """
    query = sa.select(part.table).where(chosen).order_by(*part.order)
    if "settings_id" in part.table.c:
        content = tables.settings.c.content.label("settings")
        query = query.add_columns(content).select_from(joined(part.table, tables.settings))
    for rows in connection.execute(query).mappings().partitions(_MANY):
        children = _children(connection, part, rows)
        for row in rows:
            key = tuple(row[name] for name in part.key)
            values = {name: one for name, one in row.items() if name not in _OWN}
            of_row = children[row["id"]] if part.children else {}
            yield row["valve_id"], CopiedRow(key, values, of_row)


def _children(
    connection: Connection, part: Part, rows: Sequence[RowMapping]
) -> dict[int, dict[str, list[dict[str, Any]]]]:
    """Return the children of rows, by row and table."""
    found: defaultdict[int, dict[str, list[dict[str, Any]]]] = defaultdict(
        lambda: {table.name: [] for table in part.children}
    )
    for table in part.children:
        of_rows = table.c[part.owner].in_([row["id"] for row in rows])
        for row in connection.execute(sa.select(table).where(of_rows)).mappings():
            values = dict(row)
            found[values.pop(part.owner)][table.name].append(values)
    return found


def write_rows(connection: Connection, part: Part, rows: Sequence[tuple[int, CopiedRow]]) -> None:
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
    put(connection, part.table, written, is_kept=part.is_kept)
    if not part.children:
        return
    table, (name,) = part.table, part.key
    query = sa.select(table.c.id, table.c.valve_id, table.c[name]).where(
        table.c.valve_id.in_({valve for valve, _ in rows}),
        table.c[name].in_([row.key[0] for _, row in rows]),
    )
    ids = {(valve, key): number for number, valve, key in connection.execute(query)}
    for child in part.children:
        of_rows = [
            {part.owner: ids[valve, row.key[0]], **values}
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
    source: Place,
    target: Place,
    valves: Sequence[str] | None = None,
    tell: Callable[[int], object] = lambda _: None,
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
    tell : callable, optional
        Called with the number of rows written so far.

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
        raise HistoryError(f"{target}: is both ends of the copy: name another one")
    with _source(source) as place, reading(place) as old:
        wanted = sorted(
            (KeptValve(row.name, row.tag), row.id)
            for row in old.execute(sa.select(tables.valve))
            if valves is None or row.name in valves
        )
        with writing(target) as new:
            pairs = [(here, valve_id(new, one)) for one, here in wanted]
        job = _Job(old, target, tell)
        return tuple(job.copy(part, pairs) for part in PARTS)


def _total(sums: Sequence[bytes]) -> str:
    return hashlib.sha256(b"".join(sorted(sums))).hexdigest()


class _Job:
    """Copies one part after another."""

    def __init__(self, old: Connection, target: Place, tell: Callable[[int], object]) -> None:
        self._old, self._target, self._tell = old, target, tell
        self._written = 0

    def copy(self, part: Part, pairs: Sequence[tuple[int, int]]) -> CopiedPart:
        """Copy the rows of valves, each given by its row in either history."""
        before, sums = self._sums(part, pairs), dict[tuple[int, Key], bytes]()
        begun, waiting = self._written, list[tuple[int, CopiedRow]]()
        for here, there in pairs:
            for _, row in rows_of(self._old, part, part.table.c.valve_id == here):
                sums[there, row.key] = row.checksum
                if before.get((there, row.key)) != row.checksum:
                    waiting.append((there, row))
                if len(waiting) >= _MANY:
                    self._write(part, waiting)
        self._write(part, waiting)
        after = self._sums(part, pairs) if self._written > begun else before
        found = {key: after[key] for key in sums if key in after}
        return CopiedPart(
            part.name,
            len(sums),
            self._written - begun,
            sum(found.get(key) == one for key, one in sums.items()),
            _total([*sums.values()]),
            _total([*found.values()]),
        )

    def _sums(self, part: Part, pairs: Sequence[tuple[int, int]]) -> dict[tuple[int, Key], bytes]:
        """Return the checksums of the target's rows, by valve and key."""
        with reading(self._target) as new:
            return {
                (there, row.key): row.checksum
                for _, there in pairs
                for _, row in rows_of(new, part, part.table.c.valve_id == there)
            }

    def _write(self, part: Part, waiting: list[tuple[int, CopiedRow]]) -> None:
        if waiting:
            with writing(self._target) as new:
                write_rows(new, part, waiting)
            self._written += len(waiting)
            self._tell(self._written)
            waiting.clear()
