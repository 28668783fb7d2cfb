# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Exports in which each signal of a valve has its own file."""

from collections import Counter
from datetime import datetime, timedelta, timezone
from fractions import Fraction
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from benchmark.exports.programs import PROGRAMS, pi_pairs, twin_cat, twin_cat_semicolons
from benchmark.exports.truth import draw, read
from valve_friction_ros.commands.main import run
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, SineWave, Valve, simulate
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.recordings import ReadingOptions, read_recordings
from valve_friction_ros.records.table import layout_of
from valve_friction_ros.records.units import (
    FORCE_UNITS,
    NANOSECONDS,
    POSITION_UNITS,
    PRESSURE_UNITS,
)
from valve_friction_ros.records.valve_file import read_valve_file

BEGIN = datetime(2026, 3, 13, 7, 5, tzinfo=timezone.utc)
"""Neither day nor month of it may be the other."""
PERIOD = 0.05
COUNT = 400
PRESSURE = SineWave(period=10.0).sample(PERIOD * np.arange(COUNT))
STEM = simulate(BENCH_VALVE, LOW_FRICTION, PRESSURE, PERIOD).position
GAUGE = PRESSURE - BENCH_VALVE.pressure_reference
VALVE = Valve(BENCH_VALVE.diaphragm_area, 0.0, BENCH_VALVE.travel)
LATER = 0.02
"""s from a sample of the pressure to one of the stem."""


def moments(zone="UTC", later=0.0):
    return [
        (BEGIN + timedelta(seconds=PERIOD * index + later)).astimezone(ZoneInfo(zone))
        for index in range(COUNT)
    ]


def semicolons(header, values, later=0.0, zone="UTC"):
    """German dates and numbers."""
    rows = [header]
    for moment, value in zip(moments(zone, later), values, strict=True):
        milliseconds = moment.microsecond // 1000
        number = f"{value:.6f}".replace(".", ",")
        rows.append(f"{moment:%d.%m.%Y %H:%M:%S},{milliseconds:03d};{number}")
    return "\n".join(rows)


def commas(header, values, later=0.0):
    """Dates of ISO 8601 with their zone, tags in each row, a quality."""
    rows = [f"{header[0]},t_stamp,value,quality"]
    for moment, value in zip(moments("Europe/Berlin", later), values, strict=True):
        rows.append(f"{header[1]},{moment.isoformat(timespec='milliseconds')},{value:.6f},192")
    return "\n".join(rows)


@pytest.fixture
def write(tmp_path):
    def write(**texts):
        paths = [tmp_path / f"{name.replace('__', '.')}.csv" for name in texts]
        for path, text in zip(paths, texts.values(), strict=True):
            path.write_text(text)
        return paths

    return write


def joined(paths, **form):
    options = ReadingOptions(Columns(**form), beside=tuple(paths[1:]))
    (recorded,) = read_recordings(paths[0], VALVE, options)
    return recorded.recording(), recorded.notes


def refused(paths, **form):
    with pytest.raises((ValueError, RefusalError)) as refusal:
        joined(paths, **form)
    message = str(refusal.value)
    assert message.startswith(f"{paths[0]}, {paths[1]}: ")
    assert "\n" not in message
    return message


def assert_true(recording):
    """The stem to the last digit that is written; the pressure to that, and a line between it."""
    assert recording.start_time == pytest.approx(BEGIN.timestamp() + LATER, abs=1e-3)
    count = len(recording)
    assert count == COUNT - 1
    fine = 1e-8 * BENCH_VALVE.travel
    np.testing.assert_allclose(recording.position, STEM[:count], atol=fine)
    at_stem = np.interp(PERIOD * np.arange(count) + LATER, PERIOD * np.arange(COUNT), GAUGE)
    np.testing.assert_allclose(recording.drive, at_stem, atol=0.6)


PERCENT = 100 * STEM / BENCH_VALVE.travel


class TestWhatIsWhat:
    def test_by_the_headers(self, write):
        paths = write(
            a=semicolons("Zeit;Stelldruck [bar]", GAUGE / 1e5),
            b=semicolons("Zeit;Ventilstellung [%]", PERCENT, LATER),
        )
        recording, notes = joined(paths)
        assert_true(recording)
        assert notes[0] == (
            "read as: 2 files of a valve; semicolon; decimal comma; dates day first, UTC, because "
            "no zone is stated; pressure 'Stelldruck [bar]' in bar, position 'Ventilstellung [%]' "
            "in %"
        )

    def test_by_the_names_of_the_files_in_any_order(self, write):
        paths = write(
            FV101__ZT=semicolons("Timestamp;Value", PERCENT, LATER),
            FV101__SP=semicolons("Timestamp;Value", PERCENT),
            FV101__PT=semicolons("Timestamp;Value", GAUGE / 1e5),
        )
        recording, notes = joined(paths, position_unit="percent", pressure_unit="bar")
        assert_true(recording)
        assert "pressure 'FV101.PT' in bar, position 'FV101.ZT' in %" in notes[0]
        assert notes[0].endswith("; not needed: FV101.SP.csv")

    def test_by_the_tags_in_the_rows(self, write):
        paths = write(
            export1=commas(("tag", "PT-101"), GAUGE / 1e3),
            export2=commas(("tag", "ZT-101"), STEM * 1e3, LATER),
        )
        assert_true(joined(paths, pressure_unit="kPa", position_unit="mm")[0])

    def test_by_the_names_that_are_said(self, write):
        paths = write(
            trend_A=semicolons("Time;Value (psi)", GAUGE / 6894.757293168),
            trend_B=semicolons("Time;Value", PERCENT, LATER),
        )
        recording, _ = joined(paths, position_column="trend_B", position_unit="percent")
        assert_true(recording)


