# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Ratio of the friction of a valve to its baseline, at equal speeds.

Two records of the same sensors share the unknown part of the lag between the signals. Both
frictions then have the same error, and their ratio is known better than either.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

from valve_friction_ros.health.baseline import Baseline, SlidingFriction
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.valve_numbers import SHARED, SURE_SPRING
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.identification.trust.uncertainty import NORMAL_QUANTILE, SPEED_EXPONENT
from valve_friction_ros.identification.trust.verdict import Parameter, Verdict
from valve_friction_ros.model.checks import equal_by_fields
from valve_friction_ros.wording import Code, Statement, said, sentence

_ALIKE = 0.9
"""Correlation of the effect of the lag on two records: sensors, clocks and tubing are the same, but
may have changed a little. Chosen."""

_USUAL_EXPONENT, _EXPONENT_SPREAD = 0.3, 0.4
"""Mean and standard deviation of the exponent p of friction over speed: 0 for Coulomb friction
alone, 1 for viscous friction alone, negative for friction that falls with speed."""

_USUAL_FALL, _FALL_SPREAD = 0.16, 0.12
"""Mean and standard deviation of the share of friction lost at unlimited speed.

Between two speeds of ratio s, the exp(-(v/v_s)²) of a packing that slips falls by at most 1 - 1/s,
to within 0.05. These four values are chosen to hold 90 to 98 % of drawn packings, of which half
slip (F_s 1.15 to 2 F_c, v_s 0.3 to 5 mm/s, F_v·v 0.1 to 3 F_c)."""

_USUAL_BEND, _BEND_SPREAD = 0.06, 0.12
"""Mean and standard deviation of the quadratic coefficient, in the logarithm of the speed ratio,
that is added to the power law tangent at one of two speeds: 95 % of the same packings lie between
-0.13 and 0.32."""

_WIDEST_STEP = math.log(1.5)
"""Largest half width of the step from one speed to the other at which a friction is still known.

Beyond it the speed alone may change friction by half. A comparison then shows only a change that
no difference in speed explains. Chosen."""

_NOTHING: Mapping[str, Measured] = MappingProxyType({})
_COULOMB = "coulomb_friction"


def friction_name(name: str, speed: float) -> Statement:
    """Return the name of a friction; a sliding friction includes its speed, m/s."""
    if name == SLIDING:
        return said(Code.FRICTION_AT, of=name, speed=speed)
    return said(Code.FRICTION, of=name)


@equal_by_fields
@dataclass(frozen=True)
class Ratio(Measured):
    """Present friction over baseline friction.

    Attributes
    ----------
    of : str
        The compared friction: ``sliding_friction`` or ``coulomb_friction``.
    speed : float
        Speed of the baseline, m/s, at which sliding frictions are compared; else nan.
    """

    of: str = _COULOMB
    speed: float = math.nan

    @property
    def friction(self) -> Statement:
        """The compared friction, as a statement."""
        return friction_name(self.of, self.speed)

    @property
    def what(self) -> str:
        """The compared friction, in words."""
        return sentence(self.friction)

    @property
    def change(self) -> float:
        """Distance of the interval from 1, as a logarithm; 0 if it includes 1 or has no ends."""
        if not self.low > 0:
            return 0.0
        return max(math.log(self.low), 0.0) + min(math.log(self.high), 0.0)


class Comparison(NamedTuple):
    """Present and baseline friction, N, each with half the width of its 95 % interval.

    The intervals leave out calibration. `shared` holds the parts of both half widths that come from
    a common error.
    """

    now: tuple[float, float]
    healthy: tuple[float, float]
    of: str = _COULOMB
    speed: float = math.nan
    shared: tuple[float, float] = (0.0, 0.0)

    @property
    def ratio(self) -> Ratio:
        """Ratio of the two frictions.

        The relative half widths of independent estimates add in squares. The interval is symmetric
        in the logarithm, so a ratio and its inverse have the same interval.
        """
        ratio = self.now[0] / self.healthy[0]
        if not ratio > 0:
            return Ratio(ratio, of=self.of, speed=self.speed)
        low, high = ratio * math.exp(-self.share), ratio * math.exp(self.share)
        return Ratio.between(ratio, low, high, of=self.of, speed=self.speed)

    @property
    def share(self) -> float:
        """Half the width of the interval of the ratio's logarithm."""
        return self._apart(self.now[0], self.healthy[0])

    @property
    def excess(self) -> tuple[float, float]:
        """Present less baseline friction, N, and half the width of its interval."""
        return self.now[0] - self.healthy[0], self._apart(1.0, 1.0)

    def _apart(self, now: float, healthy: float) -> float:
        """Return the half width of the difference of both frictions, each divided by a number."""
        alike = 2.0 * _ALIKE * self.shared[0] * self.shared[1] / (now * healthy)
        whole = (self.now[1] / now) ** 2 + (self.healthy[1] / healthy) ** 2
        return math.sqrt(max(whole - alike, 0.0))


