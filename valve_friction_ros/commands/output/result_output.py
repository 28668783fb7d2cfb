"""How a result is shown by a command: as an object of JSON, and as text."""

from collections.abc import Sequence
from typing import Any

from valve_friction_ros.health import Diagnosis
from valve_friction_ros.identification import Result, plain

__all__ = ["as_json", "print_table"]


def _diagnosis_as_json(diagnosis: Diagnosis) -> dict[str, Any]:
    ratio = diagnosis.ratio
    return {
        "level": diagnosis.level.name,
        "ne_107": diagnosis.status_signal.value,
        "message": diagnosis.message,
        "ratio": None if ratio is None else plain(ratio.value),
        "ratio_interval": None if ratio is None else plain([ratio.low, ratio.high]),
    }


def as_json(
    result: Result, notes: Sequence[str] = (), diagnosis: Diagnosis | None = None
) -> dict[str, Any]:
    """Build the object that JSON shows of a result.

    `notes` join its warnings; `diagnosis` is there when there is one.
    """
    shown = result.to_dict()
    shown["warnings"] = [*notes, *shown["warnings"]]
    return shown if diagnosis is None else shown | {"diagnosis": _diagnosis_as_json(diagnosis)}


def print_table(
    result: Result, notes: Sequence[str] = (), diagnosis: Diagnosis | None = None
) -> None:
    """Print a result for people; `notes` join its warnings, and a `diagnosis` ends it."""
    print(result.summary())
    for note in notes:
        print(f"note: {note}")
    if diagnosis is not None:
        print(f"{diagnosis.level.name}: {diagnosis.message}")