class TestForms:
    def test_files_of_two_forms_agree_in_utc(self, write):
        """German local times of winter, and ISO dates with their zone."""
        paths = write(
            PT101=semicolons("Zeit;Druck [bar]", GAUGE / 1e5, zone="Europe/Berlin"),
            ZT101=commas(("tag", "ZT-101 (mm)"), STEM * 1e3, LATER),
        )
        assert_true(joined(paths, time_zone="Europe/Berlin")[0])

    def test_a_missing_zone_is_asked_for(self, write):
        paths = write(
            PT101=semicolons("Zeit;Druck [bar]", GAUGE / 1e5, zone="Europe/Berlin"),
            ZT101=commas(("tag", "ZT-101 (mm)"), STEM * 1e3, LATER),
        )
        assert "the zone of the times of 'PT101.csv'" in refused(paths)
        assert "(--time-zone UTC)" in refused(paths)

    def test_files_of_other_times_are_refused(self, write):
        seconds = "\n".join(["Time (s),Hub [mm]", *(f"{i},{i % 20}" for i in range(COUNT))])
        message = refused(write(PT=semicolons("Time;Druck [bar]", GAUGE / 1e5), ZT=seconds))
        assert "do not overlap in time" in message

    def test_a_bad_row_is_named_with_its_file(self, write):
        text = semicolons("Zeit;Hub [mm]", STEM * 1e3).splitlines()
        text[9] = text[7]
        first, second = write(PT=semicolons("Zeit;Druck [bar]", GAUGE / 1e5), ZT="\n".join(text))
        with pytest.raises(ValueError, match=f"^{second}: row 10, column 'Zeit' goes back"):
            joined([first, second])


class TestQuestions:
    def test_all_at_once(self, write):
        paths = write(
            FV101__DRUCK=semicolons("Time;Value", GAUGE / 1e5),
            FV101__PV=semicolons("Time;Value", PERCENT),
        )
        low, high = min(GAUGE[:300]) / 1e5, max(GAUGE[:300]) / 1e5  # the rows that are looked at
        message = refused(paths)
        assert (
            "cannot tell in 'FV101.DRUCK.csv' the unit of the pressure 'FV101.DRUCK', values from "
            f"{low:g} to {high:g} (--pressure-unit, one of Pa hPa "
        ) in message
        assert message.endswith(
            "; which of 'FV101.DRUCK.csv', 'FV101.PV.csv' is the position (--position-column "
            "'FV101.PV'), and its unit (--position-unit)"
        )

    def test_two_of_a_kind(self, write):
        paths = write(
            PT101=semicolons("Time;bar", GAUGE / 1e5), PT102=semicolons("Time;bar", GAUGE / 1e5)
        )
        message = refused(paths)
        assert "which of 'PT101.csv', 'PT102.csv' is the pressure (--pressure-column" in message
        assert "is the position (--position-column" in message


class TestCommands:
    @pytest.fixture
    def paths(self, write):
        return write(
            FV101__PT=semicolons("Zeit;Wert [bar]", GAUGE / 1e5),
            FV101__ZT=semicolons("Zeit;Wert", PERCENT, LATER),
        )

    @pytest.fixture
    def valve_file(self, tmp_path):
        path = tmp_path / "valve.yaml"
        area, travel = BENCH_VALVE.diaphragm_area, BENCH_VALVE.travel
        path.write_text(f"diaphragm_area: {area}\npressure_reference: 0.0\ntravel: {travel}\n")
        return path

    def test_identify_finds_the_friction_and_saves_what_it_was_told(
        self, paths, valve_file, tmp_path, capsys
    ):
        """Without a volume or a lag the spring is that of the model within its interval."""
        saved = tmp_path / "saved.yaml"
        common = ["--fix", "mass=1.6", "--json"]
        first = ["--valve", str(valve_file), "--position-unit", "percent"]
        assert (
            run(["identify", *map(str, paths), *first, "--save-columns", str(saved), *common]) == 0
        )
        out = capsys.readouterr().out
        assert run(["identify", *map(str, paths), "--valve", str(saved), *common]) == 0
        assert capsys.readouterr().out == out
        assert read_valve_file(saved).columns.position_column == "FV101.ZT"

    def test_inspect_shows_both(self, paths, capsys):
        assert run(["inspect", *map(str, paths), "--position-unit", "percent"]) == 0
        out = capsys.readouterr().out
        assert "FV101.ZT" in out
        assert out.startswith("read as: 2 files of a valve; ")
        assert run(["inspect", *map(str, paths)]) == 2
        assert "--position-unit" in capsys.readouterr().err


