# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One row per valve of a recording: its cells, its rank and its report."""

import hashlib
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.health.diagnosis import Diagnosis, FrictionLimits, dead_band
from valve_friction_ros.health.levels import Finding, Level, StatusSignal, by_severity
from valve_friction_ros.identification.rendering import parameter_columns, plain
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import PARAMETER_UNITS
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.records.files import write_whole
from valve_friction_ros.reports.identified_record import what_to_do
from valve_friction_ros.streams import utc_second

Cell = str | float | int | None

COLUMNS: tuple[str, ...] = (
    "recording",
    "valve",
    "valves",
    "content",
    "settings",
    "level",
    "ne_107",
    "ratio",
    "ratio_low",
    "ratio_high",
    "ratio_of",
    "dead_band_of_travel",
    "message",
    "survey",
    "what_to_do",
    "findings_level",
    "findings",
    "method",
    *(column for name in PARAMETER_UNITS for column in parameter_columns(name, None)),
    "sliding_speed_m_per_s",
    "fit",
    "rms_m",
    "began",
    "samples",
    "duration_s",
    "report",
    "warnings",
    "error",
)
"""All columns: first the subject of the row, then its results, last the reason of a refusal."""

PICTURE = "picture"
"""Extra cell of a row: the points of its picture."""

DATED = 946_684_800.0
"""Time, s since 1970, from which a stamp is a date: the year 2000."""


def _one_line(text: str) -> str:
    return " ".join(text.split())


def diagnosis_cells(diagnosis: Diagnosis, findings: Sequence[Finding] = ()) -> dict[str, Cell]:
    """Return the cells of a diagnosis and of the findings beyond friction."""
    told = diagnosis.to_dict()
    low, high = told["ratio_interval"] or (None, None)
    return {
        **{name: told[name] for name in ("level", "ne_107", "ratio", "ratio_of")},
        "ratio_low": low,
        "ratio_high": high,
        "message": _one_line(diagnosis.message),
        "survey": told["survey"],
        "what_to_do": _one_line(what_to_do(diagnosis, findings)),
        "findings_level": max(one.level for one in findings).name if findings else None,
        "findings": "; ".join(map(str, by_severity(findings))) or None,
    }


def result_cells(
    valve: str,
    result: Result,
    diagnosis: Diagnosis,
    notes: Sequence[str],
    findings: Sequence[Finding] = (),
) -> dict[str, Cell]:
    """Return the cells of an identified valve; the notes on reading join the warnings.

    `findings` are those beyond friction. A parameter that is not in the result leaves its cells
    empty.
    """
    shown, recording = result.to_dict(), result.recording
    cells: dict[str, Cell] = {
        "valve": _one_line(valve),
        "method": shown["method"],
        **diagnosis_cells(diagnosis, findings),
        "dead_band_of_travel": plain(dead_band(result, result.valve)),
        PICTURE: signature_points(recording),
    }
    for name in PARAMETER_UNITS:
        cells |= parameter_columns(name, shown["parameters"].get(name))
    return cells | {
        "sliding_speed_m_per_s": plain(result.sliding_speed),
        "fit": shown["fit"],
        "rms_m": shown["rms"],
        "began": utc_second(1e9 * began) if (began := recording.start_time) >= DATED else None,
        "samples": len(recording),
        "duration_s": round((len(recording) - 1) * recording.sample_period, 9),
        "warnings": "; ".join(map(_one_line, (*notes, *shown["warnings"]))) or None,
    }


def error_cells(valve: str, reason: str, path: Path) -> Mapping[str, Cell]:
    """Return the cells of a refused valve; `reason` loses `path`, which the row already names."""
    for start in (f"{path}, {valve}: ", f"{path}: "):
        while reason.startswith(start):
            reason = reason.removeprefix(start)
    return {"valve": _one_line(valve), "error": _one_line(reason)}


class RowStatus(NamedTuple):
    """The diagnosis of a row in a word or two, with its colour class."""

    word: str
    colour: str


_LIMITS = FrictionLimits()
_MAYBE = "maybe"
_SURVEYS = {
    "bad": RowStatus("bad", "warn"),
    "watch": RowStatus("watch", _MAYBE),
    "good": RowStatus("good", "ok"),
}
"""Results of the first survey of a valve without a baseline, worst first."""
_BY_SIGNAL = {
    StatusSignal.FAILURE.value: "excessive",
    StatusSignal.OUT_OF_SPECIFICATION.value: "collapsed",
    StatusSignal.MAINTENANCE_REQUIRED.value: "grown",
    StatusSignal.CHECK_FUNCTION.value: "check",
}


def _friction_level(row: Mapping[str, Cell]) -> Level | None:
    return Level[str(row["level"])] if row.get("level") else None


def level_of(row: Mapping[str, Cell]) -> Level | None:
    """Return the level of friction and findings together; None for a refused valve."""
    own, others = _friction_level(row), row.get("findings_level")
    return own if own is None or not others else max(own, Level[str(others)])


def _number(row: Mapping[str, Cell], name: str) -> float:
    value = row.get(name)
    return float(value) if isinstance(value, (int, float)) else -math.inf


