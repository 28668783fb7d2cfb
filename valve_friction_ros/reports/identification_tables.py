# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Tables in the report of an identification."""

import math
import platform
from collections.abc import Iterable, Mapping
from datetime import datetime, timezone
from typing import Any

import matplotlib
import numba
import numpy as np
import scipy

import valve_friction_ros
from valve_friction_ros.health.comparison import compared
from valve_friction_ros.health.diagnosis import dead_band
from valve_friction_ros.health.levels import Level
from valve_friction_ros.health.measured import DIFFERENCES, Measured, valve_changes
from valve_friction_ros.health.valve_numbers import comparable_numbers
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import (
    CALIBRATION,
    PARAMETER_UNITS,
    TIMING_UNCERTAINTY,
)
from valve_friction_ros.identification.trust.verdict import Verdict
from valve_friction_ros.reports.identified_record import IdentifiedRecord, began
from valve_friction_ros.reports.page import Column, PageTable, Verbatim
from valve_friction_ros.wording import (
    in_zone,
    name_in_words,
    percentage,
    ratio_interval,
    two_digits,
    with_width,
)

_WORDS = {
    "mass": "moving mass m",
    "viscous_friction": "viscous friction F_v",
    "coulomb_friction": "Coulomb friction F_c",
    "static_friction": "static friction F_s",
    "spring_constant": "spring constant k",
    "spring_preload": "spring preload F_0",
    "stribeck_velocity": "Stribeck velocity v_s",
    "coulomb_asymmetry": "asymmetry of F_c",
    "viscous_asymmetry": "asymmetry of F_v",
}

_NOTHING = "–"
_WHOLE = 1e4
"""Size from which numbers are written without decimals: they keep five digits."""
_ROUNDED = 0.01
"""Share of a variance that is lost when its root is rounded to two digits. Chosen."""


def written(value: float | None) -> str:
    """Write a number to at least five digits, without an exponent if possible."""
    if value is None:
        return _NOTHING
    return f"{value:.0f}" if abs(value) >= _WHOLE else f"{value:.5g}"


def _to_width(value: float, half_width: float) -> float:
    """Round a number to two digits of half the width of its interval, if that has a width."""
    return round(value, 1 - math.floor(math.log10(half_width))) if half_width > 0 else value


def words_of(name: str) -> str:
    """Return the name of a parameter in words, with its symbol."""
    return _WORDS.get(name, name_in_words(name))


def _heading(name: str, one: Mapping[str, Any]) -> str:
    return f"{words_of(name)} [{one['unit']}]"


def _is_estimated(one: Mapping[str, Any]) -> bool:
    return one["value"] is not None and one["verdict"] != Verdict.FIXED.value


def _cells(name: str, one: Mapping[str, Any]) -> tuple[str, ...]:
    value, ends = one["value"], _NOTHING
    low, high = one["interval"]
    if _is_estimated(one) and low is not None:
        value, low, high = (_to_width(size, (high - low) / 2) for size in (value, low, high))
        ends = f"{written(low)} to {written(high)}"
    return (
        _heading(name, one),
        written(value),
        ends,
        ": ".join(filter(None, (one["verdict"], one["reason"]))),
        written(one["published"]),
    )


def parameter_table(record: IdentifiedRecord) -> PageTable:
    """Return the parameters with interval and verdict, and with published values if known."""
    shown = record.result.to_dict()["parameters"]
    columns = (
        Column("parameter"),
        Column("value", is_number=True),
        Column("95 % interval", is_number=True),
        Column("verdict"),
        Column("published", is_number=True),
    )
    rows = [_cells(name, one) for name, one in shown.items()]
    marked = ([*shown].index("coulomb_friction"),)
    count = 4 + any(one["published"] is not None for one in shown.values())
    return PageTable(columns[:count], tuple(row[:count] for row in rows), marked=marked)


def budget_table(record: IdentifiedRecord) -> PageTable | None:
    """Return the standard uncertainty of each estimate by source.

    Return None for a method whose evidence has no ``uncertainty_budget``.
    """
    shown = record.result.to_dict()
    parameters, budget = shown["parameters"], shown["evidence"].get("uncertainty_budget")
    if not budget:
        return None
    sources = [*next(iter(budget.values()))]
    parts = {
        name: [*one.values(), _left(record.result.parameters[name].half_width / 2, one.values())]
        for name, one in budget.items()
        if _is_estimated(parameters[name])
    }
    headings = [f"from {source}" for source in sources]
    if any(values[-1] for values in parts.values()):
        headings.append("from other models")
    columns = (Column("standard uncertainty"), *(Column(one, is_number=True) for one in headings))
    rows = (
        (_heading(name, parameters[name]), *map(two_digits, values[: len(headings)]))
        for name, values in parts.items()
    )
    return PageTable(columns, tuple(rows))


