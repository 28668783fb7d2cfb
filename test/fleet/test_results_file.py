# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The results: rows survive a kill, none is lost or doubled, the output holds them all."""

import csv
import json
import math
import signal
import sqlite3
import subprocess
import sys
import tempfile
from html.parser import HTMLParser
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from valve_friction_ros.fleet import ResultsFile
from valve_friction_ros.fleet.results_file import database_of, page_text
from valve_friction_ros.fleet.rows import (
    COLUMNS,
    HEIGHT,
    PAGE,
    WIDTH,
    error_cells,
    ranked,
    reaches,
    report_name,
    signature_points,
    status_of,
    with_reports_written,
)
from valve_friction_ros.health import Level
from valve_friction_ros.model import Recording
from valve_friction_ros.outside_text import as_read

TEXTS = st.text(
    st.characters(categories=("L", "N", "P", "S", "Zs")), max_size=20
) | st.sampled_from(["=1+1", "+1", "-1", "@a", "'=1", "''=1", "'"])
FLEETS = st.lists(st.tuples(st.integers(1, 3), TEXTS), min_size=1, max_size=5)
ENDINGS = st.sampled_from([".csv", ".jsonl"])
A_FEW = settings(max_examples=25, deadline=None)  # each of them flushes a disk several times

KILLED = """
import os, signal, sys
from pathlib import Path
from test_results_file import rows_of
from valve_friction_ros.fleet import ResultsFile
results = ResultsFile(Path(sys.argv[1]))
results.append(rows_of(0, 1, "one"))
results.append(rows_of(1, 2, "two"))
results._connection.execute("INSERT INTO result (recording, valve) VALUES ('half', '')")
os.kill(os.getpid(), signal.SIGKILL)
"""


def rows_of(number, valves, text):
    """The rows of a recording: what is in them must not disturb how they are told apart."""
    keys = {"recording": f"{number}, {text}", "content": f"c{number}", "settings": "s"}
    refused = (error_cells(f"/v{n}", text, Path("x")) for n in range(valves))
    return [{**cells, **keys, "valves": valves} for cells in refused]


def recordings_in(results):
    return [(entry.recording, len(entry.rows)) for entry in results.entries()]


def written(path):
    """The rows of an output, an empty cell as None."""
    with path.open(newline="", encoding="utf-8") as stream:
        if path.suffix == ".jsonl":
            return [json.loads(line) for line in stream]
        rows = csv.DictReader(stream)
        assert (*rows.fieldnames,) == COLUMNS
        found = [{name: cell or None for name, cell in row.items()} for row in rows]
    for row in found:
        assert not any(cell and cell[0] in "=+-@\t\r" for cell in row.values())
    return [{name: cell and as_read(cell) for name, cell in row.items()} for row in found]


@A_FEW
@given(FLEETS, ENDINGS, st.data())
def test_closed_and_gone_on_with(fleet, ending, data):
    entries = [rows_of(number, *one) for number, one in enumerate(fleet)]
    part = data.draw(st.integers(0, len(entries)))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"out{ending}")
        for some in (entries[:part], entries[part:]):
            with ResultsFile(path) as results:
                for entry in some:
                    results.append(entry)
        with ResultsFile(path) as results:
            assert recordings_in(results) == [
                (entry[0]["recording"], len(entry)) for entry in entries
            ]
        texts = [{c: row.get(c) or None for c in COLUMNS} for entry in entries for row in entry]
        if ending == ".csv":
            texts = [{c: cell and str(cell) for c, cell in row.items()} for row in texts]
        assert [{c: cell or None for c, cell in row.items()} for row in written(path)] == texts


