# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The search for the stroke test with the smallest predicted intervals.

A forecast predicts the motion of a valve in a test and the intervals that follow from it; remarks
say what the people who play the test must know.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.engine.method import expected_half_widths
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import SLIDING, IdentificationSettings
from valve_friction_ros.identification.trust.uncertainty import mean_sliding_friction
from valve_friction_ros.identification.trust.verdict import FALL_SPEED
from valve_friction_ros.model.excitations import Excitation
from valve_friction_ros.model.recording import Recording, SensorNoise, converter_response
from valve_friction_ros.model.simulation import simulate
from valve_friction_ros.model.valve import KarnoppParameters, Valve
from valve_friction_ros.planning.conditions import AIMS, Conditions, Limits
from valve_friction_ros.planning.stroke_test import (
    SHAPES,
    FrictionRange,
    Pattern,
    PressureBand,
    StrokeTest,
    frictionless_reach,
    pressure_band,
    stroke_test,
    strokes,
)
from valve_friction_ros.wording import LAG_SETTING, percentage

_MOST_SAMPLES = 12_000
"""Most samples that a forecast simulates: fewer samples with less noise give the same intervals."""


@dataclass(frozen=True)
class Forecast:
    """Forecast for the valve with these `parameters`: its motion, and the intervals."""

    parameters: KarnoppParameters
    values: Mapping[str, float]
    half_widths: Mapping[str, float]
    """True values, and half the widths of their 95 % intervals; SI units. No widths if refused."""
    reach: tuple[float, float]
    """Lowest and highest position, m."""
    top_speed: float
    """Largest speed, m/s."""
    breakaways: int
    refusal: str = ""
    """Why the identification would refuse the record; empty if it would not."""

    def relative(self, name: str) -> float:
        """Half width over the value, inf where either is missing."""
        value = abs(self.values.get(name, 0.0))
        return self.half_widths[name] / value if value and name in self.half_widths else math.inf


def moved(
    excitation: Excitation,
    duration: float,
    valve: Valve,
    parameters: KarnoppParameters,
    conditions: Conditions,
) -> tuple[Recording, NDArray[np.float64]]:
    """Simulate a valve under a signal of a converter, without noise.

    Return pressure behind the converter and stem position, and the velocity of the stem, m/s.
    """
    samples = duration * conditions.sample_rate
    stride = max(math.ceil(samples / _MOST_SAMPLES), 1)
    period = stride / conditions.sample_rate
    time = np.arange(math.floor(duration / period + 1e-9) + 1) * period
    pressure = converter_response(excitation.sample(time), period, conditions.converter_lag)
    stem = simulate(valve, parameters, pressure, period)
    return Recording(period, pressure, stem.position), stem.velocity


def forecast(
    motion: tuple[Recording, NDArray[np.float64]],
    valve: Valve,
    parameters: KarnoppParameters,
    conditions: Conditions,
    settings: IdentificationSettings,
    *,
    with_competitors: bool = False,
) -> Forecast:
    """Predict what the identification will determine from a simulated test, as `moved` returns it.

    The noise is one realisation of the sensors' noise, the same for each test: the width of an
    interval hardly depends on it.
    """
    exact, velocity = motion
    fewer = math.sqrt(1.0 / (exact.sample_period * conditions.sample_rate))
    noise = SensorNoise(conditions.position_noise * fewer, conditions.pressure_noise * fewer, 0)
    refusal, widths = "", {}
    try:
        widths = dict(
            expected_half_widths(
                noise.applied_to(exact),
                valve,
                parameters,
                settings,
                start=float(exact.position[0]),
                with_competitors=with_competitors,
            )
        )
    except RefusalError as error:
        refusal = str(error)
    values = {**vars(parameters), SLIDING: mean_sliding_friction(parameters, velocity)}
    return Forecast(
        parameters,
        values,
        widths,
        (float(exact.position.min()), float(exact.position.max())),
        float(np.max(np.abs(velocity))),
        int(np.count_nonzero((velocity[1:] != 0) & (velocity[:-1] == 0))),
        refusal,
    )


_SHAPES = (("full",), ("stairs",), ("turning",), ("full", "stairs"))
_SPEEDS = ((1.0,), (0.4,), (0.15,), (1.0, 0.4), (1.0, 0.15), (1.0, 0.3, 0.1))
_HOLDS = (0.1, 0.3, 1.0, 4.0)
"""Shapes, speeds and holds (s) with whose combinations the search begins."""

