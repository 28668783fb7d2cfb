"""The status of a valve in a few words and a colour, and the date of its record."""

import math
from datetime import datetime, timezone

from valve_friction_ros.health import FrictionState, Level, StatusSignal
from valve_friction_ros.identification import SLIDING
from valve_friction_ros.model import Recording
from valve_friction_ros.reports.identified_record import IdentifiedRecord
from valve_friction_ros.reports.page import Colour, Status

__all__ = ["began", "date_line", "valve_status"]

_DATED = (1e9, 1e11)
"""Start times, s, that count from 1970: they lie between the years 2001 and 5138."""

_ALARMS = {
    FrictionState.EXCESS: Status(Colour.RED, "Excess friction", "failure (NE 107: F)"),
    FrictionState.COLLAPSED: Status(
        Colour.RED, "Friction has collapsed", "out of specification (NE 107: S)"
    ),
    FrictionState.GROWN: Status(
        Colour.AMBER, "Friction has grown", "maintenance required (NE 107: M)"
    ),
    FrictionState.FALLEN: Status(
        Colour.AMBER, "Friction has fallen", "maintenance required (NE 107: M)"
    ),
    FrictionState.PERHAPS_GROWN: Status(
        Colour.AMBER, "Uncertain", "the friction has perhaps grown"
    ),
    FrictionState.PERHAPS_FALLEN: Status(
        Colour.AMBER, "Uncertain", "the friction has perhaps fallen"
    ),
}


def valve_status(record: IdentifiedRecord) -> Status:
    """Return the status; green only where a comparison with a baseline found nothing."""
    diagnosis = record.diagnosis
    worst = next(iter(record.findings), None)
    if worst is not None and worst.level > diagnosis.level:
        colour = Colour.RED if worst.level is Level.ERROR else Colour.AMBER
        if record.is_scaled and worst.status_signal is StatusSignal.CHECK_FUNCTION:
            return Status(colour, "Check the sensors' scales", "check function (NE 107: C)")
        return Status(colour, "The valve has changed", f"NE 107: {worst.status_signal.value}")
    if record.is_scaled:
        return Status(Colour.AMBER, "Check the sensors' scales", "check function (NE 107: C)")
    return _of_friction(record)


def _of_friction(record: IdentifiedRecord) -> Status:
    diagnosis = record.diagnosis
    if diagnosis.state in _ALARMS:
        return _ALARMS[diagnosis.state]
    if diagnosis.level >= Level.WARN:
        return Status(Colour.AMBER, "Check sensors and model", "check function (NE 107: C)")
    if diagnosis.ratio is None:
        return Status(Colour.GREY, "Unknown", _why_unknown(record))
    return Status(Colour.GREEN, "Friction normal", "compared with the healthy valve")


def _why_unknown(record: IdentifiedRecord) -> str:
    values = record.result.values
    frictions = [values.get(name, math.nan) for name in ("coulomb_friction", SLIDING)]
    if all(map(math.isnan, frictions)):
        return "this record does not determine the friction"
    if record.baseline is None:
        return "no baseline to compare the friction with"
    return "not comparable with the baseline"


def began(recording: Recording) -> datetime | None:
    """Return when a record began; None where its time does not count from 1970."""
    if not _DATED[0] < recording.start_time < _DATED[1]:
        return None
    return datetime.fromtimestamp(recording.start_time, timezone.utc)


def date_line(record: IdentifiedRecord) -> str:
    """Return the date of the record in one sentence."""
    begin = began(record.recording)
    known = "The record has no date" if begin is None else f"Recorded {begin:%Y-%m-%d %H:%M} UTC"
    return "; ".join(filter(None, (known, record.dated))) + "."
