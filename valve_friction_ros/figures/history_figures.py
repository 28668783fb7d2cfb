# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Figures over time: friction with its trend, and usage, per valve."""

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from valve_friction_ros.figures.panels import COLOURS, dress, labelled_in, legend_above
from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.comparison import friction_name
from valve_friction_ros.health.measured import DatedNumber
from valve_friction_ros.history import (
    LIMIT_NAMES,
    Trend,
    ValveHistory,
    drift_text,
    end_of_trend,
    friction_of,
    trended,
)
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.identification.trust.verdict import Verdict
from valve_friction_ros.outside_text import printable
from valve_friction_ros.streams import DAY
from valve_friction_ros.usage import BINS, UsedDay, ValveUsage

_ESTIMATE, _TREND = COLOURS[:2]
_LIMITS = {"warn_ratio": "#E69F00", "error_ratio": "#B2182B", "low_ratio": "#762A83"}
_REFUSAL_HEIGHT = 0.03
"""Height of the marks of refusals, as a share of the panel."""

_SHORTEST = 7_200_000_000_000
"""Shortest time axis, ns; matplotlib would show years around a single point."""

_PLACES = 150
"""Points with an interval that fit side by side on a time axis."""

_TITLE_WIDTH = 110
"""Characters per line of a panel title."""


def _dates(times: ArrayLike) -> NDArray[np.datetime64]:
    """Turn times in ns since 1970 into dates."""
    return np.asarray(times, dtype=np.int64).astype("datetime64[ns]")


def _end(history: ValveHistory) -> int:
    """Return the end of the curves of a valve, ns."""
    last, trend = history.entries[-1].time, history.trend
    return last if trend is None else max(last, end_of_trend(trend))


def span_of_time(histories: Sequence[ValveHistory], now: int | None) -> tuple[int, int]:
    """Return the ends of a time axis for several histories, ns.

    The axis includes today, unless that would squeeze the histories into less than a third of it.
    """
    begin = min(history.entries[0].time for history in histories)
    end = max(map(_end, histories))
    if now is not None and end < now <= end + 2 * max(end - begin, _SHORTEST):
        end = now
    room = max((end - begin) // 50, (_SHORTEST - (end - begin)) // 2)
    return begin - room, end + room


def draw_history(
    axes: Axes, history: ValveHistory, span: tuple[int, int], now: int | None = None
) -> None:
    """Draw a history on a time axis of this span, ns, and mark today if it lies within."""
    _draw_limits(axes, history, span)
    _draw_estimates(axes, history, span)
    _draw_refusals(axes, history)
    if history.set_baseline is not None and history.set_baseline.time >= span[0]:
        _mark(axes, history.set_baseline.time, ":", "baseline set")
    if now is not None and span[0] <= now <= span[1]:
        _mark(axes, now, "-", "today")
    if history.trend is not None and history.trend.is_significant:
        _draw_trend(axes, history.trend)
    axes.set_ylabel(f"{_what(history)} [N]")
    dress((axes,))


def _mark(axes: Axes, time: int, style: str, label: str) -> None:
    axes.axvline(_dates([time])[0], color="0.4", ls=style, lw=1.5, label=label)


def entitle(axes: Axes, history: ValveHistory) -> None:
    """Write valve and drift above a panel; a tag comes from outside and may be long."""
    tag, name = history.valve.tag, history.valve.name
    title = f"{tag} ({name})" if tag else name
    drift = ""
    if history.trend is not None and history.trend.is_significant:
        drift = drift_text(history.trend)
    lines = textwrap.wrap(title, _TITLE_WIDTH, max_lines=2, placeholder=" …")
    if drift and len(lines[-1]) + len(drift) > _TITLE_WIDTH:
        lines.append("")
    axes.set_title(
        "\n".join(map(printable, lines)), loc="left", fontsize="medium", parse_math=False
    )
    axes.set_title(drift, loc="right", fontsize="medium", color=_TREND)


def _tick_dates(axes: Axes, most: int, least: int = 5) -> None:
    locator = AutoDateLocator(minticks=least, maxticks=most)  # type: ignore[no-untyped-call]
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]


def set_dates(
    axes: Axes, span: tuple[int, int], histories: Sequence[ValveHistory], most_ticks: int = 9
) -> None:
    """Label the time axis of several histories with their first and last day."""
    axes.set_xlim(*_dates(span))
    _tick_dates(axes, most_ticks)
    times = [entry.time for history in histories for entry in history.entries]
    first, last = _dates([min(times), max(times)]).astype("datetime64[D]")
    axes.set_xlabel(f"time [UTC]; identified from {first} to {last}")