@A_FEW
@given(FLEETS, ENDINGS, st.data())
def test_what_is_kept_stays_as_it_is(fleet, ending, data):
    entries = [rows_of(number, *one) for number, one in enumerate(fleet)]
    wanted = data.draw(st.lists(st.booleans(), min_size=len(entries), max_size=len(entries)))
    kept = [entry for entry, is_wanted in zip(entries, wanted, strict=True) if is_wanted]
    names = {entry[0]["recording"] for entry in kept}
    with tempfile.TemporaryDirectory() as folder:
        path, expected = Path(folder, f"out{ending}"), Path(folder, f"expected{ending}")
        new = rows_of(9, 2, "new")
        with ResultsFile(path) as results, ResultsFile(expected) as other:
            for entry in entries:
                results.append(entry)
            assert results.keep(lambda entry: entry.recording in names) == wanted.count(False)
            results.append(new)
            for entry in [*kept, new]:
                other.append(entry)
        assert path.read_bytes() == expected.read_bytes()
        outputs = {path, expected}
        assert set(Path(folder).iterdir()) == outputs | {database_of(one) for one in outputs}


def test_numbers_come_back_to_the_last_bit(tmp_path):
    row = rows_of(0, 1, "one")[0] | {"coulomb_friction_n": 0.1 + 0.2, "samples": 2000, "fit": 1.0}
    with ResultsFile(tmp_path / "out.csv", tmp_path / "out.jsonl") as results:
        results.append([row])
    (text,), (number,) = (written(tmp_path / name) for name in ("out.csv", "out.jsonl"))
    assert (number["coulomb_friction_n"], number["fit"]) == (0.1 + 0.2, 1.0)
    assert (text["coulomb_friction_n"], text["samples"], text["fit"]) == (
        "0.30000000000000004",
        "2000",
        "1.0",
    )


def test_a_kill_loses_nothing_finished(tmp_path):
    path = tmp_path / "out.csv"
    killed = subprocess.run(
        [sys.executable, "-c", KILLED, str(path)], cwd=Path(__file__).parent, check=False
    )
    assert killed.returncode == -signal.SIGKILL
    assert not path.exists()
    with ResultsFile(path) as results:
        assert recordings_in(results) == [("0, one", 1), ("1, two", 2)]
    assert [row["recording"] for row in written(path)] == ["0, one", "1, two", "1, two"]


@pytest.mark.parametrize(
    ("name", "content"),
    [("data.csv", "time_s,position_m\n0,1\n"), ("data.csv", ""), ("data.jsonl", '{"a": 1}\n')],
)
def test_the_file_of_another_program_is_left_alone(tmp_path, name, content):
    path = tmp_path / name
    path.write_text(content)
    before = path.stat()
    with pytest.raises(ValueError, match=r"it exists, but data\.sqlite, which holds"):
        ResultsFile(path)
    assert path.read_text() == content
    assert path.stat().st_mtime_ns == before.st_mtime_ns
    assert [*tmp_path.iterdir()] == [path]


def test_another_database_is_left_alone(tmp_path):
    path = tmp_path / "out.csv"
    with sqlite3.connect(database_of(path)) as other:
        other.execute("CREATE TABLE result (name)")
    other.close()
    before = database_of(path).read_bytes()
    with pytest.raises(ValueError, match="results of another version: use another output"):
        ResultsFile(path)
    database_of(path).write_bytes(b"no database at all" * 100)
    with pytest.raises(ValueError, match="file is not a database"):
        ResultsFile(path)
    database_of(path).write_bytes(before)
    assert not path.exists()


def test_one_writer_at_a_time(tmp_path):
    path = tmp_path / "out.csv"
    with ResultsFile(path) as results:
        for act in (
            lambda: None,
            lambda: results.append(rows_of(0, 1, "one")),
            lambda: results.keep(lambda _: False),
        ):
            act()
            with pytest.raises(ValueError, match="another run is writing it"):
                ResultsFile(path)
    with ResultsFile(path) as results:
        assert recordings_in(results) == []
        with pytest.raises(ValueError, match="another run is writing it"):  # nothing was written
            ResultsFile(path)


def test_a_link_stays_a_link(tmp_path):
    path, link = tmp_path / "there.csv", tmp_path / "out.csv"
    link.symlink_to(path)
    with ResultsFile(link) as results:
        results.append(rows_of(0, 1, "one"))
        results.append(rows_of(1, 1, "two"))
        assert results.keep(lambda entry: entry.recording.startswith("1")) == 1
    assert link.is_symlink()
    assert {one.name for one in tmp_path.iterdir()} == {"there.csv", "out.csv", "there.sqlite"}
    with ResultsFile(path) as results:
        assert recordings_in(results) == [("1, two", 1)]


