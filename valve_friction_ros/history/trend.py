# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""History of a valve as values: the drift of its friction, and the expected crossing of a limit."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.comparison import friction_name
from valve_friction_ros.health.diagnosis import FrictionLimits
from valve_friction_ros.health.measured import DatedNumber
from valve_friction_ros.history.entry import (
    AlarmRecording,
    HistoryEntry,
    KeptBaseline,
    KeptValve,
    trended,
)
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.identification.trust.uncertainty import student_quantile
from valve_friction_ros.model.checks import equal_by_fields
from valve_friction_ros.response import ResponseSummary, summarised
from valve_friction_ros.streams import DAY, utc
from valve_friction_ros.usage import ValveUsage
from valve_friction_ros.wording import number_and_width

MONTH = 365.25 / 12 * DAY
"""Nanoseconds per month: a twelfth of the Julian year."""

_NORMAL = 1.959964
"""Standard errors per half width in a large sample (95 %), so that few strokes weigh less."""

_HORIZON = 2.0
"""Largest distance of a crossing after the last point, in spans of the points.

Chosen: the line is not evidence beyond it."""

_OUTLIER = 0.001
"""Probability of finding an outlier in a history without outliers. Chosen."""

_MOST_OUTLIERS = 0.1
"""Largest share of the days left out as outliers. Chosen: more would be a change, not outliers."""

LEAST_ESTIMATES = 4
"""Fewest estimates for a line: two more than its parameters."""
_HALVINGS = 60

LIMIT_NAMES = {"warn_ratio": "worth maintenance", "error_ratio": "excess", "low_ratio": "may leak"}
"""Meaning of the limits of the friction."""


class ScatteredLine(NamedTuple):
    """A line y = level + slope·(t − centre), with its uncertainty."""

    centre: float
    """Time at which level and slope are uncorrelated."""
    level: float
    slope: float
    level_error: float
    slope_error: float
    scatter: float
    """Standard deviation between estimates beyond their own errors."""
    freedom: int
    """Degrees of freedom."""

    @property
    def quantile(self) -> float:
        """Half width of a 95 % interval, in standard errors."""
        return student_quantile(0.975, self.freedom)

    @property
    def slope_half_width(self) -> float:
        """Half the width of the slope's 95 % interval."""
        return self.quantile * self.slope_error

    def at(self, time: Any) -> Any:
        """Return the line at a time, or at an array of times."""
        return self.level + self.slope * (time - self.centre)

    def half_width(self, time: Any) -> Any:
        """Return half the width of the line's 95 % interval at a time or an array of times."""
        away = time - self.centre
        return self.quantile * np.hypot(self.level_error, self.slope_error * away)

    def crossing(self, level: float, level_error: float) -> tuple[float, float, float] | None:
        """Return when the line reaches a level with a standard error: time and 95 % interval.

        The interval is Fieller's: it holds the times at which line and level do not differ at the
        5 % significance level. It is finite only if the interval of the slope excludes zero; None
        otherwise.
        """
        gap, factor = level - self.level, self.quantile**2
        a = self.slope**2 - factor * self.slope_error**2
        if a <= 0:
            return None
        c = gap**2 - factor * (self.level_error**2 + level_error**2)
        root = math.sqrt(max((self.slope * gap) ** 2 - a * c, 0.0))
        ends = sorted((self.slope * gap + sign * root) / a for sign in (-1.0, 1.0))
        return (self.centre + gap / self.slope, self.centre + ends[0], self.centre + ends[1])


def _misfit(
    scatter: float,
    times: NDArray[np.float64],
    values: NDArray[np.float64],
    errors: NDArray[np.float64],
) -> tuple[float, float, float, float, float]:
    """Fit at a given scatter; return centre, level, slope, weight of the slope, and χ²."""
    weights = 1.0 / (errors**2 + scatter**2)
    total = weights.sum()
    centre = float(weights @ times / total)
    level = float(weights @ values / total)
    away = times - centre
    spread = float(weights @ away**2)
    slope = float(weights @ (away * values) / spread)
    residual = values - level - slope * away
    return centre, level, slope, spread, float(weights @ residual**2)