def _left(whole: float, parts: Iterable[float]) -> float:
    """Return the rest of a standard uncertainty beyond its parts, 0 if they make it up."""
    left = whole**2 - sum(one**2 for one in parts)
    return math.sqrt(left) if left > _ROUNDED * whole**2 else 0.0


def _pairs(rows: list[tuple[str, str]], first: str, second: str) -> PageTable:
    return PageTable((Column(first), Column(second)), tuple(rows))


def friction_table(record: IdentifiedRecord) -> PageTable:
    """Return the friction compared with its baseline, and the diagnosis."""
    baseline, diagnosis, limits = record.baseline, record.diagnosis, record.limits
    rows, found = [], None
    if baseline is not None:
        rows.append(("friction of the healthy valve (baseline)", str(baseline)))
        result = record.result
        numbers = comparable_numbers(result.evidence)
        found = compared(result.parameters, result.sliding_speed, baseline, numbers)
    if found is not None and (ratio := diagnosis.ratio) is not None:
        excess, width = found.excess
        if any(one.uncalibrated for one in record.result.parameters.values()):
            rows.append(
                (
                    "calibration uncertainty",
                    "left out of this comparison: the same area and sensors scale both friction "
                    "values alike, which cancels in their ratio",
                )
            )
        rows += [
            ("excess friction", f"{'+' * (excess > 0)}{with_width(excess, width)} N"),
            (
                "friction ratio to baseline",
                f"{ratio.what}: {ratio.value:.2f}, {ratio_interval(ratio.low, ratio.high)}",
            ),
            (
                "limits of that ratio",
                f"collapsed below {limits.low_ratio:g}, worth maintenance above "
                f"{limits.warn_ratio:g}, excessive above {limits.error_ratio:g}; "
                "a limit is exceeded if the whole interval lies beyond it",
            ),
        ]
    share = dead_band(record.result, record.valve)
    if math.isfinite(share):
        rows.append(("dead band (F_c + F_s)/k", f"{percentage(share)} of the travel"))
    rows += [("level", _level(record)), ("diagnosis", diagnosis.message)]
    return _pairs(rows, "friction", "finding")


def _level(record: IdentifiedRecord) -> str:
    diagnosis = record.diagnosis
    if diagnosis.level is Level.OK and diagnosis.ratio is None:
        return "unknown: nothing was compared, so no alarm is raised (OK) and none is excluded"
    signal = diagnosis.status_signal.value
    return diagnosis.level.name + (f", NE 107 status signal {signal}" if signal else "")


def record_table(record: IdentifiedRecord) -> PageTable:
    """Return source and extent of the record."""
    recording, drive = record.recording, record.recording.driven_by
    shown, position = recording.drive / drive.size, recording.position * 1e3
    rows: list[tuple[str, str]] = [("source", Verbatim(record.source))]
    if begin := began(record):
        rows.append(("began", in_zone(begin, record.zone, "%Y-%m-%d %H:%M:%S")))
    rows += [
        ("duration", f"{recording.duration:.4g} s"),
        ("samples", f"{len(recording)}, sampled every {recording.sample_period * 1e3:.4g} ms"),
        (drive.label, f"{shown.min():.5g} to {shown.max():.5g}"),
        ("stem [mm]", f"{position.min():.4g} to {position.max():.4g}"),
    ]
    return _pairs(rows, "record", "extent")


def settings_table(record: IdentifiedRecord) -> PageTable:
    """Return settings, valve and software of the identification."""
    result, valve = record.result, record.valve
    shown = result.to_dict()
    settings = shown["settings"]
    fixed, stated = (
        ", ".join(f"{name} = {value:g}" for name, value in settings[which].items())
        for which in ("fixed", "stated")
    )
    window = shown["derivative_window"]
    source = "chosen from the noise of the record"
    if settings["derivative_window"] is not None:
        source = "as given"
    bias = settings["position_bias"]
    rows = [
        ("method", shown["method"]),
        *([("derivative window", f"{window} samples, {source}")] if window else []),
        *_timing(shown),
        *_calibration(settings),
        *(result.drawing.settings or {}).items(),
        ("given parameters", fixed or "none"),
        *([("stated values, compared with those found", stated)] if stated else []),
        ("position bias x̄", "not given" if bias is None else f"{bias:g} m"),
        (
            "mass where the record does not determine it",
            f"{settings['assumed_mass']:g} kg",
        ),
        *(
            []
            if valve.diaphragm_area is None
            else [
                ("diaphragm area S_a", f"{valve.diaphragm_area:g} m²"),
                ("pressure reference P_ref", f"{valve.pressure_reference:g} Pa"),
            ]
        ),
        (
            "travel",
            f"{valve.travel * 1e3:g} mm" if math.isfinite(valve.travel) else "without stops",
        ),
        ("software", _versions()),
        ("report written", in_zone(datetime.now(timezone.utc), record.zone)),
    ]
    return _pairs(rows, "setting", "value")


