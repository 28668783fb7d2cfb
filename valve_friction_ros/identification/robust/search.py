"""From a record to the best fit: starts from a regression, and branches where it is stuck."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from valve_friction_ros.identification.robust.broad_model import ABSENT, SWINGING, BroadModel
from valve_friction_ros.identification.robust.coordinates import MAIN, Coordinates
from valve_friction_ros.identification.robust.fitted_record import (
    FittedRecord,
    set_anew_at_rests,
)
from valve_friction_ros.identification.robust.friction_curve import FrictionCurve
from valve_friction_ros.identification.robust.imperfections import TIMING, deviations
from valve_friction_ros.identification.robust.intervals import UNLIKELY
from valve_friction_ros.identification.robust.posterior_fit import PosteriorFit, fit
from valve_friction_ros.identification.robust.starts import (
    lagging,
    nearest,
    sliding,
    split,
    splits,
)

__all__ = ["Prior", "posteriors_at", "search"]

_SLIP_SHARES = (0.35, 0.55, 0.75, 0.9)
_SLIPS = (0.15, 0.4, 0.8)
_LIMIT_VELOCITIES = (2e-4, 6e-4)
_SUSPICIOUS = 2.0
"""Inflation of a residual beyond which other starts are tried: half of it is not noise."""

_START_NOISE = 3.0
_START_TIME = 5e-3
"""The first position is known to so many deviations of its noise, and to what the stem moves in
such a time (s) and in that by which its sensor may be late."""

_MOST_WORK = 20_000_000
"""Steps of simulations after which no other branch begins: 1.5 seconds of a processor or so.

