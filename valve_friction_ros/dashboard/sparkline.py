"""The trend of a ratio as a small picture: the path of an SVG of 100 × 24 units."""

import math
from collections import defaultdict
from collections.abc import Sequence
from statistics import fmean, median
from typing import NamedTuple

from valve_friction_ros.streams import DAY

__all__ = ["Sparkline", "sparkline"]

_POINTS = 40
_TOP, _BOTTOM = 2.0, 22.0


class Sparkline(NamedTuple):
    """Paths of an SVG: the ratios over time, and a line at 1; and the days that they span."""

    path: str
    base: str
    days: int


def sparkline(times: Sequence[int], ratios: Sequence[float]) -> Sparkline | None:
    """Draw ratios over their times, ns; None for fewer than two of them.

    The height is logarithmic and spans a factor of 1.6 at least, so that noise looks small. Many
    points are combined to `_POINTS` by the median.
    """
    found = sorted((t, math.log(r)) for t, r in zip(times, ratios, strict=True) if 0 < r < math.inf)
    if len(found) < 2:
        return None
    begin = found[0][0]
    span = found[-1][0] - begin or 1
    places: defaultdict[int, list[tuple[int, float]]] = defaultdict(list)
    for time, height in found:
        places[min((time - begin) * _POINTS // span, _POINTS - 1)].append((time, height))
    points = [
        (fmean(t for t, _ in some) - begin, median(y for _, y in some)) for some in places.values()
    ]
    low = min(0.0, *(y for _, y in points))
    high = max(0.0, *(y for _, y in points))
    spare = max(0.0, math.log(1.6) - (high - low)) / 2
    low, high = low - spare, high + spare

    def at(y: float) -> float:
        return round(_BOTTOM - (y - low) / (high - low) * (_BOTTOM - _TOP), 1)

    steps = [f"{100 * t / span:.1f} {at(y)}" for t, y in points]
    return Sparkline(f"M{'L'.join(steps)}", f"M0 {at(0.0)}L100 {at(0.0)}", round(span / DAY))
