# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What plants export, through the real command: each must give the numbers of the plain file."""

import gzip
import json
import os
import sys
import zipfile
from datetime import datetime, timedelta, timezone
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from processes import ran

from valve_friction_ros.model import BENCH_VALVE, Recording, SensorNoise, SineWave, simulate

START = datetime(2026, 10, 25, 0, 59, 55, tzinfo=timezone.utc)  # clocks go back at 01:00 UTC
VALVE = "diaphragm_area: 0.0445\npressure_reference: 41740.0\ntravel: 0.028575\nmass: 1.6\n"
QUICK = ("--method", "published", "--fix", "mass=1.6")


@pytest.fixture(scope="module")
def record(benches):
    """Twenty seconds of a sine at 100 Hz, rounded as an export rounds."""
    pressure = SineWave(period=10.0).sample(np.arange(2000) / 100)
    stem = simulate(*benches["low"], pressure, 0.01).position
    noisy = SensorNoise(2e-6, 20.0, seed=3).applied_to(Recording(0.01, pressure, stem))
    return np.round(noisy.pressure), np.round(noisy.position, 7)


@pytest.fixture
def valve(tmp_path):
    """Function of further lines: the valve file."""

    def valve(text=""):
        path = tmp_path / "valve.yaml"
        path.write_text(VALVE + text)
        return path

    return valve


@pytest.fixture
def friction(printed):
    def friction(*arguments):
        answer = printed(*arguments, *QUICK)
        return answer["parameters"]["coulomb_friction"]["value"], answer

    return friction


@pytest.fixture
def expected(friction, write_csv, valve, record):
    pressure, position = record
    columns = {
        "time_s": np.round(np.arange(2000) / 100, 2),
        "position_m": position,
        "pressure_pa": pressure,
    }
    found, _ = friction(write_csv(columns, "plain.csv"), "--valve", valve())
    assert found == pytest.approx(152.7, rel=0.05)
    return found


def export(record, times, header="Time;Stem;Air", above=(), rows=None):
    """Text of a semicolon-separated file: mm, bar, decimal commas."""
    pressure, position = record
    lines = [*above, header]
    lines += rows or [
        f"{time};{1e3 * place:.4f};{value / 1e5:.5f}".replace(".", ",")
        for time, place, value in zip(times, position, pressure, strict=True)
    ]
    return "\n".join(lines) + "\n"


def seconds():
    return [f"{index / 100:.2f}" for index in range(2000)]


def plain(folder, times, position, pressure, *others, names=()):
    """A file with commas in SI units."""
    numbers = zip(*(column.tolist() for column in (position, pressure, *others)), strict=True)
    rows = [(time, *map(repr, row)) for time, row in zip(times, numbers, strict=True)]
    header = ("time_s", "position_m", "pressure_pa", *names)
    path = folder / "export.csv"
    path.write_text("".join(",".join(row) + "\n" for row in (header, *rows)))
    return path


COLUMNS = """columns:
  time_column: Time
  position_column: Stem
  position_unit: mm
  pressure_column: Air
  pressure_unit: bar
  delimiter: ";"
  decimal: ","
"""


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16-le", "cp1252", "cp850"])
def test_an_umlaut_names_a_column_in_any_encoding(friction, expected, record, tmp_path, encoding):
    """Only one that bytes cannot tell is named; Windows' is noted."""
    path = tmp_path / "export.csv"
    path.write_text(export(record, seconds(), "Time;Öffnung;Air"), encoding=encoding)
    columns = COLUMNS.replace("Stem", "Öffnung")
    (tmp_path / "valve.yaml").write_text(VALVE + columns, encoding="utf-8")
    options = ("--encoding", encoding) if encoding == "cp850" else ()
    found, answer = friction(path, "--valve", tmp_path / "valve.yaml", *options)
    assert found == pytest.approx(expected, rel=1e-9)
    is_noted = any("Windows-1252" in warning for warning in answer["warnings"])
    assert is_noted == (encoding == "cp1252")


def test_rows_above_units_comments_and_blank_rows(friction, expected, record, valve, tmp_path):
    path = tmp_path / "export.csv"
    text = export(record, seconds(), above=["# exported by X;1;2", "", "Report;;"])
    lines = text.splitlines()
    lines[4:4] = ["s;mm;[bar]"]
    lines[100:100] = ["! maintenance;;", ";;"]
    path.write_text("\r\n".join(lines) + "\r\n")
    found, _ = friction(path, "--valve", valve(COLUMNS), "--comment", "!")
    assert found == pytest.approx(expected, rel=1e-9)


def test_a_unit_row_that_says_otherwise(refusal, record, valve, tmp_path):
    path = tmp_path / "export.csv"
    path.write_text(export(record, seconds()).replace("Air\n", "Air\ns;cm;bar\n", 1))
    message = refusal(path, "--valve", valve(COLUMNS))
    assert message.endswith("name it by position_unit (--position-unit cm)")