_FACTORS = (0.6, 0.8, 1.25, 1.6)
_ROUNDS = 8
"""Factors by which a speed or the hold is changed, and most improvements of a start."""

_MIXES = tuple(one for count in (1, 2) for one in itertools.permutations(SHAPES, count))
"""Shapes that a neighbour may have."""

_LONGEST_HOLD = 5.0

_REFUSAL_LOSS = 3.0
"""Loss of a refused record: that of a record whose intervals are e³ times wider than others."""


@dataclass(frozen=True)
class StrokePlan:
    """A stroke test with its forecasts, and what it was planned for.

    Attributes
    ----------
    band : PressureBand
        Pressures between which it moves.
    forecasts : tuple of Forecast
        Forecast for each valve of `frictions`.
    aim : str
        Its aim, one of `AIMS`.
    tried : int
        Number of tests that were compared.
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
        """Forecast for the most likely valve."""
        return self.forecasts[self.frictions.middle]


def _neighbours(pattern: Pattern) -> list[Pattern]:
    """Return patterns that differ in one property."""
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
        aim: str,
    ) -> None:
        if aim not in AIMS:
            raise ValueError(f"unknown aim {aim!r}: choose from {', '.join(AIMS)}")
        self.valve, self.frictions, self.limits = valve, frictions, limits
        self.conditions, self.settings, self.names = conditions, settings, AIMS[aim]
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

        For small w it is the mean logarithm of w; a number that stays unknown in any test has no
        effect. A test that determines nothing of a valve is worse than one that determines little.
        """
        if (pattern, place) not in self.known:
            test, found = self.test(pattern), _REFUSAL_LOSS
            if test is not None:
                expected = self.forecast(test, place)
                shares = [expected.relative(name) for name in self.names]
                found = sum(-math.log1p(1 / one) for one in shares if one > 0) / len(shares)
                found += _REFUSAL_LOSS * bool(expected.refusal)
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
        """Return the initial patterns that fit into the duration."""
        found = [Pattern(*one) for one in itertools.product(_SHAPES, _SPEEDS, _HOLDS)]
        fitting = [one for one in found if self.test(one) is not None]
        if not fitting:
            span = (self.band.high - self.band.low) / self.band.rate
            raise RefusalError(
                f"{self.limits.duration:g} s do not allow two strokes up and down of {span:.3g} s "
                f"each at {self.band.rate / 1e3:.3g} kPa/s: allow more time, a higher speed or "
                "rate, or a smaller part of the travel"
            )
        return fitting

    def best(self, progress: Callable[[float], object]) -> Pattern:
        """Compare patterns for the likely valve, and improve the best of each shape for all."""
        first = self.patterns()
        for count, one in enumerate(first):
            self.likely(one)
            progress(0.5 * (count + 1) / len(first))
        # The loss has many valleys, so the best pattern of each shape is improved.
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
    range; the posterior of the method ``plant`` gives the half widths (`expected_half_widths`). The
    criterion is the mean logarithm of their shares of the values, over the numbers of the aim and
    over the valves: the D-criterion of these numbers if they are taken as independent.

    Parameters
    ----------
    valve : Valve
        Geometry and pressure range.
    frictions : FrictionRange
        Prior knowledge of friction and spring.
    limits : Limits, optional
        Limits of the test.
    conditions : Conditions, optional
        Conditions of its measurement.
    settings : IdentificationSettings, optional
        Settings of the later identification.
    aim : str
        Aim of the test, one of `AIMS`.
    progress : callable, optional
        Called with the share of the work that is done.

    Returns
    -------
    StrokePlan
        The test and its forecasts. They depend on no clock and no chance. The search is local, from
        several starts: in eight problems a global search (differential evolution, thousands of
        tests) found intervals that were at most 13 % narrower.

    Raises
    ------
    RefusalError
        If no test within the limits moves the stem, or none determines its friction; the message
        is one line with what to relax.
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
    limits, conditions = limits or Limits(), conditions or Conditions()
    settings = settings or IdentificationSettings()
    found = _Search(valve, frictions, limits, conditions, settings, aim)
    say = progress or (lambda _: None)
    test = found.test(found.best(say))
    assert test is not None  # noqa: S101 - it was simulated
    forecasts: list[Forecast] = []
    for place in range(len(frictions.draws)):
        forecasts.append(found.forecast(test, place, is_final=True))
        say(0.9 + 0.1 * len(forecasts) / len(frictions.draws))
    tried = len({pattern for pattern, _ in found.known})
    plan = StrokePlan(
        test, valve, found.band, frictions, tuple(forecasts), limits, conditions, aim, tried
    )
    if plan.likely.refusal:
        raise RefusalError(
            f"no test within these limits determines friction: {plan.likely.refusal}"
        )
    return plan