def _draw_limits(axes: Axes, history: ValveHistory, span: tuple[int, int]) -> None:
    """Draw the baseline and limits in force at each identification, across the axis."""
    times = [entry.time for entry in history.entries]
    of = trended(history.entries[-1].baseline)
    known = [friction_of(entry.baseline, of) for entry in history.entries]
    levels = np.array(known, dtype=float)  # nan for None
    if np.isnan(levels).all():
        return
    dates = _dates([span[0], *times, span[1]])

    def draw(heights: NDArray[np.float64], label: str, **style: Any) -> None:
        axes.step(dates, np.pad(heights, 1, "edge"), where="post", label=label, **style)

    draw(levels, "baseline", color="0.4", lw=1.0)
    for name, colour in _LIMITS.items():
        ratios = np.array([getattr(entry.limits, name) for entry in history.entries])
        draw(ratios * levels, f"{LIMIT_NAMES[name]} ({name})", color=colour, ls="--", lw=1.2)


def _what(history: ValveHistory) -> str:
    baseline = history.entries[-1].baseline
    if baseline is None or baseline.sliding is None:
        return "Coulomb friction $F_c$"
    return str(friction_name(SLIDING, baseline.sliding.speed))


def _draw_estimates(axes: Axes, history: ValveHistory, span: tuple[int, int]) -> None:
    """Draw every friction as a dot, and add intervals where there is room."""
    baseline = history.entries[-1].baseline
    of = trended(baseline)
    points = {
        verdict: [
            point
            for entry in history.entries
            if (point := entry.point(baseline)) is not None
            and entry.parameters[of].verdict is verdict
        ]
        for verdict in (Verdict.IDENTIFIED, Verdict.WEAK)
    }
    for (verdict, some), face in zip(points.items(), (_ESTIMATE, "white"), strict=True):
        if not some:
            continue
        shown = _with_room(some, span)
        if len(shown) < len(some):
            times, values, _ = zip(*some, strict=True)
            axes.plot(_dates(times), values, ".", color=_ESTIMATE, ms=3, alpha=0.3, mew=0)
        times, values, half_widths = zip(*shown, strict=True)
        axes.errorbar(
            _dates(times),
            values,
            half_widths,
            fmt="o",
            color=_ESTIMATE,
            mfc=face,
            ms=5,
            lw=1.2,
            capsize=2,
            label=f"{verdict.value}, 95 % interval",
        )
    if of == SLIDING:
        _draw_other_speeds(axes, history, baseline)


def _draw_other_speeds(axes: Axes, history: ValveHistory, baseline: Baseline | None) -> None:
    """Mark the sliding frictions that are not known at the speed of the baseline."""
    far = [
        (entry.time, entry.parameters[SLIDING].value)
        for entry in history.entries
        if entry.is_at_other_speed(baseline)
    ]
    if far:
        times, values = zip(*far, strict=True)
        axes.plot(_dates(times), values, "x", color="0.4", ms=5, label="at another speed")


