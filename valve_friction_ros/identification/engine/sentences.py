# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Imperfections of the valve in words: those that are certain, and those left open."""

import math

from valve_friction_ros.identification.engine.imperfections import IMPERFECTIONS, TIMING
from valve_friction_ros.identification.engine.intervals import ROUNDING, Budget, Estimated
from valve_friction_ros.identification.engine.posterior_fit import PosteriorFit
from valve_friction_ros.identification.trust.uncertainty import NORMAL_QUANTILE
from valve_friction_ros.identification.units import UNITS
from valve_friction_ros.wording import percentage, two_digits

_SURE = 3.0
_LEAST_SLIP = 0.1
"""Slip force over F_s above which there is a slip jump.

The slip force cannot be negative, so that noise alone makes it positive."""

_LEAST = {
    "along_travel": 0.01,
    "in_record": 0.01,
    "at_low_speed": 0.03,
    "curvature": 1e-3,
    "cubic": 2e-3,
    "drift": 5e-4,
    "presliding": 2e-6,
    "limit_velocity": 5e-5,
    "viscous_asymmetry": 0.02,
    "slip_force": 0.0,
}
"""Least size of an imperfection that is worth a sentence, in its own unit."""

_OTHERS = {
    "start_position": "initial stem position",
    ROUNDING: "force within one step of the converter",
}
"""Words for the sources of uncertainty that are not imperfections."""

_SHARE = 0.2
"""Share of the variance above which a source is named."""


def _deviation(fit: PosteriorFit, name: str) -> float:
    if name not in fit.names:
        return 0.0
    index = fit.names.index(name)
    return math.sqrt(max(float(fit.stages[-1].covariance[index, index]), 0.0))


def _size(name: str, value: float) -> str:
    if name in TIMING:
        return f"{two_digits(1e3 * abs(value))} ms"
    if name == "presliding":
        return f"{1e6 * value:.2g} µm"
    if name == "limit_velocity":
        return f"{1e3 * value:.2g} mm/s"
    if name == "slip_force":
        return f"F_s above F_c by {value:.3g} N"
    if name in ("along_travel", "in_record"):
        way = "rises" if value > 0 else "falls"
        return f"friction {way} by {percentage(2 * abs(value))}"
    return percentage(value)


def slips(fit: PosteriorFit) -> bool:
    """Return whether F_s lies above F_c by more than chance and its bound at F_c explain."""
    static = fit.at["coulomb_friction"] + fit.at["slip_force"]
    return fit.at["slip_force"] > max(_SURE * _deviation(fit, "slip_force"), _LEAST_SLIP * static)


def found_imperfections(fit: PosteriorFit, lag: Estimated) -> tuple[str, ...]:
    """Return a sentence for each imperfection that is certain, the most certain first.

    A single source of a lag is certain only if their sum is, `lag`, s, over all probable fits.
    """
    found = []
    is_late = abs(lag.value) > _SURE * lag.half_width / NORMAL_QUANTILE
    for name in fit.names:
        if (name == "slip_force" and not slips(fit)) or (name in TIMING and not is_late):
            continue
        least = _LEAST.get(name, 1e-3 if name in TIMING else math.inf)
        value, deviation = fit.at[name], _deviation(fit, name)
        if abs(value) > least and abs(value) > _SURE * deviation:
            sentence = f"{IMPERFECTIONS[name].words}: {_size(name, value)}"
            found.append((deviation / abs(value), sentence))
    return tuple(sentence for _, sentence in sorted(found))


def main_doubt(budget: Budget, width: str) -> str:
    """Name what makes an interval wide: the imperfections that the record leaves open.

    `width` is the text of `interval_share`.
    """
    total = sum(source**2 for source in budget.sources.values()) + budget.record**2
    named = [
        _OTHERS[name] if name in _OTHERS else IMPERFECTIONS[name].words
        for name, source in sorted(budget.sources.items(), key=lambda item: -item[1])
        if source**2 > _SHARE * total
    ]
    share = f"its interval is {width}"
    if not named:
        return f"{share}, due to noise and to motion that the model does not explain"
    return f"{share}; not determined by the record: {', '.join(named[:3])}"


def late_sensor(name: str, value: float) -> str:
    """Say what a number would be if the sensor of the stem were slow."""
    unit = UNITS.get(name, "N")
    return (
        f"it would be {value:.3g} {unit} with a slow stem sensor, whose lag the record cannot "
        "separate from viscous friction; set timing_uncertainty"
    )


def by_stretch(used: float, motion: float) -> str:
    """Say how much of the motion in a long record was used, both in s."""
    return (
        f"used the {used / 60:.3g} min with the most stem travel out of {motion / 60:.3g} min of "
        "motion"
    )


def by_departures(count: int) -> str:
    """Say from how many departures of the stem F_s is taken."""
    return f"the static friction is taken from {count} breakaways of the stem from rest"
