# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Recordings in CSV files: what is read, and which row and column of a bad file is named."""

import gzip
import math
import re
import zipfile
from dataclasses import replace
from datetime import datetime, timedelta, timezone

import numpy as np
import pytest
import scipy.io

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import BENCH_VALVE, Drive, Valve
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.recorded_valve import Stretch
from valve_friction_ros.records.recordings import ReadingOptions, holds_force, read_recordings
from valve_friction_ros.records.table import read_columns

HEADER = "time_s,position_m,pressure_pa"
TIME = np.arange(40) / 1000
POSITION = 1e-3 + np.sin(TIME) / 100
PRESSURE = 1e5 + 1e4 * np.cos(TIME)


def rows(*columns):
    return [",".join(map(repr, row)) for row in zip(*(c.tolist() for c in columns), strict=True)]


GOOD = rows(TIME, POSITION, PRESSURE)


def with_row(number, text):
    """Replace the good row of that number, as a spreadsheet counts (the header is row 1)."""
    lines = [HEADER, *GOOD]
    lines[number - 1] = text
    return lines


@pytest.fixture
def write(tmp_path):
    def write(lines, name="record.csv", newline="\n"):
        path = tmp_path / name
        path.write_bytes((newline.join(lines) + newline).encode())
        return path

    return write


def recorded(path, valve=BENCH_VALVE, form=None, stretch=None):
    options = ReadingOptions(form or Columns(), stretch=stretch or Stretch())
    (found,) = read_recordings(path, valve, options)
    return found


def read_csv(*arguments, **options):
    return recorded(*arguments, **options).recording()


def refused(path, valve=BENCH_VALVE, form=None, stretch=None):
    """Message of the refusal: one line that begins with the file."""
    with pytest.raises((ValueError, RefusalError)) as refusal:
        read_csv(path, valve, form, stretch)
    file, _, message = str(refusal.value).partition(": ")
    assert file == str(path)
    assert "\n" not in message
    return message


def assert_good(record):
    np.testing.assert_array_equal(record.position, POSITION)
    np.testing.assert_array_equal(record.pressure, PRESSURE)
    assert record.sample_period == 1e-3
    assert record.start_time == 0.0


class TestGoodFiles:
    @pytest.mark.parametrize("name", ["record.csv", "record.csv.gz"])
    def test_gzipped_or_not_whatever_its_name(self, write, name):
        """Told by the first bytes: names lie after a download or a decompression."""
        path = write([HEADER, *GOOD], name)
        assert_good(read_csv(path))
        path.write_bytes(gzip.compress(path.read_bytes()))
        assert_good(read_csv(path))

    @pytest.mark.parametrize("factor", [1, 1_000_000])
    def test_days_of_a_clock_are_local_where_a_zone_is_given(self, write, factor):
        """Days since 1899-12-30, or WinCC's millionths of them; summer in Berlin is UTC + 2 h."""
        noon = datetime(2026, 7, 1, 12, tzinfo=timezone.utc).timestamp()
        days = (noon + np.arange(40) / 10) / 86_400 + 25_569
        lines = ["Time_ms,position (m),pressure (Pa)"]
        lines += [
            f"{factor * day:.9f},{row}"
            for day, row in zip(days, rows(POSITION, PRESSURE), strict=True)
        ]
        for zone, shift in (("", 0.0), ("Europe/Berlin", -7200.0)):
            found = read_csv(write(lines), form=Columns(time_zone=zone))
            assert found.start_time == pytest.approx(noon + shift, abs=1e-3)
            assert found.sample_period == pytest.approx(0.1, rel=1e-3)

    def test_spaces_blank_rows_and_quotes(self, write):
        lines = [" time_s , position_m,pressure_pa", *GOOD[:5], "", *GOOD[5:]]
        lines[3] = ",".join(f' "{entry}"'.strip() for entry in lines[3].split(","))
        lines[4] = lines[4].replace(",", " ,  ")
        assert_good(read_csv(write(lines)))

    def test_further_columns_and_any_order(self, write):
        lines = ["note,pressure_pa,tag,position_m,time_s,force_n"]
        unknown = np.full(TIME.size, math.nan)
        lines += [f'"a, ""b""",{row},' for row in rows(PRESSURE, unknown, POSITION, TIME)]
        assert_good(read_csv(write(lines)))

    def test_other_headers(self, write):
        form = Columns(time_column="t", position_column="Weg [m]", pressure_column="Druck, Pa")
        path = write(['t,Weg [m],"Druck, Pa"', *GOOD])
        assert_good(read_csv(path, form=form))

    @pytest.mark.parametrize(("unit", "size"), [("N", 1.0), ("kN", 1000.0)])
    def test_force_stands_for_pressure(self, write, unit, size):
        """(100 N + 2 N·i)/0.5 m² + 8 Pa: exact. Without a diaphragm it stays a force."""
        force = 100.0 + 2 * np.arange(40)
        path = write(["time_s,position_m,force_n", *rows(TIME, POSITION, force)])
        form = Columns(force_unit=unit)
        record = read_csv(path, Valve(0.5, pressure_reference=8.0), form)
        np.testing.assert_array_equal(record.pressure, size * force / 0.5 + 8.0)
        record = read_csv(path, Valve(), form)
        assert record.driven_by is Drive.FORCE
        np.testing.assert_array_equal(record.drive, size * force)

    def test_pressure_goes_before_force(self, write):
        path = write([HEADER + ",force_n", *(row + ",1.0" for row in GOOD)])
        assert not holds_force(path, ReadingOptions())
        assert_good(read_csv(path))

    @pytest.mark.parametrize(
        ("header", "unit", "size"),
        [("time_s", "", 1.0), ("time_s", "ns", 1e9), ("t", "", 1e9)],
        ids=["seconds", "a stated unit", "known by their size"],
    )
    def test_times_of_a_clock(self, write, header, unit, size):
        """Doubles of this century are 238 to 256 ns apart: so far may a stamp be off."""
        stamps = 1.7e9 * size + size * TIME
        path = write([f"{header},position_m,pressure_pa", *rows(stamps, POSITION, PRESSURE)])
        record = read_csv(path, form=Columns(time_unit=unit))
        assert record.start_time == 1.7e9
        assert record.sample_period == pytest.approx(1e-3, abs=2.56e-7)

    def test_times_rounded_to_nanoseconds(self, write):
        lines = [HEADER, *rows(TIME + 1e-12 * (-1.0) ** np.arange(40), POSITION, PRESSURE)]
        assert_good(read_csv(write(lines)))

    def test_columns_alone(self, write):
        found = read_columns(write([HEADER, *GOOD]), ("pressure_pa", "time_s"))
        assert list(found) == ["pressure_pa", "time_s"]
        np.testing.assert_array_equal(found["pressure_pa"], PRESSURE)
        np.testing.assert_array_equal(found["time_s"], TIME)


