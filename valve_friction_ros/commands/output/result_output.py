"""How a result is shown by a command: as an object of JSON, and as text."""

from collections.abc import Sequence
from typing import Any

from valve_friction_ros.health import Diagnosis, Finding
from valve_friction_ros.identification import Result
from valve_friction_ros.outside_text import printable

__all__ = ["as_json", "print_table"]


def as_json(
    result: Result,
    notes: Sequence[str] = (),
    diagnosis: Diagnosis | None = None,
    findings: Sequence[Finding] = (),
) -> dict[str, Any]:
    """Build the object that JSON shows of a result.

    `notes` join its warnings; `diagnosis` is there when there is one, and with it the `findings`
    beside the friction.
    """
    shown = result.to_dict()
    shown["warnings"] = [*notes, *shown["warnings"]]
    if diagnosis is None:
        return shown
    found = [one.to_dict() for one in findings]
    return shown | {"diagnosis": diagnosis.to_dict(), "findings": found}


def print_table(
    result: Result,
    notes: Sequence[str] = (),
    diagnosis: Diagnosis | None = None,
    findings: Sequence[Finding] = (),
) -> None:
    """Print a result for people; `notes` join its warnings, `diagnosis` and `findings` end it."""
    print(result.summary())
    for note in notes:
        print(f"note: {printable(note)}")
    if diagnosis is not None:
        print(diagnosis)
    for finding in findings:
        print(finding)
