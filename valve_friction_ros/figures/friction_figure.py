"""The figure of an identification: record, sweep, signature and verdicts on one page."""

import math
from collections.abc import Sequence

from matplotlib.figure import Figure

from valve_friction_ros.figures.case import Case
from valve_friction_ros.figures.page import dress, titled_figure
from valve_friction_ros.figures.panels import (
    COLOURS,
    draw_coulomb_sweep,
    draw_record,
    draw_sigma_sweep,
    draw_signature,
)
from valve_friction_ros.figures.signature_figure import signature_figure
from valve_friction_ros.health import dead_band, percentage
from valve_friction_ros.identification import (
    PARAMETER_UNITS,
    Parameter,
    Result,
)
from valve_friction_ros.model import Valve

__all__ = ["friction_figure", "identification_figure"]


def friction_figure(cases: Sequence[Case], title: str) -> Figure:
    """Draw one or several identified records of a valve.

    Parameters
    ----------
    cases : sequence of Case
        One to four, in the order of time.
    title : str
        One sentence, printed above the panels.

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
    figure = titled_figure(title)
    panels = figure.subplot_mosaic(
        [
            ["pressure", "pressure"],
            ["stem", "stem"],
            ["coulomb", "signature"],
            ["sigma", "signature"],
        ],
        height_ratios=[1, 1.2, 1.8, 1],
    )
    panels["stem"].sharex(panels["pressure"])
    panels["sigma"].sharex(panels["coulomb"])
    draw_record(panels["pressure"], panels["stem"], cases)
    draw_coulomb_sweep(panels["coulomb"], cases)
    draw_sigma_sweep(panels["sigma"], cases)
    draw_signature(panels["signature"], cases)
    if len(cases) > 1:
        panels["signature"].legend(loc="upper left", frameon=False)
    dress(panels.values())
    return figure


def identification_figure(result: Result) -> Figure:
    """Draw a recording and its identification, each number with its verdict."""
    title = _title(result, result.valve)
    if result.signature is not None:
        return signature_figure(result, title)
    if result.estimate is None:
        return _figure_without_sweep(result, title)
    return friction_figure([Case.of("recording", result)], title)


def _figure_without_sweep(result: Result, title: str) -> Figure:
    figure = titled_figure(title)
    panels = figure.subplot_mosaic([["pressure", "signature"], ["stem", "signature"]])
    panels["stem"].sharex(panels["pressure"])
    case = Case.without_sweep("recording", result)
    draw_record(panels["pressure"], panels["stem"], [case])
    draw_signature(panels["signature"], [case])
    dress(panels.values())
    return figure


def _title(result: Result, valve: Valve) -> str:
    parts = [
        _with_verdict(symbol, result.parameters[name], PARAMETER_UNITS[name])
        for symbol, name in (
            ("F_c", "coulomb_friction"),
            ("F_v", "viscous_friction"),
            ("k", "spring_constant"),
        )
    ]
    share = dead_band(result, valve)
    if math.isfinite(share):
        parts.append(f"dead band {percentage(share)} of travel")
    if math.isfinite(result.rms):
        parts.append(f"fit {100 * result.fit:.2f} %")
    return "; ".join((*parts, *result.warnings))


def _with_verdict(symbol: str, parameter: Parameter, unit: str) -> str:
    if math.isnan(parameter.value):
        return f"{symbol} {parameter.verdict.value}"
    return f"{symbol} {parameter.value:.4g} {unit} ({parameter.verdict.value})"