ASKED = {
    "aspen_long", "ignition_dataset", "grafana_raw", "labview", "without_units", "bad_beyond",
    "day_or_month", "rockwell", "second_sheet", "finnish",
}  # fmt: skip
"""Exports that do not say their units, what a column is, or whether day or month is first."""


@pytest.fixture(scope="module", params=[1, 2])
def outcomes(request, tmp_path_factory):
    pytest.importorskip("openpyxl")
    pytest.importorskip("pyarrow")
    random = np.random.default_rng(request.param)
    folder = tmp_path_factory.mktemp("exports")
    found = {}
    for program, truth in zip(PROGRAMS, draw(len(PROGRAMS), request.param), strict=True):
        place = folder / program.__name__
        place.mkdir()
        found[program.__name__] = read(program(truth, random), truth, place)
    return found


def test_none_is_read_wrongly(outcomes):
    assert not {name: one.message for name, one in outcomes.items() if one.kind == "wrong"}


def test_nearly_all_are_read(outcomes):
    assert not {name for name, one in outcomes.items() if one.kind == "refused"}
    counts = Counter(one.options for one in outcomes.values())
    assert counts[0] >= 43
    assert counts[0] + counts[1] >= 0.9 * len(outcomes)
    assert set(counts) <= {0, 1, 2}


def test_what_is_ambiguous_is_asked_for(outcomes):
    assert {name for name, one in outcomes.items() if one.kind == "options"} <= ASKED
    message = outcomes["without_units"].message
    assert "--pressure-unit" in message
    assert "--position-unit" in message


@pytest.mark.parametrize("program", [twin_cat, twin_cat_semicolons, pi_pairs])
def test_what_is_saved_of_a_table_with_several_times_reads_it_alike(program, tmp_path):
    """Each signal keeps its own time, although the saved section names columns."""
    (truth,) = draw(1, 3)
    export = program(truth, np.random.default_rng(3))
    path, valve = tmp_path / export.name, Valve(truth.area, 0.0, truth.travel)
    path.write_bytes(export.content)
    (first,) = read_recordings(path, valve)
    saved = ReadingOptions(layout_of(path, Columns()).form)
    (again,) = read_recordings(path, valve, saved)
    assert again.recording().start_time == first.recording().start_time
    np.testing.assert_array_equal(again.recording().drive, first.recording().drive)
    np.testing.assert_array_equal(again.recording().position, first.recording().position)


INCH = Fraction("0.0254")
POUND_FORCE = Fraction("0.45359237") * Fraction("9.80665")
DEFINITIONS = {
    "Pa": Fraction(1),
    "hPa": Fraction(100),
    "kPa": Fraction(1000),
    "MPa": Fraction(10**6),
    "mbar": Fraction(100),
    "bar": Fraction(10**5),
    "psi": POUND_FORCE / INCH**2,
    "kgf/cm2": Fraction("9.80665") * 10**4,
    "inH2O": Fraction("249.08891"),  # at 4 °C
    "inHg": Fraction("3386.389"),  # at 0 °C
    "mmHg": Fraction("133.322387415"),
    "m": Fraction(1),
    "cm": Fraction(1, 100),
    "mm": Fraction(1, 1000),
    "um": Fraction(1, 10**6),
    "in": INCH,
    "N": Fraction(1),
    "kN": Fraction(1000),
    "lbf": POUND_FORCE,
    "kgf": Fraction("9.80665"),
}
UNITS = {**PRESSURE_UNITS, **POSITION_UNITS, **FORCE_UNITS}


def test_each_is_as_large_as_defined():
    """Within a rounding of each of its two numbers and of their ratio."""
    found = {name: unit.to_si(np.array([1.0]))[0] for name, unit in UNITS.items()}
    defined = {name: float(size) for name, size in DEFINITIONS.items()}
    assert found == pytest.approx(defined, rel=2**-51)


@given(some.integers(-(10**9), 10**9), some.sampled_from(["m", "mm", "um", "in", "kPa", "bar"]))
def test_whole_numbers_are_converted_to_the_last_bit(number, name):
    assert UNITS[name].to_si(np.array([float(number)]))[0] == float(number * DEFINITIONS[name])


def test_times():
    short = {"ns": 1, "us": 10**3, "ms": 10**6, "s": 10**9}
    assert short | {"min": 60 * 10**9, "h": 3600 * 10**9, "d": 86400 * 10**9} == {
        name: size for name, size in NANOSECONDS.items() if name != "microdays"
    }
    assert NANOSECONDS["microdays"] * 10**6 == NANOSECONDS["d"]
