"""What the charts share: colours, axes and lines."""

import math
from collections.abc import Sequence
from typing import Any

__all__ = [
    "BLUE",
    "GREEN",
    "GREY",
    "MOST_POINTS",
    "ORANGE",
    "Options",
    "axis",
    "base",
    "line",
    "plain",
    "rounded",
]

BLUE, ORANGE, GREY, GREEN = "#0072B2", "#D55E00", "#8a949f", "#009E73"
MOST_POINTS = 1500
"""Most points of a line."""
_SPLIT = "rgba(128,140,152,0.22)"

Options = dict[str, Any]


def base() -> Options:
    """Return what all charts share."""
    return {
        "animation": False,
        "useUTC": True,
        "textStyle": {"fontFamily": "inherit"},
        "grid": {"left": 64, "right": 18, "top": 34, "bottom": 30},
        "legend": {"top": 0, "left": 0, "itemWidth": 16, "itemHeight": 8, "icon": "roundRect",
                   "textStyle": {"color": GREY, "fontSize": 12}},
    }  # fmt: skip


def axis(kind: str, name: str, **more: Any) -> Options:
    """Return an axis of a kind of ECharts."""
    return {
        "type": kind,
        "name": name,
        "nameLocation": "middle",
        "nameGap": 46,
        "nameTextStyle": {"color": GREY},
        "scale": True,
        "axisLabel": {"color": GREY, "hideOverlap": True},
        "axisLine": {"show": True, "lineStyle": {"color": GREY}},
        "splitLine": {"lineStyle": {"color": _SPLIT}, "show": kind == "value"},
        **more,
    }


def line(name: str, data: Sequence[Any], colour: str, **style: Any) -> Options:
    """Return a line through points; `width` and `dashes` are its own, the rest the series'."""
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


def plain(value: float | None) -> float | None:
    """Return a number as JSON can hold it, rounded."""
    return None if value is None or not math.isfinite(value) else rounded(value)


def rounded(value: float) -> float:
    """Return a number with six digits, more than a screen shows."""
    return float(f"{value:.6g}")
