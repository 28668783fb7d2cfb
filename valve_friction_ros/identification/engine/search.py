# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Search for the best fit of a record: it starts from a regression, and branches where stuck."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from valve_friction_ros.identification.engine.broad_model import ABSENT, SWINGING, BroadModel
from valve_friction_ros.identification.engine.coordinates import (
    BOUNDS,
    MAIN,
    TIMING,
    Coordinates,
    Profile,
    deviations,
)
from valve_friction_ros.identification.engine.fitted_record import (
    FittedRecord,
    set_anew_at_rests,
)
from valve_friction_ros.identification.engine.friction_curve import FrictionCurve
from valve_friction_ros.identification.engine.intervals import NOISE_LIKE, UNLIKELY
from valve_friction_ros.identification.engine.lags import LagPrior
from valve_friction_ros.identification.engine.posterior_fit import PosteriorFit, fit, lag_of
from valve_friction_ros.identification.refusal import RefusalError

_SLIDING = 0.15
"""Share of the top speed above which a stem clearly slides."""

_DRY_SHARES = (0.3, 0.5, 0.7, 0.85, 0.95, 1.0)
"""Shares of the sliding friction to start F_c from; the rest is viscous."""

_LAGS = (-2.0, -1.5, -1.0, -0.5, -0.25, 0.25, 0.5, 1.0, 1.5, 2.0)
"""Lags to start from, in timing uncertainties."""

_LEAST_VISCOUS = 0.1
"""Share of the viscous friction that a start keeps: without any, the stem swings and no derivative
shows the way."""


class Sliding(NamedTuple):
    """Sliding friction, N, at the mean speed, m/s, and the spring of a stem that clearly slides."""

    friction: float
    speed: float
    spring_constant: float
    spring_preload: float


def sliding(record: FittedRecord) -> Sliding:
    """Regress the averaged force on the side of motion, the velocity, the position and 1."""
    slow = record.slow
    fast = slow.speed > _SLIDING * np.quantile(slow.speed, 0.98)
    position = slow.lowest + 0.5 * (slow.place + 1.0) * slow.range
    columns = np.column_stack(
        [np.sign(slow.velocity), slow.velocity, position, np.ones_like(position)]
    )[fast]
    scale = np.max(np.abs(columns), axis=0)
    solution = np.linalg.lstsq(columns / scale, slow.force[fast], rcond=1e-6)[0] / scale
    dry, viscous, spring, preload = solution.tolist()
    speed = float(np.mean(slow.speed[fast]))
    if not spring > 0:
        raise RefusalError(
            "the stem does not follow the force: check that both signals belong to this valve, "
            "their directions and their units"
        )
    return Sliding(max(dry + viscous * speed, 1.0), speed, spring, preload)


def split(sliding: Sliding, share: float) -> dict[str, float]:
    """Split the sliding friction into F_c and F_v."""
    return {
        "coulomb_friction": share * sliding.friction,
        "viscous_friction": max(1.0 - share, 0.02) * sliding.friction / sliding.speed,
    }


def nearest(model: BroadModel, starts: Sequence[Coordinates]) -> Coordinates:
    """Return the start whose simulated stem is nearest to the measured one.

    The distance is a mean magnitude: a single jump at the wrong time says little about a start.
    """

    def distance(start: Coordinates) -> float:
        residual = model.record.position - model.readings(start)
        return float(np.sum(np.abs(residual * model.weights)))

    return min(starts, key=distance)


def lagging(at: Coordinates, timing_uncertainty: float) -> list[Coordinates]:
    """Return starts with one lag each, and the delay F_v/k reduced by it.

    A sliding stem lags the force by F_v/k, and a lag of a sensor adds to that; a fit without lags
    finds their sum. From there a fit with all lags may lead into a wrong valley.
    """
    starts: list[Coordinates] = []
    for name in TIMING:
        for share in _LAGS:
            lag = share * timing_uncertainty
            viscous = at["viscous_friction"] - lag * at["spring_constant"]
            least = _LEAST_VISCOUS * at["viscous_friction"]
            if lag > BOUNDS.get(name, -np.inf) and lag != 0.0:
                starts.append({**at, name: lag, "viscous_friction": max(viscous, least)})
    return starts


