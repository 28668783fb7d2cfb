# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Stroke tests: patterns of strokes within a pressure band, for a range of frictions.

Between the pressures of the band a stem stays within a part of its travel, whatever its friction.
"""

import itertools
import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.checks import require_finite, require_positive
from valve_friction_ros.model.excitations import SampledPressure
from valve_friction_ros.model.valve import KarnoppParameters, Valve
from valve_friction_ros.planning.conditions import STOP_MARGIN, Limits

_USUAL_DELAY = 0.1
"""F_v/k, s, where F_v is not known. The packings of the paper's bench have 0.02 to 0.34 s."""

_UNKNOWN = ((0.015, 0.03, 1.0), (0.05, 0.1, 1.2), (0.15, 0.3, 1.4))
"""F_c over the spring's force along the travel, F_v/k (s) and F_s/F_c, of three valves.

Chosen about the three packings of the paper's bench, whose shares are 2.6 %, 10 % and 11 %, whose
delays 0.02, 0.22 and 0.34 s, and whose ratios 1.0, 1.0 and 1.4."""


@dataclass(frozen=True)
class FrictionRange:
    """Valves that span the possible frictions of the true valve.

    Attributes
    ----------
    draws : tuple of KarnoppParameters
        The valves; the middle one is the most likely. All have the same spring.
    names : tuple of str
        Name of each.

    Raises
    ------
    ValueError
        If they have no spring.
    """

    draws: tuple[KarnoppParameters, ...]
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        if not self.draws[0].spring_constant > 0:
            raise ValueError("a stroke test needs a spring: give spring_constant above zero")

    @property
    def middle(self) -> int:
        """Index of the most likely valve."""
        return len(self.draws) // 2

    @property
    def spring(self) -> tuple[float, float]:
        """Spring constant, N/m, and preload, N."""
        return self.draws[0].spring_constant, self.draws[0].spring_preload


def known_friction(
    coulomb_friction: float,
    spring: tuple[float, float],
    mass: float,
    *,
    static_friction: float | None = None,
    viscous_friction: float | None = None,
    factor: float = 2.0,
) -> FrictionRange:
    """Return valves about a friction that is known to within a factor.

    Parameters
    ----------
    coulomb_friction : float
        F_c, N, above zero.
    spring : tuple of float
        Spring constant, N/m, and preload, N.
    mass : float
        Mass, kg.
    static_friction : float, optional
        F_s, N; by default F_c.
    viscous_friction : float, optional
        F_v, N·s/m; by default that of a delay F_v/k of 0.1 s.
    factor : float
        All frictions may be larger or smaller by this factor, at least 1.
    """
    require_positive("coulomb_friction", coulomb_friction)
    if not require_finite("factor", factor) >= 1:
        raise ValueError(f"the factor of the friction must be at least 1, got {factor:g}")
    constant, preload = spring
    likely = KarnoppParameters(
        mass=mass,
        viscous_friction=_USUAL_DELAY * constant if viscous_friction is None else viscous_friction,
        coulomb_friction=coulomb_friction,
        static_friction=coulomb_friction if static_friction is None else static_friction,
        spring_constant=constant,
        spring_preload=preload,
    )
    if factor == 1:
        return FrictionRange((likely,), ("as assumed",))
    return FrictionRange(
        (_scaled(likely, 1 / factor), likely, _scaled(likely, factor)),
        (f"{factor:g} times smaller", "as assumed", f"{factor:g} times larger"),
    )


def _scaled(valve: KarnoppParameters, factor: float) -> KarnoppParameters:
    return replace(
        valve,
        coulomb_friction=valve.coulomb_friction * factor,
        static_friction=valve.static_friction * factor,
        viscous_friction=valve.viscous_friction * factor,
    )


def unknown_friction(valve: Valve, spring: tuple[float, float], mass: float) -> FrictionRange:
    """Return three valves for an unknown friction: 1.5, 5 and 15 % of the spring's force.

    `spring` is as for `known_friction`; the valve gives the travel.
    """
    constant, preload = spring
    draws = tuple(
        KarnoppParameters(
            mass=mass,
            viscous_friction=delay * constant,
            coulomb_friction=share * constant * valve.travel,
            static_friction=share * ratio * constant * valve.travel,
            spring_constant=constant,
            spring_preload=preload,
        )
        for share, delay, ratio in _UNKNOWN
    )
    return FrictionRange(draws, ("light", "medium", "heavy"))


LEAST_STROKE = 0.03
"""Share of the travel that the stem must move over: three times what an identification needs."""


