# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Intervals of the reported numbers, and where they come from."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.engine.broad_model import SWINGING, BroadModel
from valve_friction_ros.identification.engine.coordinates import MAIN, Coordinates
from valve_friction_ros.identification.engine.imperfections import IMPERFECTIONS, TIMING
from valve_friction_ros.identification.engine.numbers import (
    RECTANGLE,
    ReportedNumber,
    loop_friction,
    reported_numbers,
)
from valve_friction_ros.identification.engine.posterior_fit import PosteriorFit, Stage
from valve_friction_ros.identification.engine.weights import stroke_cells
from valve_friction_ros.identification.trust.sliding import FINEST_SLIDING
from valve_friction_ros.identification.trust.uncertainty import NORMAL_QUANTILE
from valve_friction_ros.identification.trust.verdict import WEAK_SHARE
from valve_friction_ros.identification.units import SLIDING

NumbersAt = Callable[[BroadModel, Coordinates], Mapping[str, ReportedNumber]]
"""Function of a model and a place of its fit: numbers by name."""

NOISE_LIKE = 4.0
"""Inflation of the residual up to which it may be noise of a sensor that is not quite white."""

NOT_QUITE = 1.5
"""Inflation from which on the motion is not quite that of the model.

What the model lacks may then be taken for a lag, which the work of the measured signals does not
know; with noise alone the inflation is 1.0 to 1.3."""

_FAR_BEYOND, _BEYOND = 2.0, 1.1
"""Half widths beyond which a less probable explanation is named; and how far an interval reaches to
a nearer one, over its distance: no more is known of where that is."""

_ODDS = 6.0
"""Rise of the sum of squares (odds of 1 to 20) up to which a stem without viscous friction behind a
slow sensor counts beside one with it, or one with it beside one without: no valley joins them."""

_FOLLOWS = 10.0
"""Inflation of the residual over that of the best fit up to which another one follows the stem, as
few steps lead to it."""

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

