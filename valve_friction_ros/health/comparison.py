# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""How far the friction of a valve has moved away from its baseline, at equal speeds.

Two records of the same sensors share what the record does not say of the lag between the signals:
both frictions are then wrong alike, and their ratio is known better than either.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

from valve_friction_ros.health.baseline import Baseline, SlidingFriction
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.valve_numbers import SHARED
from valve_friction_ros.identification import SLIDING, SPEED_EXPONENT, Parameter, Verdict
from valve_friction_ros.identification.trust.uncertainty import NORMAL_QUANTILE
from valve_friction_ros.wording import Code, Statement, said, sentence

_ALIKE = 0.9
"""Correlation of what the lag does to two records: the same sensors, clocks and tubing, which may
have changed a little. Chosen."""

_USUAL_EXPONENT, _EXPONENT_SPREAD = 0.3, 0.4
"""Mean and standard deviation of p where friction grows as the power p of the speed: Coulomb
friction alone has 0, viscous friction alone 1, and friction that falls with the speed less."""

_USUAL_FALL, _FALL_SPREAD = 0.16, 0.12
"""Mean and standard deviation of the share of friction that a speed without limit takes from it.

Of a packing that slips exp(-(v/v_s)²) falls, between two speeds of which one is s times the other,
by 1 - 1/s at most, to within 0.05. These four are chosen so that of drawn packings, of which half
slip (F_s 1.15 to 2 F_c, v_s 0.3 to 5 mm/s, F_v·v 0.1 to 3 F_c), 90 to 98 % are inside."""

_USUAL_BEND, _BEND_SPREAD = 0.06, 0.12
"""Mean and standard deviation of what the square of the logarithm of two speeds' ratio adds to the
power law whose exponent is that of the friction at one of them: of the same packings 95 % are
between -0.13 and 0.32."""

_WIDEST_STEP = math.log(1.5)
"""Half width of the step from one speed to the other beyond which nothing is compared.

A friction that may differ by half for its speed alone says little, and what it says is what is
usual. Chosen."""

_NOTHING: Mapping[str, Measured] = MappingProxyType({})
_COULOMB = "coulomb_friction"


def friction_name(name: str, speed: float) -> Statement:
    """Return the name of a friction, with the speed, m/s, that a sliding friction belongs to."""
    if name == SLIDING:
        return said(Code.FRICTION_AT, of=name, speed=speed)
    return said(Code.FRICTION, of=name)


@dataclass(frozen=True)
class Ratio(Measured):
    """A friction now over that of the baseline.

    Attributes
    ----------
    of : str
        The friction that is compared: ``sliding_friction`` or ``coulomb_friction``.
    speed : float
        Speed at which sliding frictions are compared, that of the baseline, m/s; else nan.
    """

    of: str = _COULOMB
    speed: float = math.nan

    @property
    def friction(self) -> Statement:
        """The friction that is compared."""
        return friction_name(self.of, self.speed)

    @property
    def what(self) -> str:
        """What is compared, in words."""
        return sentence(self.friction)

    @property
    def change(self) -> float:
        """Distance of the interval from 1, as a logarithm; 0 where it holds 1, or has no ends."""
        if not self.low > 0:
            return 0.0
        return max(math.log(self.low), 0.0) + min(math.log(self.high), 0.0)


class Comparison(NamedTuple):
    """A friction and that of the baseline, N, each with half the width of its 95 % interval.

    The intervals are those without calibration; `shared` are the parts of both half widths by
    which the two are wrong alike.
    """

    now: tuple[float, float]
    healthy: tuple[float, float]
    of: str = _COULOMB
    speed: float = math.nan
    shared: tuple[float, float] = (0.0, 0.0)

    @property
    def ratio(self) -> Ratio:
        """Ratio of the two.

        The relative half widths of two independent estimates add in squares, and the interval is
        symmetric in the logarithm, so that a ratio and its inverse have the same interval.
        """
        ratio = self.now[0] / self.healthy[0]
        if not ratio > 0:
            return Ratio(ratio, of=self.of, speed=self.speed)
        low, high = ratio * math.exp(-self.share), ratio * math.exp(self.share)
        return Ratio.between(ratio, low, high, of=self.of, speed=self.speed)

    @property
    def share(self) -> float:
        """Half the width of the interval of the ratio's logarithm."""
        values = (self.now[0], self.healthy[0])
        return self._apart(*values)

    @property
    def excess(self) -> tuple[float, float]:
        """Friction now less that of the baseline, N, and half the width of its interval."""
        return self.now[0] - self.healthy[0], self._apart(1.0, 1.0)

    def _apart(self, now: float, healthy: float) -> float:
        """Return the half width of the difference of both, each over a number."""
        alike = 2.0 * _ALIKE * self.shared[0] * self.shared[1] / (now * healthy)
        whole = (self.now[1] / now) ** 2 + (self.healthy[1] / healthy) ** 2
        return math.sqrt(max(whole - alike, 0.0))


