# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""Tables in other languages and from other programs: read without an option, and read rightly."""

from datetime import datetime, timedelta, timezone

import numpy as np
import pytest

from valve_friction_ros.model import Valve
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.recordings import ReadingOptions, read_recordings

VALVE = Valve(0.04, travel=0.03)
COUNT = 80
BARS = [f"{1 + 0.3 * np.cos(one / 9):.3f}" for one in range(COUNT)]
MILLIMETRES = [f"{12 + 9 * np.sin(one / 9):.3f}" for one in range(COUNT)]
BEGIN = datetime(2026, 10, 13, 11, 59, 58, tzinfo=timezone.utc)
STAMPS = [BEGIN + timedelta(seconds=one / 20) for one in range(COUNT)]
SECONDS = [f"{one.replace(microsecond=0).timestamp():.0f}" for one in STAMPS]


def comma(texts):
    return [text.replace(".", ",") for text in texts]


def table(header, *columns, mark=";"):
    return "\n".join([header, *map(mark.join, zip(*columns, strict=True))])


def written(form, zero=""):
    """Stamps by a strftime format; `zero` removes leading zeros behind it, as Windows does."""
    texts = [f"{one:{form}}".replace("~", f"{one.microsecond // 1000:03d}") for one in STAMPS]
    return [text.replace(f"{zero}0", zero).lstrip("0") for text in texts] if zero else texts


def read(path, count=COUNT, **form):
    (found,) = read_recordings(path, VALVE, ReadingOptions(Columns(**form)))
    record = found.recording()
    kept = slice(COUNT - count, None)
    assert record.pressure == pytest.approx(1e5 * np.array(BARS[kept], float))
    assert record.position == pytest.approx(1e-3 * np.array(MILLIMETRES[kept], float))
    assert record.sample_period == pytest.approx(0.05)
    return record


QUALITY = ["Bonne"] * COUNT
FRENCH = "Horodatage;Pression (bar);Course (mm);Qualité"
SPANISH = "Fecha y hora\tPresión [bar]\tCarrera [mm]"
HALF = {"AM": "a. m.", "PM": "p. m."}
WRITTEN = {
    "French": table(
        FRENCH, written("%d/%m/%Y %H:%M:%S,~"), comma(BARS), comma(MILLIMETRES), QUALITY
    ),
    "Spanish, twelve hours": table(
        SPANISH,
        [f"{one[:-2]}{HALF[one[-2:]]}" for one in written("%d/%m/%Y %I:%M:%S,~ %p")],
        comma(BARS),
        comma(MILLIMETRES),
        mark="\t",
    ),
    "Italian, points in the time": table(
        "Data;Ora;Pressione [bar];Corsa [mm]",
        written("%d/%m/%Y"),
        written("%H.%M.%S,~"),
        comma(BARS),
        comma(MILLIMETRES),
    ),
    "Czech, blanks in the date": table(
        "Čas;Tlak [bar];Zdvih [mm]",
        written("%d. %m. %Y %H:%M:%S,~", zero=". "),
        comma(BARS),
        comma(MILLIMETRES),
    ),
    "ROS message": table(
        "Time,header.stamp.sec,header.stamp.nanosec,pressure_bar,stem_mm",
        [f"{one.timestamp() + 0.4:.3f}" for one in STAMPS],
        SECONDS,
        [f"{one.microsecond * 1000}" for one in STAMPS],
        BARS,
        MILLIMETRES,
        mark=",",
    ),
    "vertical bars": table(
        "epoch_ms|pt_bar|zt_mm",
        [f"{one.timestamp() * 1000:.0f}" for one in STAMPS],
        BARS,
        MILLIMETRES,
        mark="|",
    ),
}


@pytest.mark.parametrize("name", WRITTEN)
def test_it_needs_no_option(tmp_path, name):
    """Blanks were taken for delimiters, and the dates for unknown."""
    path = tmp_path / "export.csv"
    path.write_text(WRITTEN[name], encoding="cp1250" if name.startswith("Czech") else "utf-8")
    assert read(path).start_time == pytest.approx(BEGIN.timestamp())


@pytest.mark.parametrize(
    "words", [("Qualité", "Bonne", "Mauvaise"), ("Kwaliteit", "Goed", "Slecht")]
)
def test_bad_values_in_other_languages(tmp_path, words):
    """They were kept without a word."""
    path = tmp_path / "export.csv"
    name, good, bad = words
    lines = WRITTEN["French"].replace("Qualité", name).replace("Bonne", good).splitlines()
    lines[1] = lines[1].replace(f";{comma(BARS)[0]};", ";9,9;").replace(good, bad)
    path.write_text("\n".join(lines))
    read(path, COUNT - 1)


def test_status_codes_of_opc_ua(tmp_path):
    codes = ["0x80050000", *["0x00000000"] * (COUNT - 2), "0x00000400"]
    air = ["0.000", *BARS[1:]]
    header = "SourceTimestamp;ServerTimestamp;PT [bar];ZT [mm];StatusCode"
    path = tmp_path / "export.csv"
    stamps = written("%Y-%m-%dT%H:%M:%S.~Z")
    late = [one.replace("Z", "9Z") for one in stamps]
    path.write_text(table(header, stamps, late, air, MILLIMETRES, codes))
    assert read(path, COUNT - 1).start_time == pytest.approx(BEGIN.timestamp() + 0.05, abs=1e-6)


def test_a_store_of_ignition(tmp_path):
    rows = ["tagpath,t_stamp,intvalue,floatvalue,dataintegrity"]
    for stamp, air, stem in zip(STAMPS, BARS, MILLIMETRES, strict=True):
        begin = f"{stamp.timestamp() * 1000:.0f},"
        rows += [f"fv1/pressure,{begin},{air},192", f"fv1/position,{begin},{stem},192"]
    path = tmp_path / "export.csv"
    path.write_text("\n".join(rows))
    read(path, pressure_unit="bar", position_unit="mm")


