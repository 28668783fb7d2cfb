# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Figures of a record: identification, validation and report; and of a planned test."""

import math
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from valve_friction_ros.figures.panels import (
    COLOURS,
    SYMBOLS,
    Case,
    draw_panels,
    draw_record,
    draw_signature,
    dress,
    labelled_in,
    legend_above,
    thinned,
    titled_figure,
)
from valve_friction_ros.health.diagnosis import dead_band
from valve_friction_ros.identification.drawing import Drawing
from valve_friction_ros.identification.result import Result, StemComparison
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.identification.steps.validation import Validation
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.planning.search import StrokePlan, moved
from valve_friction_ros.wording import percentage, with_width


def friction_figure(cases: Sequence[Case], title: str, notes: Sequence[str] = ()) -> Figure:
    """Draw one or several identified records of a valve.

    Parameters
    ----------
    cases : sequence of Case
        One to four cases in order of time.
    title : str
        One sentence, printed above the panels.
    notes : sequence of str
        Printed below the panels in small type.

    Returns
    -------
    Figure
        Figure to save or show; matplotlib's global state is not changed.

    Raises
    ------
    ValueError
        If `cases` is empty or holds more cases than there are colours.
    """
    if not 0 < len(cases) <= len(COLOURS):
        raise ValueError(f"one to {len(COLOURS)} cases can be drawn, got {len(cases)}")
    own = [[one for one in case.drawing.panels if not one.is_detail] for case in cases]
    names = list(dict.fromkeys(panel.name for panels in own for panel in panels))
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
    draw_panels({name: panels[name] for name in names}, own)
    draw_signature(panels["signature"], cases)
    dress(panels.values())
    return figure


def identification_figure(result: Result) -> Figure:
    """Draw a recording and its identification, each number with its verdict."""
    return friction_figure(
        [Case.of("recording", result)], _identification_title(result), result.to_dict()["warnings"]
    )


def _identification_title(result: Result) -> str:
    """Name the sliding friction first; if it is known, leave out unknown parameters."""
    found, sliding = result.parameters, result.parameters.get(SLIDING)
    is_known = sliding is not None and math.isfinite(sliding.value)
    parts = [_with_verdict("sliding friction", sliding)] if sliding and is_known else []
    parts += [
        _with_verdict(f"${symbol}$", found[name])
        for name, symbol in SYMBOLS.items()
        if not (is_known and math.isnan(found[name].value))
    ]
    share = dead_band(result, result.valve)
    if math.isfinite(share):
        parts.append(f"dead band {percentage(share)} of travel")
    if math.isfinite(result.rms):
        parts.append(f"fit {100 * result.fit:.2f} %")
    return "; ".join(parts)


def _with_verdict(words: str, one: Parameter) -> str:
    if math.isnan(one.value):
        return f"{words} {one.verdict.value}"
    return f"{words} {with_width(one.value, one.half_width)} {one.unit} ({one.verdict.value})"


def validation_figure(validation: Validation, valve: Valve) -> Figure:
    """Draw measured and simulated stem, residual and drive over time.

    The title gives the rms of the residual as a share of the travel, too.
    """
    share = valve.share_of_travel(validation.rms)
    of_travel = f" ({percentage(share)} of travel)" if math.isfinite(share) else ""
    figure = titled_figure(
        f"fit {100 * validation.fit:.2f} %; rms {validation.rms * 1e6:.3g} µm{of_travel}; "
        f"largest error {validation.maximum_error * 1e6:.3g} µm"
    )
    panels = figure.subplot_mosaic(
        [["stem"], ["residual"], ["pressure"]], height_ratios=[2, 1, 1], sharex=True
    )
    recording = validation.recording
    some = thinned(len(recording))
    time = recording.time[some]
    drawing = Drawing(stem_title="stem (dotted: simulated)")
    stem = StemComparison(recording.sample_period, recording.position, validation.simulated)
    case = Case("", recording, drawing, stem)
    draw_record(panels["pressure"], panels["stem"], [case])
    panels["residual"].plot(time, validation.residual[some] * 1e3, color=COLOURS[1], lw=0.9)
    panels["residual"].set_ylabel("simulated −\nmeasured [mm]")
    panels["stem"].set_xlabel("")
    panels["pressure"].set_xlabel("time [s]")
    dress(panels.values())
    return figure


