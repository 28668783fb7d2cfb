# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Charts of the pages as ECharts options: numbers and fixed words, never text from outside.

Times of the trend are wall-clock times in the chosen zone. The chart treats them as UTC, since
ECharts knows no other zones.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any
from zoneinfo import ZoneInfo

import numpy as np

from valve_friction_ros.dashboard.live_strip import Strip
from valve_friction_ros.health.alarms import AlarmAction, AlarmEvent
from valve_friction_ros.history import (
    LIMIT_NAMES,
    Trend,
    ValveHistory,
    end_of_trend,
    friction_of,
    trended,
)
from valve_friction_ros.identification.trust.verdict import Verdict
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.streams import utc

_BLUE, _ORANGE, _GREY, _GREEN = "#0072B2", "#D55E00", "#8a949f", "#009E73"
_MOST_POINTS = 1500
"""Maximum number of points per line."""
_SPLIT = "rgba(128,140,152,0.22)"

Options = dict[str, Any]


def _base() -> Options:
    """Return the options common to all charts."""
    return {
        "animation": False,
        "useUTC": True,
        "textStyle": {"fontFamily": "inherit"},
        "grid": {"left": 64, "right": 18, "top": 34, "bottom": 30},
        "legend": {"top": 0, "left": 0, "itemWidth": 16, "itemHeight": 8, "icon": "roundRect",
                   "textStyle": {"color": _GREY, "fontSize": 12}},
    }  # fmt: skip


def _axis(kind: str, name: str, **more: Any) -> Options:
    return {
        "type": kind,
        "name": name,
        "nameLocation": "middle",
        "nameGap": 46,
        "nameTextStyle": {"color": _GREY},
        "scale": True,
        "axisLabel": {"color": _GREY, "hideOverlap": True},
        "axisLine": {"show": True, "lineStyle": {"color": _GREY}},
        "splitLine": {"lineStyle": {"color": _SPLIT}, "show": kind == "value"},
        **more,
    }


def _line(name: str, data: Sequence[Any], colour: str, **style: Any) -> Options:
    """Return a line series; `width` and `dashes` style the line, other keys the series."""
    width = style.pop("width", 1.5)
    dashes = style.pop("dashes", "solid")
    return {
        "name": name,
        "type": "line",
        "data": list(data),
        "showSymbol": False,
        "silent": True,
        "itemStyle": {"color": colour},
        "lineStyle": {"color": colour, "width": width, "type": dashes},
        **style,
    }


def _scatter(name: str, data: Sequence[Any], colour: str, **style: Any) -> Options:
    """Return a scatter series; `style` holds further keys of the series."""
    return {"name": name, "type": "scatter", "data": data, "itemStyle": {"color": colour}, **style}


def _plain(value: float | None) -> float | None:
    """Return a number for JSON, with six digits, or None if not finite."""
    return None if value is None or not math.isfinite(value) else float(f"{value:.6g}")


def live_data(pressure: Strip, stem: Strip) -> list[Options]:
    """Return the data series of the live chart: pressure, kPa, and stem, mm."""
    return [
        {"data": [[round(t, 3), float(f"{v * scale:.6g}")] for t, v in _pairs(strip)]}
        for strip, scale in ((pressure, 1e-3), (stem, 1e3))
    ]


def _pairs(strip: Strip) -> Iterable[tuple[float, float]]:
    return zip(strip.times.tolist(), strip.values.tolist(), strict=True)


def live_chart(span: float) -> Options:
    """Return the empty chart of the last `span` seconds: pressure above, stem below."""
    names = ("pressure [kPa]", "stem [mm]")
    grids = [
        {"left": 64, "right": 18, "top": 10, "height": "39%"},
        {"left": 64, "right": 18, "top": "53%", "bottom": 28},
    ]
    x = {"min": -span, "max": 0, "scale": False}
    upper = _axis("value", "", gridIndex=0, **x)
    upper["axisLabel"] = {"show": False}
    return {
        **_base(),
        "legend": {"show": False},
        "grid": grids,
        "xAxis": [upper, _axis("value", "", gridIndex=1, **x)],
        "yAxis": [_axis("value", name, gridIndex=i) for i, name in enumerate(names)],
        "series": [
            {**_line(name, [], colour, width=1.2), "xAxisIndex": i, "yAxisIndex": i}
            for i, (name, colour) in enumerate(zip(names, (_BLUE, _ORANGE), strict=True))
        ],
    }


