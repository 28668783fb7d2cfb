# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The diagnostic status of a monitored valve."""

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from valve_friction_ros.health import (
    Diagnosis,
    Finding,
    FrictionMonitor,
    Level,
    StatusSignal,
    Survey,
    by_severity,
    dead_band,
    dead_band_half_width,
)
from valve_friction_ros.history import Trend
from valve_friction_ros.history.status_values import (
    baseline_values,
    exact_time,
    ratio_values,
    result_values,
    trend_values,
)
from valve_friction_ros.identification import SLIDING
from valve_friction_ros.wording import Code, said, sentence

_NO_VALUES: Mapping[str, str] = MappingProxyType({})


def estimate_status(
    monitor: FrictionMonitor,
    name: str,
    hardware_id: str,
    findings: Sequence[Finding],
    trend: Trend | None = None,
    alarms: Mapping[str, str] = _NO_VALUES,
) -> DiagnosticStatus:
    """Compose what is known of a valve; the unit of a number is in its key.

    It changes only when that does: it has the time of the estimate in place of an age, and nothing
    of the inputs; `alarms` are values, too. What else is found on the valve follows the diagnosis
    of its friction; the most severe of all sets the level.
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
        values["estimate_time"] = exact_time(monitor.stamp)
        values["estimate_from"] = "this run" if monitor.earlier is None else "before the restart"
        valve = monitor.settings.valve
        values |= result_values(
            estimate.to_dict(), dead_band(estimate, valve), dead_band_half_width(estimate, valve)
        )
    values |= baseline_values(monitor.baseline)
    values |= ratio_values(diagnosis.ratio)
    if diagnosis.survey is not Survey.UNKNOWN:
        values["survey"] = diagnosis.survey.value
    values |= trend_values(trend)
    values |= alarms
    message = "; ".join(_sentences(monitor, diagnosis, findings))
    return _status(level, name, hardware_id, message, values)


def _sentences(
    monitor: FrictionMonitor, diagnosis: Diagnosis, findings: Sequence[Finding]
) -> list[str]:
    """Return what is said of a valve, one sentence each.

    The latest identification comes first, unless a finding on the friction leads: then it is dated.
    """
    leading = [one.message for one in findings if one.leads]
    told = diagnosis.statement
    if leading and monitor.seen_until is not None:
        told = said(Code.DATED_EARLIER, of=told, time=monitor.seen_until)
    return [*leading, sentence(told), *(one.message for one in findings if not one.leads)]


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
        causes = sorted(f"{cause} ({count})" for cause, count in rejected.items())
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
