"""Friction over time, on the page *Valve*."""

import time
from zoneinfo import ZoneInfo

from nicegui import ui

from valve_friction_ros.dashboard.charts import trend_chart
from valve_friction_ros.dashboard.pages.parts import text
from valve_friction_ros.dashboard.times import moment
from valve_friction_ros.history import ValveHistory, drift_text

__all__ = ["draw_trend"]

_UTC = ZoneInfo("UTC")


def draw_trend(kept: ValveHistory | None, problem: str | None, zone: ZoneInfo) -> None:
    """Draw friction over time and say its trend; or why there is none."""
    if problem:
        text("p", problem, "vf-none")
    if kept is None:
        if not problem:
            text("p", "No identification is kept of this valve.", "vf-none")
        return
    chart = ui.echart(trend_chart(kept, zone, time.time_ns()))
    chart.classes("vf-chart-trend").props["aria-label"] = "Friction over time"
    text("p", _trend_words(kept), "vf-trend-words")


def _trend_words(kept: ValveHistory) -> str:
    trend = kept.trend
    if trend is None:
        return "No trend: it needs estimates of four days since the baseline."
    if not trend.is_significant:
        return f"No significant drift of the {trend.what} in {trend.days} days with estimates."
    words = f"{trend.what[0].upper()}{trend.what[1:]}: {drift_text(trend)}"
    if trend.crossing is None:
        return f"{words}."
    early, late = (
        f"{moment(t, _UTC)[:10]}" for t in (trend.crossing.earliest, trend.crossing.latest)
    )
    return f"{words} (95 %: {early} to {late})."
