"""The panel of one valve's history: friction, intervals, limits, trend, refusals."""

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from numpy.typing import ArrayLike, NDArray

from valve_friction_ros.figures.panels import COLOURS
from valve_friction_ros.health import friction_words
from valve_friction_ros.history import (
    LIMIT_NAMES,
    FrictionPoint,
    Trend,
    ValveHistory,
    drift_text,
    end_of_trend,
    friction_of,
    trended,
)
from valve_friction_ros.identification import SLIDING, Verdict
from valve_friction_ros.outside_text import printable

__all__ = ["draw_history", "drift_text", "entitle", "set_dates", "span_of_time"]

_ESTIMATE, _TREND = COLOURS[:2]
_LIMITS = {"warn_ratio": "#E69F00", "error_ratio": "#B2182B", "low_ratio": "#762A83"}
_MARGIN = 0.03
"""Height of the marks of refusals, as a share of the panel."""

_SHORTEST = 7_200_000_000_000
"""Shortest time axis, ns; around a single point matplotlib would show years."""

_PLACES = 150
"""Points with an interval that have room side by side on a time axis."""

_TITLE = 110
"""Characters of one line above a panel."""


def _dates(times: ArrayLike) -> NDArray[np.datetime64]:
    """Turn times in ns since 1970 into dates."""
    return np.asarray(times, dtype=np.int64).astype("datetime64[ns]")


def _end(history: ValveHistory) -> int:
    """Return the time up to which a valve is drawn, ns."""
    last, trend = history.entries[-1].time, history.trend
    return last if trend is None else max(last, end_of_trend(trend))


def span_of_time(histories: Sequence[ValveHistory], now: int | None) -> tuple[int, int]:
    """Return the ends of a time axis for some histories, ns.

    Today is within it, unless that would leave them less than a third of it.
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
    """Draw a history on a time axis of this span, ns, and today, where it lies within."""
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
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)


def _mark(axes: Axes, time: int, style: str, label: str) -> None:
    axes.axvline(_dates([time])[0], color="0.4", ls=style, lw=1.5, label=label)


def entitle(axes: Axes, history: ValveHistory) -> None:
    """Write valve and drift above a panel; a tag is text from outside, and may be long."""
    tag, name = history.valve.tag, history.valve.name
    title = f"{tag} ({name})" if tag else name
    drift = ""
    if history.trend is not None and history.trend.is_significant:
        drift = drift_text(history.trend)
    lines = textwrap.wrap(title, _TITLE, max_lines=2, placeholder=" …")
    if drift and len(lines[-1]) + len(drift) > _TITLE:
        lines.append("")
    axes.set_title(
        "\n".join(map(printable, lines)), loc="left", fontsize="medium", parse_math=False
    )
    axes.set_title(drift, loc="right", fontsize="medium", color=_TREND)


def set_dates(
    axes: Axes, span: tuple[int, int], histories: Sequence[ValveHistory], most_ticks: int = 9
) -> None:
    """Label the time axis of some histories, with their first and last day."""
    axes.set_xlim(*_dates(span))
    locator = AutoDateLocator(maxticks=most_ticks)  # type: ignore[no-untyped-call]
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(
        ConciseDateFormatter(locator)  # type: ignore[no-untyped-call]
    )
    times = [entry.time for history in histories for entry in history.entries]
    first, last = _dates([min(times), max(times)]).astype("datetime64[D]")
    axes.set_xlabel(f"time [UTC]; identified from {first} to {last}")


def _draw_limits(axes: Axes, history: ValveHistory, span: tuple[int, int]) -> None:
    """Draw baseline and limits as they were in force at each identification, over the axis."""
    times = [entry.time for entry in history.entries]
    of = trended(history.entries[-1].baseline)
    levels = np.array(
        [
            np.nan if (level := friction_of(entry.baseline, of)) is None else level
            for entry in history.entries
        ]
    )
    if np.isnan(levels).all():
        return
    dates = _dates([span[0], *times, span[1]])
    axes.step(
        dates, [levels[0], *levels, levels[-1]], where="post", color="0.4", lw=1.0, label="baseline"
    )
    for name, colour in _LIMITS.items():
        ratios = np.array([getattr(entry.limits, name) for entry in history.entries])
        limit = ratios * levels
        axes.step(
            dates,
            [limit[0], *limit, limit[-1]],
            where="post",
            color=colour,
            ls="--",
            lw=1.2,
            label=f"{LIMIT_NAMES[name]} ({name})",
        )


def _what(history: ValveHistory) -> str:
    """Return what is drawn, in words."""
    baseline = history.entries[-1].baseline
    if baseline is None or baseline.sliding is None:
        return "Coulomb friction $F_c$"
    return friction_words(SLIDING, baseline.sliding.speed)


def _draw_estimates(axes: Axes, history: ValveHistory, span: tuple[int, int]) -> None:
    """Draw every friction as a dot, and those that have room with their intervals."""
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


def _with_room(points: Sequence[FrictionPoint], span: tuple[int, int]) -> list[FrictionPoint]:
    """Return, for each place on the time axis, the point of the middle friction."""
    size = max((span[1] - span[0]) // _PLACES, 1)
    places: dict[int, list[FrictionPoint]] = {}
    for point in points:
        places.setdefault((point.time - span[0]) // size, []).append(point)
    return [sorted(some, key=lambda one: one.value)[len(some) // 2] for some in places.values()]


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
