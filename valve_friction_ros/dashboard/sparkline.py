"""The trend of a ratio as a small picture: the path of an SVG of 100 × 24 units."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

__all__ = ["Sparkline", "sparkline"]

_POINTS = 40
_TOP, _BOTTOM = 2.0, 22.0
_DAY = 86_400_000_000_000


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
    time, ratio = np.asarray(times, dtype=np.float64), np.asarray(ratios, dtype=np.float64)
    good = np.isfinite(ratio) & (ratio > 0)
    time, height = time[good], np.log(ratio[good])
    if time.size < 2:
        return None
    span = time.max() - time.min() or 1.0
    place = np.minimum((time - time.min()) / span * _POINTS, _POINTS - 1).astype(np.int64)
    points = [
        (float(time[place == one].mean()), float(np.median(height[place == one])))
        for one in np.unique(place)
    ]
    low = min(0.0, *(y for _, y in points))
    high = max(0.0, *(y for _, y in points))
    spare = max(0.0, math.log(1.6) - (high - low)) / 2
    low, high = low - spare, high + spare

    def at(y: float) -> float:
        return round(_BOTTOM - (y - low) / (high - low) * (_BOTTOM - _TOP), 1)

    steps = [f"{100 * (t - time.min()) / span:.1f} {at(y)}" for t, y in points]
    return Sparkline(f"M{'L'.join(steps)}", f"M0 {at(0.0)}L100 {at(0.0)}", round(span / _DAY))
