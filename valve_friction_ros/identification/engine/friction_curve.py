# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Friction over speed as a record shows it, before any stem is simulated.

While the stem clearly slides, the actuator force is

    F(t − τ) = F_c·sgn ẋ + (F_s − F_c)·exp(−(ẋ/v_s)²)·sgn ẋ + F_v·ẋ + k·x + F_0 + … ,

linear in all but the lag τ and the Stribeck speed v_s; the dots are the imperfections of a plant,
each with its prior. Force and stem are averaged with the same weights, so the averages obey the
same law. In each product of the normal equations one factor comes from the even samples and the
other from the odd ones: noise of the regressors then biases nothing.

A stick-slip valve, whose simulated stem jumps at other times than the measured one, is described
here as well as any other. The numbers are also where the simulation starts (`search`).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from sys import float_info

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.engine.balance_posterior import Posterior, posterior_of
from valve_friction_ros.identification.engine.balance_regression import Regression
from valve_friction_ros.identification.engine.coordinates import sensor_span, zero_drift
from valve_friction_ros.identification.engine.intervals import (
    AVERAGES,
    RECTANGLE,
    ROUNDING,
    STROKES,
    UNSEEN,
    Estimated,
)
from valve_friction_ros.identification.engine.lags import LagPrior, LagProfile
from valve_friction_ros.identification.engine.sliding_averages import (
    FINEST_STEP,
    MeasuredSignal,
    Work,
    averages_of,
    away_from_stops,
    force_and_stem,
    larger_change,
    least_stroke,
    quiet_grid,
    turns_of,
    work_of_rounding,
)
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.identification.trust.uncertainty import (
    CONFIDENCE,
    NORMAL_QUANTILE,
    Correlation,
    correlation_of,
    half_width,
)
from valve_friction_ros.model.recording import StampedRecord
from valve_friction_ros.model.valve import Valve

_Array = NDArray[np.float64]

_AVERAGING_TIMES = (0.03, 0.06, 0.12, 0.24, 0.48, 0.96)
_SHORT_AVERAGING_TIMES = (0.015, 0.008, 0.004)
"""Times, s, over which the signals are averaged, twice; the short times apply where no longer time
leaves samples of a stem that slides, as in the jumps of stick-slip."""

_MOST_CURVES = 4
_FEWEST_PERIODS = 2.9
"""Most averaging times that are used, and fewest sampling periods in each."""

_LEAST_HALF_WIDTH, _LEAST_OF_MACHINE, _LEAST_ALONE = 0.015, 0.04, 0.06
"""Least half width over the value of any number, as no force balance of a plant is more accurate;
the same without a spring, where the reversals that are left out hold more of the friction; and
where no second averaging time confirms it."""

_CONFIRMED = 2
"""Averaging times that confirm each other."""

_AS_WELL = 1.1
"""Half width over the least up to which an averaging time determines a number as well."""

_NEARLY = 5.0
_SCATTERS = 2.0
"""Half width over the least up to which an averaging time is included, and deviations of their
scatter that are added to the interval."""

_CONTRADICTED, _NEITHER = 0.02, 0.1
"""Difference of the lags, s, above which two averaging times contradict each other: what looks like
a lag may then be none, as in a packing that creeps before it slides. And the least likelihood of
each lag then, over the likeliest."""

_PULL = 1.0 / 3.0
"""Share of the difference from the force balance that widens the interval of a simulated number:
a number from the transients alone is known no better."""

_LONGEST = 0.1
"""Longest time, s, over which the signals are averaged: a stem that hunts rests for seconds."""

_FEWEST_SAMPLES = 20
_COEFFICIENTS = 3
"""Friction, spring and preload: more strokes than that determine them and their scatter."""

_PIECES = 8
"""Least number of pieces, into which strokes are cut where there are fewer; the kinetic energy of
the stem between two pieces of a stroke is part of their scatter."""

_ROUNDS = 5
"""Rounds in which regression and scatter come to agree."""

