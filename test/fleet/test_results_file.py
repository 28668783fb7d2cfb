"""The results: rows survive a kill, none is lost or doubled, the output holds them all."""

import csv
import json
import signal
import sqlite3
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from valve_friction_ros.fleet import COLUMNS, ResultsFile, database_of, error_cells, key_cells
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
    keys = key_cells(f"{number}, {text}", f"c{number}", "s", valves)
    return [{**error_cells(f"/v{n}", text, Path("x")), **keys} for n in range(valves)]


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
    with pytest.raises(ValueError, match=r"it is there, but not data\.sqlite"):
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
    with pytest.raises(ValueError, match="results of another version: give another output"):
        ResultsFile(path)
    database_of(path).write_bytes(b"no database at all" * 100)
    with pytest.raises(ValueError, match="file is not a database"):
        ResultsFile(path)
    database_of(path).write_bytes(before)
    assert not path.exists()


def test_one_writer_at_a_time(tmp_path):
    path = tmp_path / "out.csv"
    with ResultsFile(path) as results:
        with pytest.raises(ValueError, match="another run is writing it"):
            ResultsFile(path)
        results.append(rows_of(0, 1, "one"))
        with pytest.raises(ValueError, match="another run is writing it"):
            ResultsFile(path)
        results.keep(lambda _: False)
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