def carried(
    parameters: Mapping[str, Parameter],
    speed: float,
    to: SlidingFriction,
    numbers: Mapping[str, Measured] = _NOTHING,
) -> SlidingFriction | None:
    """Carry the sliding friction of a result to the speed of another one.

    The exponent of the friction curve at the speed of the record, which is among the `numbers` of
    the valve, says how friction changes near it. Farther away F_v, as far as it is known, says by
    how much friction grows with the speed; by how much it also falls, nobody knows (`_USUAL_FALL`).
    The one that knows more is joined with what is usual (`_USUAL_EXPONENT`). The farther the
    speeds are apart, the wider the interval.

    Returns None where there is no sliding friction above zero, or the speeds are so far apart that
    too little is known between them (`_WIDEST_STEP`).
    """
    sliding = parameters.get(SLIDING)
    if sliding is None or not (sliding.value > 0 and sliding.half_width >= 0 and speed > 0):
        return None
    sliding = sliding.without_calibration
    if speed == to.speed:
        return SlidingFriction(sliding.value, sliding.half_width, speed)
    shares = _viscous_shares(parameters.get("viscous_friction"), sliding.value / speed)
    step, doubt = _step(math.log(to.speed / speed), shares, numbers.get(SPEED_EXPONENT))
    if doubt > _WIDEST_STEP:
        return None
    value = sliding.value * math.exp(step)
    share = math.hypot(sliding.half_width / sliding.value, doubt)
    return SlidingFriction(value, share * value, to.speed)


def _viscous_shares(viscous: Parameter | None, largest: float) -> tuple[float, float]:
    """Return the least and the largest share of friction that is viscous, of `largest` = F/v."""
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
    """Return by how much the logarithm of friction changes over that of the speed, and ± 95 %."""
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


def compared(
    parameters: Mapping[str, Parameter],
    speed: float,
    baseline: Baseline,
    numbers: Mapping[str, Measured] = _NOTHING,
) -> Comparison | None:
    """Compare the friction of a result with its baseline, by the number that says more.

    The sliding friction is carried to the speed of the baseline (`carried`). F_c is compared where
    there is no such pair. Where both can be, F_c counts only if it is identified, and has not
    changed by more newtons than the sliding friction can have: what F_c gains from F_v, or loses to
    it, is no change of friction. Then the one counts that has surely changed further, or, where
    neither has surely changed, the one known better: a lag between the signals changes the sliding
    friction and not F_c, and the viscous part hides the growth of F_c.

    The uncertainties of area and sensor scales are left out of both sides: the same area and
    sensors scale both frictions alike, and a common scale cancels in the ratio. After a new
    calibration the baseline must be set anew.

    Parameters
    ----------
    parameters : mapping of str to Parameter
        Parameters of the result.
    speed : float
        Its `Result.sliding_speed`, m/s.
    baseline : Baseline
        Friction of the healthy valve.
    numbers : mapping of str to Measured, optional
        What else the result says of its valve (`valve_numbers`).

    Returns
    -------
    Comparison or None
        None where the result has no friction that the baseline has.
    """
    by_sliding = by_coulomb = None
    if baseline.sliding is not None:
        healthy = baseline.sliding
        now = carried(parameters, speed, healthy, numbers)
        if now is not None:
            shared, healthy_shared = _shared(numbers, baseline.numbers, speed / healthy.speed)
            by_sliding = Comparison(
                (now.value, now.half_width),
                (healthy.value, healthy.half_width),
                SLIDING,
                healthy.speed,
                (min(shared, now.half_width), min(healthy_shared, healthy.half_width)),
            )
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
    """Return what both half widths share, N: a lag is a force that grows with the speed."""
    if not (SHARED in now and SHARED in healthy):
        return 0.0, 0.0
    return now[SHARED].value / speeds, healthy[SHARED].value


def _exchanged(coulomb: Comparison, sliding: Comparison) -> bool:
    """Return whether F_c has surely changed by more newtons than the sliding friction, one way."""
    change, width = coulomb.excess
    limit, doubt = sliding.excess
    way = math.copysign(1.0, change)
    return way * (change - limit) > math.hypot(width, doubt)