def plan_figure(plan: StrokePlan) -> Figure:
    """Draw the pressure before the converter, and the expected stem for each assumed friction."""
    test, travel = plan.test, plan.valve.travel
    figure = titled_figure(f"planned stroke test: {test.duration:.3g} s, {test.cycles} cycles")
    pressure, stem = figure.subplots(2, sharex=True)
    pressure.plot(test.times, test.pressures / 1e3, color=COLOURS[0])
    pressure.set_ylabel("pressure before\nthe converter [kPa]")
    for name, draw, colour in zip(
        plan.frictions.names,
        plan.frictions.draws,
        np.resize(COLOURS, len(plan.frictions.draws)),
        strict=True,
    ):
        record, _ = moved(test.excitation, test.duration, plan.valve, draw, plan.conditions)
        percent = 100 * record.position / travel
        stem.plot(record.time, percent, color=colour, label=f"friction {name}")
    for share, label in ((plan.limits.lowest, "part of the travel"), (plan.limits.highest, None)):
        stem.axhline(100 * share, color="0.5", lw=0.8, ls="--", label=label)
    stem.set_ylabel("expected stem [% of travel]")
    stem.set_xlabel("time [s]")
    stem.legend(frameon=False, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    dress((pressure, stem))
    return figure


_PAPER_WIDTH = 7.1
"""Width between the margins of an A4 page, inches."""

_PANEL_HEIGHT = 3.4
"""Height of a panel without another below it, inches."""

_HALF_WIDTH = 3.45
"""Width of each of two pictures side by side, inches."""

_PANEL_TITLE_WIDTH = 42
"""Characters per line of a panel title that fits a narrow screen."""

_PALE = "#8CC5E8"
"""Pale colour; curves drawn on it remain visible."""

_LAGS = 200
_BINS = 60
"""Lags and bins in the panels of the residual. Chosen: readable at page width."""


def _paper_figure(height: float) -> Figure:
    return Figure(figsize=(_PAPER_WIDTH, height), layout="constrained")


def record_figure(recording: Recording) -> Figure:
    """Draw drive and measured stem position over time."""
    figure = _paper_figure(2.9)
    pressure, stem = figure.subplots(2, 1, sharex=True)
    draw_record(pressure, stem, [Case("", recording, Drawing())])
    dress((pressure, stem))
    return figure


def signature_loop_figure(result: Result, healthy: Recording | None = None) -> Figure:
    """Draw the valve signature with the additions of the method, over that of the baseline."""
    figure = _paper_figure(_PANEL_HEIGHT)
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
    """Draw the panels of a method, with its chosen region shaded."""
    count = len(drawing.panels)
    figure = _paper_figure(1.5 * count if count > 1 else _PANEL_HEIGHT)
    ratios = [2, *[1] * (count - 1)]
    panels = figure.subplots(count, 1, sharex=True, height_ratios=ratios, squeeze=False)[:, 0]
    names = [panel.name for panel in drawing.panels]
    draw_panels(dict(zip(names, panels, strict=True)), [drawing.panels])
    for axes, panel in zip(panels, drawing.panels, strict=True):
        axes.set_title(textwrap.fill(panel.title, _PANEL_TITLE_WIDTH), fontsize="medium")
        if drawing.region is not None:
            axes.axvspan(*drawing.region, color="black", alpha=0.12, lw=0, zorder=0)
    dress(panels)
    return figure


def comparison_figure(comparison: StemComparison) -> Figure:
    """Draw the measured stem over time, with the simulated stem as a dotted line on it."""
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
    """Draw the residual over time."""
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
    """Draw histogram and autocorrelation of the residual."""
    residual = comparison.residual * 1e6
    figures = [Figure(figsize=(_HALF_WIDTH, 2.3), layout="constrained") for _ in range(2)]
    histogram, axes = (figure.subplots() for figure in figures)
    histogram.hist(residual, bins=_BINS, color=COLOURS[1])
    histogram.set_xlabel("residual [µm]")
    histogram.set_ylabel("samples")
    correlation = comparison.autocorrelation(min(_LAGS, residual.size))
    lags = np.arange(correlation.size) * comparison.sample_period
    chance = 1.96 / math.sqrt(residual.size)  # 95 % band of the autocorrelation of white noise
    axes.plot(lags, correlation, color=COLOURS[1], lw=1.2)
    axes.axhspan(-chance, chance, color="black", alpha=0.15, lw=0)
    axes.set_ylim(-1.05, 1.05)
    axes.set_xlabel("lag [s]")
    axes.set_ylabel("autocorrelation [-]")
    dress((histogram, axes))
    return figures[0], figures[1]
