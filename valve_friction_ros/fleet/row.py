"""A row of the output: its columns, with units in their names, and its cells."""

from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from pathlib import Path

from valve_friction_ros.fleet.picture import signature_points
from valve_friction_ros.health import Diagnosis, Finding, by_severity, dead_band
from valve_friction_ros.identification import PARAMETER_UNITS, Result, parameter_columns, plain
from valve_friction_ros.model import Recording

__all__ = ["COLUMNS", "PICTURE", "Cell", "error_cells", "key_cells", "result_cells"]

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
"""All columns: what a row is about, what came of it, and last why nothing did."""

PICTURE = "picture"
"""What a row holds beside its columns: the points of its picture."""

_DATED = 946_684_800.0
"""Time, s since 1970, from which a stamp is a date: the year 2000."""


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _began(recording: Recording) -> str | None:
    if recording.start_time < _DATED:
        return None
    began = datetime.fromtimestamp(recording.start_time, timezone.utc)
    return f"{began:%Y-%m-%dT%H:%M:%SZ}"


def result_cells(
    valve: str,
    result: Result,
    diagnosis: Diagnosis,
    notes: Sequence[str],
    findings: Sequence[Finding] = (),
) -> dict[str, Cell]:
    """Fill the cells of an identified valve; the notes of the reading join the warnings.

    `findings` are those beside the friction.

    A parameter that the result does not hold leaves its cells empty.
    """
    shown, told, recording = result.to_dict(), diagnosis.to_dict(), result.recording
    low, high = told["ratio_interval"] or (None, None)
    cells: dict[str, Cell] = {
        "valve": _one_line(valve),
        "method": shown["method"],
        **{name: told[name] for name in ("level", "ne_107", "ratio", "ratio_of")},
        "ratio_low": low,
        "ratio_high": high,
        "dead_band_of_travel": plain(dead_band(result, result.valve)),
        "message": _one_line(diagnosis.message),
        "findings_level": max(one.level for one in findings).name if findings else None,
        "findings": "; ".join(map(str, by_severity(findings))) or None,
        PICTURE: signature_points(recording),
    }
    for name in PARAMETER_UNITS:
        cells |= parameter_columns(name, shown["parameters"].get(name))
    return cells | {
        "sliding_speed_m_per_s": plain(result.sliding_speed),
        "fit": shown["fit"],
        "rms_m": shown["rms"],
        "began": _began(recording),
        "samples": len(recording),
        "duration_s": round((len(recording) - 1) * recording.sample_period, 9),
        "warnings": "; ".join(map(_one_line, (*notes, *shown["warnings"]))) or None,
    }


def error_cells(valve: str, reason: str, path: Path) -> Mapping[str, Cell]:
    """Fill the cells of a refused valve; `path`, which the row names, is removed from `reason`."""
    for start in (f"{path}, {valve}: ", f"{path}: "):
        while reason.startswith(start):
            reason = reason.removeprefix(start)
    return {"valve": _one_line(valve), "error": _one_line(reason)}


def key_cells(recording: str, content: str, settings: str, valves: int) -> Mapping[str, Cell]:
    """Fill the cells by which a later run knows what was done.

    `content` and `settings` are fingerprints of the files and of the options, `valves` is the
    number of rows of this recording.
    """
    return {
        "recording": recording,
        "content": content,
        "settings": settings,
        "valves": valves,
    }
