"""Figures of one identification for the pages of a report, each for the width of the paper."""

import math

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
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
    "record_figure",
    "residual_figure",
    "signature_loop_figure",
]

_WIDTH = 7.1
"""Between the margins of an A4 page, inches."""

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


def signature_loop_figure(result: Result) -> Figure:
    """Draw stem position over the drive, with what the method adds."""
    figure = _paper_figure(3.4)
    axes = figure.subplots()
    draw_signature(axes, [Case.of("recording", result)])
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
        axes.set_title(panel.title, fontsize="medium")
        if panel.is_logarithmic:
            axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.yaxis.set_major_formatter("{x:g}")
            axes.yaxis.set_minor_formatter(NullFormatter())
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
    axes.plot(time, comparison.simulated[some] * 1e3, "k:", lw=1.2, label="simulated")
    axes.set_ylabel("stem [mm]")
    axes.set_xlabel("time [s]")
    legend_above(figure, labelled_in([axes]), columns=2, place="right")
    dress((axes,))
    return figure


def residual_figure(comparison: StemComparison) -> Figure:
    """Draw the residual over the time, its histogram, and its autocorrelation."""
    figure = _paper_figure(4.0)
    panels = figure.subplot_mosaic([["time", "time"], ["histogram", "correlation"]])
    residual = comparison.residual * 1e6
    some = thinned(residual.size)
    panels["time"].plot(comparison.time[some], residual[some], color=COLOURS[1], lw=0.8)
    panels["time"].axhline(0, color="black", lw=0.8)
    panels["time"].set_ylabel("residual [µm]")
    panels["time"].set_xlabel("time [s]")
    panels["histogram"].hist(residual, bins=_BINS, color=COLOURS[1])
    panels["histogram"].set_xlabel("residual [µm]")
    panels["histogram"].set_ylabel("samples")
    correlation = comparison.autocorrelation(min(_LAGS, residual.size))
    lags = np.arange(correlation.size) * comparison.sample_period
    chance = _chance(residual)
    axes = panels["correlation"]
    axes.plot(lags, correlation, color=COLOURS[1], lw=1.2)
    axes.axhspan(-chance, chance, color="black", alpha=0.15, lw=0)
    axes.set_ylim(-1.05, 1.05)
    axes.set_xlabel("lag [s]")
    axes.set_ylabel("autocorrelation [-]")
    dress(panels.values())
    return figure


def _chance(residual: NDArray[np.float64]) -> float:
    """Return the bound within which 95 % of the autocorrelations of white noise lie."""
    return 1.96 / math.sqrt(residual.size)
