"""Verdicts on the numbers of a fit with imperfections."""

import math
from collections.abc import Mapping

import numpy as np

from valve_friction_ros.identification.robust.friction_curve import FrictionCurve
from valve_friction_ros.identification.robust.intervals import NOISE_LIKE, Estimated
from valve_friction_ros.identification.robust.posterior_fit import PosteriorFit
from valve_friction_ros.identification.robust.sentences import main_doubt, slips
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.limits import FALL_SPEED, NO_SLIP
from valve_friction_ros.identification.trust.misfit import Misfit
from valve_friction_ros.identification.trust.sliding import SLIDING
from valve_friction_ros.identification.trust.verdict import (
    WEAK_SHARE,
    Parameter,
    fixed,
    not_identifiable,
    with_verdict,
)
from valve_friction_ros.identification.units import UNITS

__all__ = ["USABLE", "curve_misfit", "curve_verdicts", "fit_misfit", "fit_verdicts"]

USABLE = 0.1
"""Half width over value up to which a sliding friction is of use to maintenance.

Chosen: well below the 25 % of growth that raises the first alarm."""

_SPLIT_DOUBT = (
    "the motion is not quite that of any friction model here ({:.2g} µm are not noise), which "
    "leaves the sliding friction but not what it is made of"
)
_BY_SPEED = ("coulomb_friction", "viscous_friction", "static_friction")
"""What a friction that falls with speed has in other proportions at higher speeds."""

_UNCONFIRMED = "it follows from the forces alone: no simulated stem confirms it"
_OF_THE_BALANCE = (SLIDING, "spring_constant", "spring_preload")
"""What the force balance of the sliding stem determines without a simulation."""

_TWO = 2.0


def fit_misfit(fit: PosteriorFit, numbers: Mapping[str, Estimated]) -> Misfit:
    """Return how well the simulated stem follows the measured one.

    The model is doubted only where its misfit is more than noise and the friction stays uncertain:
    where the interval of the sliding friction is wider than twice `USABLE`.
    """
    record = fit.model.record
    rms = float(np.sqrt(np.mean(fit.residual**2)))
    noise = float(np.mean(record.noise**2 / record.samples))
    systematic = math.sqrt(max(rms**2 - noise, 0.0))
    spread = float(np.std(record.position))
    sliding = numbers["sliding_friction"]
    certain = sliding.half_width <= _TWO * USABLE * abs(sliding.value)
    describes = certain or fit.inflation < NOISE_LIKE
    tolerated = systematic if describes else 0.5 * systematic
    return Misfit(1.0 - rms / spread, rms, systematic, tolerated)


def fit_verdicts(
    fit: PosteriorFit,
    numbers: Mapping[str, Estimated],
    settings: IdentificationSettings,
    misfit: Misfit,
) -> dict[str, Parameter]:
    """Return every reported number with its verdict.

    Where the model is doubted none is more than weak; where its misfit is more than noise and the
    sliding friction is narrow all the same, that alone may be identified.
    """
    doubt = ""
    if not misfit.describes:
        doubt = (
            "the Karnopp model does not describe this valve: "
            f"{misfit.systematic * 1e6:.3g} µm of misfit are not noise"
        )
    slow = _slow_doubt(fit)
    verdicts = {}
    for name, one in numbers.items():
        width = one.half_width
        reason = doubt or (slow if name in _BY_SPEED else "")
        if name in _OF_THE_BALANCE and fit.inflation > NOISE_LIKE:
            reason = ""
        if not reason and fit.inflation > NOISE_LIKE and name not in _OF_THE_BALANCE:
            reason = _SPLIT_DOUBT.format(1e6 * misfit.systematic)
        if not reason and one.value and width > 0.05 * abs(one.value):
            reason = main_doubt(one.budget, width / abs(one.value))
        if name in settings.fixed and name != "limit_velocity":
            verdicts[name] = fixed(name, settings.fixed[name])
        elif name == "mass" and width > abs(one.value):
            verdicts[name] = not_identifiable(
                name,
                "inertia is too small a part of the force to be seen; "
                f"{settings.assumed_mass:g} kg assumed",
            )
        elif name in ("static_friction", "stribeck_velocity") and not (
            slips(fit) and fit.at["slip_force"] > width
        ):
            verdicts[name] = not_identifiable(name, NO_SLIP)
        else:
            verdicts[name] = with_verdict(name, one.value, width / _TWO, width, reason)
    return verdicts


def curve_misfit(curve: FrictionCurve, sliding: Estimated) -> Misfit:
    """Return how well the force balance of the sliding stem reproduces the force, N.

    As for a simulation, the model is doubted only where the sliding friction stays uncertain.
    """
    systematic = curve.misfit * math.sqrt(max(1.0 - 1.0 / curve.inflation, 0.0))
    describes = sliding.half_width <= _TWO * USABLE * abs(sliding.value)
    tolerated = systematic if describes else 0.5 * systematic
    return Misfit(curve.fit, curve.misfit, systematic, tolerated, "N")


def curve_verdicts(
    numbers: Mapping[str, Estimated],
    settings: IdentificationSettings,
    stribeck_velocity: float,
) -> dict[str, Parameter]:
    """Return every reported number of a force balance with its verdict.

    Mass, spring, preload and sliding friction may be identified. What the sliding friction is made
    of is at most weak, as no simulated stem confirms it.
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
            if not reason and width > WEAK_SHARE * abs(one.value):
                reason = main_doubt(one.budget, width / max(abs(one.value), 1e-300))
            verdicts[name] = with_verdict(name, one.value, width / _TWO, width, reason)
    return verdicts


def _slow_doubt(fit: PosteriorFit) -> str:
    """Return that the record is too slow to separate F_c from friction at low speed, or nothing."""
    top = float(np.max(fit.model.record.slow.speed))
    if top >= FALL_SPEED:
        return ""
    return (
        f"holds up to {top * 1e3:.2g} mm/s, the fastest here: "
        f"friction may fall further up to {FALL_SPEED * 1e3:.2g} mm/s"
    )
