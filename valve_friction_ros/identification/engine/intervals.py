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
from dataclasses import dataclass, field, replace
from sys import float_info

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.engine.broad_model import SWINGING, BroadModel
from valve_friction_ros.identification.engine.coordinates import (
    IMPERFECTIONS,
    MAIN,
    TIMING,
    Coordinates,
    sensor_span,
)
from valve_friction_ros.identification.engine.fitted_record import stroke_cells
from valve_friction_ros.identification.engine.lags import (
    LagPrior,
    LagProfile,
    mixture_half_width,
    share_of_timing,
    spread_of,
)
from valve_friction_ros.identification.engine.posterior_fit import PosteriorFit
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.identification.trust.uncertainty import (
    FINEST_SLIDING,
    NORMAL_QUANTILE,
    mean_over_distance,
    mean_speed,
)
from valve_friction_ros.model.checks import equal_by_fields

RECTANGLE = 1.0 / math.sqrt(3.0)
"""Standard deviation of a rectangular distribution over its half width."""

_MOVING = 0.02
"""Share of the top speed above which the averaged stem moves."""

ASYMMETRY = 0.05
"""Standard deviation of the share by which F_c is larger upward: it has the effect of a change of
F_0, and no record can separate the two."""


@dataclass(frozen=True)
class ReportedNumber:
    """A number at one point of the fit, SI unit, and its derivatives by the coordinates.

    `definition` is its standard deviation where the quantity has no single value: a friction that
    changes along the travel, the constant of a curved spring.
    """

    value: float
    gradient: Mapping[str, float]
    definition: float


def _sliding(model: BroadModel, at: Coordinates, asymmetry: float) -> ReportedNumber:
    """Return ∫|F_friction|·|dx| / ∫|dx| of the simulated stem."""
    slow = model.record.slow
    velocity = model.simulate(at).velocity
    speed = np.abs(velocity)
    mean = mean_speed(speed)
    place, age = mean_over_distance(slow.place, speed), mean_over_distance(slow.age, speed)
    low = mean_over_distance(slow.slowness, speed)
    dry, viscous = at["coulomb_friction"], at["viscous_friction"]
    falling = 0.0
    if at["stribeck_velocity"] > 0:
        falling = mean_over_distance(np.exp(-((speed / at["stribeck_velocity"]) ** 2)), speed)
    share = 1 + at["along_travel"] * place + at["in_record"] * age + at["at_low_speed"] * low
    value = dry * share + viscous * mean + at["slip_force"] * falling
    gradient = {
        "coulomb_friction": share,
        "viscous_friction": mean,
        "along_travel": place * dry,
        "in_record": age * dry,
        "at_low_speed": dry * low,
        "slip_force": falling,
    }
    net = abs(float(np.sum(velocity))) / max(float(np.sum(speed)), float_info.min)
    return ReportedNumber(value, gradient, asymmetry * dry * net)


def reported_numbers(
    model: BroadModel, at: Coordinates, asymmetry: float = ASYMMETRY
) -> dict[str, ReportedNumber]:
    """Return all reported numbers at a point of the fit.

    `asymmetry` is the standard deviation of the share by which F_c is larger upward.

    A friction that changes by ±a over the travel or over the record, or that is larger by a at low
    speed, has no single value; the number is then taken to lie anywhere within ±a. The same
    applies to a spring whose constant changes by ±4c over the measured range.
    """
    slow = model.record.slow
    dry, spring = at["coulomb_friction"], at["spring_constant"]
    static = dry + at["slip_force"]
    friction = RECTANGLE * math.hypot(at["along_travel"], at["in_record"], at["at_low_speed"])
    curve = abs(at["curvature"]) + abs(at["cubic"])
    stiffness = RECTANGLE * 4.0 * curve * spring
    middle = 0.5 * (slow.lowest + slow.highest)
    seat = -2.0 * middle / slow.range
    bow = RECTANGLE * curve * spring * slow.range * max(abs(seat**2 - 1 / 3), 2 / 3)
    drift = RECTANGLE * abs(at["drift"]) * sensor_span(model.record.force)
    preload = math.hypot(bow, stiffness * abs(middle), drift, asymmetry * dry)
    static_gradient = {"coulomb_friction": 1.0, "slip_force": 1.0}
    numbers = {
        "mass": ReportedNumber(at["mass"], {"mass": 1.0}, 0.0),
        "viscous_friction": ReportedNumber(
            at["viscous_friction"], {"viscous_friction": 1.0}, friction * at["viscous_friction"]
        ),
        "coulomb_friction": ReportedNumber(dry, {"coulomb_friction": 1.0}, friction * dry),
        "static_friction": ReportedNumber(static, static_gradient, friction * static),
        "spring_constant": ReportedNumber(spring, {"spring_constant": 1.0}, stiffness),
        "spring_preload": ReportedNumber(at["spring_preload"], {"spring_preload": 1.0}, preload),
        "sliding_friction": _sliding(model, at, asymmetry),
    }
    if at["stribeck_velocity"] > 0:
        speed = at["stribeck_velocity"]
        numbers["stribeck_velocity"] = ReportedNumber(speed, {"stribeck_velocity": 1.0}, 0.0)
    return numbers