def status_of(row: Mapping[str, Cell]) -> RowStatus:
    """Return the status of a valve, coloured ``error``, ``warn``, ``maybe``, ``ok`` or ``none``."""
    level, ratio = level_of(row), _number(row, "ratio")
    if level is None:
        return RowStatus("refused", "none")
    if row.get("error"):  # refused, but its test shows what held the stem
        return RowStatus("stuck", level.name.lower())
    if level > (_friction_level(row) or Level.OK):
        return RowStatus("changed", level.name.lower())
    if level is Level.OK or row["ne_107"] == StatusSignal.CHECK_FUNCTION.value:
        by_ratio = _status_of_ratio(ratio)
        if ratio == -math.inf and str(row.get("survey")) in _SURVEYS:
            return _SURVEYS[str(row["survey"])]
        if level is Level.OK or by_ratio.colour == _MAYBE:
            return by_ratio
    has_fallen = row["ne_107"] == StatusSignal.MAINTENANCE_REQUIRED.value and ratio < 1
    word = "fallen" if has_fallen else _BY_SIGNAL[str(row["ne_107"])]
    return RowStatus(word, level.name.lower())


def _status_of_ratio(ratio: float) -> RowStatus:
    if ratio == -math.inf:
        return RowStatus("no comparison", "none")
    if ratio >= _LIMITS.warn_ratio:
        return RowStatus("perhaps grown", _MAYBE)
    if ratio <= _LIMITS.low_warn_ratio:
        return RowStatus("perhaps fallen", _MAYBE)
    return RowStatus("normal", "ok")


def _need(row: Mapping[str, Cell]) -> tuple[float, float, float, float, str, str]:
    """Return the sort key that puts the valve most in need of attention first."""
    level, ratio = level_of(row), _number(row, "ratio")
    change = abs(math.log(ratio)) if ratio > 0 else -math.inf
    severity = -1.0 if level is None else float(level)
    names = (str(row["recording"]), str(row["valve"]))
    surveys = [*_SURVEYS, str(row.get("survey"))]
    first = float(surveys.index(str(row.get("survey")))) if ratio == -math.inf else len(_SURVEYS)
    return (-severity, first, -change, -_number(row, "dead_band_of_travel"), *names)


def ranked(rows: Iterable[Mapping[str, Cell]]) -> list[Mapping[str, Cell]]:
    """Sort rows by diagnosis, then by first survey, change of friction and dead band.

    A halved friction has changed as much as a doubled friction. Refused valves come last.
    """
    return sorted(rows, key=_need)


def reaches(row: Mapping[str, Cell], level: Level) -> bool:
    """Return whether the diagnosis of a row is at least as severe as `level`."""
    found = level_of(row)
    return found is not None and found >= level


PAGE = "page"
"""Extra cell of a row until its report is written: the text of the page."""

_STRANGE = re.compile(r"[^A-Za-z0-9.-]+")
_LONGEST_NAME = 100
"""Most characters of a report name before its digest."""


def report_name(recording: str, valve: str) -> str:
    """Return a readable name for a report that is unique to the valve."""
    name = f"{recording} {valve}".strip()
    digest = hashlib.blake2b(name.encode(), digest_size=4).hexdigest()
    return f"{_STRANGE.sub('_', name).strip('_')[:_LONGEST_NAME]}_{digest}.html"


def with_reports_written(
    rows: Iterable[Mapping[str, Cell]], beside: Path
) -> list[Mapping[str, Cell]]:
    """Write the pages of rows relative to the folder `beside`, and return the rows.

    A page that cannot be written becomes a warning in its row, which keeps its numbers.
    """
    written: list[Mapping[str, Cell]] = []
    for row in rows:
        cells = dict(row)
        page = cells.pop(PAGE, None)
        if page is not None:
            try:
                write_whole(beside / str(row["report"]), str(page).encode())
            except OSError as error:
                cells["report"] = None
                told = f"no report: {error.filename}: {error.strerror}"
                cells["warnings"] = "; ".join(filter(None, (str(row["warnings"] or ""), told)))
        written.append(cells)
    return written


WIDTH, HEIGHT = 120, 64
"""Size of the picture, in its own units."""

_POINT_STEP = 1.0
"""Least distance between two points. Chosen: the resolution of a screen at this size."""
_MOST_POINTS = 500
"""Most points of a picture. Chosen: some strokes, in 5 kB."""


def _scaled(values: NDArray[np.float64], length: int) -> NDArray[np.float64]:
    span = float(np.ptp(values)) or 1.0
    return np.asarray(1.0 + (values - values.min()) / span * (length - 2), dtype=np.float64)


def signature_points(recording: Recording) -> str:
    """Return stem position over drive as the points of an SVG polyline, rounded.

    A long recording shows its first strokes.
    """
    across, up = _scaled(recording.drive, WIDTH), HEIGHT - _scaled(recording.position, HEIGHT)
    points = [(float(across[0]), float(up[0]))]
    for x, y in zip(across.tolist(), up.tolist(), strict=True):
        if abs(x - points[-1][0]) + abs(y - points[-1][1]) >= _POINT_STEP:
            points.append((x, y))
            if len(points) == _MOST_POINTS:
                break
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
