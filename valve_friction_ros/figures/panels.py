"""Panels of the figures, each drawn on given axes in the paper's units: kPa, mm, m/s, N."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from valve_friction_ros.figures.case import Case
from valve_friction_ros.identification import Curve, Panel, Parameter, two_digits

__all__ = [
    "COLOURS",
    "SYMBOLS",
    "draw_curves",
    "draw_panels",
    "draw_record",
    "draw_signature",
    "number",
    "thinned",
]

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""Colours of Okabe and Ito: colour-blind readers can distinguish them."""

_WHOLE, _HUGE = 1e4, 1e6
"""Sizes between which numbers are written without decimals."""

SYMBOLS = {"coulomb_friction": "F_c", "viscous_friction": "F_v", "spring_constant": "k"}
"""The parameters that figures name, by their symbols."""

_PALE = 0.4
"""Opacity of a curve on which another one stays visible, in print too."""

_LEAST_TICKS = 3
"""Ticks that a logarithmic axis needs, so that it can be read."""

_MOST_POINTS = 20_000
"""Most points drawn of a record. Chosen: ten for each pixel of the width, so that peaks stay."""


def thinned(size: int) -> slice:
    """Return the samples of a record to draw."""
    return slice(None, None, max(1, size // _MOST_POINTS))


def draw_record(drive_axes: Axes, stem_axes: Axes, cases: Sequence[Case]) -> None:
    """Draw drive and stem position over the time since the first record began."""
    origin = cases[0].recording.start_time
    for case, colour in zip(cases, COLOURS, strict=False):
        recording = case.recording
        some = thinned(len(recording))
        time = (recording.time + recording.start_time - origin)[some]
        drive_axes.plot(
            time, recording.drive[some] / recording.driven_by.size, color=colour, lw=1.2
        )
        is_alone = case.simulated is None
        stem_axes.plot(
            time,
            recording.position[some] * 1e3,
            color=colour,
            label=case.label,
            lw=1.2 if is_alone else 3.2,
            alpha=1.0 if is_alone else _PALE,
        )
        if case.simulated is not None:
            spread = np.linspace(time[0], recording.time[-1] + time[0], case.simulated.size)
            few = thinned(case.simulated.size)
            stem_axes.plot(spread[few], case.simulated[few] * 1e3, "k:", lw=1.3)
            stem_axes.set_title(case.drawing.stem_title, loc="right", fontsize="small")
        draw_curves(stem_axes, case.drawing.stem, 1.0)
    drive_axes.set_ylabel(cases[0].recording.driven_by.label)
    stem_axes.set_ylabel("stem [mm]")
    stem_axes.set_xlabel("time [s]")


def draw_curves(
    axes: Axes, curves: Sequence[Curve], x_unit: float, marker_colour: str = "black"
) -> None:
    """Draw curves of a method on the stem position, in mm, over what has this unit."""
    colours = iter(COLOURS[1:] * len(curves))
    for curve in curves:
        x, y = curve.scaled(x_unit, 1e-3)
        if curve.is_line:
            axes.plot(x, y, curve.style, color=next(colours), lw=1.6, label=curve.label)
        else:
            axes.plot(
                x,
                y,
                curve.style,
                color=marker_colour,
                mec="white",
                ms=9,
                zorder=4,
                label=curve.label,
            )


def draw_signature(axes: Axes, cases: Sequence[Case]) -> None:
    """Draw the valve signature: stem position over the drive, with what the method adds."""
    for case, colour in zip(cases, COLOURS, strict=False):
        recording, some = case.recording, thinned(len(case.recording))
        label = case.label if len(cases) > 1 else None
        drive = recording.driven_by
        axes.plot(
            recording.drive[some] / drive.size,
            recording.position[some] * 1e3,
            color=colour,
            lw=1.2,
            label=label,
        )
        draw_curves(axes, case.drawing.loop, drive.size)
    axes.set_xlabel(cases[0].recording.driven_by.label)
    axes.set_ylabel("stem [mm]")
    axes.set_title(cases[0].drawing.loop_title)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="upper left", frameon=False)


def _told(parameter: Parameter) -> str:
    """Return a parameter and its verdict as text."""
    symbol = SYMBOLS.get(parameter.name, parameter.name)
    if math.isnan(parameter.value):
        return f"${symbol}$ {parameter.verdict.value}"
    interval = f" ± {two_digits(parameter.half_width)}" if parameter.half_width > 0 else ""
    value = f"{number(parameter.value)}{interval} {parameter.unit}"
    return f"${symbol}$ = {value}: {parameter.verdict.value}"


def number(value: float) -> str:
    """Write a number with four digits, a true minus sign, and no exponent up to a million."""
    digits = f"{value:.0f}" if _WHOLE <= abs(value) < _HUGE else f"{value:.4g}"
    return digits.replace("-", "−")


def _draw_level(axes: Axes, level: Parameter, colour: str) -> list[float]:
    """Draw a parameter with its interval as a band; return its place, if it has one."""
    if math.isnan(level.value):
        return []
    axes.axhline(level.value, color=colour, ls="--", lw=1.0)
    axes.axhspan(*level.interval, color=colour, alpha=0.2, lw=0)
    return [level.value]


def _tell_levels(axes: Axes, panels: Sequence[Panel]) -> None:
    """Write parameters with their verdicts into the upper left corner, where no sweep begins."""
    levels = [panel.level for panel in panels if panel.level is not None]
    for row, (level, colour) in enumerate(zip(levels, COLOURS, strict=False)):
        axes.annotate(
            _told(level),
            (0.0, 1.0),
            xycoords="axes fraction",
            xytext=(6, -4 - 14 * row),
            textcoords="offset points",
            va="top",
            color="black" if len(levels) == 1 else colour,
            bbox={"facecolor": "white", "alpha": 0.8, "linewidth": 0, "pad": 1},
        )


def _make_logarithmic(axes: Axes) -> None:
    """Make the y axis logarithmic, with at least `_LEAST_TICKS` numbers on it."""
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    locator = LogLocator(subs=(1.0, 2.0, 5.0))
    ticks = [tick for tick in locator.tick_values(low, high) if low <= tick <= high]
    is_short = len(ticks) < _LEAST_TICKS
    axes.yaxis.set_major_locator(MaxNLocator(4) if is_short else locator)
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())


