"""The figure of a history: friction over months, with its intervals, limits and trend."""

from collections.abc import Sequence
from datetime import datetime, timezone

import numpy as np
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from valve_friction_ros.figures.page import labelled_in, legend_above
from valve_friction_ros.figures.panels import COLOURS
from valve_friction_ros.health import Baseline, friction_words
from valve_friction_ros.history import Trend, ValveHistory, trended
from valve_friction_ros.identification import SLIDING, Verdict

__all__ = ["MOST_PANELS", "trend_figure"]

MOST_PANELS = 12
"""Most valves on one page. Chosen: still readable."""

_ESTIMATE, _TREND = COLOURS[:2]
_LIMITS = {"warn_ratio": "#E69F00", "error_ratio": "#B2182B", "low_ratio": "#762A83"}
_NAMES = {"warn_ratio": "worth maintenance", "error_ratio": "excess", "low_ratio": "may leak"}
_MARGIN = 0.03
"""Height of the marks of refusals, as a share of the panel."""

_SHORTEST = np.timedelta64(2, "h")
"""Shortest time axis; around a single point matplotlib would show years."""


def _dates(times: ArrayLike) -> NDArray[np.datetime64]:
    """Turn times in ns since 1970 into dates."""
    return np.asarray(times, dtype=np.int64).astype("datetime64[ns]")


def trend_figure(histories: Sequence[ValveHistory]) -> Figure:
    """Draw the friction of valves over time, one panel a valve.

    It is the sliding friction at the speed of the last baseline, where that has one, else F_c.

    Parameters
    ----------
    histories : sequence of ValveHistory
        One to `MOST_PANELS`.

    Returns
    -------
    Figure
        To be saved or shown; no global state of matplotlib is touched.

    Raises
    ------
    ValueError
        If `histories` is empty, or holds more than `MOST_PANELS` valves.
    """
    if not 0 < len(histories) <= MOST_PANELS:
        raise ValueError(
            f"one to {MOST_PANELS} valves can be drawn, got {len(histories)}: choose some"
        )
    height = 1.0 + (4.5 if len(histories) == 1 else 3.0 * len(histories))
    figure = Figure(figsize=(11, height), layout="constrained", dpi=110)
    panels = figure.subplots(len(histories), squeeze=False)[:, 0]
    for axes, history in zip(panels, histories, strict=True):
        _draw(axes, history)
    legend_above(figure, labelled_in(panels), columns=4)
    return figure


def _end_of_trend(trend: Trend) -> int:
    """Return the time up to which a trend is drawn, ns."""
    if trend.crossing is None:
        return trend.end
    return min(trend.crossing.latest, trend.end + 2 * (trend.end - trend.begin))


def _end(history: ValveHistory) -> int:
    """Return the time up to which a valve is drawn, ns."""
    last, trend = history.entries[-1].time, history.trend
    return last if trend is None else max(last, _end_of_trend(trend))


def _draw(axes: Axes, history: ValveHistory) -> None:
    _draw_limits(axes, history)
    _draw_estimates(axes, history)
    _draw_refusals(axes, history)
    if history.set_baseline is not None:
        axes.axvline(
            _dates([history.set_baseline.time])[0],
            color="0.4",
            ls=":",
            lw=1.5,
            label="baseline set",
        )
    if history.trend is not None and history.trend.is_significant:
        _draw_trend(axes, history.trend)
    times = _dates([history.entries[0].time, history.entries[-1].time])
    first, last = times.astype("datetime64[D]")
    if times[1] - times[0] < _SHORTEST:
        middle = times[0] + (times[1] - times[0]) // 2
        axes.set_xlim(middle - _SHORTEST // 2, middle + _SHORTEST // 2)
    locator = AutoDateLocator(maxticks=9)  # type: ignore[no-untyped-call]
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(
        ConciseDateFormatter(locator)  # type: ignore[no-untyped-call]
    )
    tag = history.valve.tag
    axes.set_title(f"{tag} ({history.valve.name})" if tag else history.valve.name, loc="left")
    if history.trend is not None and history.trend.is_significant:
        axes.set_title(_drift_text(history.trend), loc="right", fontsize="medium", color=_TREND)
    axes.set_ylabel(f"{_what(history)} [N]")
    axes.set_xlabel(f"time [UTC]; identified from {first} to {last}")
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)


def _draw_limits(axes: Axes, history: ValveHistory) -> None:
    """Draw baseline and limits as they were in force at each identification."""
    times = [entry.time for entry in history.entries]
    of = trended(history.entries[-1].baseline)
    levels = np.array(
        [
            np.nan if entry.baseline is None else _level(entry.baseline, of)
            for entry in history.entries
        ]
    )
    if np.isnan(levels).all():
        return
    dates = _dates([*times, _end(history)])
    axes.step(dates, [*levels, levels[-1]], where="post", color="0.4", lw=1.0, label="baseline")
    for name, colour in _LIMITS.items():
        ratios = np.array([getattr(entry.limits, name) for entry in history.entries])
        limit = ratios * levels
        axes.step(
            dates,
            [*limit, limit[-1]],
            where="post",
            color=colour,
            ls="--",
            lw=1.2,
            label=f"{_NAMES[name]} ({name})",
        )


def _level(baseline: Baseline, of: str) -> float:
    if of == SLIDING:
        return np.nan if baseline.sliding is None else baseline.sliding.value
    return np.nan if baseline.coulomb_friction is None else baseline.coulomb_friction


def _what(history: ValveHistory) -> str:
    """Return what is drawn, in words."""
    baseline = history.entries[-1].baseline
    if baseline is None or baseline.sliding is None:
        return "coulomb friction $F_c$"
    return friction_words(SLIDING, baseline.sliding.speed)


def _draw_estimates(axes: Axes, history: ValveHistory) -> None:
    baseline = history.entries[-1].baseline
    of = trended(baseline)
    for verdict, face in ((Verdict.IDENTIFIED, _ESTIMATE), (Verdict.WEAK, "white")):
        some = [
            point
            for entry in history.entries
            if (point := entry.point(baseline)) is not None
            and entry.parameters[of].verdict is verdict
        ]
        if some:
            times, values, half_widths = zip(*some, strict=True)
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


def _draw_refusals(axes: Axes, history: ValveHistory) -> None:
    refused = [entry.time for entry in history.entries if entry.refusal]
    if refused:
        axes.plot(
            _dates(refused),
            np.full(len(refused), _MARGIN),
            "|",
            color="0.4",
            ms=9,
            transform=axes.get_xaxis_transform(),
            label="refused",
        )


def _draw_trend(axes: Axes, trend: Trend) -> None:
    time = np.linspace(0.0, float(_end_of_trend(trend) - trend.begin), 200)
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


def _drift_text(trend: Trend) -> str:
    text = f"{trend.drift:+.3g} ± {trend.half_width:.2g} N a month"
    if trend.crossing is None:
        return text
    when = datetime.fromtimestamp(trend.crossing.time / 1e9, timezone.utc)
    return f"{text}; {_NAMES[trend.crossing.limit.value]} expected {when:%Y-%m-%d}"
