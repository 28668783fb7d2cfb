"""Figures of the models: the sweep (Figs. 3 and 4) and the validation (Figs. 6 to 9)."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from valve_friction_ros.figures.page import dress, labelled_in, legend_above
from valve_friction_ros.figures.panels import COLOURS, thinned
from valve_friction_ros.reproduction import paper
from valve_friction_ros.reproduction.checks.parameter_checks import NOTATION
from valve_friction_ros.reproduction.experiments import Experiment
from valve_friction_ros.reproduction.figures.record_figures import new_figure, packing_name
from valve_friction_ros.reproduction.programme import BenchResult, Comparison

__all__ = ["estimates_figure", "quality_figure", "validation_figure"]

_SWEPT = ("mass", "viscous_friction", "coulomb_friction", "spring_constant")
_SHOWN = (2.0, 98.0)
"""Percentiles of an estimate at the ends of the axis; the extremes are far outside."""


def _mark(axes: Axes, result: BenchResult) -> None:
    """Mark the region of the least σ_s, the chosen δv, and the paper's choice."""
    free = result.identified.free
    axes.axvspan(*free.region, color=COLOURS[2], alpha=0.2, lw=0, label="σ_s within 5 % of least")
    axes.axvline(free.threshold, color=COLOURS[2], lw=1.5, label="chosen here")
    axes.axvline(
        paper.CHOSEN_THRESHOLD, color="black", ls="--", lw=1.2, label="the paper's choice, low"
    )


def estimates_figure(result: BenchResult) -> Figure:
    """Draw Fig. 3: the four estimates over δv, with the truth."""
    figure = new_figure(6.4)
    panels = figure.subplots(2, 2, sharex=True)
    sweep = result.identified.free.sweep
    for axes, name in zip(panels.flat, _SWEPT, strict=True):
        estimate, truth = sweep.estimates[name], getattr(result.bench.truth, name)
        axes.plot(sweep.thresholds, estimate, color=COLOURS[0], lw=1.2, label="estimate")
        axes.axhline(truth, color=COLOURS[1], ls=":", lw=1.5, label="truth")
        _mark(axes, result)
        symbol, unit = NOTATION[name]
        axes.set_ylabel(f"${symbol}$ [{unit}]")
        low, high = np.nanpercentile(np.append(estimate, truth), _SHOWN)
        room = max(0.15 * (high - low), 1e-4 * abs(truth))
        axes.set_ylim(min(low, truth) - room, max(high, truth) + room)
        axes.ticklabel_format(axis="y", useOffset=False)
    for axes in panels[1]:
        axes.set_xlabel("threshold δv [m/s]")
    legend_above(figure, labelled_in([panels[0, 0]]), columns=5)
    dress(panels.flat)
    return figure


def quality_figure(result: BenchResult) -> Figure:
    """Draw Fig. 4: σ_s and R²_s over δv, and how many samples are left."""
    figure = new_figure(6.4)
    panels = figure.subplots(3, 1, sharex=True, height_ratios=[1.3, 1.3, 1])
    sweep = result.identified.free.sweep
    panels[0].semilogy(sweep.thresholds, sweep.sigma, color=COLOURS[0], lw=1.2)
    panels[0].set_ylabel("$\\sigma_s$ [N]")
    panels[1].semilogy(sweep.thresholds, np.abs(1 - sweep.r_squared), color=COLOURS[0], lw=1.2)
    panels[1].set_ylabel("$|1 - R_s^2|$")
    panels[2].semilogy(sweep.thresholds, np.maximum(sweep.samples, 1), color=COLOURS[0], lw=1.2)
    panels[2].set_ylabel("samples $n_s$")
    panels[2].set_xlabel("threshold δv [m/s]")
    for axes in panels:
        _mark(axes, result)
    legend_above(figure, labelled_in([panels[0]]), columns=3)
    dress(panels)
    return figure


def validation_figure(
    result: BenchResult, experiment: Experiment, models: dict[str, Comparison]
) -> Figure:
    """Draw one of Figs. 6 to 9: measured stem, models, and their errors."""
    styles = {
        "model 1": (COLOURS[0], "-"),
        "model 2": (COLOURS[1], "--"),
        "paper's model 2": (COLOURS[2], "-."),
    }
    drawn = {name: style for name, style in styles.items() if name in models}
    of_paper = [name for name in drawn if name.startswith("paper")]
    figure = new_figure(6.8)
    rows = 3 if of_paper else 2
    panels = figure.subplots(rows, 1, sharex=True, height_ratios=[2, *[1] * (rows - 1)])
    stem = panels[0]
    recording = experiment.measured
    some = thinned(len(recording))
    time = recording.time[some]
    stem.plot(time, recording.position[some] * 1e3, color="0.6", lw=3.0, label="measured")
    for name, (colour, line) in drawn.items():
        one = models[name]
        simulated = one.validation.simulated[some] * 1e3
        stem.plot(time, simulated, line, color=colour, lw=1.1, label=name)
        axes = panels[1] if name in of_paper else panels[-1]
        axes.plot(time, one.error[some] * 1e6, line, color=colour, lw=1.1)
    stem.set_ylabel("stem position [mm]")
    stem.set_title(packing_name(result))
    if of_paper:
        panels[1].set_ylabel("paper's model 2\nerror [µm]")
    panels[-1].set_ylabel("our models\nerror [µm]")
    panels[-1].set_xlabel("time [s]")
    legend_above(figure, labelled_in([stem]), columns=4)
    dress(panels)
    return figure
