"""The results of many identifications: kept in SQLite, written out in the formats asked for."""

import contextlib
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from types import TracebackType

from valve_friction_ros.fleet.outputs import writer_of
from valve_friction_ros.fleet.row import COLUMNS, PICTURE, Cell
from valve_friction_ros.records.whole_file import write_whole

__all__ = ["Entry", "ResultsFile", "database_of", "reports_of"]

_Row = Mapping[str, Cell]
_KEPT = (*COLUMNS, PICTURE)


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


def database_of(output: Path) -> Path:
    """Return the file in which the rows of an output are kept, beside it: ``NAME.sqlite``."""
    return output.resolve().with_suffix(".sqlite")


def reports_of(output: Path) -> Path:
    """Return the folder of the reports of an output, beside it: ``NAME_reports``."""
    return output.resolve().with_name(f"{output.resolve().stem}_reports")


class ResultsFile:
    """Rows that are on the disk when `append` returns; leaving the context writes the outputs.

    They are kept in the table ``result`` of `database_of` the first output, in its columns and in
    the order in which they were appended. Only one process at a time can open it. The ending of an
    output's name is its format.

    Raises ValueError if an output or the database is another program's, or the database cannot be
    opened.
    """

    def __init__(self, path: Path, *others: Path) -> None:
        self.path = path
        self._outputs = {output: writer_of(output) for output in (path, *others)}
        self._database = database_of(path)
        for output in self._outputs:
            if output.is_file() and not self._database.exists():
                raise ValueError(
                    f"{output}: it is there, but not {self._database.name}, which it would have "
                    "been written from: give another output, or move the file away"
                )
        with self._explained():
            self._connection = sqlite3.connect(self._database, timeout=0)
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
            f"CREATE TABLE IF NOT EXISTS result ({', '.join(_KEPT)}, "
            "PRIMARY KEY (recording, valve))"
        )
        self._connection.commit()
        found = self._connection.execute("SELECT * FROM result LIMIT 0").description
        if tuple(name for name, *_ in found) != _KEPT:
            raise ValueError(f"{self._database}: results of another version: give another output")

    def __enter__(self) -> "ResultsFile":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Write the outputs and close the database."""
        try:
            self._write_outputs()
        finally:
            self._connection.close()

    @contextlib.contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            locked = "another run is writing it: wait for its end"
            cause = locked if "locked" in str(error) else str(error)
            raise ValueError(f"{self._database}: {cause}") from None

    def _rows(self) -> Iterator[_Row]:
        with self._explained():
            for cells in self._connection.execute("SELECT * FROM result ORDER BY rowid"):
                yield dict(zip(_KEPT, cells, strict=True))

    def _write_outputs(self) -> None:
        """Replace each output as a whole."""
        for output, write in self._outputs.items():
            write_whole(output, write(self._rows(), output).encode())

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
        marks = ", ".join("?" * len(_KEPT))
        cells = [[row.get(column) for column in _KEPT] for row in rows]
        with self._explained(), self._connection:
            self._connection.executemany(f"INSERT INTO result VALUES ({marks})", cells)  # noqa: S608