_SLIP_SHARES = (0.35, 0.55, 0.75, 0.9)
_SLIPS = (0.15, 0.4, 0.8)
_FALLS = (0.05, 0.2)
"""Stribeck speeds to start from, over the sliding speed, where the stem clearly slips."""

_LIMIT_VELOCITIES = (2e-4, 6e-4)
_SUSPICIOUS = 1.5
"""Inflation of a residual beyond which other starts are tried: a third of it is not noise."""

_SURE_FALL = 2.0
"""Standard deviations by which a friction must fall with speed for a fit of v_s to be tried."""

_START_NOISE = 3.0
_START_TIME = 5e-3
"""Uncertainty of the first position: deviations of its noise, and the time (s) in which the stem
moves, to which the time by which its sensor may be late is added."""

_MOST_WORK, _FOR_LAGS = 36_000_000, 10_000_000
"""Simulation steps after which no other branch begins, and steps reserved for other lags after
them: a second of processor time or so, and a third of a second.

A count and not a time, so that the answer does not depend on the machine."""

_OF_TANGENT = 5
"""Simulations that take as long as one that carries all derivatives along."""

_COARSENESS = 100.0
"""Coarseness of the derivatives until a fit is near its end."""

_FEWEST_STEPS = 2
_PROFILE, _PROFILE_STEPS = 3, 4
_LEAST_STEP, _LARGEST_STEP = 5e-4, 20e-3
_IMPROBABLE, _LEAST_LEFT = 16.0, 0.1
"""Lags each way at which the likelihood is followed, and steps of a fit there; least and largest
first step along the lag, s, which is one deviation by the linear model; the rise of the cost
after which the next lag lies nearer; and the share of a force that a start keeps."""

_DEMANDED = 30.0
"""Fall of the sum of squares, in inflated variances (5.5 standard errors), below which no record
demands a slip, and no record of a bench a further coordinate."""

_WORTH = 1.0
"""Fall of the same sum for which another fit is worth descending from."""

_FEW_STEPS = 6
_MORE_STEPS = 12


@dataclass(frozen=True)
class Prior:
    """Prior knowledge of a valve and its signals.

    Of the lag; of the mass, kg; of coordinates that are `fixed`; and, by the `profile`, of which
    imperfections there are. The mass of a plant may be as large as its `diaphragm_area`, m²,
    suggests: 0 where there is none, or the mass was stated.
    """

    lag: LagPrior
    mass: float
    fixed: Mapping[str, float]
    profile: Profile = Profile.PLANT
    diaphragm_area: float = 0.0


