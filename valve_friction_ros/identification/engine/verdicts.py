# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Verdicts on the numbers of a fit with imperfections."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from valve_friction_ros.identification.engine.friction_curve import FrictionCurve
from valve_friction_ros.identification.engine.imperfections import Profile
from valve_friction_ros.identification.engine.intervals import (
    NOISE_LIKE,
    Doubt,
    Estimated,
    doubt_of,
)
from valve_friction_ros.identification.engine.posterior_fit import PosteriorFit
from valve_friction_ros.identification.engine.sentences import late_sensor, main_doubt, slips
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.misfit import Misfit
from valve_friction_ros.identification.trust.verdict import (
    FALL_SPEED,
    NO_SLIP,
    PRELOAD_SCALE,
    WEAK_SHARE,
    Parameter,
    Verdict,
    fixed,
    interval_share,
    not_identifiable,
    share_of,
    with_verdict,
)
from valve_friction_ros.identification.units import SLIDING, UNITS
from valve_friction_ros.wording import two_digits

USABLE = 0.1
"""Half width over value up to which a sliding friction is of use to maintenance.

Chosen: well below the 25 % of growth that raises the first alarm."""

_DOUBTS = {
    Doubt.MISFIT: (
        "no friction model here reproduces the motion exactly ({um} µm of the deviation is more "
        "than noise): the sliding friction is reliable, its components are not"
    ),
    Doubt.LAG: (
        "the best fit puts the signals {ms:.0f} ms apart, which is not plausible: something else "
        "in the motion looks like a lag"
    ),
    Doubt.UNTRIED: "the search ended before it tried other lags: use a shorter record",
}
_FAILED = 100.0
"""Inflation of the residual beyond which no number that only the simulation gives is reported: ten
times the noise."""

_FURTHER, _BELOW_TOP = 0.35, 0.95
"""Half width, over F_c, of its further fall beyond the speeds of a slow record: in packings that
slip, F_s is up to twice F_c, and half of all packings slip. And the share of the distance below the
top speed: a short peak shows no friction."""

_BY_SPEED = ("coulomb_friction", "viscous_friction", "static_friction", "stribeck_velocity")
"""Numbers into which a friction that falls with speed divides differently at higher speeds."""

_EXTRAPOLATED = (
    "it lies outside the stroke recorded, and the spring is not identified well "
    "enough to extrapolate"
)

_UNCONFIRMED = "it follows from the forces alone and is not confirmed by simulation"
_OF_THE_BALANCE = (SLIDING, "spring_constant", "spring_preload")
"""Numbers that the force balance of the sliding stem determines without a simulation."""

_OF_SLIP = ("static_friction", "stribeck_velocity")
"""Numbers that a simulation determines by the forces at which its stem leaves a rest, even if the
noise of the sensor is not quite white."""

_NOISE_SHARE, _LEAST = 0.2, 2e-4
"""Shares of the stem's noise and of its range in the misfit that is tolerated on a bench.

Chosen: 70 of 71 simulated records of Karnopp valves stay within it."""

_TWO = 2.0


def fit_misfit(
    fit: PosteriorFit, numbers: Mapping[str, Estimated], profile: Profile = Profile.PLANT
) -> Misfit:
    """Return how well the simulated stem follows the measured one.

    The model of a plant is doubted only where its misfit exceeds noise and the friction stays
    uncertain: where the interval of the sliding friction is wider than twice `USABLE`. The model of
    a bench is doubted where its misfit exceeds the effect of pressure noise on the simulated stem,
    by the difference of both halves, plus small shares of the stem's noise and range.
    """
    record = fit.model.record
    rms = float(np.sqrt(np.mean(fit.residual**2)))
    fitted = 1.0 - rms / float(np.std(record.position))
    noise = float(np.mean(record.noise**2 / record.samples))
    if not profile.has_imperfections:
        even, odd = record.position - fit.model.readings(fit.at)
        systematic = math.sqrt(max(float(np.mean(even * odd)) - noise, 0.0))
        by_pressure = min(0.25 * float(np.mean((even - odd) ** 2)), noise)
        tolerated = (
            math.sqrt(by_pressure)
            + _NOISE_SHARE * math.sqrt(noise)
            + _LEAST * float(np.ptp(record.position))
        )
        return Misfit(fitted, rms, systematic, tolerated)
    systematic = math.sqrt(max(rms**2 - noise, 0.0))
    sliding = numbers["sliding_friction"]
    certain = sliding.half_width <= _TWO * USABLE * abs(sliding.value)
    describes = certain or fit.inflation < NOISE_LIKE
    return Misfit(fitted, rms, systematic, systematic if describes else 0.5 * systematic)