def _timing(shown: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the timing uncertainty, for a method that uses it."""
    budget = shown["evidence"].get("uncertainty_budget", {})
    if not any("timing" in sources for sources in budget.values()):
        return []
    given = shown["settings"]["timing_uncertainty"]
    usual = 0.0 if shown["method"] == "bench" else TIMING_UNCERTAINTY
    told = f"{usual:g} s, by default" if given is None else f"{given:g} s, as given"
    return [("timing uncertainty, standard deviation of the lag between the signals", told)]


def _calibration(settings: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the relative standard uncertainties of the scales, where given."""
    return [
        (f"relative standard uncertainty of {what}", percentage(settings[name]))
        for name, what in CALIBRATION.items()
        if settings[name]
    ]


def _versions() -> str:
    """Return the versions of the software that affects the numbers."""
    versions = {
        "valve_friction_ros": valve_friction_ros.__version__,
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "numba": numba.__version__,
        "matplotlib": matplotlib.__version__,
        "Python": platform.python_version(),
    }
    return ", ".join(f"{name} {version}" for name, version in versions.items())


def valve_table(record: IdentifiedRecord) -> PageTable | None:
    """Return the numbers that result and baseline share, with their changes, or None."""
    if record.baseline is None:
        return None
    drive = "Pa" if record.recording.driven_by.unit == "kPa" else "N"
    units = {**PARAMETER_UNITS, **DIFFERENCES, "drive_noise": drive, "stem_noise": "m"}
    now, healthy = record.numbers, record.baseline.numbers
    rows = tuple(
        (
            f"{name_in_words(name)} [{units[name]}]",
            _size(healthy[name]),
            _size(now[name]),
            _change(change, is_ratio=name not in DIFFERENCES),
        )
        for name, change in valve_changes(now, healthy).items()
    )
    titles = ("number", "healthy valve (baseline)", "now", "change, 95 % interval")
    return PageTable(tuple(map(Column, titles)), rows) if rows else None


def _size(one: Measured) -> str:
    return with_width(one.value, one.half_width)


def _change(change: Measured, is_ratio: bool) -> str:
    if is_ratio:
        return f"{change.value:.3g} times, {change.low:.3g} to {change.high:.3g}"
    return f"{change.value:+.3g}, {change.low:+.3g} to {change.high:+.3g}"


_UNKNOWN_THRESHOLD = "samples faster than a threshold δv"


def published_words(result: Result) -> str:
    """Return why and where published values differ from the values; empty without any."""
    beside = [one for one in result.parameters.values() if not math.isnan(one.published)]
    if not beside or result.method in ("published", "signature"):
        return ""
    evidence = result.evidence
    samples = _UNKNOWN_THRESHOLD
    if "threshold" in evidence:
        samples = f"samples faster than δv = {evidence['threshold']:.3g} m/s"
    words = (
        "Published method: the regression of the paper, for comparison. It uses derivatives of "
        f"the smoothed position, and only {samples}. Noise, smoothing, lags and slow sliding bias "
        "it; it has no interval, and gives a number even where the record determines none. "
        f"{_how_else(result)}If the two differ, trust the value, not the published one."
    )
    outside = [one for one in beside if 0 < one.half_width < abs(one.published - one.value)]
    if not outside:
        return f"{words} Here every published value lies within the interval, if there is one."
    told = "; ".join(
        f"{words_of(one.name)}: {written(one.published)} against {written(one.value)} {one.unit}"
        for one in outside
    )
    return f"{words} Published values beyond the interval here: {told}."


def _how_else(result: Result) -> str:
    """Say how the method finds the value, if known."""
    if result.stem is not None:
        samples = "over all samples"
        if "uncertainty_budget" in result.evidence:
            samples += (
                ", including those at rest, and takes lags, noise and imperfections of the sensors "
                "into account"
            )
        return f"The value fits the simulated stem to the measured one, {samples}. "
    if result.method in ("plant", "bench"):
        return (
            "The value averages force and friction in the same way as acceleration, over all "
            "samples. "
        )
    return ""
