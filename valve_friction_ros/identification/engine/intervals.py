# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Intervals of the reported numbers, and the sources of their uncertainty."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.engine.broad_model import SWINGING, BroadModel
from valve_friction_ros.identification.engine.coordinates import MAIN, Coordinates
from valve_friction_ros.identification.engine.imperfections import IMPERFECTIONS, TIMING, Profile
from valve_friction_ros.identification.engine.lags import (
    LARGEST_LAG,
    LagPrior,
    LagProfile,
    mixture_half_width,
    share_of_timing,
    spread_of,
)
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
from valve_friction_ros.identification.units import SLIDING

NumbersAt = Callable[[BroadModel, Coordinates], Mapping[str, ReportedNumber]]
"""Function of a model and a point of its fit: numbers by name."""

NOISE_LIKE = 4.0
"""Inflation of the residual up to which it may be noise of a sensor that is not quite white."""

NOT_QUITE = 1.5
"""Inflation above which the motion is not quite that of the model.

What the model lacks may then be mistaken for a lag, which does not affect the work of the measured
signals; with noise alone the inflation is 1.0 to 1.3."""

_FAR_BEYOND = 2.0
"""Half widths beyond which a less probable explanation is named."""

_FOLLOWS = 10.0
"""Inflation of the residual, over that of the best fit, up to which another fit, of few steps,
follows the stem."""

UNLIKELY = 12.0
"""Penalty of the priors beyond which a fit is doubted: such imperfections together are two
standard deviations or more above what is usual for their number."""

_LOST = NORMAL_QUANTILE * IMPERFECTIONS["in_record"].deviation
"""Share by which the sliding friction in gaps may differ from the mean: as friction may change
during a record."""

_LOOP = 0.02
"""Share by which the work of friction from the averaged signals may be wrong."""

_FAR = 0.5
"""Share of that work by which a fit may differ from it before it is doubted, however well it
follows the stem: a lag alone explains less."""

ROUNDING = "rounding"
"""Source of the uncertainty of a number: the step of the converter of the force."""

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
        Due to each imperfection whose prior matters, timing included, and the force's converter.
    shared : float
        Part of the timing that the record does not determine: another record of the same sensors
        has the same error.
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
        Sources of its width.
    rival : float
        The value if a slow sensor of the stem, and not viscous friction, made the stem late; nan
        where the record excludes that.
    """

    value: float
    half_width: float
    budget: Budget
    rival: float = math.nan

    @property
    def shared_half_width(self) -> float:
        """Part of the half width that another record of the same sensors has in common."""
        whole = math.hypot(self.budget.record, self.budget.timing)
        return self.half_width * self.budget.shared / whole if whole > 0 else 0.0

    @property
    def own_half_width(self) -> float:
        """Part of the half width of this record alone: both parts add in squares."""
        return math.sqrt(max(self.half_width**2 - self.shared_half_width**2, 0.0))

    @property
    def rounding(self) -> float:
        """Part of the half width that comes from the converter of the force."""
        return NORMAL_QUANTILE * self.budget.sources.get(ROUNDING, 0.0)

    @property
    def but_rounding(self) -> float:
        """Half width without `rounding`: both parts add in squares."""
        return math.sqrt(max(self.half_width**2 - self.rounding**2, 0.0))

    @property
    def has_rival(self) -> bool:
        """Whether the rival lies far beyond the interval."""
        return abs(self.rival - self.value) > _FAR_BEYOND * self.half_width


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


def _deviation(fit: PosteriorFit, number: ReportedNumber) -> float:
    """Deviation of a number at one point and its lag, including the remaining step of the fit.

    Where the stem swings, or slips between two samples, F_v is taken to be unknown by k·τ, for
    which a lag τ compensates.
    """
    stage = fit.stages[-1]
    gradient = _vector(fit, number)
    variance = float(gradient @ stage.covariance @ gradient) + number.definition**2
    variance -= float(gradient @ fit.along_lag) ** 2 * fit.lag_variance
    if "delay" in fit.names:
        lag = fit.precision[fit.names.index("delay")] ** -0.5 if _swings(stage) else 0.0
        lag = math.hypot(lag, _unseen_moment(fit) if stage.at["slip_force"] > 0.0 else 0.0)
        viscous = number.gradient.get("viscous_friction", 0.0)
        variance += (viscous * stage.at["spring_constant"] * lag) ** 2
    left = abs(float(gradient @ _possible(fit))) / NORMAL_QUANTILE
    return math.hypot(math.sqrt(max(variance, 0.0)), left)


def _unseen_moment(fit: PosteriorFit) -> float:
    """Return the deviation, s, of the moments at which the stem slips, over all strokes.

    Each slip is anywhere between two samples. The linear model takes the moment as known, since the
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
    """Return the remaining step, bounded so that it changes no force by more than a third."""
    bounds = np.array([0.3 * abs(fit.at[n]) if n in MAIN else math.inf for n in fit.names])
    return np.clip(fit.remaining, -bounds, bounds)


