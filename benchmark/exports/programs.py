# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What forty programs write: each a function of the truth, and of chance, to the bytes of a file.

The conventions are those of the programs' own exports; numbers are rounded as they round them.
"""

import csv
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta, timezone
from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import NDArray

from benchmark.exports.truth import Truth

Random = np.random.Generator
PRESSURES = {"Pa": 1.0, "kPa": 1e3, "bar": 1e5, "mbar": 1e2, "psi": 6894.757293168}
LENGTHS = {"mm": 1e-3, "in": 25.4e-3, "cm": 1e-2, "m": 1.0}
TRANSMITTER = (0.0, 4e5)
"""Range of the pressure transmitters, Pa."""


@dataclass(frozen=True)
class Export:
    """A file, and what a person knows who has to answer.

    Attributes
    ----------
    name, content : str, bytes
        Name and bytes.
    answers : mapping of str to str
        The true answer to each option, by its name in `Columns`.
    coarse_pressure, coarse_position : float
        Largest error by rounding, Pa and m.
    exact_date : bool
        Whether the file says when it was recorded.
    others : list of Truth
        Further valves of the file.
    """

    name: str
    content: bytes
    answers: dict[str, object] = field(default_factory=dict)
    coarse_pressure: float = 1.0
    coarse_position: float = 1e-6
    exact_date: bool = True
    clock: float = 1e-6


def _times(truth: Truth, form: str, zone: str = "UTC", digits: int = 3) -> list[str]:
    local = ZoneInfo(zone)
    found = []
    for stamp in truth.stamps.tolist():
        moment = datetime.fromtimestamp(stamp // 10**9, timezone.utc).astimezone(local)
        fraction = f"{stamp % 10**9:09d}"[:digits]
        text = moment.strftime(form).replace("<f>", fraction)
        if "<h>" in text:  # hours and days without zeros before them, as Americans write them
            hour = moment.hour % 12 or 12
            text = text.replace("<h>", str(hour))
        text = text.replace("<d>", str(moment.day)).replace("<m>", str(moment.month))
        found.append(text)
    return found


def _rounded(values: NDArray[np.float64], digits: int, mark: str = ".") -> list[str]:
    return [f"{value:.{digits}f}".replace(".", mark) for value in values.tolist()]


def _pressure(truth: Truth, unit: str, mark: str = ".") -> tuple[list[str], float]:
    size = PRESSURES[unit]
    digits = {"Pa": 0, "kPa": 3, "bar": 5, "mbar": 2, "psi": 4}[unit]
    return _rounded(truth.pressure / size, digits, mark), 0.6 * 10.0**-digits * size


def _position(truth: Truth, unit: str, mark: str = ".") -> tuple[list[str], float]:
    size = {"%": truth.travel / 100, "fraction": truth.travel, "mA": truth.travel / 16}
    one = size[unit] if unit in size else LENGTHS[unit]
    digits = {"%": 3, "fraction": 5, "mA": 4, "mm": 3, "in": 5, "cm": 4, "m": 6}[unit]
    shift = 4.0 if unit == "mA" else 0.0
    return _rounded(truth.position / one + shift, digits, mark), 0.6 * 10.0**-digits * one


def _with_words(texts: list[str], words: Sequence[str], random: Random) -> list[str]:
    """Replace a drawn share, up to 3 %, by the words of a program for bad values."""
    bad = random.random(len(texts)) < random.uniform(0, 0.03)
    bad[:3] = False
    return [
        str(random.choice(words)) if one else text for one, text in zip(bad, texts, strict=True)
    ]


def _joined(rows: Sequence[Sequence[str]], mark: str, quoted: bool = False) -> str:
    stream = io.StringIO()
    quoting = csv.QUOTE_ALL if quoted else csv.QUOTE_MINIMAL
    csv.writer(stream, delimiter=mark, quoting=quoting, lineterminator="\r\n").writerows(rows)
    return stream.getvalue()


def _columns(*columns: Sequence[str]) -> list[Sequence[str]]:
    return list(zip(*columns, strict=True))


def _tag(random: Random) -> str:
    kind = random.choice(["FV", "PV", "LV", "TV", "HV"])
    return f"{kind}-{random.integers(100, 999)}"


def libreoffice_german(truth: Truth, random: Random) -> Export:
    unit = str(random.choice(["bar", "mbar", "kPa"]))
    pressure, coarse = _pressure(truth, unit, ",")
    position, rough = _position(truth, "%", ",")
    zone = "Europe/Berlin"
    times = _times(truth, "%d.%m.%Y %H:%M:%S,<f>", zone)
    rows = [
        ("Zeit", "Ventilstellung [%]", f"Stelldruck [{unit}]"),
        *_columns(times, position, pressure),
    ]
    return Export(
        "export.csv", _joined(rows, ";").encode("cp1252"), {"time_zone": zone}, coarse, rough, False
    )


def libreoffice_umlaut(truth: Truth, random: Random) -> Export:
    pressure, coarse = _pressure(truth, "bar", ",")
    position, rough = _position(truth, "mm", ",")
    times = _rounded(truth.time, 3, ",")
    rows = [("Zeit (s)", "Öffnung (mm)", "Druck (bar Ü)"), *_columns(times, position, pressure)]
    del random
    content = _joined(rows, ";").encode("cp1252")
    return Export("messung.csv", content, {}, coarse, rough, False)


def libreoffice_english(truth: Truth, random: Random) -> Export:
    unit, length = str(random.choice(["psi", "kPa"])), str(random.choice(["mm", "in"]))
    pressure, coarse = _pressure(truth, unit)
    position, rough = _position(truth, length)
    times = _times(truth, "%Y-%m-%d %H:%M:%S.<f>")
    rows = [("Time", f"Stem position ({length})", f"Actuator pressure ({unit})")]
    rows += _columns(times, position, pressure)
    return Export("data.csv", _joined(rows, ",").encode(), {}, coarse, rough)


def _workbook(rows: Sequence[Sequence[object]]) -> bytes:
    import openpyxl  # noqa: PLC0415 - an extra

    book = openpyxl.Workbook(write_only=True)
    sheet = book.create_sheet("Data")
    for row in rows:
        sheet.append(list(row))
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()


def _dates(truth: Truth) -> list[datetime]:
    begin = datetime(1970, 1, 1)
    return [begin + timedelta(microseconds=stamp // 1000) for stamp in truth.stamps.tolist()]


def excel(truth: Truth, random: Random) -> Export:
    tag = _tag(random)
    rows: list[Sequence[object]] = [
        (f"Report {tag}",),
        (),
        ("Date", "Travel (%)", "Diaphragm pressure (kPa)"),
    ]
    rows += zip(
        _dates(truth),
        np.round(100 * truth.position / truth.travel, 4).tolist(),
        np.round(truth.pressure / 1e3, 4).tolist(),
        strict=True,
    )
    return Export("report.xlsx", _workbook(rows), {}, 0.06, 1e-6 * truth.travel, clock=6e-4)


def pandas_index(truth: Truth, random: Random) -> Export:
    import pandas as pd  # noqa: PLC0415

    frame = pd.DataFrame(
        {"pressure_bar": truth.pressure / 1e5, "position_mm": truth.position * 1e3},
        index=pd.to_datetime(truth.stamps),
    )
    if random.random() < 0.5:
        frame.index = frame.index.tz_localize("UTC").tz_convert("America/Chicago")
    return Export("frame.csv", frame.to_csv().encode(), {}, 1e-6, 1e-12)


def pandas_rows(truth: Truth, random: Random) -> Export:
    import pandas as pd  # noqa: PLC0415

    frame = pd.DataFrame(
        {"t": truth.time, "stem_mm": truth.position * 1e3, "pressure_kPa": truth.pressure / 1e3}
    )
    frame.loc[random.random(len(frame)) < 0.02, "stem_mm"] = np.nan
    return Export("frame.csv", frame.to_csv().encode(), {}, 1e-6, 1e-12, False)


def pandas_parquet(truth: Truth, random: Random) -> Export:
    import pandas as pd  # noqa: PLC0415

    frame = pd.DataFrame(
        {"position_percent": 100 * truth.position / truth.travel, "pressure_pa": truth.pressure},
        index=pd.DatetimeIndex(pd.to_datetime(truth.stamps), name="timestamp"),
    )
    frame.loc[random.random(len(frame)) < 0.02, "pressure_pa"] = np.nan
    stream = io.BytesIO()
    frame.to_parquet(stream)
    return Export("frame.parquet", stream.getvalue(), {}, 1e-6, 1e-12)


_PI_WORDS = ("Bad Input", "I/O Timeout", "No Data", "Bad", "Scan Off")


def pi_sampled(truth: Truth, random: Random) -> Export:
    tag = _tag(random).replace("-", "")
    pressure, coarse = _pressure(truth, "bar")
    position, rough = _position(truth, "%")
    rows: list[Sequence[object]] = [
        ("Tag", f"{tag}.PT", f"{tag}.ZT"),
        ("Descriptor", "Actuator pressure", "Valve position"),
        ("Engunits", "bar", "%"),
    ]
    rows += [
        (time, _cell(one), _cell(other))
        for time, one, other in zip(
            _dates(truth),
            _with_words(pressure, _PI_WORDS, random),
            _with_words(position, _PI_WORDS, random),
            strict=True,
        )
    ]
    return Export("datalink.xlsx", _workbook(rows), {}, coarse, rough, clock=6e-4)


def _cell(text: str) -> object:
    try:
        return float(text)
    except ValueError:
        return text


def pi_csv(truth: Truth, random: Random) -> Export:
    tag = _tag(random)
    pressure, coarse = _pressure(truth, "kPa")
    position, rough = _position(truth, "mm")
    rows = [("Timestamp", f"{tag} pressure (kPa)", f"{tag} travel (mm)")]
    rows += _columns(
        _times(truth, "%d-%b-%y %H:%M:%S.<f>"),
        _with_words(pressure, _PI_WORDS, random),
        _with_words(position, _PI_WORDS, random),
    )
    return Export("pi.csv", _joined(rows, ",").encode(), {}, coarse, rough)


def pi_pairs(truth: Truth, random: Random) -> Export:
    """Archived values: each tag with times of its own."""
    tag = _tag(random)
    pressure, coarse = _pressure(truth, "bar")
    position, rough = _position(truth, "%")
    times = _times(truth, "%d-%b-%Y %H:%M:%S.<f>")
    kept = [index for index in range(len(times)) if random.random() < 0.9 or index < 3]
    left = _columns(times, pressure)
    right = [(times[index], position[index]) for index in kept]
    right += [("", "")] * (len(left) - len(right))
    rows: list[Sequence[str]] = [("", f"{tag}.PT (bar)", "", f"{tag}.ZT (%)")]
    rows += [(*one, *other) for one, other in zip(left, right, strict=True)]
    return Export("archive.csv", _joined(rows, ",").encode(), {}, coarse, rough)


def aspen_long(truth: Truth, random: Random) -> Export:
    tag = _tag(random)
    pressure, coarse = _pressure(truth, "mbar")
    position, rough = _position(truth, "%")
    times = _times(truth, "%d-%b-%y %H:%M:%S.<f>".replace("%b", "%b"), digits=3)
    rows: list[Sequence[str]] = [("NAME", "IP_TREND_TIME", "IP_TREND_VALUE", "IP_TREND_QSTATUS")]
    for name, values in ((f"{tag}_PT", pressure), (f"{tag}_ZT", position)):
        good = [("Good" if random.random() > 0.01 else "Bad") for _ in values]
        rows += [
            (name, time.upper(), value if q == "Good" else "0", q)
            for time, value, q in zip(times, values, good, strict=True)
        ]
    answers = {"pressure_unit": "mbar", "position_unit": "%"}
    return Export("aspen.csv", _joined(rows, ",").encode(), answers, coarse, rough)


def aspen_wide(truth: Truth, random: Random) -> Export:
    pressure, coarse = _pressure(truth, "kPa")
    position, rough = _position(truth, "mm")
    bad = random.random(len(pressure)) < 0.02
    status = ["Bad" if one else "Good" for one in bad]
    shown = ["0" if one else text for one, text in zip(bad, pressure, strict=True)]
    rows = [("Time", "PT-207 (kPa)", "PT-207 Status", "ZT-207 (mm)", "ZT-207 Status")]
    rows += _columns(
        _times(truth, "%Y/%m/%d %H:%M:%S.<f>"), shown, status, position, ["Good"] * len(position)
    )
    return Export("explorer.csv", _joined(rows, ",").encode(), {}, coarse, rough)


def honeywell(truth: Truth, random: Random) -> Export:
    tag = _tag(random)
    pressure, coarse = _pressure(truth, "psi")
    position, rough = _position(truth, "%")
    confidence = ["0" if random.random() < 0.01 else "100" for _ in pressure]
    shown = ["0" if one == "0" else text for one, text in zip(confidence, pressure, strict=True)]
    rows: list[Sequence[str]] = [
        ("Uniformance PHD",),
        ("Tagname", f"{tag}.PT", "Confidence", f"{tag}.ZT", "Confidence"),
        ("Description", "Actuator pressure", "", "Stem position", ""),
        ("Units", "psig", "", "%", ""),
    ]
    rows += _columns(
        _times(truth, "<m>/<d>/%Y <h>:%M:%S.<f> %p"),
        shown,
        confidence,
        position,
        ["100"] * len(position),
    )
    month_first = "%m/%d/%Y %I:%M:%S.%f %p"
    return Export(
        "phd.csv", _joined(rows, ",").encode(), {"time_format": month_first}, coarse, rough
    )


def honeywell_long(truth: Truth, random: Random) -> Export:
    tag = _tag(random)
    pressure, coarse = _pressure(truth, "kPa")
    position, rough = _position(truth, "%")
    times = _times(truth, "%Y-%m-%dT%H:%M:%S.<f>Z")
    rows: list[Sequence[str]] = [("TagName", "Units", "TimeStamp", "Value", "Confidence")]
    for time, one, other in zip(times, pressure, position, strict=True):
        rows += [
            (f"{tag}.PRESSURE", "kPa", time, one, "100"),
            (f"{tag}.POSITION", "%", time, other, "100"),
        ]
    return Export("long.csv", _joined(rows, ",").encode(), {}, coarse, rough)


def ignition_dataset(truth: Truth, random: Random) -> Export:
    tag = _tag(random)
    pressure, coarse = _pressure(truth, "bar")
    position, rough = _position(truth, "%")
    head = [
        '"#NAMES"',
        f'"t_stamp","{tag}/Actuator Pressure","{tag}/Position"',
        '"#TYPES"',
        '"date","F","F"',
        f'"#ROWS","{len(pressure)}"',
    ]
    rows = _columns(_times(truth, "%Y-%m-%d %H:%M:%S.<f>"), pressure, position)
    text = "\r\n".join(head) + "\r\n" + _joined(rows, ",", quoted=True)
    return Export(
        "ignition.csv", text.encode(), {"pressure_unit": "bar", "position_unit": "%"}, coarse, rough
    )


def ignition_chart(truth: Truth, random: Random) -> Export:
    """Whole seconds: every sample of a slow valve."""
    slow = 50 if truth.time[1] < 0.02 else max(1, round(1 / truth.time[1]))
    slow = round(1 / truth.time[1])
    coarse_truth = Truth(
        truth.area, truth.travel, truth.friction,
        truth.time[::slow], truth.pressure[::slow], truth.position[::slow], truth.start,
    )  # fmt: skip
    pressure, coarse = _pressure(coarse_truth, "kPa")
    position, rough = _position(coarse_truth, "%")
    zone = str(random.choice(["CEST", "UTC"]))
    name = {"CEST": "Europe/Berlin", "UTC": "UTC"}[zone]
    shift = 0
    times = _times(coarse_truth, f"%a %b %d %H:%M:%S {zone} %Y", name)
    if zone == "CEST" and "CEST" not in _times(coarse_truth, "%Z", name)[0]:
        times = _times(coarse_truth, "%a %b %d %H:%M:%S CET %Y", name)
    del shift
    rows = [("Timestamp", "Valve Position (%)", "Actuator Pressure (kPa)")]
    rows += _columns(times, position, pressure)
    return Export("chart.csv", _joined(rows, ",").encode(), {}, coarse, rough)


def grafana(truth: Truth, random: Random) -> Export:
    pressure, coarse = _pressure(truth, "bar")
    position, rough = _position(truth, "%")
    rows = [("Time", "Position", "Pressure")]
    rows += _columns(
        _times(truth, "%Y-%m-%d %H:%M:%S.<f>"),
        [f"{text}%" for text in position],
        [f"{text} bar" for text in pressure],
    )
    del random
    return Export(
        "grafana.csv", _joined(rows, ",", quoted=True).encode("utf-8-sig"), {}, coarse, rough
    )


def grafana_raw(truth: Truth, random: Random) -> Export:
    tag = _tag(random).lower()
    pressure, coarse = _pressure(truth, "Pa")
    position, rough = _position(truth, "fraction")
    rows = [("time", f"{tag}.stem_position", f"{tag}.pressure_pa")]
    rows += _columns([str(stamp // 10**6) for stamp in truth.stamps.tolist()], position, pressure)
    return Export(
        "grafana.csv", _joined(rows, ",").encode(), {"position_unit": "fraction"}, coarse, rough
    )


def matlab_table(truth: Truth, random: Random) -> Export:
    pressure, coarse = _pressure(truth, "kPa")
    position, rough = _position(truth, "mm")
    rows = [("Time", "StemPosition_mm", "Pressure_kPa")]
    rows += _columns(_times(truth, "%d-%b-%Y %H:%M:%S.<f>"), position, pressure)
    del random
    return Export("table.csv", _joined(rows, ",").encode(), {}, coarse, rough)


def matlab_datenum(truth: Truth, random: Random) -> Export:
    days = truth.stamps / 86_400e9 + 719_529
    rows = [("datenum", "Stem (mm)", "Pressure (bar)")]
    rows += _columns(
        [f"{day:.12f}" for day in days.tolist()],
        _position(truth, "mm")[0],
        _pressure(truth, "bar")[0],
    )
    del random
    return Export("datenum.csv", _joined(rows, ",").encode(), {}, 1.0, 1e-6, clock=1e-4)


def matlab_file(truth: Truth, random: Random) -> Export:
    from scipy.io import savemat  # noqa: PLC0415

    stream = io.BytesIO()
    savemat(
        stream,
        {"t": truth.time, "p_bar": truth.pressure / 1e5, "x_position_mm": truth.position * 1e3},
    )
    del random
    return Export("bench.mat", stream.getvalue(), {}, 1e-6, 1e-12, False)


def labview(truth: Truth, random: Random) -> Export:
    mark = str(random.choice([",", "."]))
    pressure, coarse = _pressure(truth, "bar", mark)
    position, rough = _position(truth, "mm", mark)
    count = str(len(pressure))
    head = [
        "LabVIEW Measurement", "Writer_Version\t2", "Separator\tTab", f"Decimal_Separator\t{mark}",
        "Date\t2026/07/01", f"Time\t14:00:00{mark}123", "***End_of_Header***", "",
        "Channels\t2", f"Samples\t{count}\t{count}", "Y_Unit_Label\tbar\tmm",
        "X_Dimension\tTime\tTime", f"X0\t0{mark}0\t0{mark}0", "***End_of_Header***",
    ]  # fmt: skip
    rows = [("X_Value", "Pressure", "Position", "Comment")]
    blank = [""] * len(pressure)
    rows += _columns(_rounded(truth.time, 6, mark), pressure, position, blank)
    text = "\r\n".join(head) + "\r\n" + _joined(rows, "\t")
    answers = {"pressure_unit": "bar", "position_unit": "mm"}
    return Export("bench.lvm", text.encode(), answers, coarse, rough, False)


def labview_clock(truth: Truth, random: Random) -> Export:
    pressure, coarse = _pressure(truth, "psi")
    position, rough = _position(truth, "in")
    seconds = truth.stamps // 10**6
    times = [f"{(stamp + 2_082_844_800_000) / 1000:.3f}" for stamp in seconds.tolist()]
    rows = [("Time", "Stem travel [in]", "Pressure [psi]"), *_columns(times, position, pressure)]
    del random
    return Export("clock.txt", _joined(rows, "\t").encode(), {}, coarse, rough)


def plotjuggler(truth: Truth, random: Random) -> Export:
    """The two topics of a bag, each in rows of its own."""
    valve = _tag(random).lower().replace("-", "_")
    rows = [
        (
            "__time",
            f"/{valve}/actuator_pressure/fluid_pressure",
            f"/{valve}/stem_state/stem/position",
        )
    ]
    for time, one, other in zip(
        (truth.stamps / 1e9).tolist(), truth.pressure.tolist(), truth.position.tolist(), strict=True
    ):
        rows += [(f"{time:.6f}", f"{one:.3f}", ""), (f"{time + 1e-4:.6f}", "", f"{other:.9f}")]
    answers = {"pressure_unit": "Pa", "position_unit": "m"}
    return Export("plot.csv", _joined(rows, ",").encode(), answers, 1e-2, 1e-8, clock=2e-4)


def bag_nanoseconds(truth: Truth, random: Random) -> Export:
    rows = [("timestamp", "pressure_pa", "position_m")]
    rows += _columns(
        list(map(str, truth.stamps.tolist())),
        list(map(repr, truth.pressure.tolist())),
        list(map(repr, truth.position.tolist())),
    )
    del random
    return Export("bag.csv", _joined(rows, ",").encode(), {}, 1e-6, 1e-12)


def delta_v(truth: Truth, random: Random) -> Export:
    pressure, coarse = _pressure(truth, "bar", ",")
    position, rough = _position(truth, "%", ",")
    zone = "Europe/Vienna"
    rows = [("Datum", "Uhrzeit", "Position (%)", "Sollwert (%)", "Antriebsdruck (bar)")]
    rows += _columns(
        _times(truth, "%d.%m.%Y", zone), _times(truth, "%H:%M:%S,<f>", zone),
        position, _rounded(50 + 0 * truth.time, 1, ","), pressure,
    )  # fmt: skip
    del random
    return Export(
        "trend.csv", _joined(rows, ";").encode(), {"time_zone": zone}, coarse, rough, False
    )


def exaquantum(truth: Truth, random: Random) -> Export:
    tag = _tag(random)
    pressure, coarse = _pressure(truth, "kPa")
    position, rough = _position(truth, "%")
    rows: list[Sequence[str]] = [
        (f"Trend of {tag}",), ("Zone", "Asia/Tokyo"),
        ("Time", f"{tag} PT", f"{tag} ZT"), ("", "kPa", "%"),
    ]  # fmt: skip
    rows += _columns(_times(truth, "%Y/%m/%d %H:%M:%S.<f>", "Asia/Tokyo"), pressure, position)
    return Export("trend.txt", _joined(rows, "\t").encode("utf-16"), {}, coarse, rough)


def current_loop(truth: Truth, random: Random) -> Export:
    low, high = TRANSMITTER
    current = 4 + 16 * (truth.pressure - low) / (high - low)
    position, rough = _position(truth, "mA")
    rows = [("Time (ms)", "PT (mA)", "ZT (mA)")]
    times = [str(round(1000 * one)) for one in truth.time.tolist()]
    rows += _columns(times, _rounded(current, 5), position)
    del random
    return Export("loop.csv", _joined(rows, ";").encode(), {}, 0.6e-5 / 16 * high, rough, False)


def influx(truth: Truth, random: Random) -> Export:
    tag = _tag(random)
    rows: list[Sequence[str]] = [
        ("#datatype", "string", "long", "dateTime:RFC3339", "double", "string", "string"),
        ("#default", "_result", "", "", "", "", ""),
        ("", "result", "table", "_time", "_value", "_field", "valve"),
    ]
    times = _times(truth, "%Y-%m-%dT%H:%M:%S.<f>Z", digits=6)
    for number, (name, values) in enumerate(
        (("pressure_pa", truth.pressure), ("position_mm", truth.position * 1e3))
    ):
        rows += [
            ("", "", str(number), time, repr(value), name, tag)
            for time, value in zip(times, values.tolist(), strict=True)
        ]
    answers = {"tag_column": "_field", "value_column": "_value", "time_column": "_time"}
    return Export("influx.csv", _joined(rows, ",").encode(), answers, 1e-6, 1e-12)


def psql(truth: Truth, random: Random) -> Export:
    pressure, coarse = _pressure(truth, "kPa")
    position, rough = _position(truth, "mm")
    lines = [
        "            time            | position_mm | pressure_kpa ",
        "-" * 28 + "+" + "-" * 13 + "+" + "-" * 14,
    ]
    zone = "Europe/Berlin"
    for time, one, other in zip(
        _times(truth, "%Y-%m-%d %H:%M:%S.<f>%z", zone), position, pressure, strict=True
    ):
        lines.append(f" {time[:-2]} | {one:>11} | {other:>12}")
    lines.append(f"({len(position)} rows)")
    del random
    return Export("query.txt", "\n".join(lines).encode(), {}, coarse, rough)


def laboratory(truth: Truth, random: Random) -> Export:
    lines = ["# stroke test", "# t_s  force_dummy  position_mm  pressure_bar"]
    lines += [
        f"{time:10.4f}  {0:6.2f} {stem * 1e3:12.6f}  {pressure / 1e5:12.7f}"
        for time, stem, pressure in zip(
            truth.time.tolist(), truth.position.tolist(), truth.pressure.tolist(), strict=True
        )
    ]
    del random
    return Export("stroke.txt", "\n".join(lines).encode(), {}, 0.1, 1e-9, False)


def excel_days(truth: Truth, random: Random) -> Export:
    days = truth.stamps / 86_400e9 + 25_569
    rows = [("Zeit", "Hub (mm)", "Druck (kPa)")]
    rows += _columns(
        [f"{day:.10f}".replace(".", ",") for day in days.tolist()],
        _position(truth, "mm", ",")[0],
        _pressure(truth, "kPa", ",")[0],
    )
    del random
    return Export("tage.csv", _joined(rows, ";").encode(), {}, 1.0, 1e-6, clock=1e-4)


def newest_first(truth: Truth, random: Random) -> Export:
    pressure, coarse = _pressure(truth, "bar")
    position, rough = _position(truth, "%")
    rows = list(_columns(_times(truth, "%Y-%m-%d %H:%M:%S.<f>"), pressure, position))[::-1]
    rows.insert(0, ("Date/Time", "Actuator pressure [bar]", "Valve position [%]"))
    del random
    return Export("events.csv", _joined(rows, ";").encode(), {}, coarse, rough)


def fraction(truth: Truth, random: Random) -> Export:
    position, rough = _position(truth, "fraction")
    pressure, coarse = _pressure(truth, "kPa")
    rows = [("Elapsed (min)", "Valve position (0-1)", "Actuator pressure (kPa)")]
    rows += _columns([f"{one / 60:.9f}" for one in truth.time.tolist()], position, pressure)
    del random
    return Export("fraction.csv", _joined(rows, ",").encode(), {}, coarse, rough, False)


def day_or_month(truth: Truth, random: Random) -> Export:
    pressure, coarse = _pressure(truth, "bar")
    position, rough = _position(truth, "%")
    form = str(random.choice(["%d/%m/%Y %H:%M:%S.<f>", "%m/%d/%Y %H:%M:%S.<f>"]))
    rows = [("Timestamp", "Position (%)", "Pressure (bar)")]
    rows += _columns(_times(truth, form), position, pressure)
    answers = {"time_format": form.replace("<f>", "%f")}
    return Export("slash.csv", _joined(rows, ",").encode(), answers, coarse, rough)


def without_units(truth: Truth, random: Random) -> Export:
    unit, length = str(random.choice(["psi", "bar"])), str(random.choice(["%", "mm"]))
    pressure, coarse = _pressure(truth, unit)
    position, rough = _position(truth, length)
    rows = [
        ("Time", "Position", "Pressure"),
        *_columns(_rounded(truth.time, 3), position, pressure),
    ]
    answers = {"pressure_unit": unit, "position_unit": length}
    return Export("plain.csv", _joined(rows, ",").encode(), answers, coarse, rough, False)


def several_valves(truth: Truth, random: Random) -> Export:
    pressure, coarse = _pressure(truth, "bar")
    position, rough = _position(truth, "%")
    rows = [
        ("Time", "FV-310 pressure (bar)", "FV-310 position (%)", "FV-311 pressure (bar)",
         "FV-311 position (%)", "FI-300 flow (m3/h)"),
    ]  # fmt: skip
    other, stem = _rounded(truth.pressure[::-1] / 1e5, 5), _rounded(50 + 0 * truth.time, 3)
    rows += _columns(_times(truth, "%Y-%m-%d %H:%M:%S.<f>"), pressure, position, other, stem, stem)
    del random
    return Export("unit3.csv", _joined(rows, ",").encode(), {"valve": "FV-310"}, coarse, rough)


def thousands(truth: Truth, random: Random) -> Export:
    pressure = [f"{value:,.1f}" for value in truth.pressure.tolist()]
    position, rough = _position(truth, "mm")
    rows = [("Time (s)", "Stem Travel (mm)", "Pressure (Pa)")]
    rows += _columns(_rounded(truth.time, 3), position, pressure)
    del random
    return Export("thousands.csv", _joined(rows, ",").encode(), {}, 0.06, rough, False)


def german_thousands(truth: Truth, random: Random) -> Export:
    pressure = [
        f"{value:,.1f}".translate(str.maketrans(",.", ".,")) for value in truth.pressure.tolist()
    ]
    position, rough = _position(truth, "mm", ",")
    rows = [("Zeit (s)", "Hub (mm)", "Druck (Pa)")]
    rows += _columns(_rounded(truth.time, 3, ","), position, pressure)
    del random
    return Export("tausend.csv", _joined(rows, ";").encode(), {}, 0.06, rough, False)


def win_cc(truth: Truth, random: Random) -> Export:
    """Times of whole seconds beside days·10⁶: many values of a second."""
    days = truth.stamps / 86_400e9 + 25_569
    times = _times(truth, "%d.%m.%Y %H:%M:%S")
    rows: list[Sequence[str]] = [("VarName", "TimeString", "VarValue", "Validity", "Time_ms")]
    for index, (time, day) in enumerate(zip(times, days.tolist(), strict=True)):
        clock = f"{day * 1e6:.4f}".replace(".", ",")
        rows += [
            (
                "FV12_Druck_bar",
                time,
                f"{truth.pressure[index] / 1e5:.5f}".replace(".", ","),
                "1",
                clock,
            ),
            (
                "FV12_Hub_mm",
                time,
                f"{truth.position[index] * 1e3:.4f}".replace(".", ","),
                "1",
                clock,
            ),
        ]
    del random
    return Export("wincc.csv", _joined(rows, ";").encode("utf-16"), {}, 1.0, 1e-6)


def bad_beyond(truth: Truth, random: Random) -> Export:
    """A fifth of the values bad: refused, with the option that allows it."""
    pressure, coarse = _pressure(truth, "bar")
    position, rough = _position(truth, "%")
    bad = random.random(len(pressure)) < 0.2
    shown = ["#N/A" if one else text for one, text in zip(bad, pressure, strict=True)]
    rows = [
        ("Time (s)", "Position (%)", "Pressure (bar)"),
        *_columns(_rounded(truth.time, 3), position, shown),
    ]
    return Export(
        "holes.csv", _joined(rows, ",").encode(), {"maximum_bad_share": 0.5}, coarse, rough, False
    )


def opc_quality(truth: Truth, random: Random) -> Export:
    pressure, coarse = _pressure(truth, "kPa")
    position, rough = _position(truth, "%")
    quality = ["0" if random.random() < 0.02 else "192" for _ in pressure]
    shown = ["-1" if one == "0" else text for one, text in zip(quality, pressure, strict=True)]
    rows = [("TimeStamp", "Pressure [kPa]", "Quality", "Position [%]", "Quality")]
    rows += _columns(
        _times(truth, "%Y-%m-%dT%H:%M:%S.<f>+00:00"), shown, quality, position, ["192"] * len(shown)
    )
    return Export("opc.csv", _joined(rows, ";").encode(), {}, coarse, rough)


def kelvin_lab(truth: Truth, random: Random) -> Export:
    """A column of another pressure, and no header of the stem that says so."""
    pressure, coarse = _pressure(truth, "bar")
    position, rough = _position(truth, "mm")
    rows = [("t [s]", "supply pressure [bar]", "chamber [bar]", "LVDT [mm]")]
    rows += _columns(_rounded(truth.time, 3), _rounded(6 + 0 * truth.time, 3), pressure, position)
    del random
    return Export("lab.csv", _joined(rows, ",").encode(), {}, coarse, rough, False)


PROGRAMS: tuple[Callable[[Truth, Random], Export], ...] = (
    libreoffice_german, libreoffice_umlaut, libreoffice_english, excel, pandas_index, pandas_rows,
    pandas_parquet, pi_sampled, pi_csv, pi_pairs, aspen_long, aspen_wide, honeywell,
    honeywell_long, ignition_dataset, ignition_chart, grafana, grafana_raw, matlab_table,
    matlab_datenum, matlab_file, labview, labview_clock, plotjuggler, bag_nanoseconds, delta_v,
    exaquantum, current_loop, influx, psql, laboratory, excel_days, newest_first, fraction,
    day_or_month, without_units, several_valves, thousands, german_thousands, win_cc, bad_beyond,
    opc_quality, kelvin_lab,
)  # fmt: skip
