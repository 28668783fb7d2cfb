"""Friction over time as a chart.

Its times are those of a wall clock in the chosen zone, which the browser is told to take for UTC:
it knows no other zones.
"""

from typing import Any
from zoneinfo import ZoneInfo

import numpy as np

from valve_friction_ros.dashboard.charts.parts import (
    BLUE,
    GREEN,
    GREY,
    MOST_POINTS,
    Options,
    axis,
    base,
    line,
    plain,
)
from valve_friction_ros.history import (
    LIMIT_NAMES,
    Trend,
    ValveHistory,
    end_of_trend,
    friction_of,
    trended,
)
from valve_friction_ros.identification import Verdict
from valve_friction_ros.streams import utc

__all__ = ["trend_chart"]

_LIMITS = {"warn_ratio": "#E69F00", "error_ratio": "#D55E00", "low_ratio": "#CC79A7"}


def _wall(stamp: int, zone: ZoneInfo) -> int:
    """Return the wall clock of a zone, ms since 1970 as if it were UTC."""
    offset = utc(stamp).astimezone(zone).utcoffset()
    return stamp // 1_000_000 + (0 if offset is None else round(offset.total_seconds() * 1000))


def trend_chart(history: ValveHistory, zone: ZoneInfo, now: int) -> Options:
    """Draw friction over time with intervals, baseline, limits, trend and the crossing of a limit.

    Of many estimates the latest are drawn. `now` is today, ns since 1970.
    """
    baseline = history.entries[-1].baseline
    of = trended(baseline)
    entries = history.entries[-MOST_POINTS:]
    series = _levels(history, of, zone)
    if history.trend is not None and history.trend.is_significant:
        series += _trend(history.trend, zone)
    estimates: dict[Verdict, list[list[Any]]] = {Verdict.IDENTIFIED: [], Verdict.WEAK: []}
    bars: list[list[Any]] = []
    for entry in entries:
        point = entry.point(baseline)
        if point is None or entry.parameters[of].verdict not in estimates:
            continue
        time = _wall(point.time, zone)
        estimates[entry.parameters[of].verdict].append([time, plain(point.value)])
        ends = (point.value - point.half_width, point.value + point.half_width)
        bars += [[time, plain(ends[0])], [time, plain(ends[1])], [time, None]]
    series.append(line("95 % interval", bars, BLUE, width=1.2))
    for verdict, points in estimates.items():
        if points:
            series.append(_dots(verdict.value, points, verdict is Verdict.WEAK))
    refused = [[_wall(one.time, zone), 0] for one in entries if one.refusal]
    if refused:
        series.append(_refusals(refused))
    series[0]["markLine"] = _marks(history, zone, now)
    name = "sliding friction [N]" if of == "sliding_friction" else "Coulomb friction F_c [N]"
    return {
        **base(),
        "grid": {"left": 64, "right": 18, "top": 52, "bottom": 30},
        "tooltip": {"trigger": "item", "renderMode": "richText"},
        "dataZoom": [{"type": "inside", "filterMode": "none"}],
        "xAxis": axis("time", ""),
        "yAxis": [
            axis("value", name),
            {"type": "value", "min": 0, "max": 1, "show": False},
        ],
        "series": series,
    }


def _dots(name: str, points: list[list[Any]], is_hollow: bool) -> Options:
    style = {
        "color": "transparent" if is_hollow else BLUE,
        "borderColor": BLUE,
        "borderWidth": 1.5,
    }
    return {
        "name": name,
        "type": "scatter",
        "data": points,
        "symbolSize": 6,
        "itemStyle": style,
        "z": 4,
    }


def _refusals(points: list[list[Any]]) -> Options:
    return {
        "name": "refused",
        "type": "scatter",
        "yAxisIndex": 1,
        "symbol": "rect",
        "symbolSize": [2, 12],
        "data": points,
        "itemStyle": {"color": GREY},
    }


def _levels(history: ValveHistory, of: str, zone: ZoneInfo) -> list[Options]:
    """Draw baseline and limits as they were in force, without repetitions."""
    steps: list[tuple[int, float | None, Any]] = []
    for entry in history.entries:
        step = (_wall(entry.time, zone), friction_of(entry.baseline, of), entry.limits)
        if not steps or step[1:] != steps[-1][1:]:
            steps.append(step)
    last = history.entries[-1].time if history.trend is None else end_of_trend(history.trend)
    steps.append((_wall(max(last, history.entries[-1].time), zone), *steps[-1][1:]))
    drawn = [line("baseline", [[t, plain(v)] for t, v, _ in steps], GREY, step="end", width=1.2)]
    for name, colour in _LIMITS.items():
        data = [
            [t, None if v is None else plain(v * getattr(limits, name))] for t, v, limits in steps
        ]
        drawn.append(line(LIMIT_NAMES[name], data, colour, step="end", dashes="dashed", width=1.2))
    return drawn


def _trend(trend: Trend, zone: ZoneInfo) -> list[Options]:
    time = np.linspace(0.0, float(end_of_trend(trend) - trend.begin), 60)
    middle_line, width = trend.line.at(time), trend.line.half_width(time)
    at = [_wall(trend.begin + round(one), zone) for one in time]
    low = [[t, plain(y)] for t, y in zip(at, middle_line - width, strict=True)]
    band = [[t, plain(y)] for t, y in zip(at, 2 * width, strict=True)]
    middle = [[t, plain(y)] for t, y in zip(at, middle_line, strict=True)]
    unseen = {"stack": "band", "stackStrategy": "all", "width": 0}
    drawn = [
        line("", low, GREEN, **unseen),
        line("95 % band", band, GREEN, areaStyle={"color": GREEN, "opacity": 0.18}, **unseen),
        line("trend", middle, GREEN, width=2),
    ]
    if trend.crossing is not None:
        point = [_wall(trend.crossing.time, zone), plain(trend.crossing.level)]
        drawn.append(
            {"name": "limit expected", "type": "scatter", "symbol": "diamond", "symbolSize": 13,
             "data": [point], "itemStyle": {"color": GREEN}, "z": 5}
        )  # fmt: skip
    return drawn


def _marks(history: ValveHistory, zone: ZoneInfo, now: int) -> Options:
    label = {"show": True, "color": GREY, "fontSize": 11, "position": "insideEndTop"}
    marks = [("today", now, "solid")]
    marks += [("baseline set", one.time, "dotted") for one in history.baselines[-3:]]
    return {
        "symbol": "none",
        "silent": True,
        "data": [
            {"xAxis": _wall(time, zone), "name": name,
             "label": {**label, "formatter": name},
             "lineStyle": {"color": GREY, "type": style}}
            for name, time, style in marks
        ],
    }  # fmt: skip