class Doubt(Enum):
    """Why a simulated stem determines no more than the force balance does."""

    MISFIT = auto()
    LAG = auto()
    UNTRIED = auto()


def doubt_of(fits: Sequence[PosteriorFit], profile: Profile = Profile.PLANT) -> Doubt | None:
    """Return why the best fit does not follow the record of a plant, or None where it does.

    Its residual exceeds noise, its lag is impossible, or the search could not trade viscous
    friction for lag while both are unknown.
    """
    best = fits[0]
    if best.inflation > NOT_QUITE and profile.has_imperfections:
        return Doubt.MISFIT
    if abs(best.lag) >= LARGEST_LAG:
        return Doubt.LAG
    knows = "viscous_friction" not in best.names or not set(TIMING) & set(best.names)
    return None if len(fits) > 1 or knows else Doubt.UNTRIED


def estimated(
    fits: Sequence[PosteriorFit],
    numbers_at: NumbersAt = reported_numbers,
    lag: LagPrior | None = None,
) -> dict[str, Estimated]:
    """Return numbers with their intervals, from the best fit and those held at other lags.

    `numbers_at` gives the numbers at a point of a fit; by default the reported numbers. Each is
    integrated over the lag, by its likelihood (`LagProfile`) and the `lag` prior; a stated prior is
    already part of the fits. Where the residual exceeds noise, or the imperfections are larger than
    usual, the interval of the sliding friction also covers its value from the measured signals
    alone (`loop_friction`).
    """
    fit, profile = fits[0], LagProfile.of(fits)
    late = _least_viscous(fits, numbers_at)
    if profile is None:
        here = numbers_at(fit.model, fit.at)
        found = {
            name: Estimated(
                one.value,
                NORMAL_QUANTILE * _deviation(fit, one),
                _budget(fit, fit.stages[-1], one),
                late.get(name, one).value,
            )
            for name, one in here.items()
        }
    else:
        found = _over_lags(profile, numbers_at, lag or LagPrior(), late)
    for name, one in found.items():
        width = one.half_width
        if name == SLIDING:
            lost = fit.model.record.lost / fit.model.record.duration
            width = math.hypot(width, _LOST * lost * abs(one.value))
            loop = loop_friction(fit.model, fit.at)
            apart = abs(loop - one.value)
            unlike = fit.inflation > NOT_QUITE or fit.stages[-1].penalty > UNLIKELY
            unlike &= bool(fit.lags.any())
            if unlike or apart > _FAR * abs(loop):
                width = math.hypot(width, apart + _LOOP * abs(one.value))
        width = max(width, _FINEST.get(name, _FINEST_OTHER) * abs(one.value))
        found[name] = replace(one, half_width=width)
    return found


def _over_lags(
    profile: LagProfile,
    numbers_at: NumbersAt,
    lag: LagPrior,
    late: Mapping[str, ReportedNumber],
) -> dict[str, Estimated]:
    """Integrate each number of the likeliest fit over the lag."""
    best, stage = profile.best, profile.best.stages[-1]
    places = {fit: numbers_at(fit.model, fit.at) for fit in (*profile.fits, *profile.apart)}
    prior = lag if lag.deviation is None else LagPrior(math.inf)
    probability = prior.probability(profile.log_likelihood)
    unsaid = 1.0 - spread_of(probability) ** 2 / profile.spread**2
    found = {}
    for name, first in places[best].items():
        known = {fit: numbers.get(name, first) for fit, numbers in places.items()}
        slope = float(_vector(best, first) @ best.along_lag)
        values = profile.along({fit: one.value for fit, one in known.items()}, slope)
        own = profile.along({fit: _deviation(fit, one) for fit, one in known.items()}, 0.0)
        mean = float(probability @ values)
        half_width = mixture_half_width(probability, values, own)
        record = min(math.sqrt(float(probability @ own**2)), half_width / NORMAL_QUANTILE)
        timing = math.sqrt(float(probability @ (values - mean) ** 2))
        timing = share_of_timing(half_width, record, timing)
        budget = Budget(
            record,
            timing,
            _budget(best, stage, first).sources,
            timing * math.sqrt(max(unsaid, 0.0)),
        )
        found[name] = Estimated(mean, half_width, budget, late.get(name, first).value)
    return found


def _least_viscous(
    fits: Sequence[PosteriorFit], numbers_at: NumbersAt
) -> Mapping[str, ReportedNumber]:
    """Return the numbers of a separate fit with less viscous friction, if it follows the stem too.

    Its lags may be of any size, unless a stated timing excludes them.
    """
    best = fits[0]
    able = [
        fit
        for fit in fits
        if fit.is_apart
        and fit.inflation <= _FOLLOWS * best.inflation
        and fit.stages[-1].penalty < best.stages[-1].penalty + UNLIKELY
    ]
    last = min((best, *able), key=lambda fit: fit.at["viscous_friction"])
    return numbers_at(last.model, last.at)
