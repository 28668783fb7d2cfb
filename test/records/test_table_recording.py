"""Recordings in CSV files: what is read, and which row and column of a bad file is named."""

import gzip
import math
import re

import numpy as np
import pytest

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import BENCH_VALVE, Drive, Valve
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.stretch import Stretch
from valve_friction_ros.records.table_recording import drive_column, read_table
from valve_friction_ros.records.tables.table import read_columns

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


def read_csv(*arguments, **options):
    return read_table(*arguments, **options).recording()


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
    def test_to_the_last_bit(self, write):
        assert_good(read_csv(write([HEADER, *GOOD]), BENCH_VALVE))

    def test_gzipped(self, write):
        path = write([HEADER, *GOOD])
        packed = path.with_suffix(".csv.gz")
        packed.write_bytes(gzip.compress(path.read_bytes()))
        assert_good(read_csv(packed, BENCH_VALVE))

    def test_gzipped_or_not_whatever_its_name(self, write):
        """Told by the first bytes: names lie after a download or a decompression."""
        assert_good(read_csv(write([HEADER, *GOOD], "record.csv.gz"), BENCH_VALVE))
        path = write([HEADER, *GOOD])
        path.write_bytes(gzip.compress(path.read_bytes()))
        assert_good(read_csv(path, BENCH_VALVE))

    def test_line_ends_and_mark_of_a_spreadsheet(self, write):
        assert_good(read_csv(write(["\ufeff" + HEADER, *GOOD], newline="\r\n"), BENCH_VALVE))

    def test_spaces_blank_rows_and_quotes(self, write):
        lines = [" time_s , position_m,pressure_pa", *GOOD[:5], "", *GOOD[5:]]
        lines[3] = ",".join(f' "{entry}"'.strip() for entry in lines[3].split(","))
        lines[4] = lines[4].replace(",", " ,  ")
        assert_good(read_csv(write(lines), BENCH_VALVE))

    def test_further_columns_and_any_order(self, write):
        lines = ["note,pressure_pa,tag,position_m,time_s,force_n"]
        lines += [
            f'"a, ""b""",{pressure!r},nan,{position!r},{time!r},'
            for time, position, pressure in zip(
                TIME.tolist(), POSITION.tolist(), PRESSURE.tolist(), strict=True
            )
        ]
        assert_good(read_csv(write(lines), BENCH_VALVE))

    def test_other_headers(self, write):
        form = Columns(time_column="t", position_column="Weg [m]", pressure_column="Druck, Pa")
        path = write(['t,Weg [m],"Druck, Pa"', *GOOD])
        assert_good(read_csv(path, BENCH_VALVE, form))

    def test_force_stands_for_pressure(self, write):
        """(100 N + 2 N·i)/0.5 m² + 8 Pa: exact."""
        force = 100.0 + 2 * np.arange(40)
        path = write(["time_s,position_m,force_n", *rows(TIME, POSITION, force)])
        record = read_csv(path, Valve(0.5, pressure_reference=8.0))
        np.testing.assert_array_equal(record.pressure, 208.0 + 4 * np.arange(40))

    def test_force_without_a_diaphragm_stays_a_force(self, write):
        force = 100.0 + 2 * np.arange(40)
        path = write(["time_s,position_m,force_n", *rows(TIME, POSITION, force)])
        record = read_csv(path, Valve())
        assert record.driven_by is Drive.FORCE
        np.testing.assert_array_equal(record.drive, force)

    def test_pressure_goes_before_force(self, write):
        path = write([HEADER + ",force_n", *(row + ",1.0" for row in GOOD)])
        assert drive_column(path, Columns()) == "pressure_pa"
        assert_good(read_csv(path, BENCH_VALVE))

    def test_times_of_a_clock(self, write):
        """Float seconds of this century are 238 ns apart: so far may a stamp be off."""
        path = write([HEADER, *rows(1.7e9 + TIME, POSITION, PRESSURE)])
        record = read_csv(path, BENCH_VALVE)
        assert record.start_time == 1.7e9
        assert record.sample_period == pytest.approx(1e-3, abs=2.4e-7)

    def test_times_rounded_to_nanoseconds(self, write):
        lines = [HEADER, *rows(TIME + 1e-12 * (-1.0) ** np.arange(40), POSITION, PRESSURE)]
        assert_good(read_csv(write(lines), BENCH_VALVE))

    def test_columns_alone(self, write):
        found = read_columns(write([HEADER, *GOOD]), ("pressure_pa", "time_s"))
        assert list(found) == ["pressure_pa", "time_s"]
        np.testing.assert_array_equal(found["pressure_pa"], PRESSURE)
        np.testing.assert_array_equal(found["time_s"], TIME)


