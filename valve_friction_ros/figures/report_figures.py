"""Figures of one identification for the pages of a report, each for the width of the paper."""

import math
import textwrap

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from valve_friction_ros.figures.case import Case
from valve_friction_ros.figures.page import dress, labelled_in, legend_above
from valve_friction_ros.figures.panels import (
    COLOURS,
    draw_panels,
    draw_record,
    draw_signature,
    thinned,
)
from valve_friction_ros.identification import Drawing, Result, StemComparison
from valve_friction_ros.model import Recording

__all__ = [
    "comparison_figure",
    "evidence_figure",
    "noise_figures",
    "record_figure",
    "residual_figure",
    "signature_loop_figure",
]

_WIDTH = 7.1
"""Between the margins of an A4 page, inches."""

_HALF = 3.45
"""Width of one of two pictures beside each other, inches."""

_TITLE = 42
"""Characters of a line above a panel, on a narrow screen too."""

_PALE = "#8CC5E8"
"""Pale, so that curves on it stay visible."""

_LAGS = 200
_BINS = 60
"""Lags and bins of the residual's panels. Chosen: readable at the width of a page."""


def _paper_figure(height: float) -> Figure:
    return Figure(figsize=(_WIDTH, height), layout="constrained")


def record_figure(recording: Recording) -> Figure:
    """Draw drive and measured stem position over the time."""
    figure = _paper_figure(2.9)
    pressure, stem = figure.subplots(2, 1, sharex=True)
    draw_record(pressure, stem, [Case("", recording, Drawing())])
    dress((pressure, stem))
    return figure


def signature_loop_figure(result: Result, healthy: Recording | None = None) -> Figure:
    """Draw stem position over the drive, with what the method adds, on that of the baseline."""
    figure = _paper_figure(3.4)
    axes = figure.subplots()
    if healthy is not None:
        some, unit = thinned(len(healthy)), healthy.driven_by.size
        drive, position = healthy.drive[some] / unit, healthy.position[some] * 1e3
        axes.plot(drive, position, color="0.6", lw=1.6, label="baseline")
    draw_signature(axes, [Case.of("recording" if healthy is None else "now", result)])
    if healthy is not None:
        axes.lines[1].set_label("now")
        axes.legend(loc="upper left", frameon=False)
    dress((axes,))
    return figure


def evidence_figure(drawing: Drawing) -> Figure:
    """Draw the panels of a method, with the region that it chose shaded."""
    count = len(drawing.panels)
    figure = _paper_figure(1.5 * count)
    ratios = [2, *[1] * (count - 1)]
    panels = figure.subplots(count, 1, sharex=True, height_ratios=ratios, squeeze=False)[:, 0]
    draw_panels(panels.tolist(), [drawing.panels])
    for axes, panel in zip(panels, drawing.panels, strict=True):
        axes.set_title(textwrap.fill(panel.title, _TITLE), fontsize="medium")
        if drawing.region is not None:
            axes.axvspan(*drawing.region, color="black", alpha=0.12, lw=0, zorder=0)
    dress(panels)
    return figure


def comparison_figure(comparison: StemComparison) -> Figure:
    """Draw the measured stem over the time, and the simulated stem as a dotted line on it."""
    figure = _paper_figure(2.7)
    axes = figure.subplots()
    some = thinned(comparison.measured.size)
    time = comparison.time[some]
    axes.plot(time, comparison.measured[some] * 1e3, color=_PALE, lw=3.0, label="measured")
    axes.plot(time, comparison.simulated[some] * 1e3, "k:", lw=1.4, label="simulated")
    axes.set_ylabel("stem [mm]")
    axes.set_xlabel("time [s]")
    legend_above(figure, labelled_in([axes]), columns=2, place="right")
    dress((axes,))
    return figure


def residual_figure(comparison: StemComparison) -> Figure:
    """Draw the residual over the time."""
    figure = _paper_figure(2.2)
    axes = figure.subplots()
    residual = comparison.residual * 1e6
    some = thinned(residual.size)
    axes.plot(comparison.time[some], residual[some], color=COLOURS[1], lw=0.8)
    axes.axhline(0, color="black", lw=0.8)
    axes.set_ylabel("residual [µm]")
    axes.set_xlabel("time [s]")
    dress((axes,))
    return figure


def noise_figures(comparison: StemComparison) -> tuple[Figure, Figure]:
    """Draw the histogram of the residual, and its autocorrelation."""
    residual = comparison.residual * 1e6
    figures = [Figure(figsize=(_HALF, 2.3), layout="constrained") for _ in range(2)]
    histogram, axes = (figure.subplots() for figure in figures)
    histogram.hist(residual, bins=_BINS, color=COLOURS[1])
    histogram.set_xlabel("residual [µm]")
    histogram.set_ylabel("samples")
    correlation = comparison.autocorrelation(min(_LAGS, residual.size))
    lags = np.arange(correlation.size) * comparison.sample_period
    chance = _chance(residual)
    axes.plot(lags, correlation, color=COLOURS[1], lw=1.2)
    axes.axhspan(-chance, chance, color="black", alpha=0.15, lw=0)
    axes.set_ylim(-1.05, 1.05)
    axes.set_xlabel("lag [s]")
    axes.set_ylabel("autocorrelation [-]")
    dress((histogram, axes))
    return figures[0], figures[1]


def _chance(residual: NDArray[np.float64]) -> float:
    """Return the bound within which 95 % of the autocorrelations of white noise lie."""
    return 1.96 / math.sqrt(residual.size)