def found_sizes(_: BroadModel, at: Coordinates) -> dict[str, ReportedNumber]:
    """Return imperfections at a point of the fit that may be compared with those of another record.

    The ``lag`` of the stem behind the pressure, s, is the sum of all timing; ``slip_force`` is
    F_s − F_c, N; ``viscous_asymmetry`` is the share by which F_v is larger upward.
    """
    lag = sum(at[name] for name in TIMING)
    return {
        "lag": ReportedNumber(lag, dict.fromkeys(TIMING, 1.0), 0.0),
        "slip_force": ReportedNumber(at["slip_force"], {"slip_force": 1.0}, 0.0),
        "viscous_asymmetry": ReportedNumber(
            at["viscous_asymmetry"], {"viscous_asymmetry": 1.0}, 0.0
        ),
    }


def loop_friction(model: BroadModel, at: Coordinates) -> float:
    """Return the work of friction over the distance by the measured signals alone, N.

    The work of the actuator less what the spring keeps: ∫(F − k·x − F_0)·dx / ∫|dx|. The spring is
    taken from the fit, and matters only if the stem does not end where it began. No model of the
    friction is used.
    """
    slow = model.record.slow
    position = slow.lowest + 0.5 * (slow.place + 1.0) * slow.range
    moved = np.where(slow.speed > _MOVING * np.quantile(slow.speed, 0.98), slow.velocity, 0.0)
    surplus = slow.force - at["spring_constant"] * position - at["spring_preload"]
    return float(np.sum(surplus * moved) / np.sum(np.abs(moved)))


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

ROUNDING, OMITTED, UNSEEN = "rounding", "omitted", "unseen"
STROKES, AVERAGES, AT_REST = "strokes", "averages", "at_rest"
"""Sources of the uncertainty of a number: the step of the converter of the force, the dead band of
a historian or a sensor, what happens between two samples, strokes that differ, averaging times that
differ or are too few to tell, and friction at rest in place of that of the moves."""

_FINEST = {SLIDING: FINEST_SLIDING, "spring_constant": 2e-4}
_FINEST_OTHER = 5e-4
"""No interval is narrower than this share of its value, however quiet the record is."""


@equal_by_fields
@dataclass(frozen=True)
class Estimated:
    """A number with its interval, SI unit, and its standard uncertainty by origin (after the GUM).

    `record` is from noise, misfit and imperfections of the record, `timing` from the lag between
    the signals, and `sources` from each imperfection whose prior matters, timing included, from the
    force's converter and from a historian. The record does not determine the `shared` part of the
    timing: another record of the same sensors has the same error. The `rival` is the value if a
    slow sensor of the stem, and not viscous friction, made the stem late; nan where the record
    excludes that.
    """

    value: float
    half_width: float
    record: float
    timing: float = 0.0
    sources: Mapping[str, float] = field(default_factory=dict)
    shared: float = 0.0
    rival: float = math.nan

    @property
    def shared_half_width(self) -> float:
        """Part of the half width that another record of the same sensors has in common."""
        whole = math.hypot(self.record, self.timing)
        return self.half_width * self.shared / whole if whole > 0 else 0.0

    @property
    def own_half_width(self) -> float:
        """Part of the half width of this record alone: both parts add in squares."""
        return math.sqrt(max(self.half_width**2 - self.shared_half_width**2, 0.0))

    @property
    def rounding(self) -> float:
        """Part of the half width that comes from the converter of the force."""
        return NORMAL_QUANTILE * self.sources.get(ROUNDING, 0.0)

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