class TestUnitsAndLayout:
    def record(self, write, time, position, pressure, units=None, **layout):
        form = Columns(**(units or {}), **layout)
        delimiter, decimal = form.delimiter, form.decimal
        lines = [
            row.replace(".", decimal).replace(";", delimiter)
            for row in (line.replace(",", ";") for line in rows(time, position, pressure))
        ]
        path = write([HEADER.replace(",", delimiter), *lines])
        return read_csv(path, BENCH_VALVE, form)

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
        assert_good(self.record(write, TIME, POSITION, PRESSURE, **layout))

    def test_decimal_comma_of_a_bad_entry(self, write):
        form = Columns(delimiter=";", decimal=",")
        path = write([HEADER.replace(",", ";"), "0,0;0,001;1e5", "0,1;0,00.2;1e5"])
        assert refused(path, form=form) == (
            "row 3, column 'position_m': '0,00.2' is not a number: correct it or delete the row"
        )

    def test_units(self, write):
        """Whole µm and Pa: to the last bit."""
        micrometres, pascals = np.rint(1e6 * POSITION), np.rint(PRESSURE)
        units = {"time_unit": "ms", "position_unit": "um", "pressure_unit": "hPa"}
        record = self.record(write, 1e3 * TIME, micrometres, pascals / 100, units)
        np.testing.assert_array_equal(record.position, micrometres / 1e6)
        np.testing.assert_allclose(record.pressure, pascals, rtol=2**-52)
        assert record.sample_period == 1e-3

    def test_percent_of_the_travel(self, write):
        units = {"position_unit": "percent"}
        percent = np.linspace(10, 90, 40)
        record = self.record(write, TIME, percent, PRESSURE, units)
        np.testing.assert_array_equal(record.position, percent * BENCH_VALVE.travel / 100)
        path = write([HEADER, *rows(TIME, percent, PRESSURE)])
        assert refused(path, Valve(0.0445), Columns(**units)) == (
            "a position in percent is a share of the travel: name the travel in the valve file"
        )

    def test_stamps_in_nanoseconds(self, write):
        """Doubles of this century are 256 ns apart: so far may a stamp be off."""
        stamps = 1.7e18 + 1e6 * np.arange(40)
        record = self.record(write, stamps, POSITION, PRESSURE, {"time_unit": "ns"})
        assert record.start_time == 1.7e9
        assert record.sample_period == pytest.approx(1e-3, abs=2.56e-7)

    def test_force_in_its_unit(self, write):
        """(100 kN + 2 kN·i)/0.5 m² + 8 Pa: exact."""
        path = write(
            ["time_s,position_m,force_n", *rows(TIME, POSITION, 100.0 + 2 * np.arange(40))]
        )
        form = Columns(force_unit="kN")
        record = read_csv(path, Valve(0.5, pressure_reference=8.0), form)
        np.testing.assert_array_equal(record.pressure, 200_008.0 + 4000 * np.arange(40))

    def test_range_of_the_sensor_in_another_unit(self, write):
        path = write([HEADER, *rows(TIME, POSITION, np.linspace(100, 300, 40))])
        form = Columns(pressure_unit="kPa")
        assert refused(path, form=form).startswith(
            "row 32, column 'pressure_pa': 253.846 kPa is outside the sensor's range 0 to 250000 Pa"
        )

    @pytest.mark.parametrize(
        ("build", "message"),
        [
            (
                lambda: Columns(pressure_unit="torr"),
                "unknown unit of pressure 'torr'; known are Pa, ",
            ),
            (
                lambda: Columns(time_unit="h"),
                "unknown unit of time 'h'; known are ns, us, ms, s, min",
            ),
            (lambda: Columns(delimiter=";;"), "the delimiter must be one character"),
            (lambda: Columns(delimiter=""), "the delimiter must be one character"),
            (lambda: Columns(delimiter="."), "the delimiter must be one character"),
            (lambda: Columns(delimiter="e"), "the delimiter must be one character"),
            (lambda: Columns(decimal=";"), "the decimal mark must be '.' or ',', got ';'"),
            (lambda: Columns(decimal=","), "delimiter and decimal mark are both ','"),
        ],
    )
    def test_impossible(self, build, message):
        with pytest.raises(ValueError, match=re.escape(message)):
            build()