class TestUnitsAndLayout:
    @pytest.mark.parametrize(
        "layout",
        [
            {},
            {"delimiter": ";"},
            {"delimiter": "\t"},
            {"delimiter": "|"},
            {"delimiter": " "},
            {"delimiter": ";", "decimal": ","},
            {"delimiter": "\t", "decimal": ","},
        ],
    )
    def test_layout(self, write, layout):
        marks = str.maketrans(",.", layout.get("delimiter", ",") + layout.get("decimal", "."))
        path = write([line.translate(marks) for line in (HEADER, *GOOD)])
        assert_good(read_csv(path, form=Columns(**layout)))

    def test_units(self, write):
        """Whole µm and Pa: to the last bit."""
        micrometres, pascals = np.rint(1e6 * POSITION), np.rint(PRESSURE)
        form = Columns(time_unit="ms", position_unit="um", pressure_unit="hPa")
        path = write([HEADER, *rows(1e3 * TIME, micrometres, pascals / 100)])
        record = read_csv(path, form=form)
        np.testing.assert_array_equal(record.position, micrometres / 1e6)
        np.testing.assert_allclose(record.pressure, pascals, rtol=2**-52)
        assert record.sample_period == 1e-3

    def test_percent_of_the_travel(self, write):
        form = Columns(position_unit="percent")
        percent = np.linspace(10, 90, 40)
        path = write([HEADER, *rows(TIME, percent, PRESSURE)])
        record = read_csv(path, form=form)
        np.testing.assert_array_equal(record.position, percent * BENCH_VALVE.travel / 100)
        assert refused(path, Valve(0.0445), form) == (
            "a position in percent is a share of the travel: give the travel in the valve file"
        )

    def test_range_of_the_sensor_in_another_unit(self, write):
        path = write([HEADER, *rows(TIME, POSITION, np.linspace(100, 300, 40))])
        form = Columns(pressure_unit="kPa")
        assert refused(path, form=form).startswith(
            "row 33, column 'pressure_pa': 258.974 kPa is outside the sensor's range 0 to 250000 Pa"
        )

    @pytest.mark.parametrize(
        ("form", "message"),
        [
            ({"pressure_unit": "torr"}, "unknown unit of pressure 'torr'; known are Pa, "),
            ({"time_unit": "week"}, "unknown unit of time 'week'; known are ns, us, ms, s, min, h"),
            ({"delimiter": ";;"}, "the delimiter must be one character"),
            ({"delimiter": "."}, "the delimiter must be one character"),
            ({"delimiter": "e"}, "the delimiter must be one character"),
            ({"decimal": ";"}, "the decimal mark must be '.' or ',', got ';'"),
        ],
    )
    def test_impossible(self, form, message):
        with pytest.raises(ValueError, match=re.escape(message)):
            Columns(**form)