class PressureBand(NamedTuple):
    """Pressures of a test, and the rate that its speed allows."""

    low: float
    high: float
    """Lowest and highest pressure, Pa."""
    rate: float
    """Largest rate of the pressure, Pa/s."""


def _held(one: KarnoppParameters) -> float:
    """Return the force, N, that clearly holds the stem back at the end of a stroke.

    A stem that swings, one with less than critical damping, may go on by the slip.
    """
    swings = one.viscous_friction < 2 * math.sqrt(one.spring_constant * one.mass)
    slip = one.static_friction - one.coulomb_friction
    return max(one.coulomb_friction - (slip if swings else 0.0), 0.0)


def stroke(valve: Valve, one: KarnoppParameters, band: PressureBand) -> float:
    """Return the distance, m, between the rests at both ends of a band; negative: no motion.

    A stroke is S_a·ΔP − 2·F_c over k. A stem that rests in the middle breaks away if
    S_a·ΔP/2 > F_s; it may do so elsewhere, but the place where it rests is unknown.
    """
    span = valve.force_per_drive * (band.high - band.low)
    if span <= 2 * one.static_friction:
        return -1.0
    return (span - 2 * one.coulomb_friction) / one.spring_constant


def strokes(valve: Valve, one: KarnoppParameters, band: PressureBand) -> bool:
    """Return whether a reversal within a band moves the stem by the least stroke, as rounded."""
    return stroke(valve, one, band) >= LEAST_STROKE * valve.travel * (1 - 1e-9)


def frictionless_reach(
    valve: Valve, frictions: FrictionRange, band: PressureBand
) -> tuple[float, float]:
    """Return where a stem without friction would rest at both ends of a band, m."""
    constant, preload = frictions.spring
    low, high = ((valve.actuator_force(one) - preload) / constant for one in (band.low, band.high))
    return low, high


def pressure_band(valve: Valve, frictions: FrictionRange, limits: Limits) -> PressureBand:
    """Return the widest band that keeps to the limits.

    At the upper end a rising stem rests at k·x = S_a·(P − P_ref) − F_0 − F_c. The smallest F_c of
    the range must rest within the part of the travel, and no friction at all within the stops. No
    converter goes below the atmosphere, which is the reference of the valve.

    Raises
    ------
    RefusalError
        If the stem would not move there; the message names what to relax.
    ValueError
        If the valve has no diaphragm or no travel.
    """
    if valve.diaphragm_area is None or not math.isfinite(valve.travel):
        raise ValueError(
            "a stroke test is planned for a valve with a diaphragm and a travel: give "
            "diaphragm_area and travel in the valve file"
        )
    constant, preload = frictions.spring
    held = min(_held(one) for one in frictions.draws)
    lowest, highest = (share * valve.travel for share in (limits.lowest, limits.highest))
    low = valve.actuator_drive(constant * lowest + preload - held)
    high = valve.actuator_drive(constant * highest + preload + held)
    if not limits.allow_stops:
        margin = STOP_MARGIN * valve.travel
        low = max(low, valve.actuator_drive(constant * margin + preload))
        high = min(high, valve.actuator_drive(constant * (valve.travel - margin) + preload))
    least = max(limits.pressure_minimum, valve.pressure_minimum, valve.pressure_reference)
    most = min(limits.pressure_maximum, valve.pressure_maximum)
    pressures = PressureBand(
        max(low, least),
        min(high, most),
        min(limits.pressure_rate, limits.speed * constant / valve.diaphragm_area),
    )
    if pressures.low >= pressures.high:
        up_to = f"{most / 1e3:.4g} kPa" if math.isfinite(most) else "any pressure"
        raise RefusalError(
            f"the pressure limits leave no usable band: the stem needs {low / 1e3:.4g} to "
            f"{high / 1e3:.4g} kPa between {100 * limits.lowest:g} and {100 * limits.highest:g} % "
            f"of the travel, and {least / 1e3:.4g} kPa to {up_to} may be set: widen the range of "
            "the pressure (it cannot go below pressure_reference)"
        )
    _require_strokes(valve, frictions, limits, pressures, (low, high))
    return pressures


