"""The diagnostic status of a monitored valve."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from valve_friction_ros.health import (
    Baseline,
    Diagnosis,
    Finding,
    FrictionMonitor,
    Level,
    StatusSignal,
    by_severity,
    dead_band,
    dead_band_half_width,
)
from valve_friction_ros.history import Trend
from valve_friction_ros.identification import SLIDING
from valve_friction_ros.nodes.identifier.value_texts import number_text, ratio_values
from valve_friction_ros.streams import utc, utc_day, utc_minute

__all__ = ["estimate_status", "fail", "friction_status", "stuck_status", "trend_values"]


_EVIDENCE_UNITS = {
    "threshold": " [m/s]",
    "samples": "",
    "sigma": " [N]",
    "r_squared": "",
    "averaged_samples": "",
}


def _result_values(shown: Mapping[str, Any], band: float, half_width: float) -> dict[str, str]:
    """Return what the diagnostic shows of a result, or of what is kept of one, as `to_dict`.

    The dead band and half its interval's width are shares of the travel.
    """
    values: dict[str, str] = {}
    for name, parameter in shown["parameters"].items():
        unit = parameter["unit"]
        values[f"{name} [{unit}]"] = number_text(parameter["value"])
        values[f"{name} half width [{unit}]"] = number_text(parameter["half_width"])
        values[f"{name} verdict"] = parameter["verdict"]
        if parameter["reason"]:
            values[f"{name} reason"] = parameter["reason"]
        if parameter["published"] is not None:
            values[f"{name} published [{unit}]"] = number_text(parameter["published"])
    values["sliding_speed [m/s]"] = number_text(shown["sliding_speed"])
    if math.isfinite(band):
        values["dead_band [%]"] = number_text(100 * band)
        values["dead_band half width [%]"] = number_text(100 * half_width)
    if shown["rms"] is not None:
        values["fit [%]"] = number_text(100 * shown["fit"])
        values["rms [µm]"] = number_text(1e6 * shown["rms"])
    if shown["systematic_misfit"] is not None:
        values["systematic misfit [µm]"] = number_text(1e6 * shown["systematic_misfit"])
    values["method"] = shown["method"]
    if shown.get("derivative_window"):
        values["derivative_window [samples]"] = str(shown["derivative_window"])
    for name, unit in _EVIDENCE_UNITS.items():
        if name in shown.get("evidence", {}):
            values[name + unit] = number_text(shown["evidence"][name])
    settings = shown["settings"]
    values["fixed"] = ", ".join(settings.get("identification", settings).get("fixed", ()))
    values["warnings"] = "; ".join(shown["warnings"])
    return values


def _baseline_values(baseline: Baseline | None) -> dict[str, str]:
    values: dict[str, str] = {}
    if baseline is None:
        return values
    if baseline.coulomb_friction is not None:
        values["baseline_coulomb_friction [N]"] = number_text(baseline.coulomb_friction)
        values["baseline half width [N]"] = number_text(baseline.half_width)
    if (sliding := baseline.sliding) is not None:
        values["baseline_sliding_friction [N]"] = number_text(sliding.value)
        values["baseline_sliding_friction half width [N]"] = number_text(sliding.half_width)
        values["baseline_sliding_friction speed [m/s]"] = number_text(sliding.speed)
    return values


def _time(time: int) -> str:
    """Write a time, ns since 1970, by ISO 8601, as UTC."""
    return f"{utc(time):%Y-%m-%dT%H:%M:%S.%fZ}"


def trend_values(trend: Trend | None) -> dict[str, str]:
    """Return the values of a drift, if it is significant."""
    if trend is None or not trend.is_significant:
        return {}
    values = {
        "friction_drift [N/month]": number_text(trend.drift),
        "friction_drift half width [N/month]": number_text(trend.half_width),
        "friction_drift of": trend.what,
    }
    if trend.crossing is not None:
        values["limit_expected"] = trend.crossing.limit.value
        values["limit_expected [date]"] = utc_day(trend.crossing.time)
        values["limit_expected earliest [date]"] = utc_day(trend.crossing.earliest)
        values["limit_expected latest [date]"] = utc_day(trend.crossing.latest)
    return values


def estimate_status(
    monitor: FrictionMonitor,
    name: str,
    hardware_id: str,
    findings: Sequence[Finding],
    trend: Trend | None = None,
) -> DiagnosticStatus:
    """Compose what is known of a valve; the unit of a number is in its key.

    It changes only when that does: it has the time of the estimate in place of an age, and nothing
    of the inputs. What else is found on the valve follows the diagnosis of its friction; the most
    severe of all sets the level.
    """
    diagnosis, findings = monitor.diagnosis(), by_severity(findings)
    level, signal = diagnosis.level, diagnosis.status_signal
    if findings and findings[0].level > level:
        level, signal = findings[0].level, findings[0].status_signal
    estimate = monitor.estimate
    found = {} if estimate is None else estimate.parameters
    frictions = [found[name] for name in (SLIDING, "coulomb_friction") if name in found]
    trouble = monitor.internal_error or monitor.refusal
    valid = trouble is None and any(math.isfinite(one.value) for one in frictions)
    reason = trouble or ("" if valid or not frictions else frictions[0].reason)
    values: dict[str, str] = {
        "estimate_valid": str(valid).lower(),
        "reason": reason,
        "NE 107": signal.value,
    }
    if estimate is not None and monitor.stamp is not None:
        values["estimate_time"] = _time(monitor.stamp)
        values["estimate_from"] = "this run" if monitor.earlier is None else "before the restart"
        valve = monitor.settings.valve
        values |= _result_values(
            estimate.to_dict(), dead_band(estimate, valve), dead_band_half_width(estimate, valve)
        )
    values |= _baseline_values(monitor.baseline)
    values |= ratio_values(diagnosis.ratio)
    values |= trend_values(trend)
    message = "; ".join(_sentences(monitor, diagnosis, findings))
    return _status(level, name, hardware_id, message, values)


def _sentences(
    monitor: FrictionMonitor, diagnosis: Diagnosis, findings: Sequence[Finding]
) -> list[str]:
    """Return what is said of a valve, one sentence each.

    The latest identification comes first, unless a finding on the friction leads: then it is dated.
    """
    leading = [one.message for one in findings if one.leads]
    told = diagnosis.message
    if leading and monitor.seen_until is not None:
        told += f" (identified earlier, {utc_minute(monitor.seen_until)})"
    return [*leading, told, *(one.message for one in findings if not one.leads)]


def friction_status(
    estimate: DiagnosticStatus,
    monitor: FrictionMonitor,
    now: int,
    input_problems: Sequence[str],
    upkeep_problems: Sequence[str],
    more: Mapping[str, str],
    findings: Sequence[Finding],
    is_watched: bool = True,
) -> DiagnosticStatus:
    """Compose the status of a valve at the time `now`, ns, from what is known of it.

    Problems of the inputs, and problems of the upkeep, which leave the diagnosis valid, raise the
    level to WARN at least. An earlier estimate is shown with its age. `more` holds further values.
    A valve that is not watched is never told to be normal: its samples cannot be used.
    """
    values = {one.key: one.value for one in estimate.values}
    level, signal = Level(estimate.level[0]), StatusSignal(values["NE 107"])
    if input_problems and level < Level.WARN:
        level, signal = Level.WARN, StatusSignal.CHECK_FUNCTION
    elif upkeep_problems and level < Level.WARN:
        level, signal = Level.WARN, StatusSignal.MAINTENANCE_REQUIRED
    values["NE 107"] = signal.value
    if monitor.stamp is not None:
        values["estimate_age [s]"] = f"{(now - monitor.stamp) / 1e9:.3f}"
    values |= more
    pressures, positions = monitor.buffer.counts
    values["buffered_samples"] = str(pressures + positions)
    values["buffered_pressures"] = str(pressures)
    values["buffered_positions"] = str(positions)
    values["samples_taken"] = str(monitor.buffer.taken)
    rejected = monitor.buffer.rejected
    values["samples_rejected"] = str(sum(rejected.values()))
    if rejected:
        causes = (f"{cause} ({count})" for cause, count in sorted(rejected.items()))
        values["samples_rejected causes"] = "; ".join(causes)
    known = _sentences(monitor, monitor.diagnosis(now, is_watched), by_severity(findings))
    message = "; ".join([*input_problems, *upkeep_problems, *known])
    return _status(level, estimate.name, estimate.hardware_id, message, values)


def stuck_status(name: str, hardware_id: str, problem: str) -> DiagnosticStatus:
    """Compose the status of a valve whose node is stuck, fails or cannot start."""
    values = {"estimate_valid": "false", "NE 107": StatusSignal.CHECK_FUNCTION.value}
    return _status(Level.ERROR, name, hardware_id, problem, values)


def fail(status: DiagnosticStatus, failures: Sequence[str]) -> None:
    """Turn a status into that of a valve whose node fails; what it says stays behind the cause."""
    status.level = bytes([Level.ERROR])
    status.message = "; ".join([*failures, status.message])
    for entry in status.values:
        if entry.key == "NE 107":
            entry.value = StatusSignal.CHECK_FUNCTION.value


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