class TestStretch:
    def test_arrays_of_pandas_may_be_read_only(self, write):
        pandas = pytest.importorskip("pandas")
        path = write([HEADER, *GOOD])
        with pandas.option_context("mode.copy_on_write", True):  # as always from pandas 3 on
            assert len(read_csv(path, stretch=Stretch(begin=0.01))) == 30

    @pytest.mark.parametrize(
        ("stretch", "first", "last"),
        [
            (Stretch(begin=0.01), 10, 39),
            (Stretch(end=0.02), 0, 20),
            (Stretch(begin=0.005, end=0.0305), 5, 30),
            (Stretch(last=0.01), 29, 39),
            (Stretch(end=0.03, last=0.01), 20, 30),
            (Stretch(last=100.0), 0, 39),
        ],
    )
    def test_both_ends_belong_to_it(self, write, stretch, first, last):
        path = write([HEADER, *rows(5.0 + TIME, POSITION, PRESSURE)])
        record = read_csv(path, stretch=stretch)
        np.testing.assert_array_equal(record.position, POSITION[first : last + 1])

    @pytest.mark.parametrize("bad", ["0.01,0.003,3e5", "0.0001,0.003,1e5"])
    def test_what_is_bad_outside_does_not_matter(self, write, bad):
        path = write(with_row(12, bad))
        assert refused(path).startswith("row 12, column ")
        for stretch, size in ((Stretch(begin=0.0105), 29), (Stretch(begin=0.0005, end=0.0095), 9)):
            assert len(read_csv(path, stretch=stretch)) == size

    @pytest.mark.parametrize("bad", [{"begin": 2, "end": 2}, {"begin": math.nan}, {"last": 0}])
    def test_impossible(self, bad):
        with pytest.raises(ValueError, match=r"cannot begin|must be above zero"):
            Stretch(**bad)


class TestColumns:
    """What is missing or ambiguous is asked for at once, each with its option."""

    def test_the_file_of_the_other_signal_is_asked_for(self, write):
        message = refused(write(["time_s,pressure_pa", *rows(TIME, PRESSURE)]))
        assert message.startswith(
            "cannot tell which column is the position, of time_s, pressure_pa (--position-column); "
            "if another file holds it, give both files"
        )

    @pytest.mark.parametrize(
        ("header", "asked"),
        [
            ("a,position_m,pressure_pa", "which column is the time (--time-column a)"),
            ("time_s,b,pressure_pa", "which column is the position (--position-column b)"),
            ("time_s,position_m,c", "which column is the pressure (--pressure-column c)"),
            (
                "time_s,b,c",
                "which column is the pressure (--pressure-column b or c), and its unit "
                "(--pressure-unit); which column is the position (--position-column b or c), and ",
            ),
            ("time_s,position_m,Druck", "the unit of the pressure 'Druck', values from 10"),
            ("time_s,Hub,pressure_pa", "the unit of the position 'Hub', values from 0.001 to 0."),
        ],
    )
    def test_asked_for(self, write, header, asked):
        assert refused(write([header, *GOOD])).startswith(f"cannot tell {asked}")

    @pytest.mark.parametrize(
        ("header", "size"),
        [
            ("time_s,position_m,p_bar", {"pressure": 1e5}),
            ("time_s,position_m,P [kpa]", {"pressure": 1e3}),
            ("time_s,travel (mm),Actuator pressure / Pa", {"position": 1e-3}),
            ("time_s,Hub in mm,Druck (Pa)", {"position": 1e-3}),
        ],
    )
    def test_units_of_headers(self, write, header, size):
        record = read_csv(write([header, *GOOD]), Valve(0.0445))
        np.testing.assert_allclose(record.position, POSITION * size.get("position", 1), rtol=1e-14)
        np.testing.assert_allclose(record.pressure, PRESSURE * size.get("pressure", 1), rtol=1e-14)

    def test_a_named_column_without_a_unit_is_in_its_si_unit(self, write):
        """As files of earlier versions mean it."""
        path = write(["time_s,Stem,Air", *GOOD])
        assert_good(read_csv(path, form=Columns(position_column="Stem", pressure_column="Air")))

    def test_the_unit_of_a_named_column_that_cannot_be_si_is_asked_for(self, write):
        """1.2 of a pressure may be bar; Pa would be read wrongly without a word."""
        path = write(["time_s,Stem,Air", *rows(TIME, 1e3 * POSITION, 1e-5 * PRESSURE)])
        form = Columns(position_column="Stem", pressure_column="Air")
        told = refused(path, form=form)
        assert "the unit of the pressure 'Air', values from 1.09992 to 1.1" in told
        assert "the unit of the position 'Stem'" in told
        record = read_csv(path, form=replace(form, position_unit="mm", pressure_unit="bar"))
        np.testing.assert_allclose(record.position, POSITION, rtol=1e-12)
        np.testing.assert_allclose(record.pressure, PRESSURE, rtol=1e-12)

    def test_all_that_the_valve_file_names_and_the_file_lacks(self, write):
        form = Columns(time_column="Zeit", position_column="Hub", pressure_column="pressure_pa")
        assert refused(write([HEADER, *GOOD]), form=form) == (
            "cannot tell which column is 'Zeit' (--time-column), 'Hub' (--position-column), as the "
            "valve file or an option names it; columns: time_s, position_m, pressure_pa"
        )

    def test_twice(self, write):
        path = write(["time_s,position_m,pressure_pa,position_m", *(row + ",0" for row in GOOD)])
        assert "(--position-column 'position_m (1)' or 'position_m (2)')" in refused(path)
        assert_good(read_csv(path, form=Columns(position_column="position_m (1)")))

    def test_times_that_repeat_end_the_reading(self, tmp_path):
        """At the first block: a row beyond it, which cannot be read, is not looked at."""
        lines = [HEADER, *("100000,0,1e5" for _ in range(20_000)), "x,x,x"]
        path = tmp_path / "record.csv.gz"
        path.write_bytes(gzip.compress("\n".join(lines).encode()))
        assert refused(path).startswith("row 3, column 'time_s' repeats (")


class TestEntries:
    """Bad entries are left out and told, up to a share; beyond it the first is named."""

    BAD = ("closed", "1_000", "١", "0x10", '"0,003"', "#N/A", "nan", "-inf", "1e999", "Bad Input")

    @pytest.mark.parametrize("entry", BAD)
    @pytest.mark.parametrize("column", [0, 1, 2])
    def test_left_out(self, write, entry, column):
        cells = GOOD[10].split(",")
        cells[column] = entry
        found = recorded(write(with_row(12, ",".join(cells))))
        stamped = found.recording().stamped
        for signal, all_of_it, is_hit in (
            (stamped.position, POSITION, column in (0, 1)),
            (stamped.drive, PRESSURE, column in (0, 2)),
        ):
            kept = (np.arange(40) != 10) | (not is_hit)
            np.testing.assert_array_equal(signal.value, all_of_it[kept])
        told = [note for note in found.notes if "left out" in note]
        name = HEADER.split(",")[max(column, 1)]
        assert any(f"1 of 40 values of {name!r} are bad and were left out" in note for note in told)

    def test_an_empty_entry_is_no_value(self, write):
        """Two signals of their own rates share a table."""
        found = recorded(write(with_row(12, "0.01,,1e5")))
        assert found.notes == ()
        assert found.recording().stamped.position.value.size == 39
        missing = read_csv(write(with_row(12, "0.01,0.003")))
        assert missing.stamped.drive.value.size == 39

    def test_single_zeros(self, write):
        """A signal of a historian that falls to 0 for one sample has lost its transmitter.

        Zeros next to small values are the closed valve.
        """
        time = np.arange(400) / 10
        position = np.maximum(40 * np.sin(time / 4), 0.01 * (np.arange(400) % 2))  # mm
        pressure = 1 + 0.5 * np.sin(time / 4)  # bar
        lost = {"position": [25, 30, 300], "pressure": [100, 300]}
        shown = {"position": position.copy(), "pressure": pressure.copy()}
        for name, places in lost.items():
            shown[name][places] = 0.0
        heads = "Time [s],Stem position [mm],Actuator pressure [bar]"
        found = recorded(write([heads, *rows(time, *shown.values())]), Valve(0.05, travel=0.04))
        stamped = found.recording().stamped
        np.testing.assert_array_equal(
            stamped.position.value, np.delete(position, [25, 30, 300]) / 1e3
        )
        np.testing.assert_array_equal(stamped.drive.value, np.delete(pressure, [100, 300]) * 1e5)
        assert [note.partition(" ")[0] for note in found.notes if "('dropout to 0' " in note] == [
            "2",
            "3",
        ]

    def test_zeros_in_a_row_are_told(self, write):
        """They are kept: a valve that is shut and opened again from sample to sample reads so."""
        time = np.arange(400) / 10
        position, pressure = 20 + 10 * np.sin(time / 4), 1 + 0.5 * np.sin(time / 4)
        pressure[100:111] = pressure[300:302] = 0.0
        heads = "Time [s],Stem position [mm],Actuator pressure [bar]"
        found = recorded(write([heads, *rows(time, position, pressure)]), Valve(0.05, travel=0.04))
        assert found.notes[1:] == (
            "'Actuator pressure [bar]' jumps to 0 for 11 samples from row 102 on (one of 2 such "
            "runs): if its transmitter failed then, empty these cells",
        )
        assert np.count_nonzero(found.recording().drive) == 387

    def test_beyond_the_share(self, write):
        lines = with_row(12, "0.01,closed,1e5")
        lines[20:23] = ["0.019,open,1e5", "0.02,open,1e5", "0.021,open,1e5"]
        path = write(lines)
        assert refused(path).startswith(
            "row 12, column 'position_m': 'closed' is not a valid value, and 4 of 40 values of "
            "'position_m' are bad, more than 5 %"
        )
        assert "(--maximum-bad-share 0.11)" in refused(path)
        assert read_csv(path, form=Columns(maximum_bad_share=0.11))

    @pytest.mark.parametrize(
        ("pressure", "inside"),
        [(-3125.0, True), (257812.5, True), (-3125.1, False), (257812.6, False)],
    )
    def test_range_of_the_sensor(self, write, pressure, inside):
        """With what NAMUR NE 43 reserves beyond it: 3.8 to 20.5 mA, −1/80 and +1/32 of the span."""
        path = write(with_row(12, f"0.01,0.003,{pressure!r}"))
        if inside:
            assert read_csv(path).pressure[10] == pressure
        else:
            assert refused(path) == (
                f"row 12, column 'pressure_pa': {pressure:g} Pa is outside the sensor's range 0 to "
                "250000 Pa: use a stretch of the record without it, specify its unit, or correct "
                "the range"
            )


