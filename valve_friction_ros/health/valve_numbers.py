# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a result says of the whole valve: parameters, ends of the stem's motion, sensors."""

import math
from collections.abc import Mapping
from typing import Any

from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.sensor_noise import sensor_noises
from valve_friction_ros.health.stem_reach import stem_reach
from valve_friction_ros.health.valve_changes import DIFFERENCES
from valve_friction_ros.identification import (
    COMPARABLE,
    IMPERFECTIONS_FOUND,
    SPEED_EXPONENT,
    Parameter,
    Result,
    Verdict,
)

SHARED = "sliding_friction_shared"
"""Part of the half width of a sliding friction, N, by which other records are wrong alike."""

OF_ONE_RESULT = (SHARED, SPEED_EXPONENT)
"""Numbers that belong to the sliding friction of their own result, and to no other."""

COMPARED = (
    "spring_constant",
    "spring_preload",
    "coulomb_friction",
    "static_friction",
    "viscous_friction",
    "viscous_asymmetry",
)
"""Parameters of a result that are compared with those of a baseline."""

IDENTIFIED_ONLY = ("viscous_friction",)
"""Parameters that are compared only where they are identified.

A weak viscous friction is not told apart from a lag, or from a friction that falls with the speed,
and changes with either, and with the motion."""

_COULOMB = "coulomb_friction"
_DOUBTED = "slip_force"
_OF_THE_BALANCE = ("spring_constant", "spring_preload")
_SLIP_SHARE = 0.5
"""Share of a slip force by which it may be too large, whatever the law of the friction.

Chosen: on simulated valves whose friction falls with the speed, 0.4 to 1 of F_s − F_c was found."""

_SURE_SPRING = 0.1
"""Half width of the spring constant, as a share, up to which the numbers of a fit count.

Chosen. Where the spring is known no better, the record leaves open what is spring and what is
friction, and all numbers of the fit depend on that."""


def valve_numbers(result: Result) -> dict[str, Measured]:
    """Return all that a result has measured of the valve, by name, SI units.

    Parameters are there where they are identified or weak (but `IDENTIFIED_ONLY`), the preload with
    any interval, without the uncertainties of area and sensor scales, which two records of the same
    sensors share; not where the model does not describe the valve, but for the slip jump, which may
    be why, and for spring and preload where the force balance has identified them, or where the
    spring constant is known to no better than 10 %. The others are:

    - ``slip_force``, F_s − F_c, N; ``viscous_asymmetry``; ``lag`` of the stem, s;
    - ``lowest_position``, ``highest_position``, and the stops that were met (`stem_reach`);
    - ``drive_noise`` and ``stem_noise`` (`sensor_noises`);
    - what the comparison of its sliding friction needs (`comparable_numbers`).
    """
    known = {name: one for name, each in result.parameters.items() if (one := _measured(each))}
    fit = fit_numbers(known)
    if fit:
        fit |= _imperfections(result.evidence, known)
    for name in IDENTIFIED_ONLY:
        if result.parameters[name].without_calibration.verdict is not Verdict.IDENTIFIED:
            fit.pop(name, None)
    if result.misfit is not None and not result.misfit.describes:
        identified = (name for name in _OF_THE_BALANCE if name in result.parameters)
        sure = [n for n in identified if result.parameters[n].verdict is Verdict.IDENTIFIED]
        fit = {name: one for name, one in fit.items() if name in (_DOUBTED, *sure)}
    slip = fit.get("slip_force")
    largest = math.nan if slip is None else max(slip.value, 0.0) + slip.half_width
    numbers = sensor_noises(result.recording)
    numbers |= stem_reach(result.recording, result.valve, largest)
    return numbers | fit | comparable_numbers(result.evidence)


def comparable_numbers(evidence: Mapping[str, Any]) -> dict[str, Measured]:
    """Return what a comparison needs of the evidence of a result: `OF_ONE_RESULT`."""
    told = evidence.get(COMPARABLE, {})
    numbers = {}
    if told.get("shared_half_width", 0.0) > 0:
        numbers[SHARED] = Measured(told["shared_half_width"], 0.0)
    if SPEED_EXPONENT in told:
        numbers[SPEED_EXPONENT] = Measured(told[SPEED_EXPONENT], told["half_width"])
    return numbers


def fit_numbers(known: Mapping[str, Measured]) -> dict[str, Measured]:
    """Return what known parameters say of a valve: `COMPARED` and ``slip_force``, F_s − F_c.

    There is nothing where the spring constant is not known well enough.
    """
    spring = known.get("spring_constant")
    if spring is None or spring.share > _SURE_SPRING:
        return {}
    numbers = {name: known[name] for name in COMPARED if name in known}
    if {"static_friction", "coulomb_friction"} <= known.keys():
        static, coulomb = known["static_friction"], known["coulomb_friction"]
        numbers["slip_force"] = Measured(
            static.value - coulomb.value, static.half_width + coulomb.half_width
        )
    return numbers


def _measured(one: Parameter) -> Measured | None:
    """Return a parameter without its calibration, where it is identified or weak.

    Of one that is compared by its difference, zero is a value as good as any: its interval counts
    though it is wider than the value.
    """
    one = one.without_calibration
    if one.verdict is Verdict.NOT_IDENTIFIABLE and one.name in DIFFERENCES:
        return None if math.isnan(one.magnitude_bound) else Measured(*one.withheld)
    if one.verdict in (Verdict.IDENTIFIED, Verdict.WEAK) and one.half_width >= 0:
        return Measured(one.value, one.half_width)
    return None


def _imperfections(
    evidence: Mapping[str, Any], known: Mapping[str, Measured]
) -> dict[str, Measured]:
    """Return slip force, asymmetry and lag, as the method found them.

    A slip force is known no better than F_c, from which it is counted, or to `_SLIP_SHARE` of
    itself. Sliding, the stem stands (F_v/k)·ẋ behind where it would be without viscous friction,
    and a lag τ shows it τ·ẋ behind: so the lag is known no better than F_v/k, and not at all
    without F_v.
    """
    found = {
        name: Measured(one["value"], one["half_width"])
        for name, one in evidence.get(IMPERFECTIONS_FOUND, {}).items()
    }
    if (slip := found.get("slip_force")) is not None:
        share = _SLIP_SHARE * slip.value
        doubt = min(known[_COULOMB].half_width, share) if _COULOMB in known else share
        found["slip_force"] = Measured(slip.value, math.hypot(slip.half_width, doubt))
    if (lag := found.pop("lag", None)) is not None and "viscous_friction" in known:
        doubt = known["viscous_friction"].half_width / known["spring_constant"].value
        found["lag"] = Measured(lag.value, math.hypot(lag.half_width, doubt))
    return found
