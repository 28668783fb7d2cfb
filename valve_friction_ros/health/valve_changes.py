"""How far the numbers of a valve have moved away from those of its baseline."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from valve_friction_ros.health.measured import Measured

__all__ = ["DIFFERENCES", "RATIOS", "Change", "valve_changes"]

RATIOS = (
    "spring_constant",
    "coulomb_friction",
    "static_friction",
    "viscous_friction",
    "drive_noise",
    "stem_noise",
)
"""Numbers of which the ratio is compared: they are above zero."""

DIFFERENCES = {
    "spring_preload": "N",
    "slip_force": "N",
    "viscous_asymmetry": "1",
    "lower_stop": "m",
    "upper_stop": "m",
    "lag": "s",
}
"""Numbers of which the difference is compared, with their units."""


@dataclass(frozen=True)
class Change:
    """The change of a number, with its 95 % interval: a ratio, or a difference.

    The half widths of two independent measurements add in squares; those of a ratio are shares, and
    its interval is symmetric in the logarithm. Where the interval of a number reaches zero, that of
    the ratio has all quotients of the two intervals.

    Attributes
    ----------
    value, low, high : float
        Number now over that of the baseline (`RATIOS`), or less that (`DIFFERENCES`, SI unit).
    """

    value: float
    low: float
    high: float

    def agrees_with(self, other: "Change") -> bool:
        """Return whether the two intervals have a part in common."""
        return self.low <= other.high and other.low <= self.high

    def holds(self, value: float) -> bool:
        """Return whether a value lies in the interval."""
        return self.low <= value <= self.high

    def beyond(self, low: float, high: float) -> int:
        """Return 1 where the whole interval lies above `high`, −1 below `low`, else 0."""
        return int(self.low > high) - int(self.high < low)

    def times(self, factor: float) -> "Change":
        """Return the change in another unit; a negative factor turns the interval round."""
        low, high = sorted((factor * self.low, factor * self.high))
        return Change(factor * self.value, low, high)


def _ratio(now: Measured, healthy: Measured) -> Change | None:
    if not (now.value > 0 and healthy.value > 0):
        return None
    ratio, spread = now.value / healthy.value, math.hypot(now.share, healthy.share)
    if max(now.share, healthy.share) >= 1.0:
        least, healthy_least = (max(one.value - one.half_width, 0.0) for one in (now, healthy))
        low = least / (healthy.value + healthy.half_width)
        most = now.value + now.half_width
        return Change(ratio, low, most / healthy_least if healthy_least else math.inf)
    return Change(ratio, ratio * math.exp(-spread), ratio * math.exp(spread))


def difference(now: Measured, healthy: Measured) -> Change:
    """Return a number less that of the baseline."""
    value, width = now.value - healthy.value, math.hypot(now.half_width, healthy.half_width)
    return Change(value, value - width, value + width)


def valve_changes(
    now: Mapping[str, Measured], healthy: Mapping[str, Measured]
) -> dict[str, Change]:
    """Return the change of each number that both have, by name: `RATIOS` and `DIFFERENCES`."""
    both = now.keys() & healthy.keys()
    changes = {name: _ratio(now[name], healthy[name]) for name in RATIOS if name in both}
    found = {name: change for name, change in changes.items() if change is not None}
    return found | {
        name: difference(now[name], healthy[name]) for name in DIFFERENCES if name in both
    }
