# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Numbers and states of a valve as texts under keys: its status values in `/diagnostics`."""

import math
from collections.abc import Mapping

from valve_friction_ros.health.alarms import Alarm, AlarmKind, AlarmState
from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.comparison import Ratio
from valve_friction_ros.health.diagnosis import Estimate, dead_band, dead_band_half_width
from valve_friction_ros.history.trend import Trend
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams import utc, utc_day, utc_second


def number_text(value: float | None) -> str:
    """Return a number as text; nan for None."""
    return f"{math.nan if value is None else value:.9g}"


def ratio_values(ratio: Ratio | None, prefix: str = "") -> dict[str, str]:
    """Return the values of a friction over its baseline, with `prefix` before the keys."""
    if ratio is None:
        return {}
    return {
        f"{prefix}friction_ratio": number_text(ratio.value),
        f"{prefix}friction_ratio low": number_text(ratio.low),
        f"{prefix}friction_ratio high": number_text(ratio.high),
        f"{prefix}friction_ratio of": ratio.of,
    }


_EVIDENCE_UNITS = {
    "threshold": " [m/s]",
    "samples": "",
    "sigma": " [N]",
    "r_squared": "",
    "averaged_samples": "",
}


def result_values(estimate: Estimate, valve: Valve) -> dict[str, str]:
    """Return the status values of a result, or of its history entry."""
    shown, values = estimate.to_dict(), dict[str, str]()
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
    if math.isfinite(band := dead_band(estimate, valve)):
        values["dead_band [%]"] = number_text(100 * band)
        half_width = dead_band_half_width(estimate, valve)
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
    settings = shown["settings"].get("identification", shown["settings"])
    values["fixed"] = ", ".join(settings.get("fixed", ()))
    values["assumed"] = ", ".join(settings.get("assumed", ()))
    values["warnings"] = "; ".join(shown["warnings"])
    return values


def baseline_values(baseline: Baseline | None) -> dict[str, str]:
    """Return the status values of the frictions of a baseline."""
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


def exact_time(time: int) -> str:
    """Return a time, ns since 1970, in ISO 8601 as UTC."""
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


def alarm_values(alarms: Mapping[AlarmKind, Alarm]) -> dict[str, str]:
    """Return the state of each alarm, with details of alarms that are not normal."""
    values = {}
    for kind in AlarmKind:
        alarm = alarms.get(kind, Alarm(kind))
        values[f"alarm {kind.value}"] = alarm.state.value
        if alarm.state is AlarmState.NORMAL:
            continue
        values[f"alarm {kind.value} level"] = alarm.condition.level.name
        values[f"alarm {kind.value} message"] = alarm.message
        if alarm.raised is not None:
            values[f"alarm {kind.value} raised [time]"] = utc_second(alarm.raised)
        if alarm.until is not None:
            values[f"alarm {kind.value} until [time]"] = utc_second(alarm.until)
    return values
