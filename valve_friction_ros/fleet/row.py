"""A row of the output: its columns, with units in their names, and its cells."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from valve_friction_ros.identification import PARAMETER_UNITS, Result, parameter_columns
from valve_friction_ros.model import Recording

__all__ = ["COLUMNS", "Cell", "error_cells", "key_cells", "result_cells"]

Cell = str | float | int | None

COLUMNS: tuple[str, ...] = (
    "recording",
    "valve",
    "valves",
    "content",
    "settings",
    "method",
    *(column for name in PARAMETER_UNITS for column in parameter_columns(name, None)),
    "fit",
    "rms_m",
    "samples",
    "duration_s",
    "warnings",
    "error",
)
"""All columns: what a row is about, what came of it, and last why nothing did."""


def _one_line(text: str) -> str:
    return " ".join(text.split())


def result_cells(
    valve: str, result: Result, recording: Recording, notes: Sequence[str]
) -> Mapping[str, Cell]:
    """Fill the cells of an identified valve; the notes of the reading join the warnings.

    A parameter that the result does not hold leaves its cells empty.
    """
    shown = result.to_dict()
    cells: dict[str, Cell] = {"valve": _one_line(valve), "method": shown["method"]}
    for name in PARAMETER_UNITS:
        cells |= parameter_columns(name, shown["parameters"].get(name))
    return cells | {
        "fit": shown["fit"],
        "rms_m": shown["rms"],
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