ROUNDING = "rounding"
"""Source of doubt of a number: the step of the converter of the force."""

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
        Of each imperfection whose prior counts, timing among them, and of the force's converter.
    shared : float
        Part of the timing that the record says nothing of: another record of the same sensors is
        wrong the same way.
    """

    record: float
    timing: float
    sources: Mapping[str, float]
    shared: float = 0.0


@dataclass(frozen=True)
class Estimated:
    """A number with its interval.

    Attributes
    ----------
    value, half_width : float
        SI unit.
    budget : Budget
        Where its width comes from.
    rival : float
        What it would be if a slow sensor of the stem, and no viscous friction, made the stem late;
        nan where the record excludes that.
    """

    value: float
    half_width: float
    budget: Budget
    rival: float = math.nan

    @property
    def shared_half_width(self) -> float:
        """Part of the half width by which another record of the same sensors is wrong alike."""
        whole = math.hypot(self.budget.record, self.budget.timing)
        return self.half_width * self.budget.shared / whole if whole > 0 else 0.0

    @property
    def own_half_width(self) -> float:
        """The other part: both add in squares."""
        return math.sqrt(max(self.half_width**2 - self.shared_half_width**2, 0.0))

    @property
    def rounding(self) -> float:
        """Part of the half width that comes from the converter of the force."""
        return NORMAL_QUANTILE * self.budget.sources.get(ROUNDING, 0.0)

    @property
    def but_rounding(self) -> float:
        """The other part: both add in squares."""
        return math.sqrt(max(self.half_width**2 - self.rounding**2, 0.0))

    @property
    def has_rival(self) -> bool:
        """Whether that lies far beyond the interval."""
        return abs(self.rival - self.value) > _FAR_BEYOND * self.half_width

    @property
    def with_rival(self) -> "Estimated":
        """The same; where it is weak anyway, its interval reaches beyond a rival that is near.

        The sensor is that of any other record of the valve, which is then wrong alike.
        """
        reach = _BEYOND * abs(self.rival - self.value)
        if self.half_width <= WEAK_SHARE * abs(self.value) or self.has_rival:
            return self
        if not reach > self.half_width:
            return self
        more = math.sqrt(reach**2 - self.half_width**2) / NORMAL_QUANTILE
        timing, shared = (math.hypot(one, more) for one in (self.budget.timing, self.budget.shared))
        budget = replace(self.budget, timing=timing, shared=shared)
        return replace(self, half_width=reach, budget=budget)


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
    return Budget(math.sqrt(rest), math.sqrt(timing), sources, math.sqrt(timing))


def _half_width(fit: PosteriorFit, stage: Stage, number: ReportedNumber) -> float:
    """Half width at one place; what the fit has not done yet is added in full.

    Where the stem swings, or slips between two samples, F_v is taken to be unknown by the delay k·τ
    that a lag makes up for.
    """
    gradient = _vector(fit, number)
    variance = float(gradient @ stage.covariance @ gradient) + number.definition**2
    if "delay" in fit.names:
        lag = fit.precision[fit.names.index("delay")] ** -0.5 if _swings(stage) else 0.0
        lag = math.hypot(lag, _unseen_moment(fit) if stage.at["slip_force"] > 0.0 else 0.0)
        viscous = number.gradient.get("viscous_friction", 0.0)
        variance += (viscous * stage.at["spring_constant"] * lag) ** 2
    left = abs(float(gradient @ _possible(fit)))
    return NORMAL_QUANTILE * math.sqrt(max(variance, 0.0)) + left


def _unseen_moment(fit: PosteriorFit) -> float:
    """Return the deviation, s, of the moments at which the stem slips, over all strokes.

    Each slips anywhere between two samples. The linear model takes the moment for known, as the
    stem at the next sample hardly depends on it.
    """
    record = fit.model.record
    strokes = max(record.position.size / max(stroke_cells(record), 1), 1.0)
    period = record.duration / float(np.sum(record.samples))
    return 0.5 * RECTANGLE * period / math.sqrt(strokes)


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
    count = max(sum(name in IMPERFECTIONS for name in fit.names), 1)
    return count + 2.0 * math.sqrt(2.0 * count)


def has_tried_lags(fits: Sequence[PosteriorFit]) -> bool:
    """Return whether the search could trade viscous friction for lag, where either is unknown."""
    names = fits[0].names
    return len(fits) > 1 or "viscous_friction" not in names or not set(TIMING) & set(names)


def estimated(
    fits: Sequence[PosteriorFit], numbers_at: NumbersAt = reported_numbers
) -> dict[str, Estimated]:
    """Return numbers with their intervals, of the best fit and its competitors.

    `numbers_at` says what the numbers are at a place of a fit; by default the reported ones.

    Of the places that the best fit came by, and of the ends of the others, those count whose
    probability chance may have lowered. Among those with all coordinates, and with a viscous
    friction that keeps the stem from swinging, the one with the least imperfections gives the
    values. The intervals reach to what the others say, the less probable ones less far: along a
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
        if cost - least < (chance if _swings(stage[1]) == _swings(fit.stages[-1]) else _ODDS)
    ]
    places.sort(
        key=lambda place: (place[0].names != fit.names, _swings(place[1]), place[1].penalty)
    )
    readings = [numbers_at(fit.model, stage.at) for _, stage, _ in places]
    late = _least_viscous(fits, numbers_at)
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
            unlike = fit.inflation > NOT_QUITE or fit.stages[-1].penalty > UNLIKELY
            unlike &= any(timing in fit.names for timing in TIMING)
            if unlike or apart > _FAR * abs(loop):
                width = math.hypot(width, apart + _LOOP * abs(first.value))
        width = max(width, _FINEST.get(name, _FINEST_OTHER) * abs(first.value))
        budget = _budget(*places[0][:2], first)
        result[name] = Estimated(first.value, width, budget, late.get(name, first).value)
    return result


def _least_viscous(
    fits: Sequence[PosteriorFit], numbers_at: NumbersAt
) -> Mapping[str, ReportedNumber]:
    """Return the numbers of the fit with the least viscous friction that follows the stem too.

    However large its lags are: how probable they are is another question.
    """
    able = [fit for fit in fits if fit.inflation <= _FOLLOWS * fits[0].inflation]
    last = min(able, key=lambda fit: fit.at["viscous_friction"])
    return numbers_at(last.model, last.at)
