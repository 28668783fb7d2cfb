# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Huge, nested and hostile files and names: one line, and memory that stays small."""

import gzip
import resource
from functools import partial

import pytest
from histories import START, VALVE, success
from kept_rows import csv_rows
from processes import ran

from valve_friction_ros.commands.main import run
from valve_friction_ros.history import HistoryFile, KeptValve
from valve_friction_ros.outside_text import harmless, printable

HEADER = b"time_s,position_m,pressure_pa\n"
ROWS = b"".join(b"%d,0,1e5\n" % one for one in range(400))
MEMORY = 1_500_000_000
"""Address space, bytes, of a process that reads a file of 10 GB; numba and numpy take most."""


@pytest.fixture
def bounded(bench_yaml):
    """Function of arguments of `identify`: the one line of a process of little memory."""

    def bounded(*arguments):
        limited = partial(resource.setrlimit, resource.RLIMIT_DATA, (MEMORY, MEMORY))
        code, out, err = ran("identify", *arguments, "--valve", bench_yaml, preexec_fn=limited)
        assert (code, out, err.count("\n")) == (2, "", 1)
        return err

    return bounded


def packed(path, start, piece, count):
    """Write a gzip file of `start` and many times `piece`, by its packed members."""
    member = gzip.compress(piece)
    with path.open("wb") as stream:
        stream.write(gzip.compress(start))
        for _ in range(count):
            stream.write(member)
    return path


class TestTables:
    @pytest.mark.parametrize(
        ("start", "piece", "cause"),
        [
            (b"", bytes(10_000_000), "a line has more than 1048576 bytes"),
            (ROWS, b"\n" * 10_000_000, "65536 consecutive blank rows"),
            (ROWS, b",,,remark\n" * 1_000_000, "more than 20 MB, unpacked: raise maximum_megaby"),
            (
                b"0.0,0,1e5\nx,0,1e5\n",
                b"0.0,0.0,1e5\n" * 800_000,
                "row 4, column 'time_s' repeats (0 s after 0 s)",
            ),
        ],
        ids=["zeros", "blank lines", "remarks", "times that repeat"],
    )
    def test_ten_gigabytes(self, bounded, tmp_path, start, piece, cause):
        path = packed(tmp_path / "a.csv.gz", HEADER + start, piece, 1000)
        limit = ("--maximum-megabytes", "20") if b"remark" in piece else ()
        assert cause in bounded(path, *limit)

    def test_a_part_needs_room_for_itself_only(self, refusal, tmp_path, bench_options):
        """Beyond the end nothing is read: the bad row there is not met."""
        path = tmp_path / "a.csv"
        rows = b"".join(b"%d.0,0,1e5\n" % index for index in range(60_000))
        path.write_bytes(HEADER + rows + b"x\n")
        few = ("--maximum-rows", "20000")
        message = refusal(path, *bench_options, *few)
        assert "more than 20000 rows: raise maximum_rows (--maximum-rows)" in message
        for part in (("--end", "9000"), ("--begin", "20000", "--end", "29000")):
            assert "rows" not in refusal(path, *bench_options, *few, *part)
        path.write_bytes(HEADER + rows)
        assert "rows" not in refusal(path, *bench_options, *few, "--last", "5000")

    def test_a_huge_cell(self, refusal, tmp_path, bench_options):
        path = tmp_path / "a.csv"
        for cell in (b"y" * 5_000_000, b'"' + b"y" * 5_000_000 + b'"'):
            path.write_bytes(HEADER + b"0," + cell + b",1e5\n")
            assert len(refusal(path, *bench_options)) < 400
        path.write_bytes(HEADER + b"0," + b"y" * 100_000 + b",1e5\n")
        assert f"'{'y' * 40}…' is not a valid value" in refusal(path, *bench_options)

    def test_hostile_headers(self, refusal, tmp_path, bench_options):
        path = tmp_path / "a.csv"
        path.write_bytes(b"\x1b[31mred\x07,<b>,$x^2$,=cmd\n1,2,3,4\n")
        message = refusal(path, *bench_options)
        assert message.isprintable()
        assert "\\x1b[31mred\\x07" in message

    def test_a_hostile_name(self, call, tmp_path, bench_options):
        path = tmp_path / "a\x1b[2J\n.csv"
        path.write_bytes(b"1,2\n")
        code, _, err = call(path, *bench_options)
        assert code == 2
        assert err.count("\n") == 1
        assert err.strip().isprintable()


DEEP = 20_000


class TestValveFiles:
    @pytest.mark.parametrize(
        ("text", "cause"),
        [
            ("a: " + "[" * DEEP, "nested too deeply"),
            ("a: " + "{a: " * DEEP, "nested too deeply"),
            ("diaphragm_area: 1.0\n" + "# x\n" * 300_000, "more than 1000 kB"),
            ("diaphragm_area: " + "1" * 5000, "diaphragm_area"),
            ("diaphragm_area: " + "x" * 500_000, "diaphragm_area must be a number, got 'xxx"),
            ("x" * 1000 + ": 1", "unknown key 'xxx"),
            ("/**:\n  ros__parameters: [1]\n", "diaphragm_area is missing"),
            ("diaphragm_area: 1.0\ncolumns: [1]", "columns must be lines such as"),
            ("diaphragm_area: 1.0\ncolumns: {delimiter: {}}", "columns: delimiter must be a text"),
            ("diaphragm_area: 1.0\ncolumns: {time_colum: t}", "did you mean 'time_column'?"),
            ("diaphragm_area: 1.0\ncolumns: {skip_rows: 1.5}", "must be a whole number"),
            ("diaphragm_area: 1.0\ncolumns: {encoding: klingon}", "unknown encoding 'klingon'"),
            ("diaphragm_area: 1.0\nmethod: guess", "method 'guess' is unknown"),
            ("diaphragm_area: 0.04\ntravel: 28.6", "mm read as m?"),
        ],
    )
    def test_one_line(self, refusal, quick_csv, tmp_path, text, cause):
        path = tmp_path / "valve.yaml"
        path.write_text(text)
        message = refusal(quick_csv, "--valve", path)
        assert cause in message
        assert len(message) < 700


TAG = "=1+1 cost $\\foo{$ \x1b[2J\x07"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("FV-101 µm ²", "FV-101 µm ²"),
        ("\x1b[31mred\x07\n", "\\x1b[31mred\\x07\\n"),
        ("\x9b2J\u202etxt\udcff", "\\x9b2J\\u202etxt\\udcff"),
        ("x" * 20_000, "x" * 10_000 + "…"),
    ],
)
def test_printable(text, shown):
    assert printable(text) == shown


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@x", "\t=1", "\r=1"])
def test_a_formula_is_a_text(text):
    assert harmless(text) == f"'{text}"
    assert (harmless("FV-101"), harmless(-1.0), harmless(None)) == ("FV-101", -1.0, None)


def test_a_hostile_tag_in_table_csv_and_picture(tmp_path, capsys):
    file = tmp_path / "plant.sqlite"
    HistoryFile(file).add(success(START, valve=KeptValve(VALVE.name, TAG)))
    table, picture = tmp_path / "a.csv", tmp_path / "a.png"
    assert run(["history", str(file), "--csv", str(table), "--plot", str(picture)]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "=1+1 cost $\\foo{$ \\x1b[2J\\x07" in out
    (row,) = csv_rows(table)
    assert row["tag"] == f"'{TAG}"
    assert picture.stat().st_size > 5000