def carried(
    parameters: Mapping[str, Parameter],
    speed: float,
    to: SlidingFriction,
    numbers: Mapping[str, Measured] = _NOTHING,
    far: bool = False,
) -> SlidingFriction | None:
    """Carry the sliding friction of a result to the speed of another.

    Near the speed of the record, the exponent of the friction curve in `numbers` gives the change
    of friction. Farther away, F_v gives the growth with speed as far as it is known, and a prior
    gives the fall (`_USUAL_FALL`). The more precise of the two is combined with the prior of the
    exponent (`_USUAL_EXPONENT`). The interval widens with the distance of the speeds.

    Returns None where no sliding friction is above zero, or the speeds are too far apart: the
    half width of the step, as a logarithm, exceeds `_WIDEST_STEP`. If `far`, the interval then
    includes all that the speeds may explain (`_farthest_step`).
    """
    sliding = parameters.get(SLIDING)
    if sliding is None or not (sliding.value > 0 and sliding.half_width >= 0 and speed > 0):
        return None
    sliding = sliding.without_calibration
    if speed == to.speed:
        return SlidingFriction(sliding.value, sliding.half_width, speed)
    viscous, largest = _viscous_of(parameters), sliding.value / speed
    apart = math.log(to.speed / speed)
    shares = _viscous_shares(viscous, largest)
    step, doubt = _step(apart, shares, numbers.get(SPEED_EXPONENT))
    if doubt > _WIDEST_STEP:
        if not far:
            return None
        step, doubt = _farthest_step(apart, viscous, largest)
    value = sliding.value * math.exp(step)
    share = math.hypot(sliding.half_width / sliding.value, doubt)
    return SlidingFriction(value, share * value, to.speed)


def _viscous_of(parameters: Mapping[str, Parameter]) -> Parameter | None:
    """Return F_v; None where the record does not separate it from a spring (`SURE_SPRING`)."""
    spring = parameters.get("spring_constant")
    if spring is not None and spring.verdict is not Verdict.FIXED:
        one = spring.without_calibration
        if not one.half_width <= SURE_SPRING * one.value:
            return None
    return parameters.get("viscous_friction")


def _viscous_shares(viscous: Parameter | None, largest: float) -> tuple[float, float]:
    """Return the least and the largest viscous share of friction; `largest` is F/v."""
    if viscous is None:
        return 0.0, 1.0
    one = viscous.without_calibration
    value, width = one.withheld if math.isnan(one.value) else (one.value, one.half_width)
    if not width >= 0:
        return 0.0, 1.0
    low, high = (min(max(end / largest, 0.0), 1.0) for end in (value - width, value + width))
    return low, high


def _step(
    apart: float, viscous_shares: tuple[float, float], exponent: Measured | None
) -> tuple[float, float]:
    """Return the change of the logarithm of friction over a change of ln v, and its ± 95 %."""
    low, high = sorted(math.log1p(share * math.expm1(apart)) for share in viscous_shares)
    stretch = -math.expm1(-abs(apart))
    found = 0.5 * (low + high) - math.copysign(_USUAL_FALL * stretch, apart)
    doubt = math.hypot(0.5 * (high - low), NORMAL_QUANTILE * _FALL_SPREAD * stretch)
    if exponent is not None:
        bend = NORMAL_QUANTILE * _BEND_SPREAD * apart**2
        near = math.hypot(exponent.half_width * apart, bend)
        if near < doubt:
            found, doubt = exponent.value * apart + _USUAL_BEND * apart**2, near
    spread = NORMAL_QUANTILE * _EXPONENT_SPREAD * abs(apart)
    both = math.hypot(doubt, spread)
    weight = (spread / both) ** 2
    mean = weight * found + (1.0 - weight) * _USUAL_EXPONENT * apart
    return mean, doubt * spread / both


