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
import json
import math
import re
import sqlite3
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from valve_friction_ros import __version__
from valve_friction_ros.fleet.rows import COLUMNS, HEIGHT, PICTURE, WIDTH, Cell, ranked, status_of
from valve_friction_ros.outside_text import csv_text
from valve_friction_ros.page_template import page_environment
from valve_friction_ros.records.files import write_whole
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


class ResultsFile(contextlib.AbstractContextManager["ResultsFile"]):
    """Rows that are on the disk when `append` returns; leaving the context writes the outputs.

    They are kept in the table ``result`` of `database_of` the first output, in its columns and in
    the order in which they were appended. Only one process at a time can open it. The ending of an
    output's name is its format; `zone` is that of the times on its page.

    Raises ValueError if an output or the database is another program's, or the database cannot be
    opened.
    """

    def __init__(self, path: Path, *others: Path, zone: str = "") -> None:
        self.path = path
        self._zone = zone
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
        found = [row[1] for row in self._connection.execute("PRAGMA table_info(result)")]
        if set(found) - set(_KEPT):
            raise ValueError(f"{self._database}: results of another version: give another output")
        for name in _KEPT:
            if name not in found:  # of a column that an earlier version did not have
                self._connection.execute(f"ALTER TABLE result ADD COLUMN {name}")
        self._connection.commit()

    def __exit__(self, *_: object) -> None:
        """Write the outputs and close the database."""
        try:
            for output, write in self._outputs.items():
                write_whole(output, write(self._rows(), output, self._zone).encode())
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


class Tally(NamedTuple):
    """Counts of valves, and why some were refused.

    Attributes
    ----------
    outcomes : Counter of str
        Valves by the verdict on their Coulomb friction, or `REFUSED`.
    reasons : mapping of str to sequence of str
        The recording of each refused valve by `reason_of` its error, the most frequent first.
    """

    outcomes: Counter[str]
    reasons: Mapping[str, Sequence[str]]


def tally(entries: Iterable[RecordingRows]) -> Tally:
    """Count the valves of all entries."""
    outcomes: Counter[str] = Counter()
    reasons: dict[str, list[str]] = {}
    for entry in entries:
        for row in entry.rows:
            outcomes[REFUSED if row["error"] else str(row["coulomb_friction_verdict"])] += 1
            if row["error"]:
                reasons.setdefault(reason_of(str(row["error"])), []).append(entry.recording)
    return Tally(outcomes, dict(sorted(reasons.items(), key=lambda one: -len(one[1]))))


def _json_lines(rows: Iterable[_Row]) -> str:
    shown = ({column: row[column] for column in COLUMNS} for row in rows)
    return "".join(json.dumps(row, ensure_ascii=False, allow_nan=False) + "\n" for row in shown)


_WRITERS: Mapping[str, Callable[[Iterable[_Row], Path, str], str]] = {
    ".csv": lambda rows, _output, _zone: csv_text(COLUMNS, rows),
    ".jsonl": lambda rows, _output, _zone: _json_lines(rows),
    ".html": lambda rows, output, zone: page_text(rows, output.stem, zone),
}


def is_page(output: Path) -> bool:
    """Return whether an output is the page for people."""
    return output.suffix.lower() == ".html"


def writer_of(output: Path) -> Callable[[Iterable[_Row], Path, str], str]:
    """Return what writes rows in the format that the name of the output ends in.

    It takes the rows, the output, and the zone of times that people read, and returns the text.
    Raises ValueError if the ending is not known; the message lists the known ones.
    """
    known = _WRITERS.get(output.suffix.lower())
    if known is None:
        raise ValueError(f"{output}: the output must end in {', '.join(_WRITERS)}")
    return known


class _Number(NamedTuple):
    """A cell: its text, and what it is sorted by; an empty one comes last."""

    text: str = ""
    detail: str = ""
    key: float = -math.inf


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


def _line(row: _Row, zone: str) -> dict[str, Any]:
    """Return what the page shows of a valve, with times in a zone."""

    def text(name: str) -> str:
        return str(row.get(name) or "")

    began = text("began").replace("Z", "+00:00")
    return {
        "status": status_of(row),
        "name": text("valve") or text("recording"),
        "recording": text("recording") if text("valve") else "",
        "began": in_zone(datetime.fromisoformat(began), zone) if began else "",
        "points": text(PICTURE),
        "ratio": _ratio(row),
        "dead_band": _dead_band(row),
        "sliding": _with_width(row, "sliding_friction"),
        "coulomb": _with_width(row, "coulomb_friction"),
        "to_do": text("what_to_do"),
        "finding": "; ".join(filter(None, map(text, ("message", "findings", "error")))),
        "report": quote(text("report")),
    }


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
            counts=Counter(line["status"] for line in lines),
            size=(WIDTH, HEIGHT),
            made=in_zone(datetime.now(timezone.utc), zone),
            version=__version__,
        )
    )