class _Search:
    """The fits of one record."""

    def __init__(
        self,
        record: FittedRecord,
        prior: Prior,
        curves: Sequence[FrictionCurve] = (),
        static_friction: float = math.nan,
    ) -> None:
        self.work, self.most_work = 0, _MOST_WORK
        self.curves, self.static_friction = curves, static_friction
        self.prior = prior
        self.sliding = sliding(record)
        if prior.profile.has_imperfections:
            record = set_anew_at_rests(record)
        self.exact = BroadModel(record, self.sliding.spring_constant)
        self.model = replace(self.exact, coarseness=_COARSENESS)
        self.known = dict(prior.fixed)
        self.centre = {"mass": prior.mass}
        self.spread = deviations(
            prior.lag.deviation_of_each,
            prior.mass,
            self.sliding.friction,
            record.duration / 60,
            prior.profile,
            prior.diaphragm_area,
        )
        self.centre["start_position"] = record.start
        late = _START_TIME + 2.0 * prior.lag.deviation_of_all
        self.spread["start_position"] = _START_NOISE * record.noise + late * abs(
            float(record.leaving[0])
        )
        self.main = tuple(name for name in MAIN if name not in self.known)
        self.timing = tuple(name for name in TIMING if name in self.spread)
        later = {"stribeck_velocity", "start_position", *self.known}
        if not prior.profile.has_imperfections:
            later.add("mass")
        self.all = (*self.main, *(name for name in self.spread if name not in later))
        self.base = {
            **ABSENT,
            "mass": prior.mass,
            "spring_constant": self.sliding.spring_constant,
            "spring_preload": self.sliding.spring_preload,
            "start_position": record.start,
            **split(self.sliding, 0.9),
            **self.known,
        }

    def fit(
        self,
        start: Coordinates,
        names: tuple[str, ...],
        steps: int,
        model: BroadModel | None = None,
        pinned: float | None = None,
    ) -> PosteriorFit:
        """Fit from a start, and count the work."""
        start, model = {**start, **self.known}, model or self.model
        derivatives = len(names) if model.coarseness > 1.0 else _OF_TANGENT
        a_step = 2 * derivatives * model.effort(start)
        allowed = (self.most_work - self.work) // a_step
        found = fit(
            model,
            start,
            names,
            self.spread,
            self.centre,
            min(steps, max(allowed, _FEWEST_STEPS)),
            pinned,
        )
        self.work += found.steps * a_step
        return found

    def full(self, start: Coordinates, names: tuple[str, ...] = ()) -> PosteriorFit:
        """Fit with all imperfections, or with those that are named."""
        names = names or self.free(start)
        near = self.fit(start, names, _MORE_STEPS)
        return self.fit(near.at, names, _MORE_STEPS, self.exact)

    def free(self, at: Coordinates) -> tuple[str, ...]:
        """Return the free coordinates; v_s is one where friction falls with speed."""
        if not at["stribeck_velocity"] > 0:
            return self.all
        others = tuple(name for name in self.all if name != "at_low_speed")
        return (*others, "stribeck_velocity")

    @property
    def may_go_on(self) -> bool:
        """Whether another branch may be tried."""
        return self.work < self.most_work

    def slip_starts(self, *places: Coordinates) -> list[Coordinates]:
        """Return starts whose friction falls as soon as the stem moves."""
        starts: list[Coordinates] = []
        for at in places:
            total = max(at["coulomb_friction"], 0.1 * self.sliding.friction)
            for share in _SLIP_SHARES:
                for slip in _SLIPS:
                    lost = (1 - share) * total / self.sliding.speed
                    starts.append(
                        {
                            **at,
                            "coulomb_friction": share * total,
                            "viscous_friction": at["viscous_friction"] + lost,
                            "slip_force": slip * share * total,
                        }
                    )
        return starts

    def curved(self) -> PosteriorFit | None:
        """Fit a friction that falls with speed, from the friction curves.

        None without such curves, or where the first fit takes all the work.
        """
        starts = self.from_curves()
        if not starts:
            return None
        near = nearest(self.exact, starts)
        near = nearest(self.exact, self.falling(near))
        own = ("slip_force", "stribeck_velocity")
        first = self.fit(near, (*self.main, *own), _MORE_STEPS, self.exact)
        if not self.may_go_on:
            return None
        return self.fit(first.at, self.free(first.at), 2 * _MORE_STEPS, self.exact)

    def falling(self, at: Coordinates) -> list[Coordinates]:
        """Let the friction fall with speed, from the static friction of the departures if known.

        A curve of the sliding friction seldom shows how slow the stem must be for that.
        """
        dry = at["coulomb_friction"]
        slips = [dry * share for share in _SLIPS]
        if self.static_friction > dry:
            slips = [self.static_friction - dry]
        speeds = [self.sliding.speed * share for share in _FALLS]
        speeds += [at["stribeck_velocity"]] if at["stribeck_velocity"] > 0 else []
        return [
            {**at, "slip_force": slip, "stribeck_velocity": speed}
            for slip in slips
            for speed in speeds
        ]

    def stopping(self, full: PosteriorFit) -> PosteriorFit:
        """Fit a dead zone of the speed."""
        if "limit_velocity" not in self.all:
            return full
        dead = [{**full.at, "limit_velocity": speed} for speed in _LIMIT_VELOCITIES]
        return self.full(nearest(self.model, dead))

    def demanded(self, best: PosteriorFit) -> PosteriorFit:
        """Accept a falling friction, and a slip, only where the record of a bench demands them.

        The mass stays as expected, and is as uncertain as its prior says.
        """
        if not best.at["stribeck_velocity"] and any(one.stribeck_velocity for one in self.curves):
            falling = self.curved()
            if falling and best.objective - falling.objective > _DEMANDED * falling.inflation:
                best = falling
        best = self.without_slip(best)
        if "mass" in self.known:
            return best
        end = self.fit(best.at, (*best.names, "mass"), 0, self.exact)
        with_mass, known = end.covariance[:, -1], float(end.covariance[-1, -1])
        wider = self.spread["mass"] ** 2 / known**2 - 1.0 / known
        covariance = end.covariance + wider * np.outer(with_mass, with_mass)
        return replace(
            end,
            covariance=covariance,
            remaining=np.append(best.remaining, 0.0),
            kept=("mass",),
        )

    def without_slip(self, best: PosteriorFit) -> PosteriorFit:
        """Accept a slip only where the record demands it, or where friction also falls with speed.

        A stem that is sampled slowly, behind a volume or a filter, is late as if it had stuck. On a
        plant a slip of zero stays as uncertain as the record leaves it; on a bench it is dropped.
        """
        if best.at["stribeck_velocity"] or not best.at["slip_force"] > 0.0:
            return best
        names = tuple(name for name in best.names if name != "slip_force")
        plain = self.full({**best.at, "slip_force": 0.0}, names)
        if plain.objective - best.objective > _DEMANDED * best.inflation:
            return best
        if not self.prior.profile.has_imperfections:
            return plain
        return self.fit(plain.at, best.names, 0, self.exact)

    def profiled(self, best: PosteriorFit) -> list[PosteriorFit]:
        """Fit at other lags, each held: later and earlier than the best lag, and at zero.

        F_v/k delays a sliding stem as a lag does. The two trade places along a valley that is too
        bent for the linear model at its deepest point, so each fit begins at its neighbour. A slow
        sensor of the stem may also replace all viscous friction; no valley leads there. A best fit
        that does not follow the stem determines no lag.
        """
        if not best.lags.any():
            return []
        found = self.along_valley(best)
        nearest_to_none = min([best, *found], key=lambda one: abs(one.lag))
        if abs(nearest_to_none.lag) > 0.5 * _first_step(best) and self.may_go_on:
            found.append(self.without_lag(best, nearest_to_none.at))
        is_possible = best.lag + _delay(best) < self.prior.lag.reach
        follows = best.inflation <= NOISE_LIKE
        if follows and is_possible and "viscous_friction" in best.names and self.may_go_on:
            found.append(self.behind_slow_sensor(best))
        return found

    def along_valley(self, best: PosteriorFit) -> list[PosteriorFit]:
        """Fit at later and at earlier lags, if the best fit follows the stem."""
        self.most_work = max(self.most_work, self.work + _FOR_LAGS)
        if best.inflation > NOISE_LIKE:
            return []
        return [*self.followed(best, -1.0), *self.followed(best, 1.0)]

    def followed(self, best: PosteriorFit, way: float) -> list[PosteriorFit]:
        """Fit at later or earlier lags, each from the last probable fit."""
        found: list[PosteriorFit] = []
        last, step = best, _first_step(best)
        for _ in range(_PROFILE):
            lag = last.lag + way * step
            if not (self.may_go_on and abs(lag) < self.prior.lag.reach):
                break
            start = self.along(best, last.at, lag)
            found.append(self.fit(start, best.names, _PROFILE_STEPS, self.exact, lag))
            if found[-1].cost(best.inflation) - best.cost(best.inflation) < _IMPROBABLE:
                last, step = found[-1], 2.0 * step
            elif step > _LEAST_STEP:
                step /= 4.0
            else:
                break
        return found

    def without_lag(self, best: PosteriorFit, at: Coordinates) -> PosteriorFit:
        """Fit without a lag, from the linear model or from viscous friction in place of the lag."""
        delayed = at["viscous_friction"] + lag_of(at) * at["spring_constant"]
        replaced = {**at, **dict.fromkeys(TIMING, 0.0), "viscous_friction": delayed}
        starts = [dict(one) for one in (self.along(best, at, 0.0), replaced)]
        for start in starts:
            # A stem that swings takes long, and has no derivatives that can be trusted.
            least = SWINGING * start["spring_constant"]
            start["viscous_friction"] = max(start["viscous_friction"], least)
        return self.fit(nearest(self.exact, starts), best.names, _FEW_STEPS, self.exact, 0.0)

    def along(self, best: PosteriorFit, at: Coordinates, lag: float) -> Coordinates:
        """Return the point at a lag, s, to which the linear model of the best fit leads."""
        start = dict(at)
        for name, share in zip(best.names, best.along_lag.tolist(), strict=True):
            there = start[name] + share * (lag - lag_of(at))
            least = _LEAST_LEFT * abs(start[name]) if name in MAIN[:3] else -math.inf
            start[name] = max(there, least, BOUNDS.get(name, -math.inf))
        return start

    def behind_slow_sensor(self, best: PosteriorFit) -> PosteriorFit:
        """Fit a stem with hardly any viscous friction behind a slow sensor of its position."""
        spring = best.at["spring_constant"]
        late = best.lag + _delay(best) - SWINGING
        start = {
            **best.at,
            "viscous_friction": spring * SWINGING,
            "delay": 0.0,
            "force_lag": 0.0,
            "stem_lag": max(late, 0.0),
        }
        found = self.fit(start, best.names, _FEW_STEPS, self.exact, start["stem_lag"])
        return replace(found, is_apart=True)

    def all_probable(self) -> list[PosteriorFit]:
        """Return the most probable fit, and its competitors."""
        best = self.best()
        if not self.prior.profile.has_imperfections:
            best = self.demanded(best)
        elif self.may_go_on:
            best = self.without_slip(best)
        others = self.profiled(best)
        lowest = _lowest([best, *others])
        if lowest is not best:
            deeper = self.fit(lowest.at, best.names, _MORE_STEPS, self.exact)
            fall = best.objective - deeper.objective
            if fall > 0.0:
                best, others = deeper, [*others, best]
            if fall > _IMPROBABLE * deeper.inflation:
                others += self.along_valley(best)
        return [best, *others]

    def from_curves(self) -> list[Coordinates]:
        """Return starts from the friction curves."""
        starts: list[Coordinates] = []
        for curve in self.curves:
            law = curve.law
            values = {name: one for name, one in law.items() if name in MAIN}
            spring = values.get("spring_constant", 0.0)
            if not (spring > 0 and values.get("coulomb_friction", 0.0) > 0):
                continue
            if "viscous_friction" in values:  # else it is given
                values["viscous_friction"] = max(values["viscous_friction"], SWINGING * spring)
            slip = max(law.get("slip_force", 0.0), 0.0)
            starts.append(
                {
                    **self.base,
                    **values,
                    "slip_force": slip,
                    "stribeck_velocity": curve.stribeck_velocity if slip > 0 else 0.0,
                    **({"delay": curve.lag} if self.timing else {}),
                }
            )
        return starts

    def start(self) -> Coordinates:
        """Fit few coordinates, without and with a slip, each with its likeliest lag."""
        splits = [{**self.base, **split(self.sliding, share)} for share in _DRY_SHARES]
        plain = self.lagged(splits, self.main)
        if "slip_force" not in self.all:
            return plain.at
        slipping = self.slip_starts(self.base, {**self.base, **plain.at})
        slipped = self.lagged(slipping, (*self.main, "slip_force"))
        return _likeliest([plain, slipped]).at

    def lagged(self, starts: Sequence[Coordinates], names: tuple[str, ...]) -> PosteriorFit:
        """Fit from the nearest start, and again from there with the likeliest lag."""
        plain = self.fit(nearest(self.model, starts), names, _FEW_STEPS)
        if not self.timing:
            return plain
        lags = [plain.at, *lagging(plain.at, self.prior.lag.deviation_of_all)]
        near = nearest(self.model, lags)
        return self.fit(near, tuple(dict.fromkeys((*names, *self.timing))), _FEW_STEPS)

    def smooth(self) -> PosteriorFit | None:
        """Fit from the friction curves, without a fall of the friction with speed.

        A fall costs ten times as much.
        """
        starts = [{**one, "stribeck_velocity": 0.0} for one in self.from_curves()]
        if not starts:
            return None
        few = tuple(name for name in (*self.main, "slip_force") if name in self.all)
        return self.full(self.fit(nearest(self.model, starts), few, _FEW_STEPS).at)

    def best(self) -> PosteriorFit:
        """Return the most probable of all fits; a likely fit ends the search."""
        branches: list[Callable[[], PosteriorFit | None]]
        branches = [self.smooth, self.curved, lambda: self.full(self.start())]
        fits: list[PosteriorFit] = []
        while branches and not (fits and self.is_enough(fits)):
            found = branches.pop(0)()
            fits += [] if found is None else [found]
        best = _likeliest(fits)
        return best if self.is_enough(fits) else _likeliest([best, self.stopping(best)])

    def is_enough(self, fits: Sequence[PosteriorFit]) -> bool:
        """Whether one of the fits is likely, or no other branch may be tried."""
        likely = any(
            one.inflation < _SUSPICIOUS
            and one.penalty < UNLIKELY
            and _fall_at_low_speed(one) < _SURE_FALL
            for one in fits
        )
        return likely or not self.may_go_on