def _farthest_step(apart: float, viscous: Parameter | None, largest: float) -> tuple[float, float]:
    """Return the change of the logarithm of friction over any change of ln v, between its bounds.

    Nothing usual narrows them, and F_v only where it is identified: a weak one holds for the speeds
    of its record, whose lag or creep it may be.
    """
    if viscous is not None and viscous.without_calibration.verdict is not Verdict.IDENTIFIED:
        viscous = None
    low, high = sorted(
        math.log1p(share * math.expm1(apart)) for share in _viscous_shares(viscous, largest)
    )
    fall, spread = math.copysign(_USUAL_FALL, apart), NORMAL_QUANTILE * _FALL_SPREAD
    stretch = -math.expm1(-abs(apart))
    return 0.5 * (low + high) - fall * stretch, 0.5 * (high - low) + spread * stretch


def compared(
    parameters: Mapping[str, Parameter],
    speed: float,
    baseline: Baseline,
    numbers: Mapping[str, Measured] = _NOTHING,
) -> Comparison | None:
    """Compare the friction of a result with its baseline, by the more conclusive friction.

    The sliding friction is carried to the speed of the baseline (`carried`). F_c is compared where
    that is not possible. Where both are comparable, F_c qualifies only if it is identified and has
    not clearly changed by more newtons than the sliding friction: an exchange between F_c and F_v
    is not a change of friction. The friction that has clearly changed more decides. If neither
    has clearly changed, the better known decides. A lag between the signals changes the sliding
    friction but not F_c, and the viscous part hides growth of F_c.

    Both sides leave out the uncertainties of area and sensor scales: the same area and sensors
    scale both frictions, and a common scale cancels in the ratio. After a new calibration, set the
    baseline again.

    Sliding frictions at speeds too far apart (`carried`) are compared only where their ratio
    clearly differs from 1: the interval includes all that the speeds may explain.

    Parameters
    ----------
    parameters : mapping of str to Parameter
        Parameters of the result.
    speed : float
        Its `Result.sliding_speed`, m/s.
    baseline : Baseline
        Friction of the healthy valve.
    numbers : mapping of str to Measured, optional
        Further numbers of the valve from the result (`valve_numbers`).

    Returns
    -------
    Comparison or None
        None where result and baseline have no comparable friction.
    """
    by_sliding = by_coulomb = None
    if baseline.sliding is not None:
        healthy = baseline.sliding
        known = carried(parameters, speed, healthy, numbers)
        now = known or carried(parameters, speed, healthy, numbers, far=True)
        if now is not None:
            shared, healthy_shared = _shared(numbers, baseline.numbers, speed / healthy.speed)
            by_sliding = Comparison(
                (now.value, now.half_width),
                (healthy.value, healthy.half_width),
                SLIDING,
                healthy.speed,
                (min(shared, now.half_width), min(healthy_shared, healthy.half_width)),
            )
            if known is None and by_sliding.ratio.change == 0.0:
                by_sliding = None
    coulomb = parameters[_COULOMB].without_calibration
    if baseline.coulomb_friction is not None and coulomb.value >= 0:
        by_coulomb = Comparison(
            (coulomb.value, coulomb.half_width), (baseline.coulomb_friction, baseline.half_width)
        )
    if by_sliding is None or by_coulomb is None:
        return by_sliding or by_coulomb
    if coulomb.verdict is not Verdict.IDENTIFIED or _exchanged(by_coulomb, by_sliding):
        return by_sliding
    return max(by_sliding, by_coulomb, key=lambda one: (abs(one.ratio.change), -one.share))


def _shared(
    now: Mapping[str, Measured], healthy: Mapping[str, Measured], speeds: float
) -> tuple[float, float]:
    """Return the common parts of both half widths, N: the force of a lag grows with speed."""
    if not (SHARED in now and SHARED in healthy):
        return 0.0, 0.0
    return now[SHARED].value / speeds, healthy[SHARED].value


def _exchanged(coulomb: Comparison, sliding: Comparison) -> bool:
    """Return whether F_c clearly moved by more newtons than the sliding friction."""
    change, width = coulomb.excess
    limit, doubt = sliding.excess
    way = math.copysign(1.0, change)
    return way * (change - limit) > math.hypot(width, doubt)