A count and not a time, so that the answer does not depend on the machine."""

_COARSENESS = 100.0
"""Of the derivatives until a fit is near its end."""

_FEWEST_STEPS = 2
_TRADED = 4
_TRADED_STEPS = 6
_IMPROBABLE = 25.0
"""Steps of a quarter of the timing uncertainty along that valley, steps of a fit there, and the
rise of the sum of squares after which the valley is left."""

_FEW_STEPS = 6
_MORE_STEPS = 12


@dataclass(frozen=True)
class Prior:
    """What is known beforehand.

    Attributes
    ----------
    timing_uncertainty : float
        Standard deviation of the time by which one signal may lag the other in all, s.
    mass : float
        Mass to be expected, kg.
    fixed : mapping of str to float
        Coordinates that are known.
    """

    timing_uncertainty: float
    mass: float
    fixed: Mapping[str, float]


class _Search:
    """The fits of one record."""

    def __init__(
        self, record: FittedRecord, prior: Prior, curves: Sequence[FrictionCurve] = ()
    ) -> None:
        self.work = 0
        self.curves = curves
        self.prior = prior
        self.sliding = sliding(record)
        self.exact = BroadModel(record, self.sliding.spring_constant)
        self.model = replace(self.exact, coarseness=_COARSENESS)
        self.stepwise = replace(self.model, record=set_anew_at_rests(record))
        self.known = dict(prior.fixed)
        self.centre = {"mass": prior.mass}
        self.spread = deviations(
            prior.timing_uncertainty, prior.mass, self.sliding.friction, record.duration / 60
        )
        self.centre["start_position"] = record.start
        late = _START_TIME + 2.0 * prior.timing_uncertainty
        self.spread["start_position"] = _START_NOISE * record.noise + late * abs(
            float(record.leaving[0])
        )
        self.main = tuple(name for name in MAIN if name not in self.known)
        self.timing = tuple(name for name in TIMING if name in self.spread)
        self.all = (
            *self.main,
            *(
                name
                for name in self.spread
                if name not in ("stribeck_velocity", "start_position", *self.known)
            ),
        )
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
    ) -> PosteriorFit:
        """Fit from a start, and count the work."""
        start, model = {**start, **self.known}, model or self.model
        a_step = 2 * len(names) * model.effort(start)
        allowed = (_MOST_WORK - self.work) // a_step
        found = fit(
            model, start, names, self.spread, self.centre, max(min(steps, allowed), _FEWEST_STEPS)
        )
        self.work += len(found.stages) * a_step
        return found

    def full(self, start: Coordinates, names: tuple[str, ...] = ()) -> PosteriorFit:
        """Fit with all imperfections, or with those that are named."""
        names = names or self.all
        near = self.fit(start, names, _MORE_STEPS)
        return self.fit(near.at, names, _MORE_STEPS, self.exact)

    @property
    def may_go_on(self) -> bool:
        """Whether another branch may be tried."""
        return self.work < _MOST_WORK

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

    def curved(self, full: PosteriorFit) -> PosteriorFit:
        """Fit from the friction curves, each move for itself first."""
        starts = self.from_curves()
        if not starts:
            return full
        near = nearest(self.stepwise, starts)[0]
        falls = near["stribeck_velocity"] > 0
        own = ("slip_force", "stribeck_velocity") if falls else ()
        first = self.fit(near, (*self.main, *own), _FEW_STEPS, self.stepwise)
        others = tuple(name for name in self.all if not (falls and name == "at_low_speed"))
        return self.full(first.at, (*others, "stribeck_velocity") if falls else others)

    def stopping(self, full: PosteriorFit) -> PosteriorFit:
        """Fit a dead zone of the speed."""
        dead = [{**full.at, "limit_velocity": speed} for speed in _LIMIT_VELOCITIES]
        return self.full(nearest(self.model, dead)[0])

    def traded(self, best: PosteriorFit) -> list[PosteriorFit]:
        """Fit with other viscous frictions: F_v/k delays a sliding stem much as a lag does.

        The two trade places along a valley that is too bent for the linear model at its deepest
        point. Both ways along it the fit goes as far as the timing is uncertain, or until it is
        improbable.
        """
        lag = self.prior.timing_uncertainty
        if lag == 0.0 or "viscous_friction" not in best.names:
            return []
        names = tuple(
            name
            for name in best.names
            if name in (*MAIN, *TIMING, "mass", "slip_force") and name != "viscous_friction"
        )
        found = []
        for way in (-0.25, 0.25):
            last = best
            for _ in range(_TRADED):
                own = last.at["viscous_friction"] / last.at["spring_constant"]
                delay = max(own + way * lag, 0.0)
                if not (delay != own and self.may_go_on):
                    break
                start = {
                    **last.at,
                    "viscous_friction": last.at["spring_constant"] * delay,
                    "force_lag": last.at["force_lag"] + own - delay,
                }
                last = self.fit(start, names, _TRADED_STEPS, self.exact)
                found.append(last)
                if last.objective - best.objective > _IMPROBABLE * best.inflation**2:
                    break
        return found

    def all_probable(self) -> list[PosteriorFit]:
        """Return the most probable fit, and those with which it competes."""
        best = self.best()
        others = self.traded(best)
        lowest = min(others, key=lambda one: one.objective, default=best)
        if lowest.objective < best.objective - 1.0:
            deeper = self.fit(lowest.at, best.names, _MORE_STEPS, self.exact)
            if deeper.objective < best.objective:
                best, others = deeper, [*others, best]
        return [best, *others]

    def from_curves(self) -> list[Coordinates]:
        """Return what the friction curves say, as starts."""
        starts: list[Coordinates] = []
        for curve in self.curves:
            values = {name: one.value for name, one in curve.numbers.items() if name in MAIN}
            spring = values.get("spring_constant", 0.0)
            if not (spring > 0 and values.get("coulomb_friction", 0.0) > 0):
                continue
            values["viscous_friction"] = max(values["viscous_friction"], SWINGING * spring)
            static = curve.numbers.get("static_friction")
            slip = 0.0 if static is None else max(static.value - values["coulomb_friction"], 0.0)
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
        plain = self.lagged(splits(self.sliding, self.base), self.main)
        if "slip_force" not in self.all:
            return plain.at
        slipping = self.slip_starts(self.base, {**self.base, **plain.at})
        slipped = self.lagged(slipping, (*self.main, "slip_force"))
        return min(plain, slipped, key=lambda one: one.objective).at

    def lagged(self, starts: Sequence[Coordinates], names: tuple[str, ...]) -> PosteriorFit:
        """Fit from the nearest start, and again from there with the likeliest lag."""
        plain = self.fit(nearest(self.model, starts)[0], names, _FEW_STEPS)
        if not self.timing:
            return plain
        lags = [plain.at, *lagging(plain.at, self.prior.timing_uncertainty)]
        near = nearest(self.model, lags)[0]
        return self.fit(near, tuple(dict.fromkeys((*names, *self.timing))), _FEW_STEPS)

    def best(self) -> PosteriorFit:
        """Return the most probable of all fits."""
        best = self.full(self.start())
        for branch in (self.curved, self.stopping):
            is_likely = best.inflation < _SUSPICIOUS and best.stages[-1].penalty < UNLIKELY
            if is_likely or not self.may_go_on:
                break
            best = min(best, branch(best), key=lambda one: one.objective)
        return best


def search(
    record: FittedRecord, prior: Prior, curves: Sequence[FrictionCurve] = ()
) -> list[PosteriorFit]:
    """Find the most probable model of a record, and the ones that compete with it.

    The sliding friction of a regression is split into F_c and F_v in several ways, without and
    with a slip. The way whose simulated stem is nearest starts a fit of the Karnopp model alone,
    that one with the likeliest lag, and the better of both a fit with all imperfections. Where the
    residual is more than noise, the fit begins once more at the friction curve, each move for
    itself first, and then with a dead zone. At the end viscous friction is traded for lag, both
    ways along their common valley.

    Raises
    ------
    RefusalError
        If the stem does not follow the force.
    """
    return _Search(record, prior, curves).all_probable()


def posteriors_at(
    record: FittedRecord, prior: Prior, truth: Coordinates, with_competitors: bool
) -> list[PosteriorFit]:
    """Return what a record says of a model that is known to be the right one, without a search.

    Parameters
    ----------
    record : FittedRecord
        A simulated record.
    prior : Prior
        What an identification would know beforehand.
    truth : mapping of str to float
        Coordinates of the simulated valve; the others are absent.
    with_competitors : bool
        Whether the fits follow that trade viscous friction for lag, as those of `search` do.

    Raises
    ------
    RefusalError
        If the stem does not follow the force.
    """
    found = _Search(record, prior)
    at = {**found.base, **truth}
    best = fit(found.exact, {**at, **found.known}, found.all, found.spread, found.centre, 0)
    return [best, *(found.traded(best) if with_competitors else ())]
