# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Exports of fifty programs: each function turns the truth, with some chance, into a file.

Conventions and rounding follow the exports of the real programs.
"""

import csv
import io
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from datetime import datetime, timedelta, timezone
from typing import Any
from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import NDArray

from benchmark.exports.truth import TRANSMITTER, Export, Truth

Random = np.random.Generator
PRESSURES = {"Pa": 1.0, "kPa": 1e3, "bar": 1e5, "mbar": 1e2, "psi": 6894.757293168}
LENGTHS = {"mm": 1e-3, "in": 25.4e-3, "cm": 1e-2, "m": 1.0}
_ISO = "%Y-%m-%d %H:%M:%S.<f>"
_PI_WORDS = ("Bad Input", "I/O Timeout", "No Data", "Bad", "Scan Off")
_EXACT = {"coarse_pressure": 1e-6, "coarse_position": 1e-12}
"""Rounding errors of a file with all digits."""

Texts = Sequence[str]


def _times(truth: Truth, form: str = _ISO, zone: str = "UTC", digits: int = 3) -> list[str]:
    local = ZoneInfo(zone)
    found = []
    for stamp in truth.stamps.tolist():
        moment = datetime.fromtimestamp(stamp // 10**9, timezone.utc).astimezone(local)
        text = moment.strftime(form).replace("<f>", f"{stamp % 10**9:09d}"[:digits])
        # hours and days without leading zeros, as in the USA
        text = text.replace("<h>", str(moment.hour % 12 or 12))
        found.append(text.replace("<d>", str(moment.day)).replace("<m>", str(moment.month)))
    return found


def _rounded(values: NDArray[np.float64], digits: int, mark: str = ".") -> list[str]:
    return [f"{value:.{digits}f}".replace(".", mark) for value in values.tolist()]


def _signals(
    truth: Truth, pressure_unit: str, position_unit: str, mark: str = "."
) -> tuple[list[str], list[str], dict[str, float]]:
    """Return pressure and position in their units, with their rounding errors."""
    size = PRESSURES[pressure_unit]
    digits = {"Pa": 0, "kPa": 3, "bar": 5, "mbar": 2, "psi": 4}[pressure_unit]
    pressure = _rounded(truth.pressure / size, digits, mark)
    shares = {"%": truth.travel / 100, "fraction": truth.travel, "mA": truth.travel / 16}
    one = (shares | LENGTHS)[position_unit]
    fine = {"%": 3, "fraction": 5, "mA": 4, "mm": 3, "in": 5, "cm": 4, "m": 6}[position_unit]
    position = _rounded(truth.position / one + 4.0 * (position_unit == "mA"), fine, mark)
    coarse, rough = 0.6 * 10.0**-digits * size, 0.6 * 10.0**-fine * one
    return pressure, position, {"coarse_pressure": coarse, "coarse_position": rough}


def _with_words(texts: list[str], random: Random) -> list[str]:
    """Replace a random share of values, up to 3 %, by a program's words for bad values."""
    bad = random.random(len(texts)) < random.uniform(0, 0.03)
    bad[:3] = False
    return [
        str(random.choice(_PI_WORDS)) if one else text for one, text in zip(bad, texts, strict=True)
    ]


def _joined(rows: Iterable[Texts], mark: str, quoted: bool = False) -> str:
    stream = io.StringIO()
    quoting = csv.QUOTE_ALL if quoted else csv.QUOTE_MINIMAL
    csv.writer(stream, delimiter=mark, quoting=quoting, lineterminator="\r\n").writerows(rows)
    return stream.getvalue()


def _columns(*columns: Texts) -> list[Texts]:
    return list(zip(*columns, strict=True))


def _file(
    name: str, rows: Iterable[Texts], mark: str = ",", encoding: str = "utf-8", **known: Any
) -> Export:
    return Export(name, _joined(rows, mark).encode(encoding), **known)


def _workbook(name: str, rows: Iterable[Sequence[object]], cover: str = "", **known: Any) -> Export:
    import openpyxl  # noqa: PLC0415 - an extra

    book = openpyxl.Workbook(write_only=True)
    if cover:
        book.create_sheet("Cover").append([cover])
    sheet = book.create_sheet("Data")
    for row in rows:
        sheet.append(list(row))
    stream = io.BytesIO()
    book.save(stream)
    return Export(name, stream.getvalue(), **known, clock=6e-4)


def _tag(random: Random) -> str:
    kind = random.choice(["FV", "PV", "LV", "TV", "HV"])
    return f"{kind}-{random.integers(100, 999)}"


def _one_of(random: Random, *words: str) -> str:
    return str(random.choice(words))


