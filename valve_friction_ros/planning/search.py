"""The search for the stroke test with the smallest predicted intervals."""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from valve_friction_ros.identification import IdentificationSettings, RefusalError
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.planning.conditions import AIMS, Conditions, Limits
from valve_friction_ros.planning.forecast import Forecast, forecast, moved
from valve_friction_ros.planning.friction_range import FrictionRange
from valve_friction_ros.planning.pressure_band import PressureBand, pressure_band
from valve_friction_ros.planning.stroke_test import SHAPES, Pattern, StrokeTest, stroke_test

__all__ = ["StrokePlan", "plan_test"]

_SHAPES = (("full",), ("stairs",), ("turning",), ("full", "stairs"))
_SPEEDS = ((1.0,), (0.4,), (0.15,), (1.0, 0.4), (1.0, 0.15), (1.0, 0.3, 0.1))
_HOLDS = (0.1, 0.3, 1.0, 4.0)
"""Shapes, speeds and holds (s) whose combinations the search begins with."""

_FACTORS = (0.6, 0.8, 1.25, 1.6)
_ROUNDS = 8
"""Factors by which a speed or the hold is changed, and how often a start is improved on at most."""

_MIXES = tuple(one for count in (1, 2) for one in itertools.permutations(SHAPES, count))
"""Shapes that a neighbour may have."""

_LONGEST_HOLD = 5.0

_REFUSED = 3.0
"""Loss of a refused record: as of one whose intervals are e³ times wider than those of another."""


@dataclass(frozen=True)
class StrokePlan:
    """A stroke test, and what is to be expected of it.

    Attributes
    ----------
    test : StrokeTest
        The pressure.
    valve : Valve
        Geometry.
    band : PressureBand
        Pressures between which it moves.
    frictions : FrictionRange
        The valves that it is for.
    forecasts : tuple of Forecast
        What will be known of each.
    limits : Limits
        What it keeps to.
    conditions : Conditions
        What measures it.
    aim : str
        What it is for, of `AIMS`.
    tried : int
        Tests that were compared.
    """

    test: StrokeTest
    valve: Valve
    band: PressureBand
    frictions: FrictionRange
    forecasts: tuple[Forecast, ...]
    limits: Limits
    conditions: Conditions
    aim: str
    tried: int

    @property
    def likely(self) -> Forecast:
        """What will be known of the most likely valve."""
        return self.forecasts[self.frictions.middle]


def _neighbours(pattern: Pattern) -> list[Pattern]:
    """Return patterns that differ in one thing."""
    found = []
    for place, factor in itertools.product(range(len(pattern.speeds)), _FACTORS):
        speeds = list(pattern.speeds)
        speeds[place] = min(speeds[place] * factor, 1.0)
        found.append(replace(pattern, speeds=tuple(speeds)))
    for factor in _FACTORS:
        hold = min(pattern.hold * factor, _LONGEST_HOLD)
        found.append(replace(pattern, hold=hold))
    found += [replace(pattern, shapes=names) for names in _MIXES]
    found.append(replace(pattern, speeds=pattern.speeds[::-1]))
    return [one for one in found if one != pattern]


class _Search:
    """Tests of one valve, each tried once."""

    def __init__(
        self,
        valve: Valve,
        frictions: FrictionRange,
        limits: Limits,
        conditions: Conditions,
        settings: IdentificationSettings,
        names: Sequence[str],
    ) -> None:
        self.valve, self.frictions, self.limits = valve, frictions, limits
        self.conditions, self.settings, self.names = conditions, settings, names
        self.band = pressure_band(valve, frictions, limits)
        self.known: dict[tuple[Pattern, int], float] = {}

    def test(self, pattern: Pattern) -> StrokeTest | None:
        return stroke_test(pattern, self.band, self.limits.duration)

    def forecast(self, test: StrokeTest, place: int, is_final: bool = False) -> Forecast:
        draw = self.frictions.draws[place]
        motion = moved(test.excitation, test.duration, self.valve, draw, self.conditions)
        return forecast(
            motion, self.valve, draw, self.conditions, self.settings, with_competitors=is_final
        )

    def loss(self, pattern: Pattern, place: int) -> float:
        """Mean logarithm of w/(1 + w), with w the half widths over their values.

        It is that of w where w is small, and no number counts that nobody will know anyway. A test
        that tells nothing of a valve is worse than one that tells little.
        """
        if (pattern, place) not in self.known:
            test, found = self.test(pattern), _REFUSED
            if test is not None:
                expected = self.forecast(test, place)
                shares = [expected.relative(name) for name in self.names]
                found = sum(-math.log1p(1 / one) for one in shares if one > 0) / len(shares)
                found += _REFUSED * bool(expected.refusal)
            self.known[pattern, place] = found
        return self.known[pattern, place]

    def likely(self, pattern: Pattern) -> float:
        """Return the loss of the most likely valve."""
        return self.loss(pattern, self.frictions.middle)

    def overall(self, pattern: Pattern) -> float:
        """Return the mean of `loss` over all valves."""
        draws = range(len(self.frictions.draws))
        return sum(self.loss(pattern, place) for place in draws) / len(draws)

    def patterns(self) -> list[Pattern]:
        """Return the patterns to begin with that the duration has room for."""
        found = [Pattern(*one) for one in itertools.product(_SHAPES, _SPEEDS, _HOLDS)]
        fitting = [one for one in found if self.test(one) is not None]
        if not fitting:
            span = (self.band.high - self.band.low) / self.band.rate
            raise RefusalError(
                f"{self.limits.duration:g} s have no room for two strokes up and down, of "
                f"{span:.3g} s each at {self.band.rate / 1e3:.3g} kPa/s: allow more time, a "
                "higher speed or rate, or a smaller part of the travel"
            )
        return fitting

    def best(self, progress: Callable[[float], object]) -> Pattern:
        """Compare patterns for the likely valve, and improve the best of each shape for all."""
        first = self.patterns()
        for count, one in enumerate(first):
            self.likely(one)
            progress(0.5 * (count + 1) / len(first))
        # The loss has many valleys, so that the best pattern of each shape is improved on.
        starts = [
            min(same, key=self.likely)
            for shapes in _SHAPES
            if (same := [one for one in first if one.shapes == shapes])
        ]
        found = []
        for count, one in enumerate(starts):
            found.append(self.improved(one, self.likely))
            progress(0.5 + 0.3 * (count + 1) / len(starts))
        best = self.improved(min(found, key=self.overall), self.overall)
        progress(0.9)
        return best

    def improved(self, pattern: Pattern, loss: Callable[[Pattern], float]) -> Pattern:
        """Go from a pattern to the best of its neighbours, until none is better."""
        best = pattern
        for _ in range(_ROUNDS):
            better = min([best, *_neighbours(best)], key=loss)
            if better == best:
                break
            best = better
        return best