def loop_data(loop: Strip) -> list[list[float]]:
    """Return the points of a signature in kPa and mm, from Pa and m."""
    return [[float(f"{p * 1e-3:.6g}"), float(f"{x * 1e3:.6g}")] for p, x in _pairs(loop)]


def loop_chart(record: Recording | None) -> Options:
    """Draw the signature of the baseline record; `loop_data` fills in the present signature."""
    healthy = []
    if record is not None:
        step = max(1, len(record) // _MOST_POINTS)
        healthy = loop_data(Strip(record.drive[::step], record.position[::step]))
    return {
        **_base(),
        "grid": {"left": 58, "right": 18, "top": 34, "bottom": 44},
        "xAxis": _axis("value", "pressure [kPa]", nameGap=26),
        "yAxis": _axis("value", "stem [mm]", nameGap=38),
        "series": [
            _line("baseline", healthy, _GREY, width=1.4),
            _line("last minute", [], _ORANGE, width=1.4),
        ],
    }


_LIMITS = {"warn_ratio": "#E69F00", "error_ratio": "#D55E00", "low_ratio": "#CC79A7"}


def _wall(stamp: int, zone: ZoneInfo) -> int:
    """Return the wall-clock time of a zone, ms since 1970 as if it were UTC."""
    offset = utc(stamp).astimezone(zone).utcoffset()
    return stamp // 1_000_000 + (0 if offset is None else round(offset.total_seconds() * 1000))


def trend_chart(
    history: ValveHistory, zone: ZoneInfo, now: int, events: Sequence[AlarmEvent] = ()
) -> Options:
    """Draw friction over time with intervals, baseline, limits, trend and expected crossing.

    Only the latest estimates are drawn if there are many. `now` is today, ns since 1970. Alarm
    events and comments appear as marks at the bottom.
    """
    baseline = history.entries[-1].baseline
    of = trended(baseline)
    entries = history.entries[-_MOST_POINTS:]
    series = _level_lines(history, of, zone)
    if history.trend is not None and history.trend.is_significant:
        series += _trend_lines(history.trend, zone)
    estimates: dict[Verdict, list[list[Any]]] = {Verdict.IDENTIFIED: [], Verdict.WEAK: []}
    bars: list[list[Any]] = []
    for entry in entries:
        point = entry.point(baseline)
        if point is None or entry.parameters[of].verdict not in estimates:
            continue
        time = _wall(point.time, zone)
        estimates[entry.parameters[of].verdict].append([time, _plain(point.value)])
        ends = (point.value - point.half_width, point.value + point.half_width)
        bars += [[time, _plain(ends[0])], [time, _plain(ends[1])], [time, None]]
    series.append(_line("95 % interval", bars, _BLUE, width=1.2))
    for verdict, points in estimates.items():
        edge = {"borderColor": _BLUE, "borderWidth": 1.5}
        filled = "transparent" if verdict is Verdict.WEAK else _BLUE
        style = {"itemStyle": {"color": filled, **edge}, "symbolSize": 6, "z": 4}
        series += [_scatter(verdict.value, points, filled, **style)] * bool(points)
    refused = [[_wall(one.time, zone), 0] for one in entries if one.refusal]
    if refused:
        small = {"yAxisIndex": 1, "symbol": "rect", "symbolSize": [2, 12]}
        series.append(_scatter("refused", refused, _GREY, **small))
    for label, (actions, symbol, colour) in _EVENTS.items():
        points = [[_wall(one.time, zone), 0.03] for one in events if one.action in actions]
        mark = {"yAxisIndex": 1, "symbol": symbol, "symbolSize": 10, "z": 6}
        series += [_scatter(label, points, colour, **mark)] * bool(points)
    series[0]["markLine"] = _marks(history, zone, now)
    name = "sliding friction [N]" if of == "sliding_friction" else "Coulomb friction F_c [N]"
    return {
        **_base(),
        "grid": {"left": 64, "right": 18, "top": 78, "bottom": 30},
        "tooltip": {"trigger": "item", "renderMode": "richText"},
        "dataZoom": [{"type": "inside", "filterMode": "none", "zoomOnMouseWheel": "ctrl"}],
        "toolbox": {
            "right": 8,
            "top": 28,
            "feature": {"dataZoom": {"yAxisIndex": False, "filterMode": "none"}, "restore": {}},
        },
        "xAxis": _axis("time", ""),
        "yAxis": [_axis("value", name), {"type": "value", "min": 0, "max": 1, "show": False}],
        "series": series,
    }


DRAG_TO_ZOOM: Options = {
    "type": "takeGlobalCursor",
    "key": "dataZoomSelect",
    "dataZoomSelectActive": True,
}
"""Action that makes a drag over the chart select a time range."""


def zoomed(now: int, span: int | None, zone: ZoneInfo) -> Options:
    """Return the options that show a time span before now, ns; None for all.

    The axis ends now: a zoom would move to the newest point, and look as recent.
    """
    begin, end = (None, None) if span is None else (_wall(now - span, zone), _wall(now, zone))
    return {"xAxis": {"min": begin, "max": end}}


WHOLE_AXIS: Options = {"type": "dataZoom", "start": 0, "end": 100}
"""Action that ends a zoom."""


_EVENTS = {
    "alarm raised": ((AlarmAction.RAISE, AlarmAction.WORSEN), "triangle", _ORANGE),
    "alarm cleared": ((AlarmAction.CLEAR,), "circle", _GREEN),
    "acknowledged": ((AlarmAction.ACKNOWLEDGE,), "diamond", _BLUE),
    "shelved, out of service": ((AlarmAction.SHELVE, AlarmAction.TAKE_OUT), "rect", _GREY),
    "comment": ((AlarmAction.COMMENT,), "pin", _GREY),
}


def _level_lines(history: ValveHistory, of: str, zone: ZoneInfo) -> list[Options]:
    """Draw the baseline and limits in force over time, without repetitions."""
    steps: list[tuple[int, float | None, Any]] = []
    for entry in history.entries:
        step = (_wall(entry.time, zone), friction_of(entry.baseline, of), entry.limits)
        if not steps or step[1:] != steps[-1][1:]:
            steps.append(step)
    last = history.entries[-1].time if history.trend is None else end_of_trend(history.trend)
    steps.append((_wall(max(last, history.entries[-1].time), zone), *steps[-1][1:]))
    drawn = [_line("baseline", [[t, _plain(v)] for t, v, _ in steps], _GREY, step="end", width=1.2)]
    for name, colour in _LIMITS.items():
        data = [
            [t, None if v is None else _plain(v * getattr(limits, name))] for t, v, limits in steps
        ]
        drawn.append(_line(LIMIT_NAMES[name], data, colour, step="end", dashes="dashed", width=1.2))
    return drawn


def _trend_lines(trend: Trend, zone: ZoneInfo) -> list[Options]:
    time = np.linspace(0.0, float(end_of_trend(trend) - trend.begin), 60)
    line, width = trend.line.at(time), trend.line.half_width(time)
    at = [_wall(trend.begin + round(one), zone) for one in time]
    low, band, middle = (
        [[t, _plain(y)] for t, y in zip(at, heights, strict=True)]
        for heights in (line - width, 2 * width, line)
    )
    unseen = {"stack": "band", "stackStrategy": "all", "width": 0}
    drawn = [
        _line("", low, _GREEN, **unseen),
        _line("95 % band", band, _GREEN, areaStyle={"color": _GREEN, "opacity": 0.18}, **unseen),
        _line("trend", middle, _GREEN, width=2),
    ]
    if trend.crossing is not None:
        point = [_wall(trend.crossing.time, zone), _plain(trend.crossing.level)]
        style = {"symbol": "diamond", "symbolSize": 13, "z": 5}
        drawn.append(_scatter("limit expected", [point], _GREEN, **style))
    return drawn


def _marks(history: ValveHistory, zone: ZoneInfo, now: int) -> Options:
    label = {"show": True, "color": _GREY, "fontSize": 12}
    marks = [("today", now, "solid", "insideEndBottom")]  # beside, not on, a baseline of today
    top = "insideEndTop"
    marks += [("baseline set", one.time, "dotted", top) for one in history.baselines[-3:]]
    if renewed := history.usage.renewal:
        marks.append(("packing renewed", renewed, "dashed", top))
    return {
        "symbol": "none",
        "silent": True,
        "data": [
            {"xAxis": _wall(time, zone), "name": name,
             "label": {**label, "formatter": name, "position": place},
             "lineStyle": {"color": _GREY, "type": style}}
            for name, time, style, place in marks
        ],
    }  # fmt: skip