_JUMP, _NEAR = 0.1, np.array([[-4], [-1], [2], [5]])
"""Share of a stroke that the stem jumps from one point of the grid to the next; and the points at
equal distances between which it does, as averaging spreads a jump over three of them."""

_LEAST_SCATTER = 1e-3
"""Deviation of a stroke's force, as a share of the range of the force, that is always assumed."""

_FLAT = 1e-3
"""Precision of a prior that leaves a spring of ten times the slope of the whole record open."""

_OPEN_SLIP = 0.3
"""Half width of F_c over a slip force: it lies anywhere between what is left of it at the speeds of
the record and none, half of it in the mean, and evenly (half of 1/√3)."""


@dataclass(frozen=True, eq=False)
class FrictionCurve:
    """Friction over speed, and its force balance, at one averaging time, s.

    Each bin has the mean velocity `speed` (m/s, negative downward), the mean friction there and its
    standard error (N); no law is assumed except that of the spring. The `numbers` are parameters
    and sliding friction, which holds at the `sliding_speed`, the mean speed over the distance.
    `stribeck_velocity` is 0 where friction does not clearly fall with speed; `lag` is the most
    probable time by which the stem is seen late, s; `fit` is the share of the force that the
    balance reproduces, `misfit` the deviation of the residual, N, and `inflation` that over what
    noise explains; `by_sample` is the `larger_change` of the sliding friction by a sample, N. Whole
    strokes have neither a correlation of the numbers nor a posterior.
    """

    averaging_time: float
    speed: _Array = field(repr=False)
    friction: _Array = field(repr=False)
    standard_error: _Array = field(repr=False)
    numbers: Mapping[str, Estimated]
    sliding_speed: float
    stribeck_velocity: float
    lag: float
    inflation: float
    fit: float
    misfit: float
    by_sample: float = 0.0
    correlation: Correlation | None = field(default=None, repr=False)
    posterior: Posterior | None = field(default=None, repr=False)

    @property
    def law(self) -> dict[str, float]:
        """Coefficients of the likeliest law at the likeliest lag, SI units; empty for strokes."""
        if self.posterior is None:
            return {}
        solved = self.posterior.solved
        values = self.posterior.regression.values(solved)
        if self.stribeck_velocity:
            values["slip_force"] = float(solved.estimate[-1] / solved.scale[-1])
        return values

    def timed(self, lags: LagProfile) -> "FrictionCurve":
        """Return the curve with the likelihood of each lag from simulated stems."""
        if self.posterior is None or self.posterior.regression.lag.is_known:
            return self
        return _curve_of(self.posterior.timed(lags))


def friction_curves(
    record: StampedRecord,
    valve: Valve,
    lag: LagPrior | None = None,
    fixed: Mapping[str, float] | None = None,
) -> list[FrictionCurve]:
    """Regress friction over speed, for several averaging times, the shortest first.

    The `fixed` parameters are known; a spring constant of 0 is a machine without a spring. Where
    the stem nowhere clearly slides both ways, or whole strokes exclude the result of a single
    averaging time, only the curve of the strokes is returned, with the sliding friction
    (`_by_strokes`); nothing with too few strokes.
    """
    lag, fixed = lag or LagPrior(), fixed or {}
    force, stem = force_and_stem(record, valve)
    least = _FEWEST_PERIODS * max(force.period, stem.period)
    longer = [time for time in _AVERAGING_TIMES if time >= least] or [least, 2.0 * least]
    shorter = [time for time in _SHORT_AVERAGING_TIMES if time >= least]
    found: list[Posterior] = []
    for times, most in ((longer, _MOST_CURVES), (shorter, 1)):
        for time in times:
            averages = averages_of(force, stem, valve, time, lag) if len(found) < most else None
            if averages is not None:
                work = found[0].regression.work if found else Work.of(force, stem, averages, lag)
                found.append(posterior_of(Regression(averages, work, valve, lag, fixed)))
        if found:
            break
    # A lag at the limit of what is possible compensates for something else.
    found = [one for one in found if abs(one.regression.later(one.solved)) < lag.reach]
    likelihoods = [one.log_likelihood for one in found if one.log_likelihood is not None]
    likelihoods = _believed(likelihoods, [one.regression.later(one.solved) for one in found])
    for one in found:
        if likelihoods:
            one.of_record = lag.probability(_of_any(likelihoods))
    curves = [_curve_of(one) for one in found]
    if len(curves) >= _CONFIRMED:
        return curves
    return _checked_by_strokes(curves, _by_strokes(force, stem, valve, lag))


