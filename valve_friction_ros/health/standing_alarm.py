"""An alarm on friction that stands while later records cannot be compared with the baseline."""

from valve_friction_ros.health.diagnosis import DOUBT, Diagnosis, EarlierEstimate, FrictionLimits
from valve_friction_ros.health.levels import Level, StatusSignal
from valve_friction_ros.streams import utc_minute

__all__ = ["is_standing", "standing", "without_standing"]

_LATEST = "; the latest record cannot be compared: "


def standing(before: Diagnosis, time: int, latest: Diagnosis, limits: FrictionLimits) -> Diagnosis:
    """Return what is said of a valve whose latest record could not be compared.

    Parameters
    ----------
    before : Diagnosis
        Diagnosis of the last record that could be; without an alarm on its friction `latest` counts
        alone. A doubt about its model is none.
    time : int
        When that record was identified, ns since 1970 (UTC).
    latest : Diagnosis
        Diagnosis of the latest record.
    limits : FrictionLimits
        Bounds of the friction.

    Returns
    -------
    Diagnosis
        The alarm with its date, and the sentence of the latest record. It has no ratio, as the
        numbers that are shown beside it are those of the latest record.
    """
    has_grown = before.ratio is not None and before.ratio.low >= limits.warn_ratio
    if before.level < Level.ERROR and not has_grown and not is_standing(before):
        return latest
    message, stood, _ = before.message.partition(_LATEST)
    if not stood:
        message += f" (identified {utc_minute(time)})"
    worst = max(before, latest, key=lambda one: one.level)
    return Diagnosis(worst.level, worst.status_signal, message + _LATEST + latest.message, None)


def is_standing(diagnosis: Diagnosis) -> bool:
    """Return whether a diagnosis is by an alarm from before its own record."""
    return _LATEST in diagnosis.message


def without_standing(earlier: EarlierEstimate) -> Diagnosis:
    """Return the diagnosis that was kept with an estimate, without an alarm from before it."""
    _, stood, message = earlier.diagnosis.message.partition(_LATEST)
    if not stood:
        return earlier.diagnosis
    if message.startswith(DOUBT) or any(value < 0 for value in earlier.values.values()):
        return Diagnosis(Level.WARN, StatusSignal.CHECK_FUNCTION, message, None)
    return Diagnosis(Level.OK, StatusSignal.GOOD, message, None)