HIGH = "column 'pressure_pa': 300000 Pa is outside the sensor's range 0 to 250000 Pa: "


@pytest.mark.parametrize(
    ("lines", "stretch", "message"),
    [
        (with_row(22, "0.02,0,3e5"), Stretch(begin=0.01), f"row 22, {HIGH}"),
        (["", "", *with_row(12, "0.01,0,3e5")], None, f"row 14, {HIGH}"),
        ([HEADER, *GOOD], Stretch(begin=1.0), "the chosen stretch holds no rows: choose another "),
        (
            with_row(12, "0.009,0.003,1e5"),
            None,
            "row 12, column 'time_s' repeats (0.009 s after 0.009 s): export it with fractions of "
            "a second, or delete one of the rows",
        ),
        (
            with_row(12, "0.0,0.003,1e5"),
            None,
            "row 12, column 'time_s' goes back (0 s after 0.009 s): "
            "sort the rows, or use the record before or after it",
        ),
        ([HEADER, GOOD[0]], None, "only one sample of pressure_pa: check that it is sampled, and"),
        ([HEADER], None, "cannot tell what it holds: there are no values under the header"),
    ],
    ids=["from the top", "blank rows", "empty stretch", "repeated", "back", "one", "none"],
)
def test_what_is_wrong_with_the_rows_is_said_with_its_row(write, lines, stretch, message):
    assert refused(write(lines), stretch=stretch).startswith(message)


class TestTimes:
    def test_gap(self, write):
        """From row 12 on, the samples come 20 ms later: 21 periods without one."""
        late = TIME + 0.02 * (np.arange(40) >= 10)
        record = read_csv(write([HEADER, *rows(late, 0.1 * late, 1e6 * late)]))
        assert record.gap == (
            "row 12, column 'time_s': gap of 0.021 s: use a stretch without it (--begin, --end)"
        )
        assert len(record) == 60
        np.testing.assert_array_equal(record.stamped.position.value, 0.1 * late)

    def test_ten_periods_are_no_gap_and_more_than_the_samples_is_a_refusal(self, write):
        late = TIME + 0.009 * (np.arange(40) >= 10)
        record = read_csv(write([HEADER, *rows(late, POSITION, PRESSURE)]))
        assert (len(record), record.gap) == (49, "")
        late = TIME + 0.04 * (np.arange(40) >= 10)
        with pytest.raises(RefusalError, match=r"row 12, column 'time_s': gap of 0.041 s: use a "):
            read_csv(write([HEADER, *rows(late, 0.1 * late, 1e6 * late)]))

    @pytest.mark.parametrize("form", ["%d.%m.%Y", "%m/%d/%Y", "%d-%m-%Y", "%Y-%m-%d"])
    @pytest.mark.parametrize("mark", [".", ","])
    def test_dates_in_any_order_with_and_without_zeros_and_fractions(self, write, form, mark):
        """The 13th of March, from 9:59:58.5 on, every half second."""
        begin = datetime(2026, 3, 13, 9, 59, 58, 500_000, timezone.utc)
        lines = ["Time;Position [m];Pressure [Pa]"]
        for index in range(40):
            moment = begin + timedelta(seconds=0.5 * index)
            date = moment.strftime(form)
            date = date.replace("03", "3") if index % 3 == 0 and form != "%Y-%m-%d" else date
            fraction = f"{mark}5" if moment.microsecond else f"{mark}000" if index % 4 else ""
            lines.append(f"{date} {moment:%H:%M:%S}{fraction};{index / 1000};{1e5 + index}")
        record = read_csv(write(lines))
        assert record.start_time == begin.timestamp()
        assert record.sample_period == 0.5
        np.testing.assert_array_equal(record.position, np.arange(40) / 1000)


