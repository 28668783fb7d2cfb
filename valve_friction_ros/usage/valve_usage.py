"""The usage of a valve: day by day, since its packing was renewed, and in all."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

from valve_friction_ros.streams import DAY
from valve_friction_ros.usage.usage import Usage, total

__all__ = ["DAY", "Pace", "UsedDay", "ValveUsage"]

_PACE_DAYS = 14
"""Last days with samples from which the pace is taken. Chosen: two weeks of work and rest."""
_KEPT_DAYS = 31
_LEAST_WATCHED = DAY
"""Least time watched, ns, for a pace. Chosen: a day holds what recurs in a day."""


class UsedDay(NamedTuple):
    """Usage of one day.

    Attributes
    ----------
    day : int
        Days since 1970 (UTC), by the stamps.
    renewal : int
        When the packing in use was renewed, ns since 1970 (UTC); 0: not known.
    usage : Usage
        What the valve did.
    """

    day: int
    renewal: int
    usage: Usage


class Pace(NamedTuple):
    """Usage of a day of watching: distance, m, and reversals."""

    distance: float
    reversals: float


@dataclass(frozen=True)
class ValveUsage:
    """The usage of a valve.

    Attributes
    ----------
    days : tuple of UsedDay
        Oldest packing first, then by days; each pair of renewal and day once.
    renewal : int
        When the packing was renewed last, ns since 1970 (UTC); 0: not known.
    """

    days: tuple[UsedDay, ...] = ()
    renewal: int = 0

    @classmethod
    def of(cls, days: Iterable[UsedDay], renewal: int = 0) -> "ValveUsage":
        """Bring days into their order, and add up those that occur more than once."""
        found: dict[tuple[int, int], Usage] = {}
        for one in days:
            key = one.renewal, one.day
            found[key] = found[key] + one.usage if key in found else one.usage
        sums = (UsedDay(day, since, found[since, day]) for since, day in sorted(found))
        return cls(tuple(sums), renewal)

    @property
    def total(self) -> Usage:
        """Usage in all."""
        return total(one.usage for one in self.days)

    @property
    def since_renewal(self) -> Usage:
        """Usage since the packing was renewed last; in all, where no renewal is known."""
        return total(one.usage for one in self._of_this_packing())

    def pace(self) -> Pace | None:
        """Return the usage of a day of watching, over the last days of this packing.

        None before the valve has been watched for a day.
        """
        recent = total(one.usage for one in self._of_this_packing()[-_PACE_DAYS:])
        if recent.time_watched < _LEAST_WATCHED:
            return None
        share = DAY / recent.time_watched
        return Pace(recent.distance * share, recent.reversals * share)

    def condensed(self) -> "ValveUsage":
        """Return the same usage with at most 31 single days, of this packing; the rest as sums."""
        recent = set(self._of_this_packing()[-_KEPT_DAYS:])
        sums: dict[int, UsedDay] = {}
        for one in self.days:
            if one not in recent:
                before = sums.get(one.renewal, UsedDay(one.day, one.renewal, Usage()))
                sums[one.renewal] = UsedDay(one.day, one.renewal, before.usage + one.usage)
        return ValveUsage.of((*sums.values(), *recent), self.renewal)

    def _of_this_packing(self) -> tuple[UsedDay, ...]:
        return tuple(one for one in self.days if one.renewal == self.renewal)

    def to_dict(self) -> dict[str, Any]:
        """Return a mapping of plain values: m, numbers, seconds; times are ns since 1970 (UTC)."""
        pace = self.pace()
        return {
            "renewal": self.renewal or None,
            "since_renewal": self.since_renewal.to_dict(),
            "total": self.total.to_dict(),
            "pace": None if pace is None else pace._asdict(),
            "days": [
                {"day": one.day * DAY, "renewal": one.renewal or None, **one.usage.to_dict()}
                for one in self.days
            ],
        }