def fit_line(
    times: NDArray[np.float64], values: NDArray[np.float64], errors: NDArray[np.float64]
) -> ScatteredLine:
    """Fit a line to estimates with individual errors and a common additional scatter.

    The scatter makes χ² equal to its degrees of freedom (Paule and Mandel); it is zero if χ² is
    smaller without scatter. The standard errors follow Knapp and Hartung: scaled by √(χ²/freedom),
    but never down. They go with Student's t.

    Parameters
    ----------
    times, values, errors : ndarray of float, shape (n,)
        Times, not all equal, at least `LEAST_ESTIMATES`; estimates; their standard errors. Errors
        are at least 1e-9 of the largest value.

    Returns
    -------
    ScatteredLine
        The line.
    """
    unit = float(np.abs(values).max()) or 1.0
    values, errors = values / unit, np.maximum(errors / unit, 1e-9)
    freedom = times.size - 2
    scatter = 0.0
    if _misfit(0.0, times, values, errors)[-1] > freedom:
        highest = float(np.ptp(values)) + float(errors.max())
        lowest, highest = 0.0, 2 * highest
        for _ in range(_HALVINGS):  # the misfit falls with the scatter
            scatter = 0.5 * (lowest + highest)
            is_small = _misfit(scatter, times, values, errors)[-1] < freedom
            lowest, highest = (lowest, scatter) if is_small else (scatter, highest)
    centre, level, slope, spread, misfit = _misfit(scatter, times, values, errors)
    total = float((1.0 / (errors**2 + scatter**2)).sum())
    scale = unit * math.sqrt(max(misfit / freedom, 1.0))
    return ScatteredLine(
        centre,
        unit * level,
        unit * slope,
        scale / math.sqrt(total),
        scale / math.sqrt(spread),
        unit * scatter,
        freedom,
    )


class Limit(Enum):
    """A limit of the friction, by the name of its ratio."""

    WARN = "warn_ratio"
    ERROR = "error_ratio"
    LOW = "low_ratio"


@equal_by_fields
@dataclass(frozen=True)
class Crossing:
    """Expected crossing of the next limit.

    `level` is the friction at the limit, N; `earliest` and `latest` are the ends of the 95 %
    interval of the expected time, ns since 1970 (UTC).
    """

    limit: Limit
    level: float
    time: int
    earliest: int
    latest: int


