"""The figure of an identification: record, sweep, signature and verdicts on one page."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from valve_friction_ros.figures.case import Case
from valve_friction_ros.figures.page import dress, titled_figure
from valve_friction_ros.figures.panels import (
    COLOURS,
    SYMBOLS,
    draw_panels,
    draw_record,
    draw_signature,
    number,
)
from valve_friction_ros.health import dead_band, percentage
from valve_friction_ros.identification import Result

__all__ = ["friction_figure", "identification_figure"]


def friction_figure(cases: Sequence[Case], title: str, notes: Sequence[str] = ()) -> Figure:
    """Draw one or several identified records of a valve.

    Parameters
    ----------
    cases : sequence of Case
        One to four, in the order of time.
    title : str
        One sentence, printed above the panels.
    notes : sequence of str
        Printed below them, in small letters.

    Returns
    -------
    Figure
        To be saved or shown; no global state of matplotlib is touched.

    Raises
    ------
    ValueError
        If `cases` is empty, or holds more cases than distinct colours.
    """
    if not 0 < len(cases) <= len(COLOURS):
        raise ValueError(f"one to {len(COLOURS)} cases can be drawn, got {len(cases)}")
    own = [[one for one in case.drawing.panels if not one.is_detail] for case in cases]
    names = [panel.name for panel in own[0]]
    figure = titled_figure(title, notes)
    rows: list[Any]
    if names:
        rows = [["pressure"] * 2, ["stem"] * 2, *([name, "signature"] for name in names)]
        heights = [1, 1.2, 1.8, *[1] * (len(names) - 1)]
    else:
        rows, heights = [["pressure"], ["stem"], ["signature"]], [1, 1.2, 2.8]
    panels = figure.subplot_mosaic(rows, height_ratios=heights)
    panels["stem"].sharex(panels["pressure"])
    for name in names[1:]:
        panels[name].sharex(panels[names[0]])
    draw_record(panels["pressure"], panels["stem"], cases)
    panels["pressure"].tick_params(labelbottom=False)
    draw_panels([panels[name] for name in names], own)
    draw_signature(panels["signature"], cases)
    dress(panels.values())
    return figure


def identification_figure(result: Result) -> Figure:
    """Draw a recording and its identification, each number with its verdict."""
    return friction_figure(
        [Case.of("recording", result)], _title(result), result.to_dict()["warnings"]
    )


def _title(result: Result) -> str:
    shown = result.to_dict()
    parts = [_with_verdict(symbol, shown["parameters"][name]) for name, symbol in SYMBOLS.items()]
    share = dead_band(result, result.valve)
    if math.isfinite(share):
        parts.append(f"dead band {percentage(share)} of travel")
    if shown["rms"] is not None:
        parts.append(f"fit {100 * shown['fit']:.2f} %")
    return "; ".join(parts)


def _with_verdict(symbol: str, parameter: Mapping[str, Any]) -> str:
    value, verdict = parameter["value"], parameter["verdict"]
    if value is None:
        return f"${symbol}$ {verdict}"
    return f"${symbol}$ {number(value)} {parameter['unit']} ({verdict})"