def test_messages_printed_by_ros(tmp_path):
    """`ros2 topic echo --csv` prints no header, and a variance beside the pressure."""
    rest = [f"{one.microsecond * 1000}" for one in STAMPS]
    empty, joint = [""] * COUNT, ["stem"] * COUNT
    paths = [tmp_path / "actuator_pressure.csv", tmp_path / "stem_state.csv"]
    air = table("", SECONDS, rest, empty, BARS, ["0.0"] * COUNT, mark=",")
    stem = table("", SECONDS, rest, empty, joint, MILLIMETRES, mark=",")
    for path, text in zip(paths, (air, stem), strict=True):
        path.write_text(text.lstrip("\n"))
    form = Columns(pressure_unit="bar", position_unit="mm")
    (found,) = read_recordings(paths[0], VALVE, ReadingOptions(form, beside=(paths[1],)))
    record = found.recording()
    assert record.pressure == pytest.approx(1e5 * np.array(BARS, float))
    assert record.position == pytest.approx(1e-3 * np.array(MILLIMETRES, float))
    assert record.start_time == pytest.approx(BEGIN.timestamp(), abs=1e-6)


def test_messages_with_headers_in_files_of_their_own(tmp_path):
    """The number of the message was taken for a second pressure, as the file has its name."""
    number = [str(one) for one in range(COUNT)]
    rest = [f"{one.microsecond * 1000}" for one in STAMPS]
    head = "header.seq,header.stamp.secs,header.stamp.nsecs"
    path, stem = tmp_path / "actuator_pressure.csv", tmp_path / "joint_states.csv"
    pascals = [f"{1e5 * float(one):.0f}" for one in BARS]
    path.write_text(table(f"{head},fluid_pressure", number, SECONDS, rest, pascals, mark=","))
    stem.write_text(table(f"{head},position_0", number, SECONDS, rest, MILLIMETRES, mark=","))
    form = Columns(position_unit="mm")
    (found,) = read_recordings(path, VALVE, ReadingOptions(form, beside=(stem,)))
    assert found.recording().pressure == pytest.approx(1e5 * np.array(BARS, float))


def test_a_table_of_aveva(tmp_path):
    """Its values come twice, and it has three qualities, of which 0 is good in one."""
    rows = ["DateTime,TagName,Value,vValue,Quality,QualityDetail,OPCQuality"]
    stamps = written("%Y-%m-%d %H:%M:%S.~")
    for place, row in enumerate(zip(stamps, BARS, MILLIMETRES, strict=True)):
        quality = "0,192,192" if place else "1,24,0"
        for tag, value in zip(("FV1.PT", "FV1.ZT"), row[1:], strict=True):
            rows.append(f"{row[0]},{tag},{value},{value},{quality}")
    path = tmp_path / "export.csv"
    path.write_text("\n".join(rows))
    read(path, COUNT - 1, pressure_unit="bar", position_unit="mm")
    path.write_text(path.read_text().replace(",Value,vValue,", ",first,second,"))
    with pytest.raises(
        ValueError, match=r"which column is the value \(--value-column first or"
    ) as one:
        read_recordings(path, VALVE)
    assert "which tag is" not in str(one.value)


def test_units_of_labview(tmp_path):
    head = "LabVIEW Measurement\nSeparator\tTab\nDecimal_Separator\t,\n***End_of_Header***\n\n"
    head += "Channels\t2\nY_Unit_Label\tbar\tmm\nDelta_X\t0,05\t0,05\n***End_of_Header***\n"
    time = [f"{one / 20:.2f}" for one in range(COUNT)]
    columns = (comma(time), comma(BARS), comma(MILLIMETRES))
    path = tmp_path / "export.lvm"
    path.write_text(head + table("X_Value\tAntriebsdruck\tHub", *columns, mark="\t"))
    read(path)


class TestWorkbooks:
    @pytest.fixture
    def book(self):
        return pytest.importorskip("openpyxl").Workbook()

    def test_numbers_as_text(self, book, tmp_path):
        """All of them were bad. Numbers of another column may be numbers."""
        book.active.append(["Zeit [s]", "Druck [bar]", "Hub [mm]"])
        for place, row in enumerate(zip(comma(BARS), comma(MILLIMETRES), strict=True)):
            book.active.append([place / 20, *row])
        book.save(tmp_path / "a.xlsx")
        read(tmp_path / "a.xlsx")

    def test_merged_headers_below_a_title(self, book, tmp_path):
        sheet = book.active
        for row in (
            ["Prüfprotokoll"],
            ["Datum", datetime(2026, 10, 13)],
            [],
            ["Zeit", "Antrieb", None],
            [None, "Druck", "Hub"],
            ["s", "bar", "mm"],
        ):
            sheet.append(row)
        sheet.merge_cells("B4:C4")
        for place, (air, stem) in enumerate(zip(BARS, MILLIMETRES, strict=True)):
            sheet.append([place / 20, float(air), float(stem)])
        book.save(tmp_path / "a.xlsx")
        read(tmp_path / "a.xlsx")


def test_a_time_that_repeats(tmp_path):
    """Tenths of a second were called fractions that lack, and shown with nine decimals."""
    path = tmp_path / "a.csv"
    stamps = [one[:-2] for one in written("%Y-%m-%d %H:%M:%S.~")]
    path.write_text(table("Time;Air [bar];Stem [mm]", stamps, BARS, MILLIMETRES))
    with pytest.raises(ValueError, match=r"58 after 2026-10-13 11:59:58\): .* more decimals of a"):
        read(path)