@equal_by_fields
@dataclass(frozen=True)
class Trend:
    """The drift of a friction: a line through the days, N over ns since `begin`.

    `days` enter the line, `outliers` are left out. `begin` and `end` are the times of the first and
    the last estimate, ns since 1970 (UTC). The crossing is None without a significant drift,
    without a baseline, or if it is too far ahead. `of` names the friction: the sliding friction at
    `speed`, m/s, if the baseline has one, else F_c.
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
        """Name of the drifting friction, in words."""
        return str(friction_name(self.of, self.speed))

    @property
    def drift(self) -> float:
        """Drift, N per month."""
        return self.line.slope * MONTH

    @property
    def half_width(self) -> float:
        """Half the width of its 95 % interval, N per month."""
        return self.line.slope_half_width * MONTH

    @property
    def is_significant(self) -> bool:
        """Return whether the interval of the drift excludes zero."""
        return abs(self.drift) > self.half_width


class _Days(NamedTuple):
    """Times (ns since the first point), frictions and standard errors, one per day."""

    times: NDArray[np.float64]
    values: NDArray[np.float64]
    errors: NDArray[np.float64]


def _days(points: Sequence[DatedNumber]) -> _Days:
    """Combine the points of each day (UTC) into their weighted mean.

    The records of a day may overlap, and share temperature and load.
    """
    times = np.array([point.time for point in points], dtype=np.int64)
    values = np.array([point.value for point in points])
    least = 1e-9 * np.abs(values).max()
    errors = np.maximum(np.array([point.half_width for point in points]) / _NORMAL, least)
    _, day = np.unique(times // DAY, return_inverse=True)
    weights = errors**-2
    total = np.bincount(day, weights)
    since_first = (times - times.min()).astype(np.float64)
    means = [np.bincount(day, weights * one) / total for one in (since_first, values)]
    return _Days(means[0], means[1], np.sqrt(1.0 / total))


def _robust_line(days: _Days) -> tuple[ScatteredLine, int]:
    """Fit a line without outlying days; return it with the number of outliers.

    The day with the largest residual is compared with the prediction from the other days. It is an
    outlier if chance gives such a distance in 0.1 % of histories (Bonferroni).
    """
    line, outliers = fit_line(*days), 0
    for _ in range(int(_MOST_OUTLIERS * days.times.size)):
        residual = np.abs(days.values - line.at(days.times))
        worst = int(np.argmax(residual / np.hypot(days.errors, line.scatter)))
        rest = _Days(*(np.delete(one, worst) for one in days))
        others = fit_line(*rest)
        time, error = days.times[worst], np.hypot(days.errors[worst], others.scatter)
        predicted = np.hypot(error, others.half_width(time) / others.quantile)
        surprise = abs(days.values[worst] - others.at(time)) / predicted
        if surprise <= student_quantile(1 - _OUTLIER / (2 * days.times.size), others.freedom):
            break
        days, line, outliers = rest, others, outliers + 1
    return line, outliers


def _crossing(
    line: ScatteredLine, begin: int, end: int, baseline: Baseline, limits: FrictionLimits
) -> Crossing | None:
    """Return the crossing of the next limit, unless it is too far ahead."""
    friction = friction_of(baseline, trended(baseline)) or math.nan
    half_width = (baseline.sliding or baseline).half_width
    span = end - begin
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
    points: Sequence[DatedNumber],
    baseline: Baseline | None = None,
    limits: FrictionLimits | None = None,
) -> Trend | None:
    """Estimate the drift of the friction from points since the last work on the packing.

    The points, in any order, are those of `friction_point` with this baseline.

    The weight of a point depends on its interval and on the scatter between days, which `fit_line`
    estimates. All points of a day are combined into one. Outlying days are left out, at most a
    tenth of all days. The baseline and the limits, as ratios to it, give the next crossing.

    Returns None if the points lie on fewer than four days.
    """
    if not points:
        return None
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


def drift_text(trend: Trend) -> str:
    """Return the drift with its interval, and the expected crossing of a limit, as text."""
    value, width = number_and_width(trend.drift, trend.half_width)
    text = f"{'+' if trend.drift > 0 else ''}{value} {width} N per month"
    if trend.crossing is None:
        return text
    when = utc(trend.crossing.time)
    return f"{text}; {LIMIT_NAMES[trend.crossing.limit.value]} expected {when:%Y-%m-%d}"


def end_of_trend(trend: Trend) -> int:
    """Return the time up to which a trend is drawn, ns."""
    if trend.crossing is None:
        return trend.end
    return min(trend.crossing.latest, trend.end + 2 * (trend.end - trend.begin))


def friction_of(baseline: Baseline | None, of: str) -> float | None:
    """Return the friction of a baseline by its name, N; None if it has none."""
    if baseline is None:
        return None
    if of == SLIDING:
        return None if baseline.sliding is None else baseline.sliding.value
    return baseline.coulomb_friction


@dataclass(frozen=True)
class ValveHistory:
    """History of one valve over a period.

    Attributes
    ----------
    valve : KeptValve
        The valve.
    entries : tuple of HistoryEntry
        Its identifications, oldest first; at least one.
    set_baseline : KeptBaseline or None
        The last baseline set; the trend begins with it.
    trend : Trend or None
        Drift of the results of the last method, against the last baseline and limits. Two methods
        may differ systematically, so a trend uses the results of one method.
    baselines : tuple of KeptBaseline
        Each change of its baseline, oldest first, without records.
    usage : ValveUsage
        Usage of the valve over its whole life.
    alarms : tuple of AlarmRecording
        The recordings of its alarms, oldest first.
    response : ResponseSummary
        Its responses to steps of the command, with the travel of the last response.
    """

    valve: KeptValve
    entries: tuple[HistoryEntry, ...]
    set_baseline: KeptBaseline | None
    trend: Trend | None
    baselines: tuple[KeptBaseline, ...] = ()
    usage: ValveUsage = field(default_factory=ValveUsage)
    alarms: tuple[AlarmRecording, ...] = ()
    response: ResponseSummary = field(default_factory=lambda: summarised(()))