def _require_strokes(
    valve: Valve,
    frictions: FrictionRange,
    limits: Limits,
    band: PressureBand,
    wanted: tuple[float, float],
) -> None:
    """Refuse a band in which the most likely valve does not move far enough."""
    likely = frictions.draws[frictions.middle]
    if strokes(valve, likely, band):
        return
    least = LEAST_STROKE * valve.travel
    force = max(
        2 * likely.static_friction,
        2 * likely.coulomb_friction + likely.spring_constant * least,
    )
    needed = force / valve.force_per_drive
    where = (
        f"between {100 * limits.lowest:g} and {100 * limits.highest:g} % of the travel, at "
        f"{band.low / 1e3:.4g} to {band.high / 1e3:.4g} kPa"
    )
    remedy = "widen the part of the travel"
    if band.low > wanted[0] or band.high < wanted[1]:
        remedy += " or the range of the pressure"
    raise RefusalError(
        f"a reversal would not move the stem {where}: a friction of {likely.static_friction:.4g} "
        f"N needs {needed / 1e3:.4g} kPa to move the stem both ways, but the band spans "
        f"{(band.high - band.low) / 1e3:.4g} kPa: {remedy}"
    )


SHAPES = {
    "full": (1.0, 0.0),
    "turning": (1.0, 0.4, 1.0, 0.0, 0.6, 0.0),
    "stairs": (0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25, 0.0),
}
"""Levels of a cycle in turn, shares of the band; each cycle begins at the lower end.

A full stroke slides longest; a turning stroke breaks away more often; stairs stop and start again
in the same direction."""

_FEWEST_CYCLES = 2
"""Fewest cycles in a test: with three strokes or more a verdict can be better than weak."""

_MIDDLE = 0.5
_BEFORE = 1.0
"""Level, share of the band, and time, s, for which a test holds it before the first stroke."""

_SHORTEST_HOLD = 1e-3
"""Holds up to this, s, are left out: their corners would not differ in the file."""


@dataclass(frozen=True)
class Pattern:
    """The pattern that repeats in a stroke test; each cycle takes the next shape and speed."""

    shapes: tuple[str, ...]
    """Names of `SHAPES`."""
    speeds: tuple[float, ...]
    """Rates of the pressure, shares of the largest one, above 0 and at most 1."""
    hold: float
    """Time at each level, s."""


@dataclass(frozen=True, eq=False)
class StrokeTest:
    """The pressure of a stroke test: linear between corners."""

    times: NDArray[np.float64] = field(repr=False)
    pressures: NDArray[np.float64] = field(repr=False)
    """Times of the corners since the start, s, and the pressures there, Pa."""
    pattern: Pattern
    cycles: int
    """Number of times that the stem goes up and down again."""

    @property
    def duration(self) -> float:
        """Length, s."""
        return float(self.times[-1])

    @property
    def largest_rate(self) -> float:
        """Largest rate of the pressure, Pa/s."""
        return float(np.max(np.abs(np.diff(self.pressures) / np.diff(self.times))))

    @property
    def excitation(self) -> SampledPressure:
        """The pressure before the converter, as a signal."""
        return SampledPressure(self.times, self.pressures)


def stroke_test(pattern: Pattern, band: PressureBand, duration: float) -> StrokeTest | None:
    """Return the test of a pattern that lasts at most `duration` s; None if that is too short.

    It begins and ends with a hold at the middle pressure of the band, where the stem rests on that
    side of its middle from which it came. It has each kind of cycle.
    """
    span_time = (band.high - band.low) / band.rate
    ends = _BEFORE + 2 * (_MIDDLE * span_time + pattern.hold)
    left = duration - ends
    steps = [(0.0, 1.0)]
    count = 0
    cycles = zip(itertools.cycle(pattern.shapes), itertools.cycle(pattern.speeds), strict=False)
    for shape, speed in cycles:
        levels = SHAPES[shape]
        moved = sum(abs(after - before) for before, after in itertools.pairwise((0.0, *levels)))
        needed = moved * span_time / speed + pattern.hold * len(levels)
        if needed > left + 1e-9:
            break
        left -= needed
        count += 1
        steps += [(level, speed) for level in levels]
    if count < max(len(pattern.shapes), len(pattern.speeds), _FEWEST_CYCLES):
        return None
    steps.append((_MIDDLE, 1.0))
    times, shares = [0.0, _BEFORE], [_MIDDLE, _MIDDLE]
    for level, speed in steps:
        times.append(times[-1] + abs(level - shares[-1]) * span_time / speed)
        shares.append(level)
        if pattern.hold > _SHORTEST_HOLD:
            times.append(times[-1] + pattern.hold)
            shares.append(level)
    pressures = band.low + (band.high - band.low) * np.array(shares)
    return StrokeTest(np.array(times), pressures, pattern, count)