def _likeliest(fits: Sequence[PosteriorFit]) -> PosteriorFit:
    """Return the fit with the least sum of residual and prior terms, at a common inflation."""
    inflated = min(one.inflation for one in fits)
    return min(fits, key=lambda one: one.misfit / inflated + one.penalty)


def _lowest(fits: Sequence[PosteriorFit]) -> PosteriorFit:
    """Return the first fit, or one with a clearly lower cost.

    A stem behind a slow sensor is taken only where the record demands it. Without viscous friction
    a stem jumps with the noise of the pressure: its halves differ, which lowers the sum of their
    products; the plain sum of squares must fall as well.
    """
    best = fits[0]

    def cost(one: PosteriorFit) -> float:
        if not one.is_apart:
            return one.cost(best.inflation)
        falls = one.plain_misfit < best.plain_misfit
        return one.cost(best.inflation) + _DEMANDED if falls else math.inf

    lowest = min(fits, key=cost)
    return lowest if cost(lowest) < cost(best) - _WORTH else best


def _fall_at_low_speed(fit: PosteriorFit) -> float:
    """Return by how many standard deviations the friction falls with speed, where v_s is 0."""
    if "at_low_speed" not in fit.names:
        return 0.0
    return fit.at["at_low_speed"] / fit.deviation("at_low_speed")


