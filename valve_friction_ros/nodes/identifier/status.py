"""The diagnostic status of a monitored valve."""

import math
from collections.abc import Mapping, Sequence
from datetime import datetime, timezone

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from valve_friction_ros.health import FrictionMonitor, Level, StatusSignal, dead_band
from valve_friction_ros.history import Trend
from valve_friction_ros.identification import PARAMETER_UNITS, Result

__all__ = ["friction_status", "trend_values"]


def _number(value: float) -> str:
    return f"{value:.9g}"


def _assessed_values(result: Result, monitor: FrictionMonitor) -> dict[str, str]:
    values: dict[str, str] = {}
    for name, one in result.parameters.items():
        unit = PARAMETER_UNITS[name]
        values[f"{name} [{unit}]"] = _number(one.value)
        values[f"{name} half width [{unit}]"] = _number(one.half_width)
        values[f"{name} verdict"] = one.verdict.value
        if one.reason:
            values[f"{name} reason"] = one.reason
        if math.isfinite(one.published):
            values[f"{name} published [{unit}]"] = _number(one.published)
    share = dead_band(result, monitor.settings.valve)
    if math.isfinite(share):
        values["dead_band [%]"] = _number(100 * share)
    if math.isfinite(result.rms):
        values["fit [%]"] = _number(100 * result.fit)
        values["rms [µm]"] = _number(1e6 * result.rms)
    if result.misfit is not None:
        values["systematic misfit [µm]"] = _number(1e6 * result.misfit.systematic)
    values["method"] = result.method
    values["derivative_window [samples]"] = str(result.derivative_window)
    estimate = result.estimate
    if estimate is not None:
        values["threshold [m/s]"] = _number(estimate.threshold)
        values["samples"] = str(estimate.samples)
        values["sigma [N]"] = _number(estimate.sigma)
        values["r_squared"] = _number(estimate.r_squared)
    values["fixed"] = ", ".join(monitor.settings.identification.fixed)
    values["warnings"] = "; ".join(result.warnings)
    return values


def _date(time: int) -> str:
    return f"{datetime.fromtimestamp(time / 1e9, timezone.utc):%Y-%m-%d}"


def trend_values(trend: Trend | None) -> dict[str, str]:
    """Return the values that tell of a drift, if it is significant."""
    if trend is None or not trend.is_significant:
        return {}
    values = {
        "coulomb_friction_drift [N/month]": _number(trend.drift),
        "coulomb_friction_drift half width [N/month]": _number(trend.half_width),
    }
    if trend.crossing is not None:
        values["limit_expected"] = trend.crossing.limit.value
        values["limit_expected [date]"] = _date(trend.crossing.time)
        values["limit_expected earliest [date]"] = _date(trend.crossing.earliest)
        values["limit_expected latest [date]"] = _date(trend.crossing.latest)
    return values


def friction_status(
    monitor: FrictionMonitor,
    name: str,
    hardware_id: str,
    now: int,
    input_problems: Sequence[str],
    upkeep_problems: Sequence[str],
    more: Mapping[str, str],
) -> DiagnosticStatus:
    """Compose the status of a valve.

    Parameters
    ----------
    monitor : FrictionMonitor
        Estimate, baseline and verdict.
    name : str
        Name of the status.
    hardware_id : str
        Tag of the valve.
    now : int
        Time, ns, for the age of the estimate.
    input_problems : sequence of str
        What is wrong with the inputs; any raises the level to WARN at least.
    upkeep_problems : sequence of str
        What else needs somebody's hand, while the verdict holds; likewise.
    more : mapping of str to str
        Further values.

    Returns
    -------
    DiagnosticStatus
        Values are bare numbers, their unit is in the key.
    """
    diagnosis = monitor.diagnosis()
    level, signal = diagnosis.level, diagnosis.status_signal
    if input_problems and level < Level.WARN:
        level, signal = Level.WARN, StatusSignal.CHECK_FUNCTION
    elif upkeep_problems and level < Level.WARN:
        level, signal = Level.WARN, StatusSignal.MAINTENANCE_REQUIRED
    result = monitor.result
    friction = None if result is None else result.parameters["coulomb_friction"]
    valid = friction is not None and math.isfinite(friction.value) and monitor.refusal is None
    reason = monitor.refusal or ("" if friction is None or valid else friction.reason)
    values: dict[str, str] = {
        "estimate_valid": str(valid).lower(),
        "reason": reason,
        "NE 107": signal.value,
    }
    if result is not None and monitor.stamp is not None:
        values["estimate_age [s]"] = f"{(now - monitor.stamp) / 1e9:.3f}"
        values |= _assessed_values(result, monitor)
    if monitor.baseline is not None:
        values["baseline_coulomb_friction [N]"] = _number(monitor.baseline.coulomb_friction)
        values["baseline half width [N]"] = _number(monitor.baseline.half_width)
    if diagnosis.ratio is not None:
        values["coulomb_friction_ratio"] = _number(diagnosis.ratio.value)
        values["coulomb_friction_ratio low"] = _number(diagnosis.ratio.low)
        values["coulomb_friction_ratio high"] = _number(diagnosis.ratio.high)
    values |= more
    values["buffered_samples"] = str(len(monitor.buffer))
    return _status(
        level,
        name,
        hardware_id,
        "; ".join([*input_problems, *upkeep_problems, diagnosis.message]),
        values,
    )


def _status(
    level: Level, name: str, hardware_id: str, message: str, values: Mapping[str, str]
) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=bytes([level]),
        name=name,
        hardware_id=hardware_id,
        message=message,
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )
