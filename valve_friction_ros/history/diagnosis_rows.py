"""The diagnosis in a row of the identifications: its state, and an alarm that stands."""

from typing import Any

from valve_friction_ros.health.comparison import Ratio
from valve_friction_ros.health.diagnosis import (
    DOUBT,
    Diagnosis,
    FrictionLimits,
    FrictionState,
    StandingAlarm,
    friction_state,
)
from valve_friction_ros.health.levels import Level, StatusSignal

__all__ = ["diagnosis_in", "state_columns"]


def state_columns(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the columns of the state of a diagnosis; None where there is nothing to say."""
    columns: dict[str, Any] = {"state": diagnosis.state.name, "doubt": diagnosis.own.doubt}
    alarm, latest = diagnosis.alarm, diagnosis.latest
    for name, one in (("alarm", alarm), ("latest", latest)):
        columns |= {
            f"{name}_level": None if one is None else int(one.level),
            f"{name}_status_signal": None if one is None else one.status_signal.value,
            f"{name}_state": None if one is None else one.state.name,
            f"{name}_message": None if one is None else one.message,
        }
    return columns | {"alarm_time_ns": None if alarm is None else alarm.time}


def diagnosis_in(
    row: Any, ratio: Ratio | None, limits: FrictionLimits, is_below_zero: bool
) -> Diagnosis:
    """Return the diagnosis in a row of any version.

    `is_below_zero` tells of a friction that the record found there. Raises ValueError for a state
    that nobody knows.
    """
    level, signal, message = Level(row["level"]), StatusSignal(row["status_signal"]), row["message"]
    columns = row.keys()
    if "state" not in columns or row["state"] is None:
        return _of_former_version(
            Diagnosis(level, signal, message, ratio), row["time_ns"], limits, is_below_zero
        )
    doubt = row["doubt"] or ""
    if row["alarm_state"] is None:
        return Diagnosis(level, signal, message, ratio, _state(row["state"]), doubt)
    alarm = StandingAlarm(
        Level(row["alarm_level"]),
        StatusSignal(row["alarm_status_signal"]),
        _state(row["alarm_state"]),
        row["alarm_message"],
        row["alarm_time_ns"],
    )
    latest = Diagnosis(
        Level(row["latest_level"]),
        StatusSignal(row["latest_status_signal"]),
        row["latest_message"],
        ratio,
        _state(row["latest_state"]),
        doubt,
    )
    return Diagnosis(
        level, signal, message, ratio, _state(row["state"]), alarm=alarm, latest=latest
    )


def _state(name: str) -> FrictionState:
    try:
        return FrictionState[name]
    except KeyError:
        raise ValueError(f"{name!r} is no state of a friction") from None


# Rows of before version 8 have the state of the friction, and an alarm that stands, in their
# sentences only. Nothing else reads a sentence.

_LINK = "; the latest record cannot be compared: "
_BY_SIGNAL = {
    StatusSignal.FAILURE: FrictionState.EXCESS,
    StatusSignal.OUT_OF_SPECIFICATION: FrictionState.COLLAPSED,
    StatusSignal.MAINTENANCE_REQUIRED: FrictionState.GROWN,
}


def _of_former_version(
    kept: Diagnosis, time: int, limits: FrictionLimits, is_below_zero: bool
) -> Diagnosis:
    """Return the diagnosis in a row of a former version, with its state and alarm."""
    message, stood, of_record = kept.message.partition(_LINK)
    if not stood:
        state = _BY_SIGNAL.get(kept.status_signal, FrictionState.UNKNOWN)
        if kept.ratio is not None and state is FrictionState.UNKNOWN:
            state = friction_state(kept.ratio, limits)
        state = FrictionState.IMPOSSIBLE if is_below_zero else state
        return Diagnosis(
            kept.level, kept.status_signal, kept.message, kept.ratio, state, _doubt(kept.message)
        )
    of_level = FrictionState.EXCESS if kept.level is Level.ERROR else FrictionState.GROWN
    state, doubt = _BY_SIGNAL.get(kept.status_signal, of_level), _doubt(of_record)
    alarm = StandingAlarm(kept.level, kept.status_signal, state, message, time)
    latest = Diagnosis(Level.OK, StatusSignal.GOOD, of_record, None, doubt=doubt)
    if doubt or is_below_zero:
        own = FrictionState.IMPOSSIBLE if is_below_zero else FrictionState.UNKNOWN
        check = StatusSignal.CHECK_FUNCTION
        latest = Diagnosis(Level.WARN, check, of_record, None, own, doubt)
    return Diagnosis(
        kept.level, kept.status_signal, kept.message, None, state, alarm=alarm, latest=latest
    )


def _doubt(message: str) -> str:
    doubt, _, _ = message.partition(";")
    return doubt if doubt.startswith(DOUBT) else ""
