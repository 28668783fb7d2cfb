# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A number with its interval: one type for numbers, changes and ratios, dated or not."""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeVar

_Kind = TypeVar("_Kind", bound="Measured")


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
        Ends of the interval, which need not lie evenly around the value: that of a ratio is
        symmetric in the logarithm (`between`). By default value less and plus half width.
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
        """Return a number by the ends of its interval."""
        return cls(value, 0.5 * (high - low), low, high, **more)

    @property
    def share(self) -> float:
        """Half width over the magnitude of the value; infinite for zero."""
        return self.half_width / abs(self.value) if self.value else math.inf

    @property
    def interval(self) -> tuple[float, float, float]:
        """Value, low and high, as a statement has them."""
        return self.value, self.low, self.high

    def agrees_with(self, other: "Measured") -> bool:
        """Return whether the two intervals have a part in common."""
        return self.low <= other.high and other.low <= self.high

    def holds(self, value: float) -> bool:
        """Return whether a value lies in the interval."""
        return self.low <= value <= self.high

    def beyond(self, low: float, high: float) -> int:
        """Return 1 where the whole interval lies above `high`, −1 below `low`, else 0."""
        return int(self.low > high) - int(self.high < low)

    def times(self, factor: float) -> "Measured":
        """Return the number in another unit; a negative factor turns the interval round."""
        low, high = sorted((factor * self.low, factor * self.high))
        return Measured.between(factor * self.value, low, high)


class DatedNumber(NamedTuple):
    """A number and when it was identified.

    Attributes
    ----------
    time : int
        When, ns since 1970 (UTC).
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
