"""Limits of the usage of a packing, and when they are expected to be reached."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from valve_friction_ros.model.checks import require_non_negative
from valve_friction_ros.streams import DAY, utc_day
from valve_friction_ros.usage.usage import Usage
from valve_friction_ros.usage.valve_usage import Pace, ValveUsage

__all__ = ["LEAD", "LimitState", "UsageLimits", "limit_states", "warned_limits"]

LEAD = 30 * DAY
"""Time before the expected date from which a limit warns, ns. Chosen: a packing can be ordered and
its renewal planned."""
_DOUBT = 2 * DAY
"""Time, ns, by which a date may have receded by the end of the day on which it warned."""
_END_OF_TIME = 2**63 - 1


@dataclass(frozen=True)
class UsageLimits:
    """Limits of the usage since the packing was renewed; 0: no limit.

    Attributes
    ----------
    travel : float
        Travelled distance, m.
    reversals : float
        Reversals.
    """

    travel: float = 0.0
    reversals: float = 0.0

    def __post_init__(self) -> None:
        """Refuse negative limits."""
        require_non_negative("travel_limit", self.travel)
        require_non_negative("reversal_limit", self.reversals)


class LimitState(NamedTuple):
    """How far a packing is from a limit.

    Attributes
    ----------
    name : str
        Name of the limit's parameter.
    used, limit : float
        Usage since the packing was renewed, and the limit: m, or reversals.
    expected : int or None
        When the limit is expected at the pace of the last days, if the valve is watched all the
        time, ns since 1970 (UTC); None where it is reached, the pace is not known, or no date of
        the calendar.
    now : int
        Time of this state, ns.
    has_warned : bool
        Whether it has warned before: while a valve rests, the expected date recedes.
    """

    name: str
    used: float
    limit: float
    expected: int | None
    now: int
    has_warned: bool = False

    @property
    def is_reached(self) -> bool:
        """Whether the limit is reached."""
        return self.used >= self.limit

    @property
    def warns(self) -> bool:
        """Whether the limit is reached, expected within `LEAD`, or was so before."""
        return self.is_reached or self.has_warned or self.is_expected_within(LEAD)

    def is_expected_within(self, lead: int) -> bool:
        """Return whether it is expected within a time, ns."""
        return self.expected is not None and self.expected - self.now <= lead

    @property
    def message(self) -> str:
        """One sentence: the figures, the date, and what to do."""
        figures = (
            f"{self.used:.4g} m of travel"
            if self.name == "travel_limit"
            else f"{self.used:.0f} reversals"
        )
        state = ", near its limit (warned before)"
        if self.is_reached:
            state = ": reached"
        elif self.expected is not None:
            state = f", expected on {utc_day(self.expected)}"
        return (
            f"packing life: {figures} of {self.limit:.6g} ({self.name}){state}: renew the packing, "
            "then call ~/reset_usage"
        )


def limit_states(
    used: Usage, pace: Pace | None, limits: UsageLimits, now: int
) -> tuple[LimitState, ...]:
    """Compare the usage since the renewal with each limit that is given, at the time `now`, ns."""
    found = []
    for name, value, limit, daily in (
        ("travel_limit", used.distance, limits.travel, pace and pace.distance),
        ("reversal_limit", float(used.reversals), limits.reversals, pace and pace.reversals),
    ):
        if limit > 0:
            days = (limit - value) / daily if daily else math.inf
            date = now + days * DAY
            expected = round(date) if value < limit and date < _END_OF_TIME else None
            found.append(LimitState(name, value, limit, expected, now))
    return tuple(found)


def warned_limits(usage: ValveUsage, limits: UsageLimits) -> set[str]:
    """Return the names of the limits that have warned on a day of the packing in use.

    A day tells its usage as a whole, so a limit that was to warn within two days counts too.
    """
    days = [one for one in usage.days if one.renewal == usage.renewal]
    found: set[str] = set()
    for count, last in enumerate(days, 1):
        then = ValveUsage(tuple(days[:count]), usage.renewal)
        states = limit_states(then.since_renewal, then.pace(), limits, (last.day + 1) * DAY)
        found |= {
            one.name for one in states if one.is_reached or one.is_expected_within(LEAD + _DOUBT)
        }
    return found
