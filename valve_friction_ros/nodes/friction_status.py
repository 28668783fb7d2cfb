"""The diagnostic status of a monitored valve."""

import math
from collections.abc import Mapping, Sequence

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from valve_friction_ros.identification import UNITS, Estimate
from valve_friction_ros.monitoring import (
    FrictionMonitor,
    Level,
    StatusSignal,
    dead_band,
)

__all__ = ["friction_status"]


def _number(value: float) -> str:
    return f"{value:.9g}"


def _estimate_values(estimate: Estimate, monitor: FrictionMonitor) -> dict[str, str]:
    share = dead_band(estimate, monitor.settings.valve)
    values = {f"{name} [{UNITS[name]}]": _number(value) for name, value in estimate.values.items()}
    if math.isfinite(share):
        values["dead_band [%]"] = _number(100 * share)
    values["threshold [m/s]"] = _number(estimate.threshold)
    values["samples"] = str(estimate.samples)
    values["sigma [N]"] = _number(estimate.sigma)
    values["r_squared"] = _number(estimate.r_squared)
    values["fixed"] = ", ".join(estimate.fixed)
    values["warnings"] = "; ".join(estimate.warnings)
    return values


def friction_status(
    monitor: FrictionMonitor,
    name: str,
    hardware_id: str,
    now: int,
    input_problems: Sequence[str],
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

    Returns
    -------
    DiagnosticStatus
        Values are bare numbers, their unit is in the key.
    """
    diagnosis = monitor.diagnosis()
    level, signal = diagnosis.level, diagnosis.status_signal
    if input_problems and level < Level.WARN:
        level, signal = Level.WARN, StatusSignal.CHECK_FUNCTION
    estimate = monitor.estimate
    values: dict[str, str] = {
        "estimate_valid": str(estimate is not None and monitor.refusal is None).lower(),
        "reason": monitor.refusal or "",
        "NE 107": signal.value,
    }
    if estimate is not None and monitor.estimate_stamp is not None:
        values["estimate_age [s]"] = f"{(now - monitor.estimate_stamp) / 1e9:.3f}"
        values |= _estimate_values(estimate, monitor)
    if monitor.baseline is not None:
        values["baseline_coulomb_friction [N]"] = _number(monitor.baseline)
    if diagnosis.ratio is not None:
        values["coulomb_friction_ratio"] = _number(diagnosis.ratio)
    values["buffered_samples"] = str(len(monitor.buffer))
    return _status(
        level, name, hardware_id, "; ".join([*input_problems, diagnosis.message]), values
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