def libreoffice_german(truth: Truth, random: Random) -> Export:
    unit, zone = _one_of(random, "bar", "mbar", "kPa"), "Europe/Berlin"
    pressure, position, coarse = _signals(truth, unit, "%", ",")
    times = _times(truth, "%d.%m.%Y %H:%M:%S,<f>", zone)
    header = ("Zeit", "Ventilstellung [%]", f"Stelldruck [{unit}]")
    rows = [header, *_columns(times, position, pressure)]
    known = {"answers": {"time_zone": zone}, "exact_date": False}
    return _file("export.csv", rows, ";", "cp1252", **known, **coarse)


def libreoffice_umlaut(truth: Truth, random: Random) -> Export:
    pressure, position, coarse = _signals(truth, "bar", "mm", ",")
    header = ("Zeit (s)", "Öffnung (mm)", "Druck (bar Ü)")
    rows = [header, *_columns(_rounded(truth.time, 3, ","), position, pressure)]
    return _file("messung.csv", rows, ";", "cp1252", exact_date=False, **coarse)


def libreoffice_english(truth: Truth, random: Random) -> Export:
    unit, length = _one_of(random, "psi", "kPa"), _one_of(random, "mm", "in")
    pressure, position, coarse = _signals(truth, unit, length)
    header = ("Time", f"Stem position ({length})", f"Actuator pressure ({unit})")
    return _file("data.csv", [header, *_columns(_times(truth), position, pressure)], **coarse)


def _dates(truth: Truth) -> list[datetime]:
    begin = datetime(1970, 1, 1)
    return [begin + timedelta(microseconds=stamp // 1000) for stamp in truth.stamps.tolist()]


def excel(truth: Truth, random: Random) -> Export:
    travel = np.round(100 * truth.position / truth.travel, 4).tolist()
    pressure = np.round(truth.pressure / 1e3, 4).tolist()
    header = ("Date", "Travel (%)", "Diaphragm pressure (kPa)")
    rows = [(f"Report {_tag(random)}",), (), header]
    rows += zip(_dates(truth), travel, pressure, strict=True)
    coarse = {"coarse_pressure": 0.06, "coarse_position": 1e-6 * truth.travel}
    return _workbook("report.xlsx", rows, **coarse)


def pandas_index(truth: Truth, random: Random) -> Export:
    import pandas as pd  # noqa: PLC0415

    frame = pd.DataFrame(
        {"pressure_bar": truth.pressure / 1e5, "position_mm": truth.position * 1e3},
        index=pd.to_datetime(truth.stamps),
    )
    if random.random() < 0.5:
        frame.index = frame.index.tz_localize("UTC").tz_convert("America/Chicago")
    return Export("frame.csv", frame.to_csv().encode(), **_EXACT)


def pandas_rows(truth: Truth, random: Random) -> Export:
    import pandas as pd  # noqa: PLC0415

    frame = pd.DataFrame(
        {"t": truth.time, "stem_mm": truth.position * 1e3, "pressure_kPa": truth.pressure / 1e3}
    )
    frame.loc[random.random(len(frame)) < 0.02, "stem_mm"] = np.nan
    return Export("frame.csv", frame.to_csv().encode(), exact_date=False, **_EXACT)


def pandas_parquet(truth: Truth, random: Random) -> Export:
    import pandas as pd  # noqa: PLC0415

    frame = pd.DataFrame(
        {"position_percent": 100 * truth.position / truth.travel, "pressure_pa": truth.pressure},
        index=pd.DatetimeIndex(pd.to_datetime(truth.stamps), name="timestamp"),
    )
    frame.loc[random.random(len(frame)) < 0.02, "pressure_pa"] = np.nan
    stream = io.BytesIO()
    frame.to_parquet(stream)
    return Export("frame.parquet", stream.getvalue(), **_EXACT)


def _cell(text: str) -> object:
    return text if text in _PI_WORDS else float(text)


def pi_sampled(truth: Truth, random: Random) -> Export:
    tag = _tag(random).replace("-", "")
    pressure, position, coarse = _signals(truth, "bar", "%")
    cells = [map(_cell, _with_words(texts, random)) for texts in (pressure, position)]
    rows = [
        ("Tag", f"{tag}.PT", f"{tag}.ZT"),
        ("Descriptor", "Actuator pressure", "Valve position"),
        ("Engunits", "bar", "%"),
        *zip(_dates(truth), *cells, strict=True),
    ]
    return _workbook("datalink.xlsx", rows, **coarse)


def pi_csv(truth: Truth, random: Random) -> Export:
    tag, times = _tag(random), _times(truth, "%d-%b-%y %H:%M:%S.<f>")
    pressure, position, coarse = _signals(truth, "kPa", "mm")
    rows = [("Timestamp", f"{tag} pressure (kPa)", f"{tag} travel (mm)")]
    rows += _columns(times, _with_words(pressure, random), _with_words(position, random))
    return _file("pi.csv", rows, **coarse)


def pi_pairs(truth: Truth, random: Random) -> Export:
    """Archived values: each tag with its own times."""
    tag, times = _tag(random), _times(truth, "%d-%b-%Y %H:%M:%S.<f>")
    pressure, position, coarse = _signals(truth, "bar", "%")
    right = [
        pair
        for index, pair in enumerate(zip(times, position, strict=True))
        if random.random() < 0.9 or index < 3
    ]
    right += [("", "")] * (len(times) - len(right))
    rows = [("", f"{tag}.PT (bar)", "", f"{tag}.ZT (%)")]
    rows += [(*one, *other) for one, other in zip(_columns(times, pressure), right, strict=True)]
    return _file("archive.csv", rows, **coarse)


def aspen_long(truth: Truth, random: Random) -> Export:
    tag, times = _tag(random), _times(truth, "%d-%b-%y %H:%M:%S.<f>")
    pressure, position, coarse = _signals(truth, "mbar", "%")
    rows = [("NAME", "IP_TREND_TIME", "IP_TREND_VALUE", "IP_TREND_QSTATUS")]
    for name, values in ((f"{tag}_PT", pressure), (f"{tag}_ZT", position)):
        good = [("Good" if random.random() > 0.01 else "Bad") for _ in values]
        rows += [
            (name, time.upper(), value if q == "Good" else "0", q)
            for time, value, q in zip(times, values, good, strict=True)
        ]
    answers = {"pressure_unit": "mbar", "position_unit": "%"}
    return _file("aspen.csv", rows, answers=answers, **coarse)


def _bad_where(texts: list[str], marks: Texts, bad: str, shown: str) -> list[str]:
    return [shown if mark == bad else text for mark, text in zip(marks, texts, strict=True)]


def aspen_wide(truth: Truth, random: Random) -> Export:
    pressure, position, coarse = _signals(truth, "kPa", "mm")
    status = ["Bad" if one else "Good" for one in random.random(len(pressure)) < 0.02]
    shown, good = _bad_where(pressure, status, "Bad", "0"), ["Good"] * len(position)
    rows = [("Time", "PT-207 (kPa)", "PT-207 Status", "ZT-207 (mm)", "ZT-207 Status")]
    rows += _columns(_times(truth, "%Y/%m/%d %H:%M:%S.<f>"), shown, status, position, good)
    return _file("explorer.csv", rows, **coarse)


def honeywell(truth: Truth, random: Random) -> Export:
    tag, times = _tag(random), _times(truth, "<m>/<d>/%Y <h>:%M:%S.<f> %p")
    pressure, position, coarse = _signals(truth, "psi", "%")
    confidence = ["0" if random.random() < 0.01 else "100" for _ in pressure]
    shown, good = _bad_where(pressure, confidence, "0", "0"), ["100"] * len(position)
    rows = [
        ("Uniformance PHD",),
        ("Tagname", f"{tag}.PT", "Confidence", f"{tag}.ZT", "Confidence"),
        ("Description", "Actuator pressure", "", "Stem position", ""),
        ("Units", "psig", "", "%", ""),
        *_columns(times, shown, confidence, position, good),
    ]
    return _file("phd.csv", rows, answers={"time_format": "%m/%d/%Y %I:%M:%S.%f %p"}, **coarse)


def honeywell_long(truth: Truth, random: Random) -> Export:
    tag, times = _tag(random), _times(truth, "%Y-%m-%dT%H:%M:%S.<f>Z")
    pressure, position, coarse = _signals(truth, "kPa", "%")
    rows = [("TagName", "Units", "TimeStamp", "Value", "Confidence")]
    for time, one, other in zip(times, pressure, position, strict=True):
        rows.append((f"{tag}.PRESSURE", "kPa", time, one, "100"))
        rows.append((f"{tag}.POSITION", "%", time, other, "100"))
    return _file("long.csv", rows, **coarse)


def ignition_dataset(truth: Truth, random: Random) -> Export:
    tag = _tag(random)
    pressure, position, coarse = _signals(truth, "bar", "%")
    head = (
        f'"#NAMES"\r\n"t_stamp","{tag}/Actuator Pressure","{tag}/Position"\r\n'
        f'"#TYPES"\r\n"date","F","F"\r\n"#ROWS","{len(pressure)}"\r\n'
    )
    text = head + _joined(_columns(_times(truth), pressure, position), ",", quoted=True)
    answers = {"pressure_unit": "bar", "position_unit": "%"}
    return Export("ignition.csv", text.encode(), answers, **coarse)


def _every(truth: Truth, seconds: float) -> Truth:
    """Return the samples of a slow recorder."""
    step = round(seconds / truth.time[1])
    signals = {name: getattr(truth, name)[::step] for name in ("time", "pressure", "position")}
    return replace(truth, **signals)


def ignition_chart(truth: Truth, random: Random) -> Export:
    """Times in whole seconds, from a slow recorder."""
    truth = _every(truth, 1.0)
    pressure, position, coarse = _signals(truth, "kPa", "%")
    zone = _one_of(random, "CEST", "UTC")
    name = {"CEST": "Europe/Berlin", "UTC": "UTC"}[zone]
    if zone == "CEST" and "CEST" not in _times(truth, "%Z", name)[0]:
        zone = "CET"
    times = _times(truth, f"%a %b %d %H:%M:%S {zone} %Y", name)
    header = ("Timestamp", "Valve Position (%)", "Actuator Pressure (kPa)")
    return _file("chart.csv", [header, *_columns(times, position, pressure)], **coarse)


def grafana(truth: Truth, random: Random) -> Export:
    pressure, position, coarse = _signals(truth, "bar", "%")
    texts = [f"{text}%" for text in position], [f"{text} bar" for text in pressure]
    rows = [("Time", "Position", "Pressure"), *_columns(_times(truth), *texts)]
    content = _joined(rows, ",", quoted=True).encode("utf-8-sig")
    return Export("grafana.csv", content, **coarse)


def grafana_raw(truth: Truth, random: Random) -> Export:
    tag = _tag(random).lower()
    pressure, position, coarse = _signals(truth, "Pa", "fraction")
    times = [str(stamp // 10**6) for stamp in truth.stamps.tolist()]
    rows = [("time", f"{tag}.stem_position", f"{tag}.pressure_pa")]
    rows += _columns(times, position, pressure)
    return _file("grafana.csv", rows, answers={"position_unit": "fraction"}, **coarse)


def matlab_table(truth: Truth, random: Random) -> Export:
    pressure, position, coarse = _signals(truth, "kPa", "mm")
    rows = [("Time", "StemPosition_mm", "Pressure_kPa")]
    rows += _columns(_times(truth, "%d-%b-%Y %H:%M:%S.<f>"), position, pressure)
    return _file("table.csv", rows, **coarse)


def matlab_datenum(truth: Truth, random: Random) -> Export:
    pressure, position, _ = _signals(truth, "bar", "mm")
    days = _rounded(truth.stamps / 86_400e9 + 719_529, 12)
    header = ("datenum", "Stem (mm)", "Pressure (bar)")
    return _file("datenum.csv", [header, *_columns(days, position, pressure)], clock=1e-4)


def matlab_file(truth: Truth, random: Random) -> Export:
    from scipy.io import savemat  # noqa: PLC0415

    stream, position = io.BytesIO(), truth.position * 1e3
    savemat(stream, {"t": truth.time, "p_bar": truth.pressure / 1e5, "x_position_mm": position})
    return Export("bench.mat", stream.getvalue(), exact_date=False, **_EXACT)


def labview(truth: Truth, random: Random) -> Export:
    mark = _one_of(random, ",", ".")
    pressure, position, coarse = _signals(truth, "bar", "mm", mark)
    count, blank = str(len(pressure)), [""] * len(pressure)
    head = [
        "LabVIEW Measurement", "Writer_Version\t2", "Separator\tTab", f"Decimal_Separator\t{mark}",
        "Date\t2026/07/01", f"Time\t14:00:00{mark}123", "***End_of_Header***", "",
        "Channels\t2", f"Samples\t{count}\t{count}", "Y_Unit_Label\tbar\tmm",
        "X_Dimension\tTime\tTime", f"X0\t0{mark}0\t0{mark}0", "***End_of_Header***",
    ]  # fmt: skip
    rows = [("X_Value", "Pressure", "Position", "Comment")]
    rows += _columns(_rounded(truth.time, 6, mark), pressure, position, blank)
    text = "\r\n".join(head) + "\r\n" + _joined(rows, "\t")
    answers = {"pressure_unit": "bar", "position_unit": "mm"}
    return Export("bench.lvm", text.encode(), answers, exact_date=False, **coarse)


def labview_clock(truth: Truth, random: Random) -> Export:
    pressure, position, coarse = _signals(truth, "psi", "in")
    since_1904 = (truth.stamps // 10**6 + 2_082_844_800_000) / 1000
    rows = [("Time", "Stem travel [in]", "Pressure [psi]")]
    rows += _columns(_rounded(since_1904, 3), position, pressure)
    return _file("clock.txt", rows, "\t", **coarse)


def plotjuggler(truth: Truth, random: Random) -> Export:
    """The two topics of a bag in separate rows."""
    valve, topic = _tag(random).lower().replace("-", "_"), "actuator_pressure/fluid_pressure"
    rows = [("__time", f"/{valve}/{topic}", f"/{valve}/stem_state/stem/position")]
    signals = (truth.stamps / 1e9, truth.pressure, truth.position)
    for time, one, other in zip(*(signal.tolist() for signal in signals), strict=True):
        rows += [(f"{time:.6f}", f"{one:.3f}", ""), (f"{time + 1e-4:.6f}", "", f"{other:.9f}")]
    answers = {"pressure_unit": "Pa", "position_unit": "m"}
    return _file(
        "plot.csv", rows, answers=answers, coarse_pressure=1e-2, coarse_position=1e-8, clock=2e-4
    )


def bag_nanoseconds(truth: Truth, random: Random) -> Export:
    signals = (truth.stamps, truth.pressure, truth.position)
    rows = [("timestamp", "pressure_pa", "position_m")]
    rows += _columns(*(list(map(repr, signal.tolist())) for signal in signals))
    return _file("bag.csv", rows, **_EXACT)


def delta_v(truth: Truth, random: Random) -> Export:
    pressure, position, coarse = _signals(truth, "bar", "%", ",")
    zone, wanted = "Europe/Vienna", _rounded(50 + 0 * truth.time, 1, ",")
    days, times = _times(truth, "%d.%m.%Y", zone), _times(truth, "%H:%M:%S,<f>", zone)
    rows = [("Datum", "Uhrzeit", "Position (%)", "Sollwert (%)", "Antriebsdruck (bar)")]
    rows += _columns(days, times, position, wanted, pressure)
    known = {"answers": {"time_zone": zone}, "exact_date": False}
    return _file("trend.csv", rows, ";", **known, **coarse)


def exaquantum(truth: Truth, random: Random) -> Export:
    tag, zone = _tag(random), "Asia/Tokyo"
    pressure, position, coarse = _signals(truth, "kPa", "%")
    header = ("Time", f"{tag} PT", f"{tag} ZT")
    rows = [(f"Trend of {tag}",), ("Zone", zone), header, ("", "kPa", "%")]
    rows += _columns(_times(truth, "%Y/%m/%d %H:%M:%S.<f>", zone), pressure, position)
    return _file("trend.txt", rows, "\t", "utf-16", **coarse)


def current_loop(truth: Truth, random: Random) -> Export:
    low, high = TRANSMITTER
    current = _rounded(4 + 16 * (truth.pressure - low) / (high - low), 5)
    _, position, coarse = _signals(truth, "bar", "mA")
    times = [str(round(1000 * one)) for one in truth.time.tolist()]
    rows = [("Time (ms)", "PT (mA)", "ZT (mA)"), *_columns(times, current, position)]
    coarse["coarse_pressure"] = 0.6e-5 / 16 * high
    return _file("loop.csv", rows, ";", exact_date=False, **coarse)


def influx(truth: Truth, random: Random) -> Export:
    tag, times = _tag(random), _times(truth, "%Y-%m-%dT%H:%M:%S.<f>Z", digits=6)
    rows = [
        ("#datatype", "string", "long", "dateTime:RFC3339", "double", "string", "string"),
        ("#default", "_result", "", "", "", "", ""),
        ("", "result", "table", "_time", "_value", "_field", "valve"),
    ]
    signals = (("pressure_pa", truth.pressure), ("position_mm", truth.position * 1e3))
    for number, (name, values) in enumerate(signals):
        rows += [
            ("", "", str(number), time, repr(value), name, tag)
            for time, value in zip(times, values.tolist(), strict=True)
        ]
    answers = {"tag_column": "_field", "value_column": "_value", "time_column": "_time"}
    return _file("influx.csv", rows, answers=answers, **_EXACT)


def psql(truth: Truth, random: Random) -> Export:
    pressure, position, coarse = _signals(truth, "kPa", "mm")
    times = _times(truth, f"{_ISO}%z", "Europe/Berlin")
    lines = [
        "            time            | position_mm | pressure_kpa ",
        "-" * 28 + "+" + "-" * 13 + "+" + "-" * 14,
    ]
    for time, one, other in zip(times, position, pressure, strict=True):
        lines.append(f" {time[:-2]} | {one:>11} | {other:>12}")
    lines.append(f"({len(position)} rows)")
    return Export("query.txt", "\n".join(lines).encode(), **coarse)


def laboratory(truth: Truth, random: Random) -> Export:
    signals = (truth.time, truth.position, truth.pressure)
    lines = ["# stroke test", "# t_s  force_dummy  position_mm  pressure_bar"]
    for time, stem, pressure in zip(*(signal.tolist() for signal in signals), strict=True):
        lines.append(f"{time:10.4f}  {0:6.2f} {stem * 1e3:12.6f}  {pressure / 1e5:12.7f}")
    coarse = {"coarse_pressure": 0.1, "coarse_position": 1e-9}
    return Export("stroke.txt", "\n".join(lines).encode(), exact_date=False, **coarse)


def excel_days(truth: Truth, random: Random) -> Export:
    pressure, position, _ = _signals(truth, "kPa", "mm", ",")
    days = _rounded(truth.stamps / 86_400e9 + 25_569, 10, ",")
    rows = [("Zeit", "Hub (mm)", "Druck (kPa)"), *_columns(days, position, pressure)]
    return _file("tage.csv", rows, ";", clock=1e-4)


def newest_first(truth: Truth, random: Random) -> Export:
    pressure, position, coarse = _signals(truth, "bar", "%")
    header = ("Date/Time", "Actuator pressure [bar]", "Valve position [%]")
    rows = [header, *_columns(_times(truth), pressure, position)[::-1]]
    return _file("events.csv", rows, ";", **coarse)


def fraction(truth: Truth, random: Random) -> Export:
    pressure, position, coarse = _signals(truth, "kPa", "fraction")
    rows = [("Elapsed (min)", "Valve position (0-1)", "Actuator pressure (kPa)")]
    rows += _columns(_rounded(truth.time / 60, 9), position, pressure)
    return _file("fraction.csv", rows, exact_date=False, **coarse)


def day_or_month(truth: Truth, random: Random) -> Export:
    pressure, position, coarse = _signals(truth, "bar", "%")
    form = _one_of(random, "%d/%m/%Y %H:%M:%S.<f>", "%m/%d/%Y %H:%M:%S.<f>")
    rows = [("Timestamp", "Position (%)", "Pressure (bar)")]
    rows += _columns(_times(truth, form), position, pressure)
    return _file("slash.csv", rows, answers={"time_format": form.replace("<f>", "%f")}, **coarse)


def without_units(truth: Truth, random: Random) -> Export:
    unit, length = _one_of(random, "psi", "bar"), _one_of(random, "%", "mm")
    pressure, position, coarse = _signals(truth, unit, length)
    rows = [("Time", "Position", "Pressure")]
    rows += _columns(_rounded(truth.time, 3), position, pressure)
    answers = {"pressure_unit": unit, "position_unit": length}
    return _file("plain.csv", rows, answers=answers, exact_date=False, **coarse)


def several_valves(truth: Truth, random: Random) -> Export:
    pressure, position, coarse = _signals(truth, "bar", "%")
    one, two = "FV-310", "FV-311"
    rows = [
        ("Time", f"{one} pressure (bar)", f"{one} position (%)", f"{two} pressure (bar)",
         f"{two} position (%)", "FI-300 flow (m3/h)"),
    ]  # fmt: skip
    other, stem = _rounded(truth.pressure[::-1] / 1e5, 5), _rounded(50 + 0 * truth.time, 3)
    rows += _columns(_times(truth), pressure, position, other, stem, stem)
    return _file("unit3.csv", rows, answers={"valve": one}, **coarse)


def thousands(truth: Truth, random: Random) -> Export:
    _, position, coarse = _signals(truth, "Pa", "mm")
    pressure = [f"{value:,.1f}" for value in truth.pressure.tolist()]
    rows = [("Time (s)", "Stem Travel (mm)", "Pressure (Pa)")]
    rows += _columns(_rounded(truth.time, 3), position, pressure)
    coarse["coarse_pressure"] = 0.06
    return _file("thousands.csv", rows, exact_date=False, **coarse)


def german_thousands(truth: Truth, random: Random) -> Export:
    _, position, coarse = _signals(truth, "Pa", "mm", ",")
    swapped = str.maketrans(",.", ".,")
    pressure = [f"{value:,.1f}".translate(swapped) for value in truth.pressure.tolist()]
    rows = [("Zeit (s)", "Hub (mm)", "Druck (Pa)")]
    rows += _columns(_rounded(truth.time, 3, ","), position, pressure)
    coarse["coarse_pressure"] = 0.06
    return _file("tausend.csv", rows, ";", exact_date=False, **coarse)


def win_cc(truth: Truth, random: Random) -> Export:
    """Times in whole seconds, so that many values share a second, beside days·10⁶."""
    clock = _rounded((truth.stamps / 86_400e9 + 25_569) * 1e6, 4, ",")
    times = _times(truth, "%d.%m.%Y %H:%M:%S")
    pressure, stem = (
        _rounded(signal, digits, ",")
        for signal, digits in ((truth.pressure / 1e5, 5), (truth.position * 1e3, 4))
    )
    rows = [("VarName", "TimeString", "VarValue", "Validity", "Time_ms")]
    for time, day, one, other in zip(times, clock, pressure, stem, strict=True):
        rows.append(("FV12_Druck_bar", time, one, "1", day))
        rows.append(("FV12_Hub_mm", time, other, "1", day))
    return _file("wincc.csv", rows, ";", "utf-16")


def bad_beyond(truth: Truth, random: Random) -> Export:
    """A file with a fifth of its values bad: refused, naming the option that allows it."""
    pressure, position, coarse = _signals(truth, "bar", "%")
    bad = random.random(len(pressure)) < 0.2
    bad[:1] = False  # times are relative to the first sample
    shown = ["#N/A" if one else text for one, text in zip(bad, pressure, strict=True)]
    rows = [("Time (s)", "Position (%)", "Pressure (bar)")]
    rows += _columns(_rounded(truth.time, 3), position, shown)
    answers = {"maximum_bad_share": 0.5}
    return _file("holes.csv", rows, answers=answers, exact_date=False, **coarse)


def opc_quality(truth: Truth, random: Random) -> Export:
    pressure, position, coarse = _signals(truth, "kPa", "%")
    quality = ["0" if random.random() < 0.02 else "192" for _ in pressure]
    shown, good = _bad_where(pressure, quality, "0", "-1"), ["192"] * len(position)
    rows = [("TimeStamp", "Pressure [kPa]", "Quality", "Position [%]", "Quality")]
    times = _times(truth, "%Y-%m-%dT%H:%M:%S.<f>+00:00")
    rows += _columns(times, shown, quality, position, good)
    return _file("opc.csv", rows, ";", **coarse)


def kelvin_lab(truth: Truth, random: Random) -> Export:
    """A column with another pressure, and a stem column whose header does not say so."""
    pressure, position, coarse = _signals(truth, "bar", "mm")
    times, supply = _rounded(truth.time, 3), _rounded(6 + 0 * truth.time, 3)
    rows = [("t [s]", "supply pressure [bar]", "chamber [bar]", "LVDT [mm]")]
    rows += _columns(times, supply, pressure, position)
    return _file("lab.csv", rows, exact_date=False, **coarse)


def ignition_table(truth: Truth, random: Random) -> Export:
    """Dates in the US format of Java."""
    truth = _every(truth, 1.0)
    pressure, position, coarse = _signals(truth, "psi", "%")
    times = _times(truth, f"%b <d>, %Y{_one_of(random, ',', '')} <h>:%M:%S %p")
    rows = [("t_stamp", "FV101/ZT (% open)", "FV101/PT (psi g)")]
    return _file("table.csv", [*rows, *_columns(times, position, pressure)], **coarse)


def yokogawa(truth: Truth, random: Random) -> Export:
    """Day, time and milliseconds in separate columns."""
    pressure, position, coarse = _signals(truth, "kPa", "%")
    rows = [("GX20",), ("Date", "Time", "sub sec", "PT101", "ZT101"), ("", "", "", "kPa(g)", "%")]
    times = (_times(truth, form) for form in ("%Y/%m/%d", "%H:%M:%S", "<f>"))
    return _file("trend.csv", [*rows, *_columns(*times, pressure, position)], **coarse)


def rockwell(truth: Truth, random: Random) -> Export:
    pressure, position, coarse = _signals(truth, "psi", "%")
    rows = [("Date", "Time", "Millitm", "TagName", "Value", "Status", "Marker", "Internal")]
    stamps = _columns(*(_times(truth, form) for form in ("%m/%d/%Y", "%H:%M:%S", "<f>")))
    for stamp, one, other in zip(stamps, pressure, position, strict=True):
        rows.append((*stamp, "FV101_PT_psi", one, "", "", "-1"))
        rows.append((*stamp, "FV101_ZT_pct", other, "", "", "-1"))
    return _file("log.csv", rows, answers={"time_format": "%m/%d/%Y %H:%M:%S.%f"}, **coarse)


def merged_cells(truth: Truth, random: Random) -> Export:
    pressure, position = (truth.pressure / 1e5).tolist(), (1e3 * truth.position).tolist()
    rows = [
        (None, "FV-101", None, "FV-102", None),
        ("Time", "Pressure", "Travel", "Pressure", "Travel"),
        (None, "bar", "mm", "bar", "mm"),
        *zip(_dates(truth), pressure, position, pressure[::-1], position, strict=True),
    ]
    known = {"answers": {"valve": "FV-101"}, "coarse_pressure": 0.06}
    return _workbook("unit1.xlsx", rows, **known)


def second_sheet(truth: Truth, random: Random) -> Export:
    rows = [("Time", "Position (mm)", "Pressure (kPa)")]
    rows += zip(_dates(truth), 1e3 * truth.position, truth.pressure / 1e3, strict=True)
    known = {"answers": {"sheet": "Data"}, "coarse_pressure": 0.06}
    return _workbook("report.xlsx", rows, cover="Made for the audit", **known)


def quoted_commas(truth: Truth, random: Random) -> Export:
    """Decimal commas inside quotes, and commas as separators."""
    pressure, position, coarse = _signals(truth, "bar", "mm", ",")
    rows = [("Zeit (s)", "Hub (mm)", "Druck (bar)")]
    rows += _columns(_rounded(truth.time, 3, ","), position, pressure)
    text = _joined(rows, ",", quoted=True)
    return Export("zitiert.csv", text.encode(), exact_date=False, **coarse)


def sentinels(truth: Truth, random: Random) -> Export:
    """A number marks missing values, and the header gives the time zone."""
    pressure, position, coarse = _signals(truth, "bar", "%")
    shown = ["-9999" if random.random() < 0.01 else text for text in position]
    rows = [("Time (UTC+2)", "ZT-101 [%]", "PT-101 [bar]")]
    rows += _columns(_times(truth, zone="Etc/GMT-2"), shown, pressure)
    return _file("holes.csv", rows, **coarse)


def excel_minutes(truth: Truth, random: Random) -> Export:
    """Times with fractions as Excel shows and saves them: 32:15.0."""
    truth = _every(truth, 0.1)
    pressure, position, coarse = _signals(truth, "bar", "%")
    rows = [("Time", "Position (%)", "Pressure (bar)")]
    rows += _columns(_times(truth, "%M:%S.<f>", digits=1), position, pressure)
    return _file("saved.csv", rows, exact_date=False, **coarse)


def finnish(truth: Truth, random: Random) -> Export:
    truth = _every(truth, 1.0)
    pressure, position, coarse = _signals(truth, "bar", "%", ",")
    rows = [("Aika", "Asento [%]", "Paine [bar]")]
    rows += _columns(_times(truth, "%d.%m.%Y %H.%M.%S"), position, pressure)
    return _file("vienti.csv", rows, ";", answers={"position_column": "Asento [%]"}, **coarse)


_FILE_TIME = 116_444_736_000_000_000
"""Start of 1970, in 100 ns since 1601."""


def _scope(truth: Truth, mark: str) -> Export:
    """Two columns per channel, with time in ms since the start; the stem has half the rate."""
    pressure, position, coarse = _signals(truth, "bar", "mm", ",")
    since = (truth.stamps - truth.stamps[0]) / 1e6
    begin = truth.stamps[0] // 100 + _FILE_TIME
    channels = [("GVL.fStelldruck", "bar (Pressure)"), ("GVL.fHub", "mm (Length)")]

    def above(word: str, *cells: str) -> list[str]:
        return [one for cell in cells for one in (word, cell)]

    rows: list[Texts] = [
        ("Name", "Scope YT Project"),
        ("File", r"D:\Scope\valve.csv"),
        ("Starttime of export", str(begin), "Freitag, 6. März 2026", "08:00:00.000"),
        ("Endtime of export", str(begin), "Freitag, 6. März 2026", "08:00:00.000"),
        (),
        (),
        above("Name", *(name for name, _ in channels)),
        above("SymbolComment", "", ""),
        above("Data-Type", "REAL64", "REAL64"),
        above("SampleTime[ms]", "10", "20"),
        above("SymbolName", *(f"MAIN.{name}" for name, _ in channels)),
        above("IndexOffset", "385000", "385008"),
        above("Port", "851", "851"),
        above("Offset", "0", "0"),
        above("ScaleFactor", "1", "1"),
        above("Unit", *(unit for _, unit in channels)),
        above("Unit Offset", "0", "0"),
        (),
    ]
    times = _rounded(since, 3, ",")
    left, right = [*zip(times, pressure, strict=True)], [*zip(times, position, strict=True)][::2]
    right += [("", "")] * (len(left) - len(right))
    rows += [(*one, *other) for one, other in zip(left, right, strict=True)]
    return _file("scope.csv", [*rows, ("EOF",)], mark, clock=1e-6, **coarse)


def twin_cat(truth: Truth, random: Random) -> Export:
    return _scope(truth, "\t")


def twin_cat_semicolons(truth: Truth, random: Random) -> Export:
    return _scope(truth, ";")


PROGRAMS: tuple[Callable[[Truth, Random], Export], ...] = (
    libreoffice_german, libreoffice_umlaut, libreoffice_english, excel, pandas_index, pandas_rows,
    pandas_parquet, pi_sampled, pi_csv, pi_pairs, aspen_long, aspen_wide, honeywell,
    honeywell_long, ignition_dataset, ignition_chart, grafana, grafana_raw, matlab_table,
    matlab_datenum, matlab_file, labview, labview_clock, plotjuggler, bag_nanoseconds, delta_v,
    exaquantum, current_loop, influx, psql, laboratory, excel_days, newest_first, fraction,
    day_or_month, without_units, several_valves, thousands, german_thousands, win_cc, bad_beyond,
    opc_quality, kelvin_lab, ignition_table, yokogawa, rockwell, merged_cells, second_sheet,
    quoted_commas, sentinels, excel_minutes, finnish, twin_cat, twin_cat_semicolons,
)  # fmt: skip
