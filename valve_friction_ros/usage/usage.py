"""What a valve has done: distance, reversals, breakaways, and the time at each travel."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from valve_friction_ros.model.checks import require_non_negative

__all__ = ["BINS", "Usage", "total"]

BINS = 20
"""Bins of the histogram: 5 % of the travel each."""


@dataclass(frozen=True)
class Usage:
    """What a valve has done while it was watched; two of them add up.

    Attributes
    ----------
    distance : float
        Travelled distance, m: the sum of the strokes between reversals, each longer than the
        counting dead band.
    reversals : int
        Changes of direction that were followed by a stroke beyond the counting dead band.
    breakaways : int
        Starts of the stem after a rest of a whole second of the stamps (`Breakaways`).
    histogram : tuple of int
        Time at each 5 % of the travel, ns, from position 0 upwards; the first and the last hold
        what lies beyond the stops, too.

    Raises
    ------
    ValueError
        If a number is negative or not finite, or the histogram has not `BINS` bins.
    """

    distance: float = 0.0
    reversals: int = 0
    breakaways: int = 0
    histogram: tuple[int, ...] = (0,) * BINS

    def __post_init__(self) -> None:
        """Refuse impossible numbers."""
        for name in ("distance", "reversals", "breakaways"):
            require_non_negative(name, getattr(self, name))
        if len(self.histogram) != BINS or min(self.histogram) < 0:
            raise ValueError(f"the histogram must have {BINS} times of at least 0 ns")

    def __add__(self, other: "Usage") -> "Usage":
        """Add up two usages."""
        return Usage(
            self.distance + other.distance,
            self.reversals + other.reversals,
            self.breakaways + other.breakaways,
            tuple(map(sum, zip(self.histogram, other.histogram, strict=True))),
        )

    @property
    def time_watched(self) -> int:
        """Time in which the valve was watched, ns: the sum of the histogram."""
        return sum(self.histogram)

    def strokes(self, travel: float) -> float:
        """Return the distance in full strokes of a `travel`, m; nan for a machine without stops."""
        return self.distance / travel if math.isfinite(travel) else math.nan

    def time_near_seat(self, seat_is_at_travel: bool = False) -> int:
        """Return the time within 5 % of the travel from the seat, ns.

        The seat is at position 0 (air to open), or at the travel (air to close).
        """
        return self.histogram[-1 if seat_is_at_travel else 0]

    def to_dict(self) -> dict[str, Any]:
        """Return a mapping of plain values: m, numbers and seconds."""
        return {
            "distance": self.distance,
            "reversals": self.reversals,
            "breakaways": self.breakaways,
            "time_watched": self.time_watched / 1e9,
            "histogram": [time / 1e9 for time in self.histogram],
        }


def total(usages: Iterable[Usage]) -> Usage:
    """Add up any number of usages."""
    return sum(usages, Usage())