_OVERTRAVEL = 5e-3
"""Share of the travel by which a simulated stem may leave its part without a remark."""

_FASTER_RATIO = 1.05
_UNKNOWN_REL_HALF_WIDTH = 0.5
"""Half width over the value above which a number is called unknown."""


def _resting(plan: StrokePlan) -> Iterator[str]:
    """Yield a remark for each valve that may not move, or whose record would be refused."""
    for name, one, draw in zip(
        plan.frictions.names, plan.forecasts, plan.frictions.draws, strict=True
    ):
        if not strokes(plan.valve, draw, plan.band):
            yield (
                f"friction {name} (F_s {draw.static_friction:.4g} N) may hold the stem: if the "
                "stem does not move, friction has grown at least to this value; widen the part of "
                "the travel"
            )
        elif one.refusal:
            yield f"friction {name}: identification would refuse the record: {one.refusal}"


def _reaches(plan: StrokePlan) -> Iterator[str]:
    """Yield remarks that the stem may leave, or not reach the end of, its part of the travel."""
    valve, limits = plan.valve, plan.limits
    if plan.band.low <= valve.pressure_reference:
        yield (
            f"the lower end is atmospheric pressure, {plan.band.low / 1e3:.4g} kPa "
            "(pressure_reference): the stem may not reach the lower end of the part of the travel"
        )
    low, high = frictionless_reach(valve, plan.frictions, plan.band)
    if low < limits.lowest * valve.travel or high > limits.highest * valve.travel:
        yield (
            "with less friction than assumed the stem moves further, at most from "
            f"{100 * max(low, 0.0) / valve.travel:.0f} to "
            f"{100 * min(high, valve.travel) / valve.travel:.0f} % of the travel"
        )
    if low <= 0 or high >= valve.travel:
        yield (
            "the stem may reach the seat or stop, where the pressure gives no information on "
            "friction"
        )
    lowest = min(one.reach[0] for one in plan.forecasts)
    highest = max(one.reach[1] for one in plan.forecasts)
    over = max(limits.lowest * valve.travel - lowest, highest - limits.highest * valve.travel)
    if over > _OVERTRAVEL * valve.travel:
        yield (
            f"after breakaway the stem may overshoot the part of the travel by {over * 1e3:.2g} mm"
        )


def _speeds(plan: StrokePlan) -> Iterator[str]:
    """Yield remarks on jumps, and on speeds that the test does not reach."""
    fastest = max(one.top_speed for one in plan.forecasts)
    if fastest > _FASTER_RATIO * plan.limits.speed:
        yield (
            f"at breakaway the stem may jump at up to {fastest * 1e3:.2g} mm/s, whatever the "
            "pressure does"
        )
    if plan.likely.top_speed < FALL_SPEED:
        yield (
            f"the stem moves at {plan.likely.top_speed * 1e3:.2g} mm/s at most: friction above "
            f"that speed, up to {FALL_SPEED * 1e3:.2g} mm/s, remains unknown; allow more speed or "
            "travel"
        )


def _unknown_parameters(plan: StrokePlan) -> Iterator[str]:
    """Yield remarks on numbers of the aim that the test determines badly, or may."""
    for name in AIMS[plan.aim]:
        share = plan.likely.relative(name)
        if share <= _UNKNOWN_REL_HALF_WIDTH:
            continue
        why = f"is known to ±{percentage(share)} only" if math.isfinite(share) else "stays unknown"
        remedy = "allow more time, speed or travel"
        if name == "viscous_friction":
            remedy = (
                "its delay F_v/k cannot be distinguished from a lag of the signals: state a "
                f"smaller {LAG_SETTING} if the clocks allow it"
            )
        yield f"{name} {why}: {remedy}"
    packing = plan.likely.parameters
    if packing.static_friction > packing.coulomb_friction:
        yield (
            "if friction falls gradually with speed (Stribeck), the intervals of F_c, F_v and F_s "
            "will be several times wider than predicted"
        )


def plan_remarks(plan: StrokePlan) -> tuple[str, ...]:
    """Return a sentence for each fact to know before a test is played."""
    return (*_resting(plan), *_reaches(plan), *_speeds(plan), *_unknown_parameters(plan))