@pytest.mark.parametrize(
    ("form", "options"),
    [
        (lambda time: time.isoformat(timespec="milliseconds"), ()),
        (lambda time: time.strftime("%Y-%m-%dT%H:%M:%S.%fZ"), ()),
        (lambda time: time.strftime("%Y%m%dT%H%M%S.%f+0000"), ()),
        (lambda time: time.strftime("%Y-%m-%d %H:%M:%S.%f"), ()),
        (
            lambda time: time.astimezone(ZoneInfo("Europe/Berlin")).strftime(
                "%Y-%m-%d %H:%M:%S.%f"
            ),
            ("--time-zone", "Europe/Berlin"),
        ),
        (
            lambda time: time.strftime("%d.%m.%Y %H:%M:%S.%f"),
            ("--time-format", "%d.%m.%Y %H:%M:%S.%f"),
        ),
        (lambda time: f"{time.timestamp():.3f}", ()),
        (lambda time: f"{time.timestamp() * 1e3:.0f}", ("--time-unit", "ms")),
    ],
    ids=["iso", "Z", "basic", "no zone", "clocks put back", "strptime", "epoch", "epoch ms"],
)
def test_times(friction, expected, record, valve, tmp_path, form, options):
    pressure, position = record
    stamps = [form(START + timedelta(milliseconds=10 * index)) for index in range(2000)]
    path = plain(tmp_path, stamps, position, pressure)
    found, _ = friction(path, "--valve", valve(), *options)
    assert found == pytest.approx(expected, rel=2e-5)  # doubles of epoch seconds: 238 ns apart


@pytest.mark.parametrize(
    ("entry", "options", "cause"),
    [
        ("2026-11-21T08:00:00", (), "'2026-11-21T08:00:00' is not a valid value"),
        ("2026-11-31T08:00:00", (), "'2026-11-31T08:00:00' is not a valid value"),
        (
            "2026-03-29T02:30:00",
            ("--time-zone", "Europe/Berlin"),
            "'2026-03-29T02:30:00' is not a valid value",
        ),
        ("2026-11-21T08:00:00", ("--time-zone", "Europe/Berlln"), "did you mean 'Europe/Berlin'?"),
        ("x", ("--time-format", "%Y-%m-%dT%H:%M:%S"), "'x' is not a valid value"),
    ],
)
def test_impossible_times(refusal, valve, tmp_path, entry, options, cause):
    path = tmp_path / "export.csv"
    first = "0.0" if entry.endswith("11-21T08:00:00") else "2026-01-01T00:00:00"
    path.write_text(f"time_s,position_m,pressure_pa\n{first},0,1e5\n{entry},0,1e5\n")
    message = refusal(path, "--valve", valve(), *options)
    assert cause in message


def test_an_inverted_position_in_percent(friction, expected, record, valve, tmp_path):
    pressure, position = record
    path = plain(tmp_path, seconds(), 100 - 100 * position / BENCH_VALVE.travel, pressure)
    inverted = "columns: {position_unit: '%', inverted_position: true}\n"
    assert friction(path, "--valve", valve(inverted))[0] == pytest.approx(expected, rel=1e-6)


def test_a_double_acting_actuator(friction, expected, record, valve, tmp_path, refusal):
    """Half the area on the other side, at 2 bar less a tenth: the difference drives the stem."""
    pressure, position = record
    reference = BENCH_VALVE.pressure_reference
    other = 2e5 - 0.1 * pressure
    pushing = pressure + 0.5 * (other - reference)
    path = plain(tmp_path, seconds(), position, pushing, other, names=["below"])
    section = "columns: {opposing_pressure_column: below, opposing_area_ratio: 0.5}\n"
    assert friction(path, "--valve", valve(section))[0] == pytest.approx(expected, rel=1e-6)
    assert "double-acting" in refusal(tmp_path, "--valve", valve(section))


class TestWorkbooks:
    def test_one_line_names_the_extra(self, refusal, valve, tmp_path, monkeypatch):
        monkeypatch.setitem(sys.modules, "openpyxl", None)
        monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
        workbook, columns = tmp_path / "export.xlsx", tmp_path / "export.parquet"
        with zipfile.ZipFile(workbook, "w") as packed:
            packed.writestr("[Content_Types].xml", "")
        columns.write_bytes(b"PAR1" + bytes(100))
        for path in (workbook, columns):
            assert "pip install openpyxl pyarrow (the extra `tables`)" in refusal(
                path, "--valve", valve()
            )

    @pytest.mark.parametrize("start", [b"PK\x03\x04", b"PAR1", b"\xd0\xcf\x11\xe0"])
    def test_damaged(self, refusal, valve, tmp_path, start):
        pytest.importorskip("openpyxl")
        pytest.importorskip("pyarrow")
        path = tmp_path / "export.bin"
        path.write_bytes(start + bytes(100))
        assert "cannot be read as a table: " in refusal(path, "--valve", valve())


class TestPipes:
    def found(self, *arguments, **options):
        _, out, err = ran("identify", "--json", *QUICK, *arguments, text=False, **options)
        assert err == b""
        return json.loads(out)["parameters"]["coulomb_friction"]["value"]

    def test_standard_input(self, expected, record, valve):
        content = gzip.compress(export(record, seconds()).encode())
        found = self.found("-", "--valve", valve(COLUMNS), input=content)
        assert found == pytest.approx(expected, rel=1e-9)

    def test_a_pipe_of_the_shell(self, expected, record, valve):
        reading, writing = os.pipe()
        content = export(record, seconds()).encode()
        if os.fork() == 0:
            os.close(reading)
            with open(writing, "wb") as stream:  # noqa: PTH123 - a descriptor
                stream.write(content)
            os._exit(0)
        os.close(writing)
        pipe = f"/dev/fd/{reading}"
        found = self.found(pipe, "--valve", valve(COLUMNS), pass_fds=[reading])
        os.close(reading)
        os.wait()
        assert found == pytest.approx(expected, rel=1e-9)