EVIL = "<script>alert(1)</script> & \"x' {{ 1 + 1 }}"


def row(name, level="OK", signal="", ratio=None, dead_band=0.2, **cells):
    empty = dict.fromkeys((*COLUMNS, "picture"))
    return empty | {
        "recording": name,
        "valve": "",
        "level": level,
        "ne_107": signal,
        "ratio": ratio,
        "dead_band_of_travel": dead_band,
        "message": f"about {name}",
        **cells,
    }


FLEET = [
    row("refused", None, None, None, None, message=None, error="too short"),
    row("unknown"),
    row("halved", ratio=0.6),
    row("grown", "WARN", "M", 1.4),
    row("same", ratio=1.0, dead_band=0.1),
    row("same but wide", ratio=1.0, dead_band=0.3),
    row("excessive", "ERROR", "F", 2.1),
    row("collapsed", "ERROR", "S", 0.2),
    row("doubtful", "WARN", "C", 1.1),
    row("perhaps", ratio=1.3),
]
ORDER = [
    *("collapsed", "excessive", "grown", "doubtful", "halved", "perhaps"),
    *("same but wide", "same", "unknown", "refused"),
]


class Cells(HTMLParser):
    """Text of each row of the table, links, and the number of scripts."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.links, self.scripts, self.outside = [], [], 0, []
        self._is_cell = False
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        if tag == "tr":
            self.rows.append([])
        elif tag == "td":
            self.rows[-1].append("")
            self._is_cell = True
        elif tag == "a":
            self.links.append(found["href"])
        self.scripts += tag == "script"
        self.outside += [found[name] for name in ("src", "srcset") if name in found]
        assert not [name for name in found if name.startswith("on")]

    def handle_endtag(self, tag):
        self._is_cell &= tag != "td"

    def handle_data(self, data):
        if self._is_cell:
            self.rows[-1][-1] += data


CHANGED = {"findings_level": "WARN", "findings": "WARN: the spring constant has changed"}


def test_a_valve_with_a_finding_comes_before_a_normal_one():
    changed = row("b", ratio=1.0) | CHANGED
    rows = ranked([row("a", ratio=1.1), changed])
    assert [one["recording"] for one in rows] == ["b", "a"]
    assert reaches(changed, Level.WARN)
    assert not reaches(changed, Level.ERROR)
    lines = [line for line in Cells(page_text(rows, "plant")).rows if line]
    assert lines[0][-1].endswith("WARN: the spring constant has changed")


@pytest.mark.parametrize(
    ("given", "word"),
    [
        (FLEET[0], "refused"),
        (FLEET[1], "no comparison"),
        (FLEET[2], "perhaps fallen"),
        (FLEET[4], "normal"),
        (FLEET[7], "collapsed"),
        (FLEET[8], "check"),
        (FLEET[9], "perhaps grown"),
        (row("x", ratio=0.49), "perhaps fallen"),
        (row("x", "WARN", "M", 0.7), "fallen"),
        (row("x", "WARN", "C", 0.7), "perhaps fallen"),
        (row("x", "WARN", "C", 1.4), "perhaps grown"),
        (row("x", ratio=1.0) | CHANGED, "changed"),
        (row("x", ratio=3.0, level="ERROR", ne_107="F") | CHANGED, "excessive"),
    ],
)
def test_the_status(given, word):
    assert status_of(given).word == word


def test_a_page_in_this_order():
    page = Cells(page_text(FLEET, "plant"))
    lines = [line for line in page.rows if line]
    assert [line[2].strip() for line in lines] == ORDER
    assert [line[0] for line in lines] == [str(number) for number in range(1, 11)]
    assert lines[0][4:6] == ["0.20", "20 %of travel"]
    assert [line[-1] for line in lines][-2:] == ["about unknown", "too short"]
    assert page.scripts == 1
    assert page.outside == []


def test_a_refused_recording_without_a_tag_is_no_valve():
    rows = [row("q1", valve="FV-1"), row("q2", valve="FV-1"), row("lost", None, error="no tag")]
    assert "<title>Friction of 1 valve in 3 recordings: " in page_text(rows, "plant")
    assert "<title>Friction of 3 valves: " in page_text(
        [row("a"), row("b"), row("c", None)], "plant"
    )


def test_text_from_outside_is_text():
    report = "plant_reports/a b&<.html"
    evil = row(EVIL, valve=EVIL, ratio=1.0, message=EVIL, report=report)
    page = Cells(page_text([evil, row("x", None, error=EVIL)], EVIL))
    lines = [line for line in page.rows if line]
    assert lines[0][2].strip() == f"{EVIL}{EVIL}"  # the tag, and below it the recording
    assert [line[-1] for line in lines] == [EVIL, f"about x; {EVIL}"]
    assert page.scripts == 1
    assert page.links == ["plant_reports/a%20b%26%3C.html"]


def test_the_picture():
    """It stays within its frame, and a point is kept only where the line has moved."""
    drive = [1e5 + 4e4 * math.sin(number / 5000) for number in range(100_000)]
    position = [max(0.0, (one - 1e5) / 4e6) for one in drive]
    points = [
        tuple(map(float, point.split(",")))
        for point in signature_points(Recording(0.01, drive, position)).split()
    ]
    assert 200 < len(points) <= 500
    assert {round(x) for x, _ in points} >= {2, WIDTH // 2, WIDTH - 2}
    assert all(0 <= x <= WIDTH and 0 <= y <= HEIGHT for x, y in points)
    assert points[0][1] == pytest.approx(HEIGHT - 1)  # a closed valve is drawn at the bottom


def test_a_report_that_cannot_be_written_is_one_more_warning(tmp_path):
    (tmp_path / "reports").mkdir()
    row = {"valve": "/a", "report": "reports/a.html", "warnings": "short", PAGE: "<p>"}
    refused = {"valve": "/c", "error": "gap"}
    good, bad, none = with_reports_written([row, {**row, "report": "no/b.html"}, refused], tmp_path)
    assert (tmp_path / "reports" / "a.html").read_text() == "<p>"
    assert good == {"valve": "/a", "report": "reports/a.html", "warnings": "short"}
    assert bad["report"] is None
    assert bad["warnings"].startswith("short; no report: ")
    assert none == refused


def test_names_of_reports_differ_where_valves_do():
    names = {report_name("a/b.csv", valve) for valve in ("", "/x", "/X", "x")}
    names |= {report_name("a_b.csv", ""), report_name("a" * 300, "")}
    assert len(names) == 6
    assert max(map(len, names)) < 120


class TestFirstSurvey:
    """Valves without a baseline are ranked by absolute limits, and the row says what to do."""

    def test_the_worst_first(self):
        rows = [
            row(name, dead_band=dead_band, survey=survey)
            for name, survey, dead_band in (
                ("a", "good", 0.05),
                ("b", "bad", 0.27),
                ("c", "watch", 0.15),
                ("d", "unknown", 0.9),
            )
        ]
        assert [one["recording"] for one in ranked(rows)] == ["b", "c", "a", "d"]
        assert [status_of(one).word for one in ranked(rows)][:3] == ["bad", "watch", "good"]

    def test_a_file_of_an_earlier_version_gets_the_columns(self, tmp_path):
        output = tmp_path / "friction.csv"
        with ResultsFile(output) as results:
            results.append([row("a", dead_band=0.05)])
        connection = sqlite3.connect(tmp_path / "friction.sqlite")
        connection.execute("ALTER TABLE result DROP COLUMN survey")
        connection.execute("ALTER TABLE result DROP COLUMN what_to_do")
        connection.close()
        with ResultsFile(output) as results:
            (entry,) = results.entries()
            assert entry.rows[0]["dead_band_of_travel"] == 0.05
            assert entry.rows[0]["survey"] is None