def _first_step(fit: PosteriorFit) -> float:
    """Return the deviation of the lag by the linear model, s, within the limits of a step."""
    return float(np.clip(math.sqrt(fit.lag_variance), _LEAST_STEP, _LARGEST_STEP))


def _delay(fit: PosteriorFit) -> float:
    """Return the time by which viscous friction delays the stem, s."""
    return fit.at["viscous_friction"] / fit.at["spring_constant"]


def search(
    record: FittedRecord,
    prior: Prior,
    curves: Sequence[FrictionCurve] = (),
    static_friction: float = math.nan,
) -> list[PosteriorFit]:
    """Find the most probable model of a record, and its competitors.

    The friction curve starts a fit of few coordinates, which starts a fit with all imperfections.
    Where the residual exceeds noise, a fit with friction that falls with speed follows; it starts
    at the `static_friction`, N, of the departures, if known. Where that fails too, or there is no
    curve, the sliding friction of a plain regression is split into F_c and F_v in several ways,
    without and with a slip; the split whose simulated stem is nearest starts a fit, and again with
    the likeliest lag. Then follows a fit with a dead zone. At the end the likelihood is followed
    along the lag, for which viscous friction compensates, and to its two ends: viscous friction in
    place of the lag, and a slow sensor of the stem in place of all viscous friction.

    Raises RefusalError if the stem does not follow the force.
    """
    return _Search(record, prior, curves, static_friction).all_probable()


def posteriors_at(
    record: FittedRecord, prior: Prior, truth: Coordinates, with_competitors: bool
) -> list[PosteriorFit]:
    """Return the posterior of a record about a model that is known to be right, without a search.

    `truth` are coordinates of the valve that was simulated; the others are absent. The competitors
    trade viscous friction for lag, as `search` does. Raises RefusalError as there.
    """
    found = _Search(record, prior)
    at = {**found.base, **truth}
    best = fit(found.exact, {**at, **found.known}, found.all, found.spread, found.centre, 0)
    return [best, *(found.profiled(best) if with_competitors else ())]
