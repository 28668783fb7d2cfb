"""How the friction of a valve drifts, and when it is expected to cross a limit."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.comparison import friction_words
from valve_friction_ros.health.diagnosis import FrictionLimits
from valve_friction_ros.history.entry import FrictionPoint, trended
from valve_friction_ros.history.scattered_line import LEAST_ESTIMATES, ScatteredLine, fit_line
from valve_friction_ros.identification.trust.student import student_quantile
from valve_friction_ros.model.checks import require_non_negative

__all__ = ["MONTH", "Crossing", "Limit", "Trend", "trend_of"]

DAY = 86_400e9
"""Nanoseconds of a day."""

MONTH = 365.25 / 12 * DAY
"""Nanoseconds of a month: a twelfth of the Julian year."""

_NORMAL = 1.959964
"""Standard errors in a half width of a large sample (95 %), so that few strokes weigh less."""

_HORIZON = 2.0
"""Largest distance of a crossing after the last point, in spans of the points.

Chosen: a line is not evidence for a longer time."""

_OUTLIER = 0.001
"""Chance to find an outlier in a history without outliers. Chosen."""

_MOST_OUTLIERS = 0.1
"""Largest share of the days left out as outliers. Chosen: more would be a change, not outliers."""


class Limit(Enum):
    """A bound of the friction, by the name of its ratio."""

    WARN = "warn_ratio"
    ERROR = "error_ratio"
    LOW = "low_ratio"


@dataclass(frozen=True)
class Crossing:
    """When the next limit on the way is expected to be crossed.

    `level` is its friction, N; `earliest` and `latest` are the ends of the 95 % interval of
    the expected time, ns since 1970 (UTC).
    """

    limit: Limit
    level: float
    time: int
    earliest: int
    latest: int


@dataclass(frozen=True)
class Trend:
    """The drift of a friction, a line through the days, N over ns since `begin`.

    `days` go into the line, `outliers` are left out. `begin` and `end` are the first and the last
    estimate, ns since 1970 (UTC). The crossing is None without a significant drift, without a
    baseline, or where it lies too far ahead. `of` names the friction: the sliding friction at
    `speed`, m/s, where the baseline has one, else F_c.
    """

    line: ScatteredLine
    days: int
    outliers: int
    begin: int
    end: int
    crossing: Crossing | None
    of: str = "coulomb_friction"
    speed: float = math.nan

    @property
    def what(self) -> str:
        """What drifts, in words."""
        return friction_words(self.of, self.speed)

    @property
    def drift(self) -> float:
        """Drift, N a month."""
        return self.line.slope * MONTH

    @property
    def half_width(self) -> float:
        """Half the width of its 95 % interval, N a month."""
        return self.line.slope_half_width * MONTH

    @property
    def is_significant(self) -> bool:
        """Return whether the interval of the drift excludes zero."""
        return abs(self.drift) > self.half_width


class _Days(NamedTuple):
    """Times (ns since the first point), frictions and standard errors, a day each."""

    times: NDArray[np.float64]
    values: NDArray[np.float64]
    errors: NDArray[np.float64]

    def without(self, index: int) -> "_Days":
        return _Days(*(np.delete(one, index) for one in self))


def _days(points: Sequence[FrictionPoint]) -> _Days:
    """Combine the points of each day (UTC) to one point: their weighted mean.

    The records of one day may overlap, and share temperature and load.
    """
    times = np.array([point.time for point in points], dtype=np.int64)
    values = np.array([point.value for point in points])
    least = 1e-9 * np.abs(values).max()
    errors = np.maximum(np.array([point.half_width for point in points]) / _NORMAL, least)
    _, day = np.unique(times // int(DAY), return_inverse=True)
    weights = errors**-2
    total = np.bincount(day, weights)
    since_first = (times - times.min()).astype(np.float64)
    means = [np.bincount(day, weights * one) / total for one in (since_first, values)]
    return _Days(means[0], means[1], np.sqrt(1.0 / total))


def _robust_line(days: _Days) -> tuple[ScatteredLine, int]:
    """Fit a line, and leave out outlying days.

    The day with the largest residual is compared with the prediction of the other days. It is left
    out where chance gives such a distance in 0.1 % of histories (Bonferroni).
    """
    line, outliers = fit_line(*days), 0
    for _ in range(int(_MOST_OUTLIERS * days.times.size)):
        residual = np.abs(days.values - line.at(days.times))
        worst = int(np.argmax(residual / np.hypot(days.errors, line.scatter)))
        rest = days.without(worst)
        others = fit_line(*rest)
        time, error = days.times[worst], np.hypot(days.errors[worst], others.scatter)
        predicted = np.hypot(error, others.half_width(time) / others.quantile)
        surprise = abs(days.values[worst] - others.at(time)) / predicted
        if surprise <= student_quantile(1 - _OUTLIER / (2 * days.times.size), others.freedom):
            break
        days, line, outliers = rest, others, outliers + 1
    return line, outliers


def _healthy(baseline: Baseline) -> tuple[float, float]:
    """Friction of the baseline that points are compared with, and half its interval's width, N."""
    if baseline.sliding is not None:
        return baseline.sliding.value, baseline.sliding.half_width
    return baseline.coulomb_friction or math.nan, baseline.half_width


def _crossing(
    line: ScatteredLine, begin: int, end: int, baseline: Baseline, limits: FrictionLimits
) -> Crossing | None:
    """Return when the next limit is crossed, if that is not too far ahead."""
    (friction, half_width), span = _healthy(baseline), end - begin
    now = line.at(span)
    rising = ((Limit.WARN, limits.warn_ratio), (Limit.ERROR, limits.error_ratio))
    ahead = (
        [one for one in rising if one[1] * friction > now]
        if line.slope > 0
        else [(Limit.LOW, limits.low_ratio)]
    )
    if not ahead:
        return None
    limit, ratio = ahead[0]
    crossed = line.crossing(ratio * friction, ratio * half_width / _NORMAL)
    if crossed is None or not span < crossed[0] <= (1 + _HORIZON) * span:
        return None
    return Crossing(limit, ratio * friction, *(begin + round(time) for time in crossed))


def trend_of(
    points: Sequence[FrictionPoint],
    baseline: Baseline | None = None,
    limits: FrictionLimits | None = None,
) -> Trend | None:
    """Estimate the drift of the friction from points since the last work on the packing.

    The points are those of `friction_point` with this baseline.

    The weight of a point follows from its interval and from the scatter between days, which
    `fit_line` estimates. All points of one day count as one point. Outlying days are left out, a
    tenth of all days at most. The baseline and the limits, as ratios to it, give the next crossing.

    Returns None if the points, in any order, lie on fewer than four days. Raises ValueError if a
    half width is negative or not finite.
    """
    if not points:
        return None
    for point in points:
        require_non_negative("half_width", point.half_width)
    days = _days(points)
    if days.times.size < LEAST_ESTIMATES:
        return None
    line, outliers = _robust_line(days)
    begin, end = min(one.time for one in points), max(one.time for one in points)
    crossing = None
    if baseline is not None and abs(line.slope) > line.slope_half_width:
        crossing = _crossing(line, begin, end, baseline, limits or FrictionLimits())
    speed = math.nan if baseline is None or not baseline.sliding else baseline.sliding.speed
    of = trended(baseline)
    return Trend(line, days.times.size - outliers, outliers, begin, end, crossing, of, speed)
