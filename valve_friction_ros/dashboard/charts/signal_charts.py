"""The signals of a valve as charts: over time, and one over the other."""

from valve_friction_ros.dashboard.charts.parts import (
    BLUE,
    GREY,
    MOST_POINTS,
    ORANGE,
    Options,
    axis,
    base,
    line,
    rounded,
)
from valve_friction_ros.dashboard.heard.live_strip import Strip
from valve_friction_ros.model import Recording

__all__ = ["live_chart", "live_data", "loop_chart", "loop_data"]


def _points(strip: Strip, scale: float) -> list[list[float]]:
    return [
        [round(t, 3), rounded(v * scale)]
        for t, v in zip(strip.times.tolist(), strip.values.tolist(), strict=True)
    ]


def live_data(pressure: Strip, stem: Strip) -> list[Options]:
    """Return the series of the live chart: pressure in kPa and stem in mm."""
    return [{"data": _points(pressure, 1e-3)}, {"data": _points(stem, 1e3)}]


def live_chart(span: float) -> Options:
    """Return the empty chart of the last `span` seconds: the pressure over the stem."""
    names = ("pressure [kPa]", "stem [mm]")
    grids = [
        {"left": 64, "right": 18, "top": 10, "height": "39%"},
        {"left": 64, "right": 18, "top": "53%", "bottom": 28},
    ]
    x = {"min": -span, "max": 0, "scale": False}
    upper = axis("value", "", gridIndex=0, **x)
    upper["axisLabel"] = {"show": False}
    return {
        **base(),
        "legend": {"show": False},
        "grid": grids,
        "xAxis": [upper, axis("value", "", gridIndex=1, **x)],
        "yAxis": [axis("value", name, gridIndex=i) for i, name in enumerate(names)],
        "series": [
            {**line(name, [], colour, width=1.2), "xAxisIndex": i, "yAxisIndex": i}
            for i, (name, colour) in enumerate(zip(names, (BLUE, ORANGE), strict=True))
        ],
    }


def loop_data(loop: Strip) -> list[list[float]]:
    """Return the points of a signature, pressures (Pa) and positions (m), as kPa and mm."""
    return [
        [rounded(p * 1e-3), rounded(x * 1e3)]
        for p, x in zip(loop.times.tolist(), loop.values.tolist(), strict=True)
    ]


def _recorded(record: Recording | None) -> list[list[float]]:
    if record is None:
        return []
    step = max(1, len(record) // MOST_POINTS)
    return loop_data(Strip(record.drive[::step], record.position[::step]))


def loop_chart(record: Recording | None) -> Options:
    """Draw the signature of the baseline's record; that of now is filled in by `loop_data`."""
    return {
        **base(),
        "grid": {"left": 58, "right": 18, "top": 34, "bottom": 44},
        "xAxis": axis("value", "pressure [kPa]", nameGap=26),
        "yAxis": axis("value", "stem [mm]", nameGap=38),
        "series": [
            line("baseline", _recorded(record), GREY, width=1.4),
            line("last minute", [], ORANGE, width=1.4),
        ],
    }
