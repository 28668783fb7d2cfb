"""What a result says of the whole valve: parameters, ends of the stem's motion, sensors."""

import math
from collections.abc import Mapping
from typing import Any

from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.sensor_noise import sensor_noises
from valve_friction_ros.health.stem_reach import stem_reach
from valve_friction_ros.health.valve_changes import DIFFERENCES
from valve_friction_ros.identification import (
    CLOCK_OFFSET,
    IMPERFECTIONS_FOUND,
    Parameter,
    Result,
    Verdict,
)

__all__ = ["COMPARED", "fit_numbers", "valve_numbers"]

COMPARED = (
    "spring_constant",
    "spring_preload",
    "coulomb_friction",
    "static_friction",
    "viscous_friction",
    "viscous_asymmetry",
)
"""Parameters of a result that are compared with those of a baseline."""

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

    Parameters are there where they are identified or weak, the preload with any interval, without
    the uncertainties of area and sensor scales, which two records of the same sensors share; not
    where the model does not describe the valve, but for the slip jump, which may be why, and for
    spring and preload where the force balance has identified them, or where the spring constant is
    known to no better than 10 %. The others are:

    - ``slip_force``, F_s − F_c, N; ``viscous_asymmetry``; ``lag`` of the stem, s;
    - ``lowest_position``, ``highest_position``, and the stops that were met (`stem_reach`);
    - ``drive_noise`` and ``stem_noise`` (`sensor_noises`).
    """
    known = {name: one for name, each in result.parameters.items() if (one := _measured(each))}
    fit = fit_numbers(known)
    if fit:
        fit |= _imperfections(result.evidence, known)
    if result.misfit is not None and not result.misfit.describes:
        identified = (name for name in _OF_THE_BALANCE if name in result.parameters)
        sure = [n for n in identified if result.parameters[n].verdict is Verdict.IDENTIFIED]
        fit = {name: one for name, one in fit.items() if name in (_DOUBTED, *sure)}
    slip = fit.get("slip_force")
    largest = math.nan if slip is None else max(slip.value, 0.0) + slip.half_width
    numbers = sensor_noises(result.recording)
    numbers |= stem_reach(result.recording, result.valve, largest)
    return numbers | fit


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
    if CLOCK_OFFSET in known:
        found["lag"] = known[CLOCK_OFFSET]
    if (slip := found.get("slip_force")) is not None:
        share = _SLIP_SHARE * slip.value
        doubt = min(known[_COULOMB].half_width, share) if _COULOMB in known else share
        found["slip_force"] = Measured(slip.value, math.hypot(slip.half_width, doubt))
    if (lag := found.pop("lag", None)) is not None and "viscous_friction" in known:
        doubt = known["viscous_friction"].half_width / known["spring_constant"].value
        found["lag"] = Measured(lag.value, math.hypot(lag.half_width, doubt))
    return found
