"""Figures of one identification for the pages of a report, each for the width of the paper."""

import math

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from valve_friction_ros.figures.case import Case
from valve_friction_ros.figures.page import dress
from valve_friction_ros.figures.panels import (
    COLOURS,
    draw_coulomb_sweep,
    draw_drive,
    draw_sigma_sweep,
    thinned,
)
from valve_friction_ros.figures.signature_figure import draw_signature_loop
from valve_friction_ros.identification import (
    Result,
    StemComparison,
    Sweep,
)
from valve_friction_ros.model import Recording

__all__ = [
    "SETTLED_SHARE",
    "chosen_region",
    "comparison_figure",
    "record_figure",
    "residual_figure",
    "signature_loop_figure",
    "sweep_figure",
]

_WIDTH = 7.1
"""Between the margins of an A4 page, inches."""

SETTLED_SHARE = 0.1
"""Largest difference of σ_s in the chosen region, over σ_s at the chosen threshold. Chosen."""

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
    some = thinned(len(recording))
    draw_drive(pressure, recording, COLOURS[0])
    stem.plot(recording.time[some], recording.position[some] * 1e3, color=COLOURS[0], lw=1.0)
    stem.set_ylabel("stem [mm]")
    stem.set_xlabel("time [s]")
    dress((pressure, stem))
    return figure


def signature_loop_figure(result: Result) -> Figure:
    """Draw stem position over the drive; by the force balance with P1, P2 and the sliding lines."""
    figure = _paper_figure(3.4)
    axes, recording = figure.subplots(), result.recording
    if result.signature is not None:
        draw_signature_loop(axes, recording, result.valve, result.signature)
    else:
        some = thinned(len(recording))
        drive = recording.driven_by
        axes.plot(
            recording.drive[some] / drive.size,
            recording.position[some] * 1e3,
            color=COLOURS[0],
            lw=1.0,
        )
        axes.set_xlabel(drive.label)
        axes.set_ylabel("stem [mm]")
    dress((axes,))
    return figure


def chosen_region(sweep: Sweep, threshold: float) -> tuple[float, float]:
    """Return the lowest and highest threshold, m/s, of the region around the chosen threshold."""
    choice = int(np.argmin(np.abs(sweep.thresholds - threshold)))
    level = sweep.sigma[choice]
    settled = np.abs(sweep.sigma - level) <= SETTLED_SHARE * level
    others = np.flatnonzero(~settled)
    below, above = others[others < choice], others[others > choice]
    first = int(below[-1]) + 1 if below.size else 0
    last = int(above[0]) - 1 if above.size else sweep.thresholds.size - 1
    return float(sweep.thresholds[min(first, choice)]), float(sweep.thresholds[max(last, choice)])


def sweep_figure(result: Result) -> Figure:
    """Draw F_c, σ_s and R²_s over the threshold δv, the chosen region shaded."""
    if result.estimate is None:
        raise ValueError(f"the method {result.method} has no sweep to draw")
    case, sweep = Case.of("recording", result), result.estimate.sweep
    figure = _paper_figure(4.5)
    coulomb, sigma, r_squared = figure.subplots(3, 1, sharex=True, height_ratios=[2, 1, 1])
    draw_coulomb_sweep(coulomb, [case])
    coulomb.set_title("● published choice, dashed: refined, with its 95 % band", fontsize="medium")
    draw_sigma_sweep(sigma, [case])
    sigma.set_xlabel("")
    sigma.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    sigma.yaxis.set_major_formatter("{x:g}")
    sigma.yaxis.set_minor_formatter(NullFormatter())
    r_squared.plot(case.thresholds, sweep.r_squared, color=COLOURS[0], lw=1.2)
    r_squared.axvline(case.threshold, color=COLOURS[0], ls=":", lw=1.2)
    r_squared.set_ylabel("$R^2_s$ [-]")
    r_squared.set_xlabel("threshold δv [m/s]")
    low, high = chosen_region(sweep, case.threshold)
    for axes in (coulomb, sigma, r_squared):
        axes.axvspan(low, high, color="black", alpha=0.12, lw=0, zorder=0)
    dress((coulomb, sigma, r_squared))
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
    figure.legend(loc="outside upper right", ncols=2, frameon=False)
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