def _with_room(points: Sequence[DatedNumber], span: tuple[int, int]) -> list[DatedNumber]:
    """Return the point with the median friction for each place on the time axis."""
    size = max((span[1] - span[0]) // _PLACES, 1)
    places: dict[int, list[DatedNumber]] = {}
    for point in points:
        places.setdefault((point.time - span[0]) // size, []).append(point)
    return [sorted(some, key=lambda one: one.value)[len(some) // 2] for some in places.values()]


def _draw_refusals(axes: Axes, history: ValveHistory) -> None:
    refused = [entry.time for entry in history.entries if entry.refusal]
    if refused:
        axes.plot(
            _dates(refused),
            np.full(len(refused), _REFUSAL_HEIGHT),
            "|",
            color="0.4",
            ms=9,
            transform=axes.get_xaxis_transform(),
            label="refused",
        )


def _draw_trend(axes: Axes, trend: Trend) -> None:
    time = np.linspace(0.0, float(end_of_trend(trend) - trend.begin), 200)
    dates, line = _dates(time + trend.begin), trend.line.at(time)
    half_width = trend.line.half_width(time)
    axes.plot(dates, line, color=_TREND, lw=1.5, label="trend, 95 % band")
    axes.fill_between(dates, line - half_width, line + half_width, color=_TREND, alpha=0.2, lw=0)
    if trend.crossing is not None:
        axes.plot(
            _dates([trend.crossing.time]),
            [trend.crossing.level],
            "X",
            color=_TREND,
            ms=9,
            label="limit expected",
        )


_TRAVEL_COLOUR = "#56B4E9"
_RENEWED = "#009E73"


def used_days(usage: ValveUsage, span: tuple[int, int]) -> tuple[UsedDay, ...]:
    """Return the days that overlap a time span, ns."""
    begin, end = span
    return tuple(one for one in usage.days if one.day * DAY < end and (one.day + 1) * DAY > begin)


def draw_usage(axes: Axes, usage: ValveUsage, span: tuple[int, int]) -> None:
    """Draw travel per day and packing renewals on a time axis of this span, ns."""
    days = used_days(usage, span)
    numbers = sorted({one.day for one in days})
    sums = [sum(one.usage.distance for one in days if one.day == day) for day in numbers]
    width = np.timedelta64(DAY, "ns")
    axes.bar(
        _dates([DAY * day for day in numbers]),
        sums,
        width,
        align="edge",
        color=_TRAVEL_COLOUR,
        label="travel of a day",
    )
    for renewal in sorted({one.renewal for one in days if span[0] <= one.renewal <= span[1]}):
        begin = _dates([renewal])[0]
        axes.axvline(begin, color=_RENEWED, ls="-.", lw=1.5, label="packing renewed")
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("travel [m/day]")
    dress((axes,))


MOST_PANELS = 12
"""Maximum number of valves on one page. Chosen: still readable."""


_USAGE_HEIGHT = 1.5
"""Height of the usage panel, inches."""


def trend_figure(histories: Sequence[ValveHistory], now: int | None = None) -> Figure:
    """Draw the friction of valves over a common time axis, one panel per valve.

    The panel shows the sliding friction at the speed of the last baseline if that has one, else
    F_c. A panel below it shows the travel per day, if any was counted in that time.

    Parameters
    ----------
    histories : sequence of ValveHistory
        One to `MOST_PANELS`.
    now : int, optional
        Today, ns since 1970 (UTC), marked unless it is far from the history.

    Returns
    -------
    Figure
        Figure to save or show; matplotlib's global state is not changed.

    Raises
    ------
    ValueError
        If `histories` is empty, or holds more than `MOST_PANELS` valves.
    """
    if not 0 < len(histories) <= MOST_PANELS:
        raise ValueError(
            f"one to {MOST_PANELS} valves can be plotted, got {len(histories)}: choose some"
        )
    span = span_of_time(histories, now)
    heights = []
    for history in histories:
        heights.append(4.5 if len(histories) == 1 else 2.8)
        if used_days(history.usage, span):
            heights.append(_USAGE_HEIGHT)
    figure = Figure(figsize=(11, 1.0 + sum(heights)), layout="constrained", dpi=110)
    ratios = {"height_ratios": heights}
    panels = figure.subplots(len(heights), sharex=True, squeeze=False, gridspec_kw=ratios)[:, 0]
    remaining = iter(panels)
    for history in histories:
        axes = next(remaining)
        draw_history(axes, history, span, now)
        entitle(axes, history)
        if used_days(history.usage, span):
            draw_usage(next(remaining), history.usage, span)
    set_dates(panels[-1], span, histories)
    legend_above(figure, labelled_in(panels), columns=4)
    return figure


def report_trend_figure(
    history: ValveHistory, now: int | None = None, is_narrow: bool = False
) -> Figure:
    """Draw the friction of one valve over time for a report page, without a title."""
    figure = Figure(figsize=(3.7 if is_narrow else 7.1, 4.2), layout="constrained")
    axes = figure.subplots()
    span = span_of_time([history], now)
    draw_history(axes, history, span, now)
    set_dates(axes, span, [history], most_ticks=6 if is_narrow else 9)
    if is_narrow:
        axes.set_xlabel("time [UTC]")
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(
        handles,
        [label.partition(" (")[0].partition(",")[0] for label in labels],
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=2 if is_narrow else 4,
        frameon=False,
        fontsize="small",
        columnspacing=1.0,
        handlelength=1.4,
    )
    return figure


_DAYS_SHOWN = 31
"""Number of the latest days to draw."""
_FEWEST_DAYS = 7
"""Days on the axis; matplotlib would show hours around a single day."""
_USAGE_COLOUR = "#0072B2"


def usage_figure(usage: ValveUsage, is_narrow: bool = False) -> Figure:
    """Draw the time at each 5 % of travel, and the distance travelled on each of the last 31 days.

    Both cover the present packing only. A narrow page shows them one below the other. Raises
    ValueError if the valve was not monitored.
    """
    used = usage.since_renewal
    if not used.time_watched:
        raise ValueError("the valve was not monitored: there is nothing to plot")
    figure = Figure(figsize=(3.7, 4.8) if is_narrow else (7.1, 2.6), layout="constrained")
    places, days = figure.subplots(2, 1) if is_narrow else figure.subplots(1, 2)
    width = 100 / BINS
    shares = 100 * np.array(used.histogram) / used.time_watched
    places.bar(width * np.arange(BINS), shares, width, align="edge", color=_USAGE_COLOUR)
    places.set_xlim(0, 100)
    places.set_xlabel("stem position [% of the travel]")
    places.set_ylabel("time [%]")
    last = [one for one in usage.days if one.renewal == usage.renewal][-_DAYS_SHOWN:]
    dates = np.array([np.datetime64(int(one.day * DAY), "ns") for one in last], "datetime64[D]")
    days.bar(dates, [one.usage.distance for one in last], color=_USAGE_COLOUR)
    first = min(dates[0], dates[-1] - np.timedelta64(_FEWEST_DAYS - 1, "D"))
    half = np.timedelta64(12, "h")
    days.set_xlim(first - half, dates[-1] + half)
    _tick_dates(days, 5, least=2)
    days.set_xlabel("day [UTC]")
    days.set_ylabel("travelled distance [m]")
    dress((places, days))
    return figure