class TestStretch:
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
        record = read_csv(path, BENCH_VALVE, stretch=stretch)
        np.testing.assert_array_equal(record.position, POSITION[first : last + 1])

    @pytest.mark.parametrize("bad", ["0.01,nan,1e5", "0.01,0.003,3e5", "0.0001,0.003,1e5"])
    def test_what_is_bad_outside_does_not_matter(self, write, bad):
        path = write(with_row(12, bad))
        assert refused(path).startswith("row 12, column ")
        for stretch, size in ((Stretch(begin=0.0105), 29), (Stretch(begin=0.0005, end=0.0095), 9)):
            assert len(read_csv(path, BENCH_VALVE, stretch=stretch)) == size

    def test_rows_are_counted_from_the_top(self, write):
        path = write(with_row(22, "0.02,nan,1e5"))
        message = refused(path, stretch=Stretch(begin=0.01))
        assert message.startswith("row 22, column 'position_m': nan is not finite")

    def test_nothing_in_it(self, write):
        message = refused(write([HEADER, *GOOD]), stretch=Stretch(begin=1.0))
        assert message == "the chosen stretch holds no rows: choose another begin or end"

    @pytest.mark.parametrize("bad", [{"begin": 2, "end": 2}, {"begin": math.nan}, {"last": 0}])
    def test_impossible(self, bad):
        with pytest.raises(ValueError, match=r"cannot begin|must be above zero"):
            Stretch(**bad)


class TestColumns:
    @pytest.mark.parametrize(
        ("header", "wanted"),
        [
            ("t,position_m,pressure_pa", "'time_s'"),
            ("time_s,stem,pressure_pa", "'position_m'"),
            ("time_s,position_m,p", "'pressure_pa' (or 'force_n')"),
        ],
    )
    def test_missing(self, write, header, wanted):
        assert refused(write([header, *GOOD])) == (
            f"no column {wanted} among {header.replace(',', ', ')}: "
            "rename one or name the right one"
        )

    @pytest.mark.parametrize(
        ("header", "remedy"),
        [
            ("time_s,position_m,p_bar", "give --pressure-column p_bar --pressure-unit bar"),
            ("time_s,position_m,P [kpa]", "give --pressure-column 'P [kpa]' --pressure-unit kPa"),
            ("time_s,position_m,load_kN", "give --force-column load_kN --force-unit kN"),
            ("time_s,travel (mm),pressure_pa", "give --position-column 'travel (mm)' --position-"),
            ("t_ms,position_m,pressure_pa", "give --time-column t_ms --time-unit ms"),
            ("time_s,position_m,bar", "rename one or name the right one"),
            ("time_s,position_m,p_ba", "rename one or name the right one"),
        ],
    )
    def test_a_unit_at_the_end_of_another_header(self, write, header, remedy):
        _, _, told = refused(write([header, *GOOD])).rpartition(": ")
        assert told.startswith(remedy)

    def test_another_delimiter(self, write):
        assert refused(write(["time_s;position_m;pressure_pa", "0;0;1e5"])) == (
            "no column 'pressure_pa' (or 'force_n'), only 'time_s;position_m;pressure_pa': "
            "name the delimiter of the file (--delimiter ';')"
        )

    @pytest.mark.parametrize(("step", "what"), [(0, "repeats"), (-1, "goes back")])
    def test_times_that_do_not_rise_end_the_reading(self, tmp_path, step, what):
        """At the first block: a row beyond it, which cannot be read, is not looked at."""
        lines = [HEADER, *(f"{100_000 + step * row},0,1e5" for row in range(20_000)), "x,x,x"]
        path = tmp_path / "record.csv.gz"
        path.write_bytes(gzip.compress("\n".join(lines).encode()))
        assert refused(path).startswith(f"row 3, column 'time_s' {what} (")

    @pytest.mark.parametrize("entry", ["23,58", "-0,5", " 1,0"])
    def test_a_decimal_comma(self, write, entry):
        path = write(["time_s;position_m;pressure_pa", f"0;{entry};1e5", "1;0;1e5"])
        assert refused(path, form=Columns(delimiter=";")) == (
            f"row 2, column 'position_m': {entry!r} is not a number: name its decimal mark, "
            '--decimal , (decimal: "," in a valve file)'
        )

    @pytest.mark.parametrize("date", ["01.07.2026 14:00:00,010", "7/1/2026 2:00 PM"])
    def test_a_date_of_another_form(self, write, date):
        path = write(["time_s;position_m;pressure_pa", f"{date};0;1e5"])
        assert refused(path, form=Columns(delimiter=";")) == (
            f"row 2, column 'time_s': {date!r} is not a number: name the form of its dates, "
            "--time-format '%d.%m.%Y %H:%M:%S.%f'"
        )

    def test_missing_under_its_other_name(self, write):
        message = refused(write([HEADER, *GOOD]), form=Columns(time_column="t"))
        assert message.startswith("no column 't' among time_s, ")

    def test_twice(self, write):
        path = write(["time_s,position_m,pressure_pa,position_m", *(row + ",0" for row in GOOD)])
        assert refused(path) == "two columns are named 'position_m': rename one of them"