def fit_verdicts(
    fits: Sequence[PosteriorFit],
    numbers: Mapping[str, Estimated],
    settings: IdentificationSettings,
    misfit: Misfit,
    profile: Profile = Profile.PLANT,
) -> dict[str, Parameter]:
    """Return every reported number of the first fit with its verdict.

    Where the model is doubted, no number is more than weak. Where the misfit of a plant exceeds
    noise, or the search ended before it tried other lags, the numbers of the force balance
    (`checked_by_curve`) may still be identified.
    """
    fit, doubt = fits[0], ""
    force_range = float(np.ptp(fit.model.record.force))
    if not misfit.describes:
        doubt = (
            "the Karnopp model does not describe this valve: "
            f"{two_digits(misfit.systematic * 1e6)} µm of the misfit is more than noise"
        )
    top = _top_speed(fit)
    slow, split = _slow_doubt(top), _split_doubt(fits, misfit, profile)
    unseen = _unseen(fit, numbers, settings, split)
    verdicts = {}
    for name, one in numbers.items():
        width = one.half_width
        if slow and name == "coulomb_friction":
            width = math.hypot(width, _FURTHER * (1.0 - top / FALL_SPEED) * abs(one.value))
        reason = doubt or (slow if name in _BY_SPEED else "")
        if split and not (name in _OF_SLIP and fit.inflation <= NOISE_LIKE):
            reason = "" if name in _OF_THE_BALANCE else reason or split
        scale = PRELOAD_SCALE * force_range if name == "spring_preload" else 0.0
        share = share_of(one.value, width, scale)
        if not reason and WEAK_SHARE < share < math.inf:
            reason = main_doubt(one.budget, interval_share(one.value, share, scale))
        if not reason and one.has_rival:
            reason = late_sensor(name, one.rival)
        if name in settings.fixed and name != "limit_velocity":
            verdicts[name] = fixed(name, settings.fixed[name])
        elif name in unseen:
            verdicts[name] = not_identifiable(name, unseen[name])
        else:
            verdicts[name] = with_verdict(name, one.value, width / _TWO, width, reason, scale)
    return _no_surer_than_its_spring(verdicts)


def _no_surer_than_its_spring(verdicts: dict[str, Parameter]) -> dict[str, Parameter]:
    """Return the verdicts, with the preload identified only where the spring is known.

    In three draws 832 of 836 preloads whose spring was identified too lay inside their intervals;
    of 52 others 48, and two were far off.
    """
    preload, spring = verdicts.get("spring_preload"), verdicts.get("spring_constant")
    if preload is None or spring is None or preload.verdict is not Verdict.IDENTIFIED:
        return verdicts
    if spring.verdict in (Verdict.IDENTIFIED, Verdict.FIXED):
        return verdicts
    weak = replace(preload, verdict=Verdict.WEAK, reason=_EXTRAPOLATED)
    return {**verdicts, "spring_preload": weak}


def _split_doubt(fits: Sequence[PosteriorFit], misfit: Misfit, profile: Profile) -> str:
    """Return why only numbers that the force balance determines too can be identified, if so."""
    doubt = doubt_of(fits, profile)
    if doubt is None:
        return ""
    return _DOUBTS[doubt].format(um=two_digits(1e6 * misfit.systematic), ms=1e3 * abs(fits[0].lag))


