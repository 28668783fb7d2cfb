"""The figure of a history: friction over months, with its intervals, limits and trend."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from valve_friction_ros.figures.page import labelled_in, legend_above
from valve_friction_ros.figures.trend_panel import (
    draw_history,
    entitle,
    set_dates,
    span_of_time,
)
from valve_friction_ros.figures.usage_panel import draw_usage, used_days
from valve_friction_ros.history import ValveHistory, drift_text

__all__ = ["MOST_PANELS", "drift_text", "report_trend_figure", "trend_figure"]

MOST_PANELS = 12
"""Most valves on one page. Chosen: still readable."""


_USAGE_HEIGHT = 1.5
"""Height of the panel of the usage, inches."""


def trend_figure(histories: Sequence[ValveHistory], now: int | None = None) -> Figure:
    """Draw the friction of valves over time, one panel a valve, over one time axis.

    It is the sliding friction at the speed of the last baseline, where that has one, else F_c.
    Below it is the travelled distance of each day, where any was counted within that time.

    Parameters
    ----------
    histories : sequence of ValveHistory
        One to `MOST_PANELS`.
    now : int, optional
        Today, ns since 1970 (UTC), to be marked where it is not far from the history.

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
    """Draw the friction of one valve over time, for the page of a report, without a title."""
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
