"""Intervals of the reported numbers, and where they come from."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.robust.broad_model import SWINGING, BroadModel
from valve_friction_ros.identification.robust.coordinates import MAIN, Coordinates
from valve_friction_ros.identification.robust.imperfections import IMPERFECTIONS, TIMING
from valve_friction_ros.identification.robust.numbers import (
    ReportedNumber,
    loop_friction,
    reported_numbers,
)
from valve_friction_ros.identification.robust.posterior_fit import PosteriorFit, Stage
from valve_friction_ros.identification.trust.sliding import FINEST_SLIDING, SLIDING
from valve_friction_ros.identification.trust.uncertainty import CONFIDENCE

__all__ = ["NOISE_LIKE", "UNLIKELY", "Budget", "Estimated", "estimated"]

NumbersAt = Callable[[BroadModel, Coordinates], Mapping[str, ReportedNumber]]
"""Function of a model and a place of its fit: numbers by name."""

_QUANTILE = NormalDist().inv_cdf(0.5 + CONFIDENCE / 2)
NOISE_LIKE = 4.0
"""Inflation of the residual up to which it may be noise of a sensor that is not quite white."""

_NOT_QUITE = 1.5
"""Inflation from which on the motion is not quite that of the model.

What the model lacks may then be taken for a lag, which the work of the measured signals does not
know; with noise alone the inflation is 1.0 to 1.3."""

UNLIKELY = 12.0
"""Penalty of the priors beyond which a fit is doubted: such imperfections together are two
standard deviations and more above what their number makes usual."""

_WIDEST = 3.0
"""Half width at another place, over that at the first, up to which it counts: a fit begins at
places where the linear model says little."""

_LOST = 0.5
"""Share by which the sliding friction of what was lost in gaps may differ from the mean."""

_LOOP = 0.02
"""Share by which the work of friction by the averaged signals may be off."""

_FAR = 0.5
"""Share of that work by which a fit may differ from it before it is doubted, however well it
follows the stem: a lag alone makes up for less."""

_FINEST = {SLIDING: FINEST_SLIDING, "spring_constant": 2e-4}
_FINEST_OTHER = 5e-4
"""No interval is narrower than this share of its value, however quiet the record is."""


@dataclass(frozen=True)
class Budget:
    """Standard uncertainties by their sources, in the number's unit (after the GUM).

    Attributes
    ----------
    record : float
        Noise and misfit of the record, and its imperfections.
    timing : float
        Lag between the signals.
    sources : mapping of str to float
        Of each imperfection whose prior counts, timing among them.
    """

    record: float
    timing: float
    sources: Mapping[str, float]


@dataclass(frozen=True)
class Estimated:
    """A number with its interval.

    Attributes
    ----------
    value, half_width : float
        SI unit.
    budget : Budget
        Where its width comes from.
    """

    value: float
    half_width: float
    budget: Budget


def _vector(fit: PosteriorFit, number: ReportedNumber) -> NDArray[np.float64]:
    return np.array([number.gradient.get(name, 0.0) for name in fit.names])


def _budget(fit: PosteriorFit, stage: Stage, number: ReportedNumber) -> Budget:
    """Split the posterior variance gᵀCg = gᵀC(H + Λ)Cg by the priors: Λ is diagonal."""
    spread = stage.covariance @ _vector(fit, number)
    total = float(_vector(fit, number) @ spread)
    shares = fit.precision * spread**2
    sources = {
        name: math.sqrt(share)
        for name, share in zip(fit.names, shares.tolist(), strict=True)
        if share > 0
    }
    timing = sum(sources.get(name, 0.0) ** 2 for name in TIMING)
    rest = max(total - timing, 0.0) + number.definition**2
    return Budget(math.sqrt(rest), math.sqrt(timing), sources)


def _half_width(fit: PosteriorFit, stage: Stage, number: ReportedNumber) -> float:
    """Half width at one place; what the fit has not done yet is added in full.

    Where the stem swings, F_v is taken to be unknown by the delay k·τ that a lag makes up for.
    """
    gradient = _vector(fit, number)
    variance = float(gradient @ stage.covariance @ gradient) + number.definition**2
    if _swings(stage) and "delay" in fit.names:
        lag = fit.precision[fit.names.index("delay")] ** -0.5
        viscous = number.gradient.get("viscous_friction", 0.0)
        variance += (viscous * stage.at["spring_constant"] * lag) ** 2
    left = abs(float(gradient @ _possible(fit)))
    return _QUANTILE * math.sqrt(max(variance, 0.0)) + left


def _swings(stage: Stage) -> bool:
    """Return whether F_v is so small that the stem swings, and the linear model means little."""
    return stage.at["viscous_friction"] < SWINGING * stage.at["spring_constant"]


def _possible(fit: PosteriorFit) -> NDArray[np.float64]:
    """Return the step that remains, where it would change no force by more than a third."""
    bounds = np.array([0.3 * abs(fit.at[n]) if n in MAIN else math.inf for n in fit.names])
    return np.clip(fit.remaining, -bounds, bounds)


def _chance(fit: PosteriorFit) -> float:
    """Fall of the sum of squares that the imperfections bring though there are none, at most.

    It is χ² distributed with as many degrees of freedom: two standard deviations above its mean.
    """
    count = sum(name in IMPERFECTIONS for name in fit.names)
    return count + 2.0 * math.sqrt(2.0 * count)


def estimated(
    fits: Sequence[PosteriorFit], numbers_at: NumbersAt = reported_numbers
) -> dict[str, Estimated]:
    """Return numbers with their intervals, of the best fit and its competitors.

    `numbers_at` says what the numbers are at a place of a fit; by default the reported ones.

    Of the places that the best fit came by, and of the ends of the others, those count whose
    probability chance may have lowered. Among those with all coordinates, and with a viscous
    friction that keeps the stem from swinging, the one with the least imperfections gives the
    values; the intervals reach to what the others say, the less probable ones less far: along a
    bent valley the linear model at one place sees too little. Where the residual is more than
    noise, or the imperfections are larger than usual, the interval of the sliding friction also
    holds what the measured signals alone say (`loop_friction`).
    """
    fit = fits[0]
    stages = [(fit, stage) for stage in fit.stages]
    stages += [(other, other.stages[-1]) for other in fits[1:]]
    costs = [stage.misfit / fit.inflation + stage.penalty for _, stage in stages]
    least, chance = min(costs), _chance(fit) * fit.inflation
    places = [
        (*stage, cost - least)
        for stage, cost in zip(stages, costs, strict=True)
        if cost - least < chance
    ]
    places.sort(
        key=lambda place: (place[0].names != fit.names, _swings(place[1]), place[1].penalty)
    )
    readings = [numbers_at(fit.model, stage.at) for _, stage, _ in places]
    result = {}
    for name, first in readings[0].items():
        own = width = _half_width(*places[0][:2], first)
        for (other, stage, behind), numbers in zip(places[1:], readings[1:], strict=True):
            if name not in numbers:
                continue
            near = math.sqrt(max(1.0 - behind / chance, 0.0))
            apart = abs(numbers[name].value - first.value)
            there = min(_half_width(other, stage, numbers[name]), _WIDEST * own)
            width = max(width, near * (apart + 0.5 * there))
        if name == SLIDING:
            lost = fit.model.record.lost / fit.model.record.duration
            width = math.hypot(width, _LOST * lost * abs(first.value))
            loop = loop_friction(fit.model, places[0][1].at)
            apart = abs(loop - first.value)
            unlike = fit.inflation > _NOT_QUITE or fit.stages[-1].penalty > UNLIKELY
            if unlike or apart > _FAR * abs(loop):
                width = math.hypot(width, apart + _LOOP * abs(first.value))
        width = max(width, _FINEST.get(name, _FINEST_OTHER) * abs(first.value))
        result[name] = Estimated(first.value, width, _budget(*places[0][:2], first))
    return result