def _curve_of(posterior: Posterior) -> FrictionCurve:
    """Return the friction curve of a posterior."""
    regression, solved = posterior.regression, posterior.solved
    averages, numbers = regression.averages, {}
    gradients = {
        name: gradient / solved.scale
        for name, gradient in regression.gradients(posterior.stribeck, solved).items()
    }
    for name, gradient in gradients.items():
        values = [one[name] for one in posterior.near if name in one]
        spread = math.hypot(float(np.std(values or [0.0])), regression.definition(name, solved))
        if name == SLIDING:
            spread = math.hypot(
                spread,
                regression.work.noise,
                posterior.work_scatter,
                regression.beyond_shift(regression.later(solved)),
            )
        numbers[name] = posterior.number(name, gradient, spread)
    return FrictionCurve(
        averages.length * float(averages.time[1] - averages.time[0]),
        *regression.bins(solved),
        numbers,
        regression.sliding_speed,
        posterior.stribeck,
        regression.later(solved),
        posterior.inflation,
        1.0 - solved.misfit / max(float(np.std(averages.force[0][averages.taken])), float_info.min),
        solved.misfit,
        regression.work.by_sample,
        correlation_of(gradients, solved.covariance),
        posterior,
    )


def _checked_by_strokes(
    curves: list[FrictionCurve], strokes: FrictionCurve | None
) -> list[FrictionCurve]:
    """Return the curve of a single averaging time, or whole strokes where they contradict it."""
    if strokes is None or (curves and _agree(curves[0].numbers[SLIDING], strokes.numbers[SLIDING])):
        return curves
    return [strokes]


