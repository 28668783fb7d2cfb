# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The figures of the report, each with its caption, in the order of the paper."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper import published_numbers as paper
from paper.checks import FIGURES, NOTATION, force_terms
from paper.experiments import Experiment
from paper.programme import BenchResult, Programme
from valve_friction_ros.figures import draw_curves
from valve_friction_ros.figures.panels import COLOURS, dress, labelled_in, legend_above, thinned
from valve_friction_ros.reports import Picture


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
    """Draw the four excitations before and after the V/P converter."""
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
        recording, model = result.experiments.square.measured, result.identified.simulated
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
    """Draw Fig. 2: valve signatures with their P1, P2 and dead zones."""
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
    """Draw an arrow as wide as the dead zone across the loop, near mid-height."""
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


_SWEPT = ("mass", "viscous_friction", "coulomb_friction", "spring_constant")
_SHOWN = (2.0, 98.0)
"""Percentiles of an estimate at the ends of the axis; extremes lie far outside."""


def _mark(axes: Axes, result: BenchResult) -> None:
    """Mark the region of the least σ_s, the chosen δv and the paper's choice."""
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
    """Draw Fig. 4: σ_s and R²_s over δv, and the number of remaining samples."""
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


def validation_figure(result: BenchResult, is_sine: bool) -> Figure:
    """Draw one of Figs. 6 to 9, sine or ISA steps: measured stem, models, and their errors."""
    experiment = result.experiments.sine if is_sine else result.experiments.isa
    models = result.sine if is_sine else result.isa
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


Pictures = Mapping[str, Picture]


def draw_figures(programme: Programme) -> Pictures:
    """Draw all figures with captions, by file name."""
    low, high, graphite = (programme.results[name] for name in (*paper.PACKINGS, "graphite"))
    pictures: dict[str, Picture] = {}

    def keep(name: str, figure: Figure, text: str) -> None:
        pictures[name] = Picture(figure, text, text)

    what = "The four excitations as commanded, and behind the V/P converter."
    keep("excitations", excitations_figure(low), what)
    keep("figure_1", input_output_figure(low, high), "Fig. 1: input and stem, low and high.")
    what = "valve signatures with the breakaway points P1 (up) and P2 (down) and the dead zones"
    keep("figure_2", signatures_figure(low, high), f"Fig. 2: {what} (arrows).")
    what = "As Fig. 2, graphite packing: the stem jumps as it breaks away."
    keep("figure_2_graphite", signatures_figure(graphite), what)
    for one in (low, high, graphite):
        name = one.bench.name
        shown = packing_name(one) + ("." if name == "low" else " (not in the paper).")
        keep(f"figure_3_{name}", estimates_figure(one), f"Fig. 3: estimates over δv, {shown}")
        what = f"Fig. 4: σ_s of (17) and R²_s of (18) over δv, {shown}"
        keep(f"figure_4_{name}", quality_figure(one), what)
    what = "Fig. 5: contribution of each term of (4), sine, high friction."
    keep("figure_5", force_terms_figure(high), what)
    for (name, excitation), place in FIGURES.items():
        what = f"{place}: validation, {name} friction, {excitation}; errors against the stem "
        figure = validation_figure(programme.results[name], is_sine=excitation == "sine")
        keep(place.lower().replace("fig. ", "figure_"), figure, f"{what}without sensor noise.")
    for excitation, places in (("sine", "Figs. 6 and 7"), ("isa", "Figs. 8 and 9")):
        figure = validation_figure(graphite, is_sine=excitation == "sine")
        keep(f"validation_graphite_{excitation}", figure, f"As {places}, graphite packing.")
    return pictures
