"""The results of many identifications: kept in SQLite, written out as CSV or JSON lines."""

import contextlib
import csv
import json
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from types import TracebackType
from typing import TextIO

from valve_friction_ros.fleet.row import COLUMNS, Cell

__all__ = ["Entry", "ResultsFile", "database_of", "writer_of"]

_Row = Mapping[str, Cell]


@dataclass(frozen=True, eq=False)
class Entry:
    """All rows of one recording, one for each valve.

    `content` and `settings` are fingerprints of its files and of the options of its identification.
    """

    recording: str
    content: str
    settings: str
    rows: tuple[_Row, ...]

    @property
    def failed(self) -> bool:
        """True if a valve of it was refused."""
        return any(row["error"] for row in self.rows)

    @property
    def refused(self) -> bool:
        """True if all valves of it were refused."""
        return all(row["error"] for row in self.rows)


def _write_csv(stream: TextIO, rows: Iterable[_Row]) -> None:
    writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)


def _write_json_lines(stream: TextIO, rows: Iterable[_Row]) -> None:
    for row in rows:
        stream.write(json.dumps(row, ensure_ascii=False, allow_nan=False) + "\n")


_WRITERS = {".csv": _write_csv, ".jsonl": _write_json_lines}


def writer_of(output: Path) -> Callable[[TextIO, Iterable[_Row]], None]:
    """Return what writes rows in the format that the name of the output ends in.

    Raises ValueError if it is not known; the message lists the known ones.
    """
    known = _WRITERS.get(output.suffix.lower())
    if known is None:
        raise ValueError(f"{output}: the output must end in {' or '.join(_WRITERS)}")
    return known


def database_of(output: Path) -> Path:
    """Return the file in which the rows of an output are kept, beside it."""
    place = output.resolve()
    return place.with_name(f"{place.name}.sqlite")


class ResultsFile:
    """Rows that are on the disk when `append` returns; leaving the context writes the output.

    They are kept in the table ``result`` of `database_of` the output, in its columns and in the
    order in which they were appended. Only one process at a time can open it. The ending of the
    output's name is its format.

    Raises ValueError if the output or its database is another program's, or the database cannot be
    opened.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._write = writer_of(path)
        database = database_of(path)
        if path.exists() and not database.exists():
            raise ValueError(
                f"{path}: it is there, but not {database.name}, which it would have been written "
                "from: give another output, or move the file away"
            )
        with self._explained():
            self._connection = sqlite3.connect(database, timeout=0)
            try:
                self._open()
            except BaseException:
                self._connection.close()
                raise

    def _open(self) -> None:
        """Lock the database for this process, and check that it holds results of this version."""
        self._connection.execute("PRAGMA locking_mode = EXCLUSIVE")
        self._connection.execute("PRAGMA journal_mode = WAL")  # one flush of the disk a recording
        self._connection.execute("PRAGMA synchronous = FULL")
        self._connection.execute("BEGIN EXCLUSIVE")
        self._connection.execute(
            f"CREATE TABLE IF NOT EXISTS result ({', '.join(COLUMNS)}, "
            "PRIMARY KEY (recording, valve))"
        )
        self._connection.commit()
        found = self._connection.execute("SELECT * FROM result LIMIT 0").description
        if tuple(name for name, *_ in found) != COLUMNS:
            raise ValueError(f"{self.path}: results of another version: give another output")

    def __enter__(self) -> "ResultsFile":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Write the output and close the database."""
        try:
            self._write_output()
        finally:
            self._connection.close()

    @contextlib.contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            locked = "another run is writing it: wait for its end"
            cause = locked if "locked" in str(error) else str(error)
            raise ValueError(f"{database_of(self.path)}: {cause}") from None

    def _rows(self) -> Iterator[_Row]:
        with self._explained():
            for cells in self._connection.execute("SELECT * FROM result ORDER BY rowid"):
                yield dict(zip(COLUMNS, cells, strict=True))

    def _write_output(self) -> None:
        """Replace the output as a whole."""
        place = self.path.resolve()
        draft = place.with_name(f".{place.name}.draft")
        with draft.open("w", encoding="utf-8", newline="") as stream:
            self._write(stream, self._rows())
        draft.replace(place)

    def entries(self) -> Iterator[Entry]:
        """Go through the recordings."""
        for recording, group in groupby(self._rows(), lambda row: str(row["recording"])):
            rows = tuple(group)
            yield Entry(recording, str(rows[0]["content"]), str(rows[0]["settings"]), rows)

    def keep(self, wanted: Callable[[Entry], bool]) -> int:
        """Drop the entries that are not wanted, all at once; return their number."""
        dropped = [(entry.recording,) for entry in self.entries() if not wanted(entry)]
        with self._explained(), self._connection:
            self._connection.executemany("DELETE FROM result WHERE recording = ?", dropped)
        return len(dropped)

    def append(self, rows: Sequence[_Row]) -> None:
        """Add the rows of a recording, all at once; they are on the disk on return."""
        marks = ", ".join("?" * len(COLUMNS))
        cells = [[row.get(column) for column in COLUMNS] for row in rows]
        with self._explained(), self._connection:
            self._connection.executemany(f"INSERT INTO result VALUES ({marks})", cells)  # noqa: S608