def _told_nobody(share: float) -> None:
    """Take a share of the work that nobody asked for."""


def plan_test(
    valve: Valve,
    frictions: FrictionRange,
    limits: Limits | None = None,
    conditions: Conditions | None = None,
    settings: IdentificationSettings | None = None,
    aim: str = "friction",
    progress: Callable[[float], object] | None = None,
) -> StrokePlan:
    """Find the stroke test with the smallest predicted intervals.

    Patterns of strokes, with speeds, turns, stairs and holds, are simulated with each valve of the
    range; the posterior of the method robust tells the half widths (`expected_half_widths`). The
    mean logarithm of their shares of the values, over the numbers of the aim and over the valves,
    decides: it is the D-criterion of these numbers if they are taken as independent.

    Parameters
    ----------
    valve : Valve
        Geometry and pressure range.
    frictions : FrictionRange
        What is known of friction and spring.
    limits : Limits, optional
        What the test may do.
    conditions : Conditions, optional
        What will measure it.
    settings : IdentificationSettings, optional
        Those of the identification to come.
    aim : str
        What the test is for, of `AIMS`.
    progress : callable, optional
        Takes the share of the work that is done.

    Returns
    -------
    StrokePlan
        The test and its forecasts. It depends on no clock and no chance. The search is local, from
        several starts: of eight problems a global one (differential evolution, thousands of tests)
        found intervals that were at most 13 % narrower.

    Raises
    ------
    RefusalError
        If no test within the limits moves the stem, or none is known from it; one line with what
        to relax.
    ValueError
        If there is no such aim, or the valve has no diaphragm or no travel.

    Examples
    --------
    >>> import valve_friction_ros as vf
    >>> from valve_friction_ros.planning import Limits, known_friction, plan_test
    >>> valve = vf.Valve(diaphragm_area=0.0445, travel=28.575e-3)
    >>> frictions = known_friction(150.0, spring=(2.05e5, 230.0), mass=1.6, factor=1.0)
    >>> plan = plan_test(valve, frictions, Limits(lowest=0.4, highest=0.6, duration=20.0))
    >>> low, high = plan.likely.reach
    >>> 0.39 < low / valve.travel < high / valve.travel < 0.61
    True
    """
    if aim not in AIMS:
        raise ValueError(f"there is no aim {aim!r}: choose from {', '.join(AIMS)}")
    limits, conditions = limits or Limits(), conditions or Conditions()
    settings = settings or IdentificationSettings()
    found = _Search(valve, frictions, limits, conditions, settings, AIMS[aim])
    told = progress or _told_nobody
    best = found.best(told)
    test = found.test(best)
    assert test is not None  # noqa: S101 - it was simulated
    forecasts = []
    for place in range(len(frictions.draws)):
        forecasts.append(found.forecast(test, place, is_final=True))
        told(0.9 + 0.1 * (place + 1) / len(frictions.draws))
    plan = StrokePlan(
        test,
        valve,
        found.band,
        frictions,
        tuple(forecasts),
        limits,
        conditions,
        aim,
        len({pattern for pattern, _ in found.known}),
    )
    if plan.likely.refusal:
        raise RefusalError(f"no test within these limits tells the friction: {plan.likely.refusal}")
    return plan
