# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Results of many identifications: stored in SQLite, counted, written as CSV, JSON or HTML."""

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
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.outside_text import csv_text, page_environment
from valve_friction_ros.records.files import write_whole
from valve_friction_ros.wording import in_zone, number_and_width, numbered, percentage

_Row = Mapping[str, Cell]
_KEPT = (*COLUMNS, PICTURE)


@dataclass(frozen=True, eq=False)
class RecordingRows:
    """All rows of one recording, one per valve.

    `content` and `settings` are fingerprints of its files and of its identification options.
    """

    recording: str
    content: str
    settings: str
    rows: tuple[_Row, ...]

    @property
    def refused(self) -> bool:
        """True if all valves were refused."""
        return all(row["error"] for row in self.rows)


def database_of(output: Path) -> Path:
    """Return the database with the rows of an output, in the same folder: ``NAME.sqlite``."""
    return output.resolve().with_suffix(".sqlite")


def reports_of(output: Path) -> Path:
    """Return the folder for the reports of an output, in the same folder: ``NAME_reports``."""
    return output.resolve().with_name(f"{output.resolve().stem}_reports")


class ResultsFile(contextlib.AbstractContextManager["ResultsFile"]):
    """Rows that are on disk when `append` returns; leaving the context writes the outputs.

    The rows are in the table ``result`` of the database of the first output (`database_of`), in the
    order in which they were appended. Only one process at a time can open it. The ending of an
    output gives its format; `zone` is the time zone of its page.

    Raises ValueError if an output or the database belongs to another program, or the database
    cannot be opened.
    """

    def __init__(self, path: Path, *others: Path, zone: str = "") -> None:
        self.path = path
        self._zone = zone
        self._outputs = {output: writer_of(output) for output in (path, *others)}
        self._database = database_of(path)
        for output in self._outputs:
            if output.is_file() and not self._database.exists():
                raise ValueError(
                    f"{output}: it exists, but {self._database.name}, which holds its rows, does "
                    "not: use another output, or move the file away"
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
        self._connection.execute("PRAGMA journal_mode = WAL")  # one disk flush per recording
        self._connection.execute("PRAGMA synchronous = FULL")
        self._connection.execute("BEGIN EXCLUSIVE")
        self._connection.execute(
            f"CREATE TABLE IF NOT EXISTS result ({', '.join(_KEPT)}, "
            "PRIMARY KEY (recording, valve))"
        )
        self._connection.commit()
        found = [row[1] for row in self._connection.execute("PRAGMA table_info(result)")]
        if set(found) - set(_KEPT):
            raise ValueError(f"{self._database}: results of another version: use another output")
        for name in _KEPT:
            if name not in found:  # a column that an earlier version did not have
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
            locked = "another run is writing it: wait until it finishes"
            cause = locked if "locked" in str(error) else str(error)
            raise ValueError(f"{self._database}: {cause}") from None

    def _rows(self) -> Iterator[_Row]:
        with self._explained():
            query = f"SELECT {', '.join(_KEPT)} FROM result ORDER BY rowid"  # noqa: S608 - own names
            for cells in self._connection.execute(query):
                yield dict(zip(_KEPT, cells, strict=True))

    def entries(self) -> Iterator[RecordingRows]:
        """Yield the rows of each recording."""
        for recording, group in groupby(self._rows(), lambda row: str(row["recording"])):
            rows = tuple(group)
            yield RecordingRows(recording, str(rows[0]["content"]), str(rows[0]["settings"]), rows)

    def keep(self, wanted: Callable[[RecordingRows], bool]) -> int:
        """Drop the entries that are not wanted, in one transaction; return their number."""
        dropped = [(entry.recording,) for entry in self.entries() if not wanted(entry)]
        with self._explained(), self._connection:
            self._connection.executemany("DELETE FROM result WHERE recording = ?", dropped)
        return len(dropped)

    def append(self, rows: Sequence[_Row]) -> None:
        """Add the rows of a recording in one transaction; they are on disk on return."""
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
    """Return the reason of a refusal with its own numbers and names masked."""
    return _NUMBER.sub("…", _QUOTED.sub("'…'", error))


class Tally(NamedTuple):
    """Numbers of valves by the verdict on their Coulomb friction, or `REFUSED`.

    The `reasons` (`reason_of`) come with the recordings of the refused valves, the most frequent
    reason first.
    """

    outcomes: Counter[str]
    reasons: Mapping[str, Sequence[str]]


def tally(entries: Iterable[RecordingRows]) -> Tally:
    """Count the records of all entries, by the verdict on the friction that is compared."""
    outcomes: Counter[str] = Counter()
    reasons: dict[str, list[str]] = {}
    for entry in entries:
        for row in entry.rows:
            verdict = row[f"{SLIDING}_verdict"] or row["coulomb_friction_verdict"]
            outcomes[REFUSED if row["error"] else str(verdict)] += 1
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
    """Return whether an output is the HTML page."""
    return output.suffix.lower() == ".html"


def writer_of(output: Path) -> Callable[[Iterable[_Row], Path, str], str]:
    """Return the function that writes rows in the format given by the ending of the output.

    It takes the rows, the output and the time zone of the page, and returns the text. Raises
    ValueError if the ending is unknown; the message lists the known endings.
    """
    known = _WRITERS.get(output.suffix.lower())
    if known is None:
        raise ValueError(f"{output}: the output must end in {', '.join(_WRITERS)}")
    return known


class _Number(NamedTuple):
    """A cell: its text and its sort key; an empty cell is sorted last."""

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
    """Return the line of a valve on the page, with times in `zone`."""

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
    """Return the page of the rows as one HTML file that needs no network.

    A valve appears under its tag if known. Times are in `zone`, or UTC. The table is sorted by
    `ranked`, and by any column at a click.
    """
    lines = [_line(row, zone) for row in ranked(rows)]
    tagged = {line["name"] for line in lines if line["recording"]}
    others = [line for line in lines if not line["recording"]]
    # beside tags, a refused recording without one is no further valve
    valves = len(tagged) + sum(not tagged or one["status"].word != "refused" for one in others)
    subject = numbered(valves, "valve")
    if valves < len(lines):
        subject += f" in {len(lines)} recordings"
    return (
        page_environment("valve_friction_ros.fleet")
        .get_template("page.html")
        .render(
            name=name,
            subject=subject,
            lines=lines,
            counts=Counter(line["status"] for line in lines),
            size=(WIDTH, HEIGHT),
            made=in_zone(datetime.now(timezone.utc), zone),
            version=__version__,
        )
    )