class TestEntries:
    @pytest.mark.parametrize(
        ("entry", "quoted"),
        [
            ("closed", "'closed'"),
            ("", "''"),
            ("1_000", "'1_000'"),  # a number to Python
            ("١", "'١'"),  # likewise
            ("0x10", "'0x10'"),
            ('"0,003"', "'0,003'"),
            ("#N/A", "'#N/A'"),
            ("x" * 100, f"'{'x' * 40}…'"),
        ],
    )
    def test_no_number(self, write, entry, quoted):
        path = write(with_row(12, f"0.01,{entry},1e5"))
        assert refused(path) == (
            f"row 12, column 'position_m': {quoted} is not a number: correct it or delete the row"
        )

    def test_missing_in_a_row(self, write):
        message = "row 12 has no entry in column 'pressure_pa': complete or delete it"
        assert refused(write(with_row(12, "0.01,0.003"))) == message

    @pytest.mark.parametrize("column", ["time_s", "position_m", "pressure_pa"])
    @pytest.mark.parametrize(
        ("text", "value"), [("nan", "nan"), ("-inf", "-inf"), ("1e999", "inf"), ("NaN", "nan")]
    )
    def test_not_finite(self, write, column, text, value):
        entries = dict(zip(HEADER.split(","), ("0.01", "0.003", "1e5"), strict=True))
        path = write(with_row(12, ",".join((entries | {column: text}).values())))
        assert refused(path) == (
            f"row 12, column {column!r}: {value} is not finite: "
            "use a stretch of the record without it"
        )

    @pytest.mark.parametrize("bad", ["0.01,nan,1e5", "0.01,open,1e5", "0.01,0.003,3e5"])
    def test_blank_rows_are_counted(self, write, bad):
        lines = with_row(12, bad)
        lines[4:4] = ["", ""]
        assert refused(write(lines)).startswith("row 14, column ")

    def test_a_quote_without_its_end(self, write):
        path = write(with_row(12, '0.01,"0.003,1e5'))
        assert refused(path).startswith("row 12, column 'position_m': '0.003,1e5")

    @pytest.mark.parametrize(
        ("pressure", "inside"),
        [(0.0, True), (250000.0, True), (math.nextafter(0, -1), False), (250000.1, False)],
    )
    def test_range_of_the_sensor(self, write, pressure, inside):
        path = write(with_row(12, f"0.01,0.003,{pressure!r}"))
        if inside:
            assert read_csv(path, BENCH_VALVE).pressure[10] == pressure
        else:
            assert refused(path) == (
                f"row 12, column 'pressure_pa': {pressure:g} Pa is outside the sensor's range 0 "
                "to 250000 Pa: use a stretch of the record without it, name its unit, or correct "
                "the range"
            )