def _by_strokes(
    force: MeasuredSignal, stem: MeasuredSignal, valve: Valve, lag: LagPrior
) -> FrictionCurve | None:
    """Regress the mean force of each stroke on its direction and its middle.

    Between two reversals the stem has no kinetic energy to give: that mean is the force of the
    spring at the middle and the mean friction, however the stem moved. There is a bin for each
    stroke, and no law of friction. None with too few strokes to show their scatter.
    """
    between = max(force.time[0], stem.time[0]), min(force.time[-1], stem.time[-1])
    if between[1] - between[0] < _FEWEST_SAMPLES * max(stem.period, FINEST_STEP):
        return None
    grid, halves = quiet_grid(stem, between, _LONGEST)
    step = float(grid[1] - grid[0])
    # The ends of a stroke are extremes of the noise of one half: the other half is free of them.
    position, pressed = halves[1], np.mean(force.halves(grid), axis=0)
    turns = turns_of(halves[0], least_stroke(halves[0], stem.noise))
    turns = _cut(halves[0], turns, math.ceil(_PIECES / max(turns.size - 1, 1)))
    moves = np.gradient(position) * away_from_stops(position, valve)
    way = np.add.reduceat(moves, turns[:-1])
    is_free = np.abs(way) > 0.0
    few = np.count_nonzero(is_free) <= _COEFFICIENTS or np.ptp(np.sign(way)) < 2.0
    if few or not np.ptp(pressed) > 0.0:
        return None

    def mean(signal: NDArray[np.floating]) -> _Array:
        """Mean of a signal over the way of each stroke."""
        return np.asarray(np.add.reduceat(signal * moves, turns[:-1])[is_free] / way[is_free])

    age = np.linspace(-1.0, 1.0, grid.size)
    drift = zero_drift(sensor_span(pressed), float(grid[-1] - grid[0]) / 60.0)
    stiff = float(np.ptp(pressed) / np.ptp(position))
    side, middle, weight = np.sign(way[is_free]), mean(position), np.abs(way[is_free])
    weight = np.sqrt(weight / np.max(weight))
    columns = np.column_stack(
        [side, stiff * (middle - np.mean(middle)), np.ones_like(side), drift * mean(age)]
    )
    rows = weight[:, None] * columns
    precision = np.diag([0.0, _FLAT, 0.0, 1.0])
    forces, freedom = mean(pressed), float(side.size - _COEFFICIENTS)
    variance = float(np.var(forces))
    for _ in range(_ROUNDS):
        covariance = np.linalg.pinv(rows.T @ rows / variance + precision, hermitian=True)
        weights = (covariance @ (rows.T * weight))[0] / variance
        left = forces - columns @ (covariance @ (rows.T @ (weight * forces)) / variance)
        scatter = math.sqrt(float(np.sum((weight * left) ** 2)) / freedom)
        variance = max(scatter, _LEAST_SCATTER * float(np.ptp(pressed))) ** 2

    def late_by(late: float) -> float:
        """Friction if the stem is seen late, N."""
        return float(weights @ mean(np.interp(grid - late, grid, pressed)))

    value, of_lag = _over_lags(np.array([late_by(one) for one in lag.work_lags]), lag)
    distance = float(np.sum(np.abs(way)))
    along = moves / distance
    rounding = work_of_rounding(force, grid, along)
    scatter_of_strokes = half_width(math.sqrt(float(covariance[0, 0])), freedom) / NORMAL_QUANTILE
    sources = {
        ROUNDING: rounding,
        UNSEEN: _unseen_between(pressed, position, way),
        STROKES: scatter_of_strokes,
    }
    record, timing = math.hypot(*sources.values()), of_lag / NORMAL_QUANTILE
    squares = np.add.reduceat(np.gradient(halves[0]) * np.gradient(halves[1]), turns[:-1])
    width = math.hypot(NORMAL_QUANTILE * record, of_lag)
    sliding = Estimated(value, width, record, timing, sources, timing)
    return FrictionCurve(
        step,
        (squares / step)[is_free] / way[is_free],
        side * value + left,
        np.full_like(forces, scatter),
        {SLIDING: sliding},
        sliding_speed=stem.mean_speed(away_from_stops(stem.value, valve), distance),
        stribeck_velocity=0.0,
        lag=0.0,
        inflation=1.0,
        fit=1.0 - scatter / max(float(np.std(pressed)), float_info.min),
        misfit=scatter,
        by_sample=larger_change(late_by, max(force.period, stem.period)),
    )


def _unseen_between(force: _Array, position: _Array, way: _Array) -> float:
    """Return the deviation of the friction due to events between two points of the grid, N.

    Where the stem jumps from one point to the next, a force that jumps too may do so before or
    after it, and one that turns there is blunted by the averages, in all jumps alike. A force that
    changes as before and after leaves nothing open. `way` is the length of each stroke, m.
    """
    moves = np.abs(np.diff(position))
    jumps = np.flatnonzero(moves > _JUMP * np.mean(np.abs(way)))
    before, begin, end, after = force[np.clip(jumps + _NEAR, 0, force.size - 1)]
    rise, fall = begin - before, after - end
    unseen = np.hypot(end - begin - 0.5 * (rise + fall), 0.5 * (rise - fall))
    return RECTANGLE * 0.5 * float(moves[jumps] @ unseen) / float(np.sum(np.abs(way)))


def _cut(position: _Array, turns: NDArray[np.intp], pieces: int) -> NDArray[np.intp]:
    """Return the ends of the pieces of equal length into which strokes are cut."""
    cuts = [turns[-1:]]
    for begin, end in pairwise(turns.tolist()):
        way = np.abs(position[begin:end] - position[begin])
        shares = np.arange(pieces) / pieces * abs(position[end] - position[begin])
        cuts.append(begin + np.searchsorted(np.maximum.accumulate(way), shares))
    return np.unique(np.concatenate(cuts))


