# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The results of many identifications: kept in SQLite, counted, written as CSV, JSON, a page."""

import contextlib
import csv
import io
import json
import math
import re
import sqlite3
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from functools import partial
from itertools import groupby
from pathlib import Path
from types import TracebackType
from typing import NamedTuple
from urllib.parse import quote

from valve_friction_ros import __version__
from valve_friction_ros.fleet.rows import (
    COLUMNS,
    HEIGHT,
    PICTURE,
    WIDTH,
    Cell,
    RowStatus,
    ranked,
    status_of,
)
from valve_friction_ros.outside_text import harmless
from valve_friction_ros.page_template import page_environment
from valve_friction_ros.records.whole_file import write_whole
from valve_friction_ros.wording import in_zone, number_and_width, percentage

_Row = Mapping[str, Cell]
_KEPT = (*COLUMNS, PICTURE)


@dataclass(frozen=True, eq=False)
class RecordingRows:
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
    output's name is its format; `zone` is that of the times on its page.

    Raises ValueError if an output or the database is another program's, or the database cannot be
    opened.
    """

    def __init__(self, path: Path, *others: Path, zone: str = "") -> None:
        self.path = path
        self._outputs = {output: writer_of(output, zone) for output in (path, *others)}
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
        found = [row[1] for row in self._connection.execute("PRAGMA table_info(result)")]
        if set(found) - set(_KEPT):
            raise ValueError(f"{self._database}: results of another version: give another output")
        for name in _KEPT:
            if name not in found:  # of a column that an earlier version did not have
                self._connection.execute(f"ALTER TABLE result ADD COLUMN {name}")
        self._connection.commit()

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
            query = f"SELECT {', '.join(_KEPT)} FROM result ORDER BY rowid"  # noqa: S608 - own names
            for cells in self._connection.execute(query):
                yield dict(zip(_KEPT, cells, strict=True))

    def _write_outputs(self) -> None:
        """Replace each output as a whole."""
        for output, write in self._outputs.items():
            write_whole(output, write(self._rows(), output).encode())

    def entries(self) -> Iterator[RecordingRows]:
        """Go through the recordings."""
        for recording, group in groupby(self._rows(), lambda row: str(row["recording"])):
            rows = tuple(group)
            yield RecordingRows(recording, str(rows[0]["content"]), str(rows[0]["settings"]), rows)

    def keep(self, wanted: Callable[[RecordingRows], bool]) -> int:
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
            self._connection.executemany(
                f"INSERT INTO result ({', '.join(_KEPT)}) VALUES ({marks})",  # noqa: S608
                cells,
            )


REFUSED = "refused"

_NUMBER = re.compile(r"[-+−]?\b\d+(?:[.,]\d+)*(?:e[-+]?\d+)?")


_QUOTED = re.compile(r"'[^']*'")


def reason_of(error: str) -> str:
    """Return the reason of a refusal without the numbers and names that are its own."""
    return _NUMBER.sub("…", _QUOTED.sub("'…'", error))


@dataclass(frozen=True)
class Reason:
    """A reason of refusals, its numbers left open; its count of valves and its first recording."""

    text: str
    count: int
    example: str


@dataclass
class Tally:
    """Counts of valves: by the verdict on their Coulomb friction, or `REFUSED`."""

    outcomes: Counter[str] = field(default_factory=Counter)
    _reasons: Counter[str] = field(default_factory=Counter)
    _examples: dict[str, str] = field(default_factory=dict)

    def add(self, recording: str, verdict: Cell, error: Cell) -> None:
        """Count a valve by the verdict on its Coulomb friction, or by its error."""
        if not error:
            self.outcomes[str(verdict)] += 1
            return
        self.outcomes[REFUSED] += 1
        reason = reason_of(str(error))
        self._reasons[reason] += 1
        self._examples.setdefault(reason, recording)

    def reasons(self) -> list[Reason]:
        """Return the reasons of refusals, the most frequent first."""
        return [
            Reason(text, count, self._examples[text]) for text, count in self._reasons.most_common()
        ]


def tally(entries: Iterable[RecordingRows]) -> Tally:
    """Count the valves of all entries."""
    found = Tally()
    for entry in entries:
        for row in entry.rows:
            found.add(entry.recording, row["coulomb_friction_verdict"], row["error"])
    return found


_Rows = Iterable[Mapping[str, Cell]]


def _csv(rows: _Rows, _: Path) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows([harmless(row[column]) for column in COLUMNS] for row in rows)
    return text.getvalue()


def _json_lines(rows: _Rows, _: Path) -> str:
    shown = ({column: row[column] for column in COLUMNS} for row in rows)
    return "".join(json.dumps(row, ensure_ascii=False, allow_nan=False) + "\n" for row in shown)


def _page(rows: _Rows, output: Path, zone: str = "") -> str:
    return page_text(rows, output.stem, zone)


_WRITERS: Mapping[str, Callable[[_Rows, Path], str]] = {
    ".csv": _csv,
    ".jsonl": _json_lines,
    ".html": _page,
}


def is_page(output: Path) -> bool:
    """Return whether an output is the page for people."""
    return output.suffix.lower() == ".html"


def writer_of(output: Path, zone: str = "") -> Callable[[_Rows, Path], str]:
    """Return what writes rows in the format that the name of the output ends in.

    It takes the rows and the output, and returns the text. Raises ValueError if the ending is not
    known; the message lists the known ones.
    """
    known = _WRITERS.get(output.suffix.lower())
    if known is None:
        raise ValueError(f"{output}: the output must end in {', '.join(_WRITERS)}")
    return partial(_page, zone=zone) if is_page(output) else known


class _Number(NamedTuple):
    """A cell: its text, and what it is sorted by; an empty one comes last."""

    text: str = ""
    detail: str = ""
    key: float = -math.inf


class _Line(NamedTuple):
    """A valve on the page, all of it text."""

    status: RowStatus
    name: str
    recording: str
    began: str
    points: str
    ratio: _Number
    dead_band: _Number
    sliding: _Number
    coulomb: _Number
    to_do: str
    finding: str
    report: str


def _with_width(row: _Row, name: str) -> _Number:
    value, width = row[f"{name}_n"], row[f"{name}_half_width_n"]
    if not isinstance(value, (int, float)):
        return _Number()
    number, known = number_and_width(value, width if isinstance(width, (int, float)) else math.nan)
    return _Number(number, f"{known} N".strip(), value)


def _ratio(row: _Row) -> _Number:
    ratio, low, high = row["ratio"], row["ratio_low"], row["ratio_high"]
    if not isinstance(ratio, (int, float)):
        return _Number()
    is_known = isinstance(low, (int, float)) and isinstance(high, (int, float))
    return _Number(f"{ratio:.2f}", f"{low:.2f} to {high:.2f}" if is_known else "", ratio)


def _dead_band(row: _Row) -> _Number:
    share = row["dead_band_of_travel"]
    if not isinstance(share, (int, float)):
        return _Number()
    return _Number(percentage(share), "of travel", share)


def _began(text: str, zone: str) -> str:
    """Return when a record began, in words, in a zone."""
    return in_zone(datetime.fromisoformat(text.replace("Z", "+00:00")), zone) if text else ""


def _line(row: _Row, zone: str) -> _Line:
    def text(name: str) -> str:
        return str(row.get(name) or "")

    return _Line(
        status_of(row),
        text("valve") or text("recording"),
        text("recording") if text("valve") else "",
        _began(text("began"), zone),
        text(PICTURE),
        _ratio(row),
        _dead_band(row),
        _with_width(row, "sliding_friction"),
        _with_width(row, "coulomb_friction"),
        text("what_to_do"),
        text("error") or "; ".join(filter(None, (text("message"), text("findings")))),
        quote(text("report")),
    )


def page_text(rows: Iterable[_Row], name: str, zone: str = "") -> str:
    """Return the page of the rows as one HTML file, which needs no network.

    A valve is called by its tag where it is known; times are those of `zone`, or UTC. Its
    table is sorted by `ranked`, and by any of its columns at a click.
    """
    lines = [_line(row, zone) for row in ranked(rows)]
    return (
        page_environment("valve_friction_ros.fleet")
        .get_template("page.html")
        .render(
            name=name,
            lines=lines,
            counts=Counter(line.status for line in lines),
            size=(WIDTH, HEIGHT),
            made=in_zone(datetime.now(timezone.utc), zone),
            version=__version__,
        )
    )