def _budget(fit: PosteriorFit, number: ReportedNumber) -> tuple[float, float, dict[str, float]]:
    """Split the posterior variance gᵀCg = gᵀC(H + Λ)Cg by the priors, as Λ is diagonal.

    Returns record, timing and sources of `Estimated`.
    """
    spread = fit.covariance @ _vector(fit, number)
    total = float(_vector(fit, number) @ spread)
    shares = fit.precision * spread**2
    sources = {
        name: math.sqrt(share)
        for name, share in zip(fit.names, shares.tolist(), strict=True)
        if share > 0
    }
    timing = sum(sources.get(name, 0.0) ** 2 for name in TIMING)
    rest = max(total - timing, 0.0) + number.definition**2
    return math.sqrt(rest), math.sqrt(timing), sources


def _deviation(fit: PosteriorFit, number: ReportedNumber) -> float:
    """Deviation of a number at one point and its lag, including the remaining step of the fit.

    Where the stem swings, or slips between two samples, F_v is taken to be unknown by k·τ, for
    which a lag τ compensates.
    """
    gradient = _vector(fit, number)
    variance = float(gradient @ fit.covariance @ gradient) + number.definition**2
    variance -= float(gradient @ fit.along_lag) ** 2 * fit.lag_variance
    if "delay" in fit.names:
        lag = fit.precision[fit.names.index("delay")] ** -0.5 if _swings(fit) else 0.0
        lag = math.hypot(lag, _unseen_moment(fit) if fit.at["slip_force"] > 0.0 else 0.0)
        viscous = number.gradient.get("viscous_friction", 0.0)
        variance += (viscous * fit.at["spring_constant"] * lag) ** 2
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


def _swings(fit: PosteriorFit) -> bool:
    """Return whether F_v is so small that the stem swings, and the linear model means little."""
    return fit.at["viscous_friction"] < SWINGING * fit.at["spring_constant"]


def _possible(fit: PosteriorFit) -> NDArray[np.float64]:
    """Return the remaining step, bounded so that it changes no force by more than a third."""
    bounds = np.array([0.3 * abs(fit.at[n]) if n in MAIN else math.inf for n in fit.names])
    return np.clip(fit.remaining, -bounds, bounds)


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
    lag = lag or LagPrior()
    fit, profile = fits[0], LagProfile.of(fits, lag)
    late = _least_viscous(fits, numbers_at)
    if profile is None:
        found = {}
        for name, here in numbers_at(fit.model, fit.at).items():
            record, timing, sources = _budget(fit, here)
            width, rival = NORMAL_QUANTILE * _deviation(fit, here), late.get(name, here).value
            found[name] = Estimated(here.value, width, record, timing, sources, timing, rival)
    else:
        found = _over_lags(profile, numbers_at, lag, late)
    for name, one in found.items():
        width = one.half_width
        if name == SLIDING:
            lost = fit.model.record.lost / fit.model.record.duration
            width = math.hypot(width, _LOST * lost * abs(one.value))
            loop = loop_friction(fit.model, fit.at)
            apart = abs(loop - one.value)
            unlike = fit.inflation > NOT_QUITE or fit.penalty > UNLIKELY
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
    best = profile.best
    places = {fit: numbers_at(fit.model, fit.at) for fit in (*profile.fits, *profile.apart)}
    prior = lag if lag.deviation is None else replace(lag, deviation=math.inf)
    probability = prior.probability(profile.log_likelihood)
    unsaid = 1.0 - spread_of(probability, lag.lags) ** 2 / profile.spread**2
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
        _, _, sources = _budget(best, first)
        shared, rival = timing * math.sqrt(max(unsaid, 0.0)), late.get(name, first).value
        found[name] = Estimated(mean, half_width, record, timing, sources, shared, rival)
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
        and fit.penalty < best.penalty + UNLIKELY
    ]
    last = min((best, *able), key=lambda fit: fit.at["viscous_friction"])
    return numbers_at(last.model, last.at)
