"""The output file: what a kill leaves of it is recognised, and no row is lost or doubled."""

import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.fleet import ResultsFile, error_cells, key_cells

TEXTS = st.text(st.characters(categories=("L", "N", "P", "S", "Zs")), max_size=20)
FLEETS = st.lists(st.tuples(st.integers(1, 3), TEXTS), min_size=1, max_size=5)
ENDINGS = st.sampled_from([".csv", ".jsonl"])


def rows_of(number, valves, text):
    """The rows of a recording: what is in them must not disturb how they are told apart."""
    keys = key_cells(f"{number}, {text}", f"c{number}", "s", valves)
    return [{**error_cells(f"/v{n}", text, Path("x")), **keys} for n in range(valves)]


def recordings_in(results):
    return [(entry.recording, len(entry.rows)) for entry in results.entries()]


@given(FLEETS, ENDINGS, st.data())
def test_cut_anywhere_and_gone_on_with(fleet, ending, data):
    entries = [rows_of(number, *one) for number, one in enumerate(fleet)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"out{ending}")
        ends = []
        with ResultsFile(path) as results:
            ends.append(path.stat().st_size)
            for entry in entries:
                results.append(entry)
                ends.append(path.stat().st_size)  # on the disk as soon as append returns
        whole = path.read_bytes()
        cut = data.draw(st.integers(0, len(whole)))
        path.write_bytes(whole[:cut])

        complete = sum(end <= cut for end in ends[1:])
        with ResultsFile(path) as results:
            assert path.read_bytes() == whole[: ends[complete]]
            for entry in entries[complete:]:
                results.append(entry)
            assert recordings_in(results) == [
                (entry[0]["recording"], len(entry)) for entry in entries
            ]
        assert path.read_bytes() == whole


@given(FLEETS, ENDINGS, st.data())
def test_what_is_kept_stays_as_it_is(fleet, ending, data):
    entries = [rows_of(number, *one) for number, one in enumerate(fleet)]
    wanted = data.draw(st.lists(st.booleans(), min_size=len(entries), max_size=len(entries)))
    kept = [entry for entry, is_wanted in zip(entries, wanted, strict=True) if is_wanted]
    names = {entry[0]["recording"] for entry in kept}
    with tempfile.TemporaryDirectory() as folder:
        path, expected = Path(folder, f"out{ending}"), Path(folder, f"expected{ending}")
        with ResultsFile(path) as results, ResultsFile(expected) as other:
            for entry in entries:
                results.append(entry)
            assert results.keep(lambda entry: entry.recording in names) == wanted.count(False)
            results.append(entries[0])
            for entry in [*kept, entries[0]]:
                other.append(entry)
        assert path.read_bytes() == expected.read_bytes()
        assert set(Path(folder).iterdir()) == {path, expected}


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("data.csv", "time_s,position_m\n0,1\n"),
        ("data.csv", "time_s,posi"),
        ("data.jsonl", '{"a": 1}\n'),
        ("data.jsonl", '{"a": 1}'),
        ("data.jsonl", "[1, 2]\n"),
        ("data.jsonl", "\0\0\0\n"),
    ],
)
def test_the_file_of_another_program_is_left_alone(tmp_path, name, content):
    path = tmp_path / name
    path.write_text(content)
    before = path.stat()
    with pytest.raises(ValueError, match="line 1 is no row of this command"):
        ResultsFile(path)
    assert path.read_text() == content
    assert path.stat().st_mtime_ns == before.st_mtime_ns


@pytest.mark.parametrize("ending", [".csv", ".jsonl"])
def test_damage_before_the_end_is_told_by_its_line(tmp_path, ending):
    path = tmp_path / f"out{ending}"
    with ResultsFile(path) as results:
        results.append(rows_of(0, 1, "first"))
        results.append(rows_of(1, 2, "second"))
        results.append(rows_of(2, 1, "third"))
    lines = path.read_bytes().splitlines(keepends=True)
    number = len(lines) - 1  # the last row of the second recording
    for damaged in (
        [*lines[: number - 1], b"\0\n", *lines[number:]],
        lines[: number - 1] + lines[number:],
    ):
        path.write_bytes(b"".join(damaged))
        with pytest.raises(ValueError, match=f"line {number} is no row"):
            ResultsFile(path)
        assert path.read_bytes() == b"".join(damaged)


def test_one_writer_at_a_time(tmp_path):
    path = tmp_path / "out.csv"
    with ResultsFile(path) as results:
        results.append(rows_of(0, 1, "one"))
        with pytest.raises(ValueError, match="another run is writing it"):
            ResultsFile(path)
        results.keep(lambda _: False)
        with pytest.raises(ValueError, match="another run is writing it"):
            ResultsFile(path)
    with ResultsFile(path) as results:
        assert recordings_in(results) == []


def test_a_draft_that_a_kill_left_and_a_link_do_not_disturb(tmp_path):
    path, link = tmp_path / "there.csv", tmp_path / "out.csv"
    link.symlink_to(path)
    (tmp_path / ".there.csv.draft").write_text("half")
    with ResultsFile(link) as results:
        results.append(rows_of(0, 1, "one"))
        results.append(rows_of(1, 1, "two"))
        assert results.keep(lambda entry: entry.recording.startswith("1")) == 1
    assert link.is_symlink()
    with ResultsFile(path) as results:
        assert recordings_in(results) == [("1, two", 1)]