def _over_lags(by_lag: _Array, lag: LagPrior) -> tuple[float, float]:
    """Return the mean of a friction over the probable lags, and the half width due to them, N."""
    values = np.interp(lag.lags, lag.work_lags, by_lag)
    if lag.is_known:
        return float(np.interp(0.0, lag.lags, values)), 0.0
    probability = lag.probability(np.zeros_like(lag.lags))
    mean = float(probability @ values)
    away = np.abs(values - mean)
    order = np.argsort(away)
    last = np.searchsorted(np.cumsum(probability[order]), CONFIDENCE)
    return mean, float(away[order][min(int(last), order.size - 1)])


def _believed(log_likelihoods: list[_Array], lags: Sequence[float]) -> list[_Array]:
    """Return likelihoods of the lags, less sharp where averaging times contradict each other."""
    if not lags or np.ptp(lags) <= _CONTRADICTED:
        return log_likelihoods
    return [np.logaddexp(one, math.log(_NEITHER)) for one in log_likelihoods]


def _of_any(log_likelihoods: Sequence[_Array]) -> _Array:
    """Return the logarithm of a common likelihood of the lags, from all averaging times.

    All likelihoods are of one record, so they cannot be multiplied; where they contradict each
    other, any may be right. A sharper likelihood has more weight, by the inverse of its width.
    """
    parts = [np.exp(log) / np.sum(np.exp(log)) for log in log_likelihoods]
    together = sum(math.sqrt(float(part @ part)) * part for part in parts)
    return np.asarray(np.log(np.maximum(together / np.max(together), float_info.min)))


def curve_numbers(curves: Sequence[FrictionCurve]) -> dict[str, Estimated]:
    """Return each number from the shortest averaging time that determines it as well as any.

    The interval includes the scatter of those averaging times that determine it nearly as well,
    and at least `_LEAST_HALF_WIDTH`.
    """
    result: dict[str, Estimated] = {}
    has_spring = any("spring_constant" in curve.numbers for curve in curves)
    least = _LEAST_HALF_WIDTH if has_spring else _LEAST_OF_MACHINE
    if len(curves) < _CONFIRMED:
        least = _LEAST_ALONE
    for name in dict.fromkeys(name for curve in curves for name in curve.numbers):
        known = [curve.numbers[name] for curve in curves if name in curve.numbers]
        least_width = min(one.half_width for one in known)
        best = next(one for one in known if one.half_width <= _AS_WELL * least_width)
        near = [one.value for one in known if one.half_width < _NEARLY * best.half_width]
        beside = math.hypot(_SCATTERS * float(np.std(near)), least * best.value)
        result[name] = replace(
            best,
            half_width=math.hypot(best.half_width, beside),
            sources={**best.sources, AVERAGES: beside / NORMAL_QUANTILE},
        )
    return result


def timed_numbers(curves: Sequence[FrictionCurve], lags: LagProfile | None) -> dict[str, Estimated]:
    """Return the numbers of the curves, with the lag likelihood of simulated stems if any."""
    if lags is not None and len(lags.fits) > 1:
        curves = [one.timed(lags) for one in curves]
    return curve_numbers(curves)


def _agree(one: Estimated, other: Estimated) -> bool:
    """Return whether two numbers differ by no more than both intervals together."""
    return abs(one.value - other.value) <= math.hypot(one.half_width, other.half_width)


