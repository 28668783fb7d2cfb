"""Limits of the usage of a packing, and when they are expected to be reached."""

import math
from dataclasses import dataclass
from datetime import datetime, timezone
from typing import NamedTuple

from valve_friction_ros.model.checks import require_non_negative
from valve_friction_ros.usage.usage import Usage
from valve_friction_ros.usage.valve_usage import DAY, Pace

__all__ = ["LEAD", "LimitState", "UsageLimits", "limit_states"]

LEAD = 30 * DAY
"""Time before the expected date from which a limit warns, ns. Chosen: a packing can be ordered and
its renewal planned."""
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
    """

    name: str
    used: float
    limit: float
    expected: int | None
    now: int

    @property
    def is_reached(self) -> bool:
        """Whether the limit is reached."""
        return self.used >= self.limit

    @property
    def warns(self) -> bool:
        """Whether the limit is reached, or expected within `LEAD`."""
        return self.is_reached or (self.expected is not None and self.expected - self.now <= LEAD)

    @property
    def message(self) -> str:
        """One sentence: the figures, the date, and what to do."""
        figures = (
            f"{self.used:.4g} m of travel"
            if self.name == "travel_limit"
            else f"{self.used:.0f} reversals"
        )
        state = f"of {self.limit:.6g} ({self.name}): reached"
        if not self.is_reached and self.expected is not None:
            day = datetime.fromtimestamp(self.expected / 1e9, timezone.utc)
            state = f"of {self.limit:.6g} ({self.name}), expected on {day:%Y-%m-%d}"
        return f"packing life: {figures} {state}: renew the packing, then call ~/reset_usage"


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