class TestUnreadableFiles:
    def test_missing(self, tmp_path):
        message = refused(tmp_path / "record.csv")
        assert message == "cannot be read as CSV: No such file or directory"

    @pytest.mark.parametrize("ending", ["csv", "csv.gz"])
    def test_empty(self, tmp_path, ending):
        path = tmp_path / f"record.{ending}"
        path.write_bytes(b"")
        assert refused(path) == "the file is empty"

    @pytest.mark.parametrize(
        ("start", "told"),
        [
            (b"\x89HDF\r\n\x1a\n\0\0", "as a table: an HDF5 file: save it as Parquet or CSV"),
            (b"ARROW1\0\0", "as a table: a Feather file: save it as Parquet or CSV"),
            (b"TDSm\x0e\0\0\0", "as a table: a LabVIEW TDMS file: export it as .lvm or CSV"),
            (b"\x80\x05\x95", "as CSV: a binary file: export it as CSV, .xlsx, Parquet or MAT"),
            (b"<?xml version='1.0'?>\n", "as CSV: a page in HTML or XML: save it from a spread"),
            (b'[{"time":0,"value":1},\n', "as CSV: JSON: save it as CSV, one row for each time"),
        ],
    )
    def test_other_files(self, tmp_path, start, told):
        """Their bytes were read as a text in Windows-1252, and asked for its delimiter."""
        path = tmp_path / "record.csv"
        noise = np.random.default_rng(1).integers(0, 256, 5000, np.uint8).tobytes()
        path.write_bytes(start + noise)
        assert refused(path).startswith(f"cannot be read {told}")

    def test_archives_and_matrices(self, tmp_path):
        with zipfile.ZipFile(tmp_path / "a.zip", "w") as packed:
            packed.writestr("record.csv", HEADER)
        assert "an archive, but not an Excel workbook" in refused(tmp_path / "a.zip")
        scipy.io.savemat(tmp_path / "a.mat", {"data": np.ones((9, 3)), "log": {"t": TIME}})
        assert refused(tmp_path / "a.mat").endswith("but data, log: save each signal as a vector")

    def test_no_header(self, write):
        """Columns are then called by their numbers."""
        assert "which column is the time (--time-column 1 or 2 or 3)" in refused(write(GOOD))
        form = Columns(time_column="1", position_column="2", pressure_column="3")
        assert_good(read_csv(write(GOOD), form=form))

    def test_another_encoding(self, write):
        path = write([HEADER, *GOOD])
        path.write_bytes(path.read_bytes() + b"0.04,\xff,1e5\n")
        assert len(read_csv(path)) == 40
        message = refused(path, form=Columns(encoding="utf-8"))
        assert message.startswith("cannot be read as CSV: 'utf-8' codec can't decode byte")
        assert message.endswith("specify its encoding (--encoding)")

    def test_no_table_at_all(self, tmp_path):
        path = tmp_path / "record.csv"
        path.write_bytes(b"x" * 200_000)
        assert refused(path).startswith(f"only one column, '{'x' * 40}…'")
        path.write_bytes(b"x" * 2_000_000)
        assert refused(path).startswith("cannot be read as CSV: a line has more than 1048576 bytes")
        path.write_bytes("\n".join([HEADER, *GOOD[:10], ""]).encode() + b'"' + b"x\n" * 1_000_000)
        assert refused(path).startswith(
            "cannot be read as CSV: a quote is not closed within 1048576"
        )

    def test_more_columns_than_a_spreadsheet(self, write):
        """It was analysed for minutes."""
        wide = ",1" * 20_000
        path = write([HEADER + wide, *(row + wide for row in GOOD)])
        assert "20003 columns, more than a spreadsheet has" in refused(path)

    def test_wide_rows(self, write):
        """Fewer are looked at; all are read."""
        header, wide = HEADER + ",other" * 4_000, ",1" * 4_000
        assert_good(read_csv(write([header, *(row + wide for row in GOOD)])))

    def test_a_compressed_file_of_matlab(self, tmp_path):
        """Its size is that of its signals, not of the file."""
        signals = {name: np.zeros(100_000) for name in ("t", "p_bar", "x_mm")}
        scipy.io.savemat(tmp_path / "a.mat", signals, do_compression=True)
        message = refused(tmp_path / "a.mat", form=Columns(maximum_megabytes=2.0))
        assert "2.4 MB, unpacked: raise maximum_megabytes" in message

    def test_gzip_damaged(self, write):
        """At half its length, in the first block (3 is no type of one), and in the checksum."""
        random = np.random.default_rng(2)
        time = np.arange(20_000) / 1000  # enough that the header can be read without the end
        lines = [HEADER, *rows(time, random.random(time.size), 1e5 * random.random(time.size))]
        path = write(lines)
        whole = gzip.compress(path.read_bytes())
        for content, cause in (
            (whole[: len(whole) // 2], "Compressed file ended before"),
            (whole[:10] + b"\x06" + whole[11:], "Error -3 while decompressing data: invalid block"),
            (whole[:-8] + bytes([whole[-8] ^ 0xFF]) + whole[-7:], "CRC check failed"),
        ):
            path.write_bytes(content)
            assert refused(path).startswith(f"cannot be read as CSV: {cause}")


BARS = [f"{value:.3f}" for value in PRESSURE / 1e5]
SHARES = [f"{value:.4f}" for value in 20 + TIME * 1e3]  # %
TENTHS = [f"{one / 10:.1f}" for one in range(40)]
AXIS = np.array([float(one) for one in TENTHS])


def lines(header, *columns, mark=","):
    return [header, *(mark.join(row) for row in zip(*columns, strict=True))]


class TestAmbiguousFiles:
    """Files that can be read in two ways: the message names the option, which then gives one."""

    @pytest.mark.parametrize(
        ("header", "time", "pressure", "position", "asked", "answer"),
        [
            (
                "Time [s],Air [bar],Stem [%]",
                TENTHS,
                BARS,
                [f"{one / 50:.3f}" for one in range(40)],
                "--position-unit fraction",
                {"position_unit": "fraction"},
            ),
            (
                "Time [s],Air [mbar],Stem [%]",
                TENTHS,
                [f"{one:.3f}" for one in PRESSURE / 1e5],
                SHARES,
                "--decimal if these are thousands",
                {"pressure_unit": "bar"},
            ),
            (
                "Time,Air [bar],Stem [%]",
                [f"{one:.0f}" for one in 100 * np.arange(40)],
                BARS,
                SHARES,
                "--time-unit ms",
                {"time_unit": "ms", "time_column": "Time"},
            ),
        ],
        ids=["fraction", "thousands", "named milliseconds"],
    )
    def test_units(self, write, header, time, pressure, position, asked, answer):
        path = write(lines(header, time, pressure, position))
        assert asked in refused(path, form=Columns(time_column=answer.get("time_column", "")))
        found = read_csv(path, form=Columns(**answer))
        assert found.time == pytest.approx(AXIS)
        assert found.pressure == pytest.approx(PRESSURE, abs=51)
        share = 1 if "position_unit" in answer else 100
        true = [float(one) / share * BENCH_VALVE.travel for one in position]
        assert found.position == pytest.approx(true)

    def test_minutes(self, write):
        minutes = [f"{one / 400:.4f}" for one in range(40)]
        path = write(lines("Time,Air [bar],Stem [%]", minutes, BARS, SHARES))
        assert "rises by 0.0975 in total (--time-unit s or --time-unit min)" in refused(path)
        assert read_csv(path, form=Columns(time_unit="min")).sample_period == 0.15

    def test_more_entries_than_headers(self, write):
        """Decimal commas between commas: 101,5 would be 101 bar at a stem of 5 %."""
        rows = [f"{one},101,5,20,{one % 10}" for one in range(40)]
        assert "5 entries and 3 headers" in refused(write(["t [ms],Air [kPa],Stem [%]", *rows]))

    def test_thousands_that_are_integers(self, write):
        """1.010 mbar beside 990: thousands, not 1.01."""
        pressure = [f"{one:,d}".replace(",", ".") for one in range(960, 1040, 2)]
        whole = [str(one % 20) for one in range(40)]
        path = write(
            lines("t [s];Air [mbar];Stem [mm]", map(str, range(40)), pressure, whole, mark=";")
        )
        assert "(--decimal , or --decimal .)" in refused(path)
        found = read_csv(path, form=Columns(decimal=","))
        assert found.pressure == pytest.approx(np.arange(96e3, 104e3, 200))

    def test_thousands_apart(self, write):
        pressure = [f"{one:,.1f}".replace(",", " ").replace(".", ",") for one in PRESSURE.tolist()]
        stem = [f"{one:.4f}".replace(".", ",") for one in 1e3 * POSITION]
        path = write(
            lines("t [ms];Air [Pa];Stem [mm]", map(str, range(40)), pressure, stem, mark=";")
        )
        assert read_csv(path).pressure == pytest.approx(PRESSURE, abs=0.06)


class TestWrittenDates:
    @pytest.mark.parametrize(
        ("date", "asked"), [("26/07/05", ""), ("26/07/15", "--time-format '%y/%m/%d %H:%M:%S.%f'")]
    )
    def test_a_short_year_first(self, write, date, asked):
        """The day first, the former would be of 2001; the latter of 2015."""
        stamps = [f"{date} 12:00:0{one}" for one in TENTHS]
        path, form = write(lines("Time,Air [bar],Stem [%]", stamps, BARS, SHARES)), Columns()
        if asked:
            assert asked in refused(path)
            form = Columns(time_format="%y/%m/%d %H:%M:%S.%f")
        noon = datetime(2026, 7, int(date[-2:]), 12, tzinfo=timezone.utc)
        assert read_csv(path, form=form).start_time == noon.timestamp()

    @pytest.mark.parametrize("zone", ["UTC+05:30", "MESZ", "EST"])
    def test_a_zone_above_the_values_that_no_database_has(self, write, zone):
        stamps = [f"2026-07-15 12:00:0{one}" for one in TENTHS]
        path = write(lines(f"Time ({zone}),Air [bar],Stem [%]", stamps, BARS, SHARES))
        assert f"the time zone that '{zone}' above" in refused(path)
        read_csv(path, form=Columns(time_zone="Asia/Kolkata"))

    def test_hours_and_minutes(self, write):
        stamps = [f"14:{one:02d}" for one in range(5, 45)]
        path = write(lines("Time,Air [bar],Stem [%]", stamps, BARS, SHARES))
        assert "(--time-unit min)" in refused(path)
        for unit, period in (("min", 60.0), ("s", 1.0)):
            assert read_csv(path, form=Columns(time_unit=unit)).sample_period == period

    @pytest.mark.parametrize(
        ("begin", "form"),
        [("23:59:58", "%H:%M:%S.%f"), ("11:59:58", "%I:%M:%S.%f %p")],
        ids=["midnight", "noon"],
    )
    def test_a_time_of_day_goes_on(self, write, begin, form):
        first = datetime.strptime(begin, "%H:%M:%S")
        stamps = [f"{first + timedelta(seconds=one):{form}}" for one in AXIS]
        found = read_csv(write(lines("Time,Air [bar],Stem [%]", stamps, BARS, SHARES)))
        assert found.time == pytest.approx(AXIS)

    def test_a_workbook_with_a_column_for_the_day(self, tmp_path):
        openpyxl = pytest.importorskip("openpyxl")
        book = openpyxl.Workbook()
        book.active.append(["Date", "Time", "Air [bar]", "Stem [%]"])
        noon = datetime(2026, 7, 1, 12, tzinfo=timezone.utc)
        for since, bar, share in zip(AXIS, BARS, SHARES, strict=True):
            moment = noon + timedelta(seconds=since)
            book.active.append([moment.date(), moment.time(), float(bar), float(share)])
        book.save(tmp_path / "record.xlsx")
        assert read_csv(tmp_path / "record.xlsx").start_time == noon.timestamp()


class TestQualities:
    def test_a_code_that_was_the_same_at_first(self, write):
        """Of OPC UA: 0 is good, and a greater code is not better."""
        codes = ["0"] * 390 + ["2147483648"] * 10
        times, air = [f"{one / 10:.1f}" for one in range(400)], ["1.0"] * 390 + ["0.0"] * 10
        path = write(lines("t [s],Air [bar],StatusCode,Stem [mm]", times, air, codes, times))
        assert read_csv(path).pressure.min() == 1e5

    def test_a_doubt_is_no_praise(self, write):
        doubts = ["False"] * 39 + ["True"]
        path = write(lines("t [s],Air [bar],Questionable,Stem [%]", TENTHS, BARS, doubts, SHARES))
        assert len(read_csv(path).time) == 39


def test_tags_of_control_systems(write):
    """DeltaV's PV.CV is a value, not a command."""
    rows = []
    for time, bar, share in zip(TENTHS, BARS, SHARES, strict=True):
        rows.append(f"2026-07-15 12:00:0{time},FV-101/PT1/PV.CV,{bar},Good")
        rows.append(f"2026-07-15 12:00:0{time},FV-101/ZT1/PV.CV,{share},Good")
    path = write(["Date/Time,Parameter,Value,Status", *rows])
    form = Columns(pressure_unit="bar", position_unit="percent")
    assert read_csv(path, form=form).pressure == pytest.approx(PRESSURE, abs=51)
    path = write(["Date/Time,Bezeichner,Value,Status", *rows])
    assert "which column is the tag (--tag-column Bezeichner" in refused(path, form=form)
    assert len(read_csv(path, form=replace(form, tag_column="Bezeichner")).time) == 40


def test_the_supply_is_not_the_pressure_of_the_actuator(write):
    header = "t [s],Instrument air pressure [bar],Stem [%],Actuator pressure [bar]"
    path = write(lines(header, TENTHS, ["5.5"] * 40, SHARES, BARS))
    assert read_csv(path).pressure == pytest.approx(PRESSURE, abs=51)
    header = "t [s],Instrument air pressure [bar],Stem [%],Stem force [N]"
    path = write(lines(header, TENTHS, ["5.5"] * 40, SHARES, ["900.0"] * 40))
    assert recorded(path).notes[0].count("force 'Stem force [N]'") == 1


def test_range_and_travel_are_asked_for_together(write):
    path = write(lines("t [s],Air [mA],Stem [mA]", TENTHS, TENTHS, TENTHS))
    message = refused(path, Valve(0.0445))
    assert "(--pressure-range '0..2.5 bar'" in message
    assert "give the travel in the valve file" in message


def test_units_below_merged_cells(write):
    """The headers look like those of TwinCAT Scope, which are alike in every other column."""
    stamps = [f"2026-07-15 12:00:0{one}" for one in TENTHS]
    rows = lines("FV-1;;FV-1;", stamps, BARS, stamps, SHARES, mark=";")
    rows[1:1] = ["Time;Actual;Time;Actual", ";bar;;%"]
    form = Columns(position_column="FV-1 Actual (2)")
    assert read_csv(write(rows), form=form).pressure == pytest.approx(PRESSURE, abs=51)


def test_tags_with_their_folder(write):
    """A table of Ignition with tags of several valves; no header has the word for the values."""
    rows = []
    for time, bar, share in zip(TENTHS, BARS, SHARES, strict=True):
        for valve in ("FV-1", "FV-2"):
            rows.append(f"2026-07-15 12:00:0{time},[default]Plant/{valve}/PT,{bar},bar")
            rows.append(f"2026-07-15 12:00:0{time},[default]Plant/{valve}/ZT,{share},%")
    path = write(["t_stamp,tagpath,floatvalue,units", *rows])
    found = read_recordings(path, BENCH_VALVE)
    assert [one.name for one in found] == ["Plant/FV-1", "Plant/FV-2"]
    assert found[1].recording().pressure == pytest.approx(PRESSURE, abs=51)
