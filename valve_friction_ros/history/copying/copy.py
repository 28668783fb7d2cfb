"""A copy of one history to another: resumed where it ended, and verified."""

import contextlib
import hashlib
import sqlite3
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from valve_friction_ros.history.connection import Connection
from valve_friction_ros.history.copying.copied_rows import CopiedRow, Key, rows_of, write_rows
from valve_friction_ros.history.copying.parts import PARTS, Part
from valve_friction_ros.history.entry import KeptValve
from valve_friction_ros.history.errors import HistoryError
from valve_friction_ros.history.rows import valve_id
from valve_friction_ros.history.schema import (
    Place,
    is_current,
    reading,
    server_connection,
    writing,
)
from valve_friction_ros.history.server.address import HistoryServer

__all__ = ["CopiedPart", "copied", "is_there"]

_MANY = 500
"""Rows that are written in one transaction."""


class CopiedPart(NamedTuple):
    """Rows of a table after a copy.

    Attributes
    ----------
    table : str
        The table; what belongs to its rows counts with them.
    rows : int
        Rows of the copied valves in the first history.
    written : int
        Those that the second one lacked, or had otherwise.
    same : int
        Those that are in the second one now with the same checksum.
    checksum : str
        Sum over all rows in the first one, and in `copied` over the same rows of the second one.
    """

    table: str
    rows: int
    written: int
    same: int
    checksum: str
    copied: str

    @property
    def is_same(self) -> bool:
        """Whether each row of the first one is in the second one as it is there."""
        return self.rows == self.same and self.checksum == self.copied


def is_there(place: Place) -> bool:
    """Return whether a history is there, and can be read."""
    try:
        with reading(place):
            return True
    except HistoryError:
        return False


@contextlib.contextmanager
def _source(place: Place) -> Iterator[Place]:
    """Give a history of this version: a file of an older one is copied aside, and stays as it is.

    The keys that its rows get are the same each time.
    """
    if isinstance(place, HistoryServer) or is_current(place):
        yield place
        return
    with tempfile.TemporaryDirectory() as folder, reading(place) as old:
        path = Path(folder) / "history.sqlite"
        if not isinstance(old, sqlite3.Connection):
            raise TypeError(place)
        with contextlib.closing(sqlite3.connect(path)) as new:
            old.backup(new)
        with writing(path):
            pass
        yield path


_Begin = Callable[[], contextlib.AbstractContextManager[Connection]]
"""What begins a transaction."""


@contextlib.contextmanager
def _changing(place: Place) -> Iterator[_Begin]:
    """Give what begins a transaction to write to a history, which is made if it is missing."""
    if not isinstance(place, HistoryServer):
        yield lambda: writing(place)
        return
    with server_connection(place) as connection:
        yield connection.transaction


def copied(
    source: Place,
    target: Place,
    valves: Sequence[str] | None = None,
    tell: Callable[[int], object] = lambda _: None,
) -> tuple[CopiedPart, ...]:
    """Copy a history to another one, all valves or some, and compare the two.

    Only rows that the other one lacks are written, so a copy that has ended early goes on where it
    was. Rows of other valves, and of the same valves from elsewhere, stay there.

    Parameters
    ----------
    source, target : Path or HistoryServer
        From where, and to where.
    valves : sequence of str, optional
        Names of identifiers.
    tell : callable, optional
        Is given the number of rows written so far.

    Returns
    -------
    tuple of CopiedPart
        A line for each table.

    Raises
    ------
    HistoryError
        If one of them cannot be read, or the second one cannot be written.
    """
    if source == target:
        raise HistoryError(f"{target}: is both ends of the copy: name another one")
    with _source(source) as place, reading(place) as old, _changing(target) as begin:
        wanted = _valves(old, valves)
        with begin() as new:
            numbers = {one.name: valve_id(new, one) for one in wanted}
        pairs = [(_number(old, name), number) for name, number in numbers.items()]
        job = _Job(old, target, begin, tell)
        return tuple(job.copy(part, pairs) for part in PARTS)


def _valves(connection: Connection, names: Sequence[str] | None) -> list[KeptValve]:
    rows = connection.execute("SELECT name, tag FROM valve").fetchall()
    found = sorted(KeptValve(*row) for row in rows)
    return [one for one in found if names is None or one.name in names]


def _number(connection: Connection, name: str) -> int:
    (number,) = connection.execute("SELECT id FROM valve WHERE name = ?", (name,)).fetchone()
    return int(number)


def _total(sums: Sequence[bytes]) -> str:
    return hashlib.sha256(b"".join(sorted(sums))).hexdigest()


class _Job:
    """The copy of one part after the other."""

    def __init__(
        self, old: Connection, target: Place, begin: _Begin, tell: Callable[[int], object]
    ) -> None:
        self._old, self._target, self._begin, self._tell = old, target, begin, tell
        self._written = 0

    def copy(self, part: Part, pairs: Sequence[tuple[int, int]]) -> CopiedPart:
        """Copy the rows of valves, each given by its rows in the two histories."""
        before, sums = self._sums(part, pairs), dict[tuple[int, Key], bytes]()
        begun, waiting = self._written, list[tuple[int, CopiedRow]]()
        for here, there in pairs:
            for row in rows_of(self._old, part, here):
                sums[there, row.key] = row.checksum
                if before.get((there, row.key)) != row.checksum:
                    waiting.append((there, row))
                if len(waiting) >= _MANY:
                    self._write(part, waiting)
        self._write(part, waiting)
        after = self._sums(part, pairs) if self._written > begun else before
        found = {key: after[key] for key in sums if key in after}
        return CopiedPart(
            part.table,
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
                for row in rows_of(new, part, there)
            }

    def _write(self, part: Part, waiting: list[tuple[int, CopiedRow]]) -> None:
        if waiting:
            with self._begin() as new:
                write_rows(new, part, waiting)
            self._written += len(waiting)
            self._tell(self._written)
            waiting.clear()