class TestTimes:
    def test_repeated(self, write):
        assert refused(write(with_row(12, "0.009,0.003,1e5"))) == (
            "row 12, column 'time_s' repeats (0.009 after 0.009): delete one of the rows"
        )

    def test_backward(self, write):
        assert refused(write(with_row(12, "0.0,0.003,1e5"))) == (
            "row 12, column 'time_s' goes back (0 after 0.009): "
            "sort the rows, or use the record before or after it"
        )

    def test_gap(self, write):
        """From row 12 on, the samples come 20 ms later: 21 periods without one."""
        late = TIME + 0.02 * (np.arange(40) >= 10)
        record = read_csv(write([HEADER, *rows(late, POSITION, PRESSURE)]), BENCH_VALVE)
        assert record.gap == (
            "row 12, column 'time_s': gap of 0.021 s: use a stretch of the record without it"
        )
        assert len(record) == 60
        np.testing.assert_array_equal(record.stamped.position.value, POSITION)

    def test_more_gap_than_samples_is_a_refusal_of_the_record(self, write):
        late = TIME + 0.04 * (np.arange(40) >= 10)
        path = write([HEADER, *rows(late, POSITION, PRESSURE)])
        with pytest.raises(RefusalError):
            read_csv(path, BENCH_VALVE)
        assert refused(path) == (
            "row 12, column 'time_s': gap of 0.041 s: use a stretch of the record without it"
        )

    def test_ten_periods_are_no_gap(self, write):
        late = TIME + 0.009 * (np.arange(40) >= 10)
        path = write([HEADER, *rows(late, POSITION, PRESSURE)])
        record = read_csv(path, BENCH_VALVE)
        assert len(record) == 49
        assert record.gap == ""

    def test_nanoseconds_taken_for_seconds(self, write):
        stamps = 1_700_000_000_000_000_000 + 1e9 * TIME
        assert refused(write([HEADER, *rows(stamps, POSITION, PRESSURE)])) == (
            "row 41, column 'time_s': 1.7e+18 s is too large for a time: "
            "name the unit of the column, or convert it to seconds"
        )

    def test_one_sample(self, write):
        assert refused(write([HEADER, GOOD[0]])) == (
            "only one sample of pressure_pa: check that it is sampled continuously"
        )


class TestUnreadableFiles:
    def test_missing(self, tmp_path):
        message = refused(tmp_path / "record.csv")
        assert message == "cannot be read as CSV: No such file or directory"

    def test_folder(self, tmp_path):
        assert refused(tmp_path) == "cannot be read as CSV: Is a directory"

    @pytest.mark.parametrize("ending", ["csv", "csv.gz"])
    def test_empty(self, tmp_path, ending):
        path = tmp_path / f"record.{ending}"
        path.write_bytes(b"")
        assert refused(path) == "the file is empty"

    def test_only_a_header(self, write):
        assert refused(write([HEADER])) == "there are no rows under the header"

    def test_no_header(self, write):
        assert refused(write(GOOD)).startswith("no column 'pressure_pa' (or 'force_n') among 0.0, ")

    def test_another_encoding(self, write):
        path = write([HEADER, *GOOD])
        path.write_bytes(path.read_bytes() + b"0.04,\xff,1e5\n")
        assert refused(path).startswith("row 42, column 'position_m': 'ÿ' is not a number")
        message = refused(path, form=Columns(encoding="utf-8"))
        assert message.startswith("cannot be read as CSV: 'utf-8' codec can't decode byte")
        assert message.endswith("name its encoding (--encoding)")

    def test_no_table_at_all(self, tmp_path):
        path = tmp_path / "record.csv"
        path.write_bytes(b"x" * 200_000)
        message = refused(path)
        assert message.startswith(f"no column 'pressure_pa' (or 'force_n'), only '{'x' * 40}…'")
        path.write_bytes(b'"' + b"x" * 200_000)
        assert refused(path) == "cannot be read as CSV: field larger than field limit (131072)"
        path.write_bytes(b"x" * 2_000_000)
        assert refused(path).startswith("cannot be read as CSV: a line has more than 1048576 bytes")

    def packed(self, write):
        """Enough gzipped text that its header can be read without its end."""
        random = np.random.default_rng(2)
        time = np.arange(20_000) / 1000
        lines = [HEADER, *rows(time, random.random(time.size), 1e5 * random.random(time.size))]
        path = write(lines)
        return bytearray(gzip.compress(path.read_bytes())), path.with_suffix(".csv.gz")

    def test_gzip_without_its_end(self, write):
        content, path = self.packed(write)
        path.write_bytes(content[: len(content) // 2])
        assert refused(path).startswith("cannot be read as CSV: Compressed file ended before")

    @pytest.mark.parametrize(
        ("place", "cause"),
        [(10, "Error -3 while decompressing data: invalid block type"), (-8, "CRC check failed")],
    )
    def test_gzip_damaged(self, write, place, cause):
        """In the first block (3 is no type of one), and in the checksum at the end."""
        content, path = self.packed(write)
        content[place] ^= 0xFF
        content[10] |= 0x06 if place == 10 else 0
        path.write_bytes(content)
        assert refused(path).startswith(f"cannot be read as CSV: {cause}")
