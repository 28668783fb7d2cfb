"""Figures of the records: excitations, Fig. 1, Fig. 2 and Fig. 5 of the paper."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from valve_friction_ros.figures import draw_curves
from valve_friction_ros.figures.page import dress, labelled_in, legend_above
from valve_friction_ros.figures.panels import COLOURS, thinned
from valve_friction_ros.reproduction import paper
from valve_friction_ros.reproduction.experiments import Experiment
from valve_friction_ros.reproduction.force_terms import force_terms
from valve_friction_ros.reproduction.programme import BenchResult

__all__ = [
    "excitations_figure",
    "force_terms_figure",
    "input_output_figure",
    "new_figure",
    "packing_name",
    "signatures_figure",
]


def new_figure(height: float) -> Figure:
    """Return an empty figure of the page's width."""
    return Figure(figsize=(9.5, height), layout="constrained", dpi=110)


def packing_name(result: BenchResult) -> str:
    """Return the name of a result's packing."""
    name = result.bench.name
    return f"{name} friction" if name in paper.PACKINGS else f"{name} packing"


def _draw_pressure(axes: Axes, experiment: Experiment, duration: float) -> None:
    """Draw commanded and actual pressure of the first part of a record."""
    recording = experiment.measured
    count = min(round(duration / recording.sample_period) + 1, len(recording))
    time = recording.time[:count]
    some = thinned(count)
    axes.plot(time[some], experiment.command[:count][some] / 1e3, "k--", lw=1.0, label="commanded")
    axes.plot(
        time[some],
        recording.pressure[:count][some] / 1e3,
        color=COLOURS[0],
        lw=1.3,
        label="in the actuator",
    )
    axes.set_xlabel("time [s]")
    axes.set_ylabel("pressure [kPa]")


def excitations_figure(result: BenchResult) -> Figure:
    """Draw the four excitations, before and behind the V/P converter."""
    figure = new_figure(6.2)
    panels = figure.subplots(2, 2)
    experiments = result.experiments
    shown = (
        ("square wave (identification)", experiments.square, 31.2),
        ("triangle (valve signature)", experiments.triangle, 126.0),
        ("sine (validation)", experiments.sine, 71.0),
        ("ISA steps (validation)", experiments.isa, np.inf),
    )
    for axes, (title, experiment, duration) in zip(panels.flat, shown, strict=True):
        _draw_pressure(axes, experiment, min(duration, experiment.measured.duration))
        axes.set_title(title)
    legend_above(figure, labelled_in([panels[0, 0]]), columns=2)
    dress(panels.flat)
    return figure


def input_output_figure(low: BenchResult, high: BenchResult) -> Figure:
    """Draw Fig. 1: pressure and stem under the square wave, with both packings."""
    figure = new_figure(5.2)
    panels = figure.subplots(2, 2, sharex=True, sharey="row")
    for column, result in enumerate((low, high)):
        recording, model = result.experiments.square.measured, result.identified.refined
        some = thinned(len(recording))
        time = recording.time[some]
        top, bottom = panels[:, column]
        top.plot(time, recording.pressure[some] / 1e3, color=COLOURS[0], lw=1.2)
        bottom.plot(
            time, recording.position[some] * 1e3, color=COLOURS[0], lw=1.2, label="measured"
        )
        if model.stem is not None:
            few = thinned(model.stem.simulated.size)
            simulated = model.stem.simulated[few] * 1e3
            bottom.plot(model.stem.time[few], simulated, "k:", lw=1.3, label="estimated")
        top.set_title(packing_name(result))
        bottom.set_xlabel("time [s]")
    panels[0, 0].set_ylabel("pressure [kPa]")
    panels[1, 0].set_ylabel("stem position [mm]")
    legend_above(figure, labelled_in([panels[1, 0]]), columns=2)
    dress(panels.flat)
    return figure


def signatures_figure(*results: BenchResult) -> Figure:
    """Draw Fig. 2: valve signatures, with P1, P2 and the dead zone of each."""
    figure = new_figure(5.4)
    axes = figure.subplots()
    for result, colour in zip(results, COLOURS, strict=False):
        recording = result.experiments.triangle.measured
        signature = result.identified.signature
        some = thinned(len(recording))
        zone = signature.dead_zone / 1e3
        axes.plot(
            recording.pressure[some] / 1e3,
            recording.position[some] * 1e3,
            color=colour,
            lw=1.2,
            label=f"{packing_name(result)}: dead zone {zone:.2f} kPa",
        )
        draw_curves(axes, signature.breakaway_curves(), 1e3, colour)
        _draw_dead_zone(axes, result, colour)
    handles, labels = axes.get_legend_handles_labels()
    # P1 and P2 look alike for all packings; the legend lists them last.
    kept = dict(sorted(zip(labels, handles, strict=True), key=lambda one: one[0].startswith("$")))
    axes.legend(kept.values(), kept.keys(), loc="upper left", frameon=False)
    axes.set_xlabel("actuator pressure [kPa]")
    axes.set_ylabel("stem position [mm]")
    dress([axes])
    return figure


def _draw_dead_zone(axes: Axes, result: BenchResult, colour: str) -> None:
    """Draw an arrow across the loop in the middle of its height, as wide as the dead zone."""
    signature = result.identified.signature
    position = result.experiments.triangle.measured.position
    height = 0.5 * float(position.min() + position.max())
    height += 0.05 * float(np.ptp(position)) * (1 if result.bench.name == "low" else -1)
    force = signature.spring_constant * (height + signature.position_bias)
    middle = float(result.bench.valve.actuator_drive(float(force))) / 1e3
    half = signature.dead_zone / 2e3
    axes.annotate(
        "",
        (middle - half, height * 1e3),
        (middle + half, height * 1e3),
        arrowprops={"arrowstyle": "<->", "color": colour, "lw": 1.6, "shrinkA": 0, "shrinkB": 0},
    )


def force_terms_figure(result: BenchResult) -> Figure:
    """Draw Fig. 5: the contribution of each term of (4) under the sine."""
    figure = new_figure(5.6)
    large, small = figure.subplots(2, 1, sharex=True, height_ratios=[1.6, 1])
    time, terms = force_terms(result)
    some = thinned(time.size)
    for (name, term), colour in zip(terms.items(), COLOURS, strict=True):
        for axes in (large, small):
            axes.plot(time[some], term[some], color=colour, lw=1.2, label=name)
    reach = 1.3 * float(np.max(np.abs(terms["F_v·ẋ"])))
    small.set_ylim(-reach, reach)
    small.set_title("the same, enlarged: F_v·ẋ and m·ẍ", fontsize="medium", loc="left")
    small.set_xlabel("time [s]")
    for axes in (large, small):
        axes.set_ylabel("force [N]")
    large.legend(loc="upper right", ncols=4, frameon=False)
    large.set_ylim(top=1.2 * large.get_ylim()[1])
    dress([large, small])
    return figure
