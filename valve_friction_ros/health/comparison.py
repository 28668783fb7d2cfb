"""How far the friction of a valve has moved away from its baseline, at equal speeds."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from valve_friction_ros.health.baseline import Baseline, SlidingFriction
from valve_friction_ros.identification import SLIDING, Parameter, Verdict

__all__ = ["LARGEST_SPEED_RATIO", "Comparison", "Ratio", "carried", "compared", "friction_words"]

LARGEST_SPEED_RATIO = 2.0
"""Speed over that of the baseline, or the reverse, up to which sliding frictions are compared.

Between the two speeds friction is taken to change by F_v; over a wider range it may follow another
law, such as the fall of a friction with speed. Chosen."""

_COULOMB = "coulomb_friction"


def friction_words(name: str, speed: float) -> str:
    """Return the name of a friction, with the speed, m/s, that a sliding friction belongs to."""
    words = name.replace("_", " ")
    return f"{words} at {speed * 1e3:.2g} mm/s" if name == SLIDING else words


class Ratio(NamedTuple):
    """A ratio of two frictions with its 95 % interval.

    Attributes
    ----------
    value, low, high : float
        Friction now over that of the baseline.
    of : str
        The friction that is compared: ``sliding_friction`` or ``coulomb_friction``.
    speed : float
        Speed at which sliding frictions are compared, that of the baseline, m/s; else nan.
    """

    value: float
    low: float
    high: float
    of: str = _COULOMB
    speed: float = math.nan

    @property
    def what(self) -> str:
        """What is compared, in words."""
        return friction_words(self.of, self.speed)

    @property
    def change(self) -> float:
        """Distance of the interval from 1, as a logarithm; 0 where it holds 1, or has no ends."""
        if not self.low > 0:
            return 0.0
        return max(math.log(self.low), 0.0) + min(math.log(self.high), 0.0)


class Comparison(NamedTuple):
    """A friction and that of the baseline, N, each with half the width of its 95 % interval.

    The intervals are those without calibration.
    """

    now: tuple[float, float]
    healthy: tuple[float, float]
    of: str = _COULOMB
    speed: float = math.nan

    @property
    def ratio(self) -> Ratio:
        """Ratio of the two.

        The relative half widths of two independent estimates add in squares, and the interval is
        symmetric in the logarithm, so that a ratio and its inverse have the same interval.
        """
        ratio = self.now[0] / self.healthy[0]
        if not ratio > 0:
            return Ratio(ratio, math.nan, math.nan, self.of, self.speed)
        low, high = ratio * math.exp(-self.share), ratio * math.exp(self.share)
        return Ratio(ratio, low, high, self.of, self.speed)

    @property
    def share(self) -> float:
        """Half the width of the interval of the ratio's logarithm."""
        return math.hypot(*(width / value for value, width in (self.now, self.healthy)))

    @property
    def excess(self) -> tuple[float, float]:
        """Friction now less that of the baseline, N, and half the width of its interval."""
        return self.now[0] - self.healthy[0], math.hypot(self.now[1], self.healthy[1])


def carried(
    parameters: Mapping[str, Parameter], speed: float, to: SlidingFriction
) -> SlidingFriction | None:
    """Carry the sliding friction of a result to the speed of another one.

    At the speed v it is F_c + F_v·v, so the step to the other speed changes it by F_v·Δv. The half
    width of F_v widens it by its share; F_v and the friction at the mean speed of a record are
    taken as uncorrelated. Where F_v is not identifiable, it lies between none and all of the
    friction: 0 ≤ F_v ≤ friction/v.

    Returns None where there is no sliding friction above zero, or the speeds differ by more than
    `LARGEST_SPEED_RATIO`.
    """
    sliding, viscous = parameters.get(SLIDING), parameters.get("viscous_friction")
    if sliding is None or not (sliding.value > 0 and sliding.half_width >= 0 and speed > 0):
        return None
    sliding = sliding.without_calibration
    if not 1 / LARGEST_SPEED_RATIO <= to.speed / speed <= LARGEST_SPEED_RATIO:
        return None
    slope = width = 0.5 * sliding.value / speed
    if viscous is not None and viscous.half_width >= 0:
        slope, width = viscous.value, viscous.without_calibration.half_width
    step = to.speed - speed
    value = sliding.value + slope * step
    if not value > 0:
        return None
    return SlidingFriction(value, math.hypot(sliding.half_width, width * step), to.speed)


def compared(
    parameters: Mapping[str, Parameter], speed: float, baseline: Baseline
) -> Comparison | None:
    """Compare the friction of a result with its baseline, by the number that says more.

    The sliding friction is carried to the speed of the baseline; no split of friction into F_c and
    F_v enters it. F_c is compared where there is no such pair. Where both can be, F_c counts only
    if it is identified, and has not changed by more newtons than the sliding friction can have:
    what F_c gains from F_v, or loses to it, is no change of friction. Then the one counts that has
    surely changed further, or, where neither has surely changed, the one known better: a lag
    between the signals changes the sliding friction and not F_c, and the viscous part hides the
    growth of F_c.

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

    Returns
    -------
    Comparison or None
        None where the result has no friction that the baseline has.
    """
    by_sliding = by_coulomb = None
    if baseline.sliding is not None:
        healthy, now = baseline.sliding, carried(parameters, speed, baseline.sliding)
        if now is not None:
            by_sliding = Comparison(
                (now.value, now.half_width),
                (healthy.value, healthy.half_width),
                SLIDING,
                healthy.speed,
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


def _exchanged(coulomb: Comparison, sliding: Comparison) -> bool:
    """Return whether F_c has surely changed by more newtons than the sliding friction, one way."""
    change, width = coulomb.excess
    limit, doubt = sliding.excess
    way = math.copysign(1.0, change)
    return way * (change - limit) > math.hypot(width, doubt)