def draw_panel(axes: Axes, panels: Sequence[Panel]) -> None:
    """Draw the same panel of one or several cases."""
    levels = [0.0]
    for panel, colour in zip(panels, COLOURS, strict=False):
        for curve in panel.curves:
            x, y = curve.scaled(1.0, 1.0)
            if curve.is_line:
                axes.plot(x, y, curve.style, color=colour, lw=1.2)
            else:
                axes.plot(x, y, curve.style, color=colour, mec="black", ms=7, zorder=3)
                levels += y.tolist()
        if panel.chosen is not None:
            axes.axvline(panel.chosen, color=colour, ls=":", lw=1.2)
        if panel.level is not None:
            levels += _draw_level(axes, panel.level, colour)
    _tell_levels(axes, panels)
    if panels[0].level is not None and max(levels) > 0:
        axes.set_ylim(0, 1.5 * max(levels))
    if panels[0].is_logarithmic:
        _make_logarithmic(axes)
    axes.set_ylabel(panels[0].y_label)
    axes.set_title(panels[0].title)


def draw_panels(axes: Sequence[Axes], cases: Sequence[Sequence[Panel]]) -> None:
    """Draw the panels of one or several cases below one another; the lowest has the x label."""
    for place, panels in zip(axes, zip(*cases, strict=True), strict=True):
        draw_panel(place, panels)
        place.tick_params(labelbottom=False)
    if axes:
        axes[-1].set_xlabel(cases[0][-1].x_label)
        axes[-1].tick_params(labelbottom=True)