def checked_by_curve(
    simulated: Mapping[str, Estimated],
    balanced: Mapping[str, Estimated],
    follows: bool,
    slip_force: float = 0.0,
) -> dict[str, Estimated]:
    """Return the numbers of a simulation, checked and sharpened by those of the force balance.

    Where the simulated stem `follows` the record to within noise, each number comes from the source
    that determines it better. Where both exclude each other, spring, preload and sliding friction
    come from the simulation, as reversals and rests separate a lag from viscous friction there; a
    part of the difference then widens the intervals of spring and preload, and those of F_c and F_v
    where the simulation does not determine F_v. Where the stem does not follow, the numbers come
    from the force balance, and F_v without a value there is unknown, as all that the model lacks
    looks like it. Spring and preload also come from the balance where the simulation determines no
    friction: a simulation with a lag in its place has another spring, too. The split into dry and
    viscous friction is uncertain by the difference of the two, and F_c also by a `slip_force`, N,
    since the speed at which it vanishes is unknown.
    """
    result = dict(simulated)
    viscous = simulated.get("viscous_friction")
    is_split = viscous is not None and viscous.half_width < viscous.value
    for name in ("coulomb_friction", "viscous_friction"):
        ours, theirs = simulated.get(name), balanced.get(name)
        if ours is None or theirs is None:
            if ours is not None and name == "viscous_friction" and not follows:
                result[name] = replace(ours, half_width=math.inf)
            continue
        open_ = _OPEN_SLIP * slip_force if name == "coulomb_friction" else 0.0
        apart = abs(ours.value - theirs.value)
        width = math.hypot(theirs.half_width, apart, open_)
        if not (follows and ours.half_width < width):
            result[name] = replace(theirs, half_width=width, rival=ours.rival)
            continue
        share = 0.0 if is_split else _PULL
        result[name] = replace(ours, half_width=math.hypot(ours.half_width, share * apart))
    return result | _of_no_law(simulated, balanced, follows)


def _of_no_law(
    simulated: Mapping[str, Estimated], balanced: Mapping[str, Estimated], follows: bool
) -> dict[str, Estimated]:
    """Return sliding friction, spring and preload as `checked_by_curve` does."""
    result: dict[str, Estimated] = {}
    viscous = simulated.get("viscous_friction")
    slides = simulated.get(SLIDING)
    is_blind = slides is not None and slides.half_width > abs(slides.value)
    for name in (SLIDING, "spring_constant", "spring_preload"):
        ours, theirs = simulated.get(name), balanced.get(name)
        if ours is None or theirs is None or not (theirs.value > 0 or name == "spring_preload"):
            continue
        if name == SLIDING and follows:
            theirs = _as_late(theirs, ours, viscous, balanced.get("viscous_friction"))
        apart = abs(ours.value - theirs.value)
        agree = _agree(ours, theirs)
        if not follows or (is_blind and name != SLIDING):
            wider = theirs.half_width if agree else max(theirs.half_width, apart)
            wider = wider if name == SLIDING else math.hypot(wider, _PULL * apart)
            result[name] = replace(theirs, half_width=wider)
        elif agree and theirs.half_width < ours.half_width:
            result[name] = replace(theirs, rival=ours.rival)
        elif name != SLIDING:
            result[name] = replace(ours, half_width=math.hypot(ours.half_width, _PULL * apart))
    return result


def _as_late(
    theirs: Estimated,
    ours: Estimated,
    viscous: Estimated | None,
    their_viscous: Estimated | None,
) -> Estimated:
    """Return the sliding friction of a force balance, or its rival where a signal is late.

    A delay may come from viscous friction of the stem, or from a late signal; the force balance
    holds the friction for both (`Estimated.rival`). The simulation decides where its viscous
    friction excludes that of the balance.
    """
    if viscous is None or their_viscous is None or _agree(viscous, their_viscous):
        return theirs
    apart = abs(ours.value - theirs.rival)
    if not (viscous.value < their_viscous.value and apart < abs(ours.value - theirs.value)):
        return theirs
    width = math.hypot(theirs.half_width, apart)
    return replace(theirs, value=theirs.rival, half_width=width, rival=math.nan)


def curve_evidence(curves: Sequence[FrictionCurve]) -> dict[str, list[float] | float]:
    """Return the friction curve that knows the sliding friction best, as plain lists, SI units.

    It applies to a stem that is seen late by ``lag``, s.
    """
    if not curves:
        return {}
    best = min(curves, key=lambda curve: curve.numbers[SLIDING].half_width)
    return {
        "speed": best.speed.tolist(),
        "friction": best.friction.tolist(),
        "standard_error": best.standard_error.tolist(),
        "lag": best.lag,
    }