def _unseen(
    fit: PosteriorFit,
    numbers: Mapping[str, Estimated],
    settings: IdentificationSettings,
    split: str,
) -> dict[str, str]:
    """Return which of mass, F_v, F_s and v_s the record does not show, and why."""
    why = {}
    viscous = numbers.get("viscous_friction")
    if viscous is not None and math.isinf(viscous.half_width):
        why["viscous_friction"] = split
    mass = numbers.get("mass")
    if mass is not None and ("mass" in fit.kept or mass.half_width > abs(mass.value)):
        why["mass"] = (
            "inertia is too small a part of the force to be identified; "
            f"{settings.assumed_mass:g} kg is assumed"
        )
    for name in ("static_friction", "stribeck_velocity"):
        one = numbers.get(name)
        if one is not None and not (slips(fit) and fit.at["slip_force"] > one.half_width):
            why[name] = NO_SLIP
        elif split and fit.inflation > _FAILED:
            why[name] = split
    return why


def curve_misfit(curve: FrictionCurve, sliding: Estimated) -> Misfit:
    """Return how well the force balance of the sliding stem reproduces the force, N.

    As for a simulation, the model is doubted only where the sliding friction stays uncertain.
    """
    systematic = curve.misfit * math.sqrt(max(1.0 - 1.0 / curve.inflation, 0.0))
    describes = sliding.but_rounding <= _TWO * USABLE * abs(sliding.value)
    tolerated = systematic if describes else 0.5 * systematic
    return Misfit(curve.fit, curve.misfit, systematic, tolerated, "N")


def curve_verdicts(
    numbers: Mapping[str, Estimated],
    settings: IdentificationSettings,
    stribeck_velocity: float,
    force_range: float = 0.0,
) -> dict[str, Parameter]:
    """Return every reported number of a force balance with its verdict.

    Mass, spring, preload and sliding friction may be identified. The components of the sliding
    friction are at most weak, as no simulated stem confirms them. A preload that is small against
    the `force_range` of the record, N, is judged by that range.
    """
    verdicts = {}
    for name in (*UNITS, SLIDING):
        one = numbers.get(name)
        if name in settings.fixed and name != "limit_velocity":
            verdicts[name] = fixed(name, settings.fixed[name])
        elif name == "static_friction" and not stribeck_velocity:
            verdicts[name] = not_identifiable(name, NO_SLIP)
        elif one is None or (one.value < 0 and name != "spring_preload"):
            verdicts[name] = not_identifiable(name, "the record does not determine it")
        else:
            width = one.half_width
            reason = _UNCONFIRMED if name in _BY_SPEED else ""
            scale = PRELOAD_SCALE * force_range if name == "spring_preload" else 0.0
            share = share_of(one.value, width, scale)
            if not reason and share > WEAK_SHARE:
                reason = main_doubt(one.budget, interval_share(one.value, share, scale))
            if not reason and one.has_rival:
                reason = late_sensor(name, one.rival)
            verdicts[name] = with_verdict(name, one.value, width / _TWO, width, reason, scale)
    return _no_surer_than_its_spring(verdicts)


def _top_speed(fit: PosteriorFit) -> float:
    """Return the speed above which the stem covers a twentieth of its distance, m/s."""
    speed = np.sort(fit.model.record.slow.speed)
    distance = np.cumsum(speed)
    return float(speed[np.searchsorted(distance, _BELOW_TOP * distance[-1])])


def _slow_doubt(top: float) -> str:
    """Say that the record is too slow to separate F_c from friction at low speed, or nothing."""
    if top >= FALL_SPEED:
        return ""
    return (
        f"valid up to {top * 1e3:.2g} mm/s; the stem was rarely faster, and friction may still "
        f"fall between there and {FALL_SPEED * 1e3:.2g} mm/s"
    )
