# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Numbers with intervals, their dates, and their changes from the baseline."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeVar

from valve_friction_ros.model.checks import equal_by_fields

_Kind = TypeVar("_Kind", bound="Measured")


@equal_by_fields
@dataclass(frozen=True)
class Measured:
    """A number with its 95 % interval, SI unit.

    Attributes
    ----------
    value : float
        The number.
    half_width : float
        Half the width of its interval.
    low, high : float
        Ends of the interval, by default value ± half width. They may be asymmetric: the interval of
        a ratio is symmetric in the logarithm (`between`).
    """

    value: float
    half_width: float = field(default=math.nan, compare=False)
    low: float = math.nan
    high: float = math.nan

    def __post_init__(self) -> None:
        """Compute the ends of the interval where they are not given."""
        if math.isnan(self.low) and not math.isnan(self.half_width):
            object.__setattr__(self, "low", self.value - self.half_width)
            object.__setattr__(self, "high", self.value + self.half_width)

    @classmethod
    def between(cls: type[_Kind], value: float, low: float, high: float, **more: Any) -> _Kind:
        """Return a number from its value and the ends of its interval."""
        return cls(value, 0.5 * (high - low), low, high, **more)

    @property
    def share(self) -> float:
        """Half width over the magnitude of the value; infinite for zero."""
        return self.half_width / abs(self.value) if self.value else math.inf

    @property
    def interval(self) -> tuple[float, float, float]:
        """Value, low and high, as used in statements."""
        return self.value, self.low, self.high

    def agrees_with(self, other: "Measured") -> bool:
        """Return whether the two intervals overlap."""
        return self.low <= other.high and other.low <= self.high

    def holds(self, value: float) -> bool:
        """Return whether a value lies in the interval."""
        return self.low <= value <= self.high

    def beyond(self, low: float, high: float) -> int:
        """Return 1 where the whole interval lies above `high`, −1 below `low`, else 0."""
        return int(self.low > high) - int(self.high < low)

    def times(self, factor: float) -> "Measured":
        """Return the number times a factor; a negative factor swaps the ends of the interval."""
        low, high = sorted((factor * self.low, factor * self.high))
        return Measured.between(factor * self.value, low, high)


class DatedNumber(NamedTuple):
    """A number with the time of its identification.

    Attributes
    ----------
    time : int
        Time, ns since 1970 (UTC).
    value, half_width : float
        Number, and half the width of its 95 % interval, SI unit.
    """

    time: int
    value: float
    half_width: float

    @property
    def number(self) -> Measured:
        """The number without its date."""
        return Measured(self.value, self.half_width)


RATIOS = (
    "spring_constant",
    "coulomb_friction",
    "static_friction",
    "viscous_friction",
    "drive_noise",
    "stem_noise",
)
"""Numbers compared by their ratio; they are above zero."""

DIFFERENCES = {
    "spring_preload": "N",
    "slip_force": "N",
    "viscous_asymmetry": "1",
    "lower_stop": "m",
    "upper_stop": "m",
    "lag": "s",
}
"""Numbers compared by their difference, with their units."""


def ratio_of(now: Measured, healthy: Measured) -> Measured | None:
    """Return a number over its baseline; None unless both are above zero.

    The relative half widths of independent measurements add in squares, and the interval is
    symmetric in the logarithm. Where the interval of either number reaches zero, the interval of
    the ratio holds all quotients of the two intervals.
    """
    if not (now.value > 0 and healthy.value > 0):
        return None
    ratio, spread = now.value / healthy.value, math.hypot(now.share, healthy.share)
    if max(now.share, healthy.share) >= 1.0:
        least, healthy_least = (max(one.value - one.half_width, 0.0) for one in (now, healthy))
        low = least / (healthy.value + healthy.half_width)
        most = now.value + now.half_width
        return Measured.between(ratio, low, most / healthy_least if healthy_least else math.inf)
    return Measured.between(ratio, ratio * math.exp(-spread), ratio * math.exp(spread))


def difference(now: Measured, healthy: Measured) -> Measured:
    """Return a number less its baseline; independent half widths add in squares."""
    value, width = now.value - healthy.value, math.hypot(now.half_width, healthy.half_width)
    return Measured(value, width)


def valve_changes(
    now: Mapping[str, Measured], healthy: Mapping[str, Measured]
) -> dict[str, Measured]:
    """Return the changes of the common numbers by name, as in `RATIOS` and `DIFFERENCES`."""
    both = now.keys() & healthy.keys()
    changes = {name: ratio_of(now[name], healthy[name]) for name in RATIOS if name in both}
    found = {name: change for name, change in changes.items() if change is not None}
    return found | {
        name: difference(now[name], healthy[name]) for name in DIFFERENCES if name in both
    }
