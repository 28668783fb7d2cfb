"""Panels of the figures, each drawn on given axes in the paper's units: kPa, mm, m/s, N."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from valve_friction_ros.figures.case import Case
from valve_friction_ros.identification import Parameter
from valve_friction_ros.model import Recording

__all__ = [
    "COLOURS",
    "draw_coulomb_sweep",
    "draw_drive",
    "draw_record",
    "draw_sigma_sweep",
    "draw_signature",
    "draw_stem",
    "thinned",
]

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""Colours of Okabe and Ito: colour-blind readers can distinguish them."""

_MOST_POINTS = 20_000
"""Most points drawn of a record. Chosen: ten for each pixel of the width, so that peaks stay."""


def thinned(size: int) -> slice:
    """Return the samples of a record to draw."""
    return slice(None, None, max(1, size // _MOST_POINTS))


def draw_record(pressure_axes: Axes, stem_axes: Axes, cases: Sequence[Case]) -> None:
    """Draw drive and stem position over the time since the first record began."""
    origin = cases[0].recording.start_time
    for case, colour in zip(cases, COLOURS, strict=False):
        recording = case.recording
        some = thinned(len(recording))
        time = (recording.time + recording.start_time - origin)[some]
        pressure_axes.plot(
            time, recording.drive[some] / recording.driven_by.size, color=colour, lw=1.2
        )
        stem_axes.plot(time, recording.position[some] * 1e3, color=colour, label=case.label, lw=1.2)
        if case.simulated is not None:
            spread = np.linspace(time[0], recording.time[-1] + time[0], case.simulated.size)
            few = thinned(case.simulated.size)
            stem_axes.plot(spread[few], case.simulated[few] * 1e3, "k:", lw=1.0)
            stem_axes.set_title("stem (dotted: refined model)", loc="right", fontsize="small")
    pressure_axes.set_ylabel(cases[0].recording.driven_by.label)
    pressure_axes.tick_params(labelbottom=False)
    stem_axes.set_ylabel("stem [mm]")
    stem_axes.set_xlabel("time [s]")


def draw_drive(axes: Axes, recording: Recording, colour: str) -> None:
    """Draw the drive over the time since the record began."""
    some, drive = thinned(len(recording)), recording.driven_by
    axes.plot(recording.time[some], recording.drive[some] / drive.size, color=colour, lw=1.2)
    axes.set_ylabel(drive.label)


def draw_stem(axes: Axes, recording: Recording, simulated: NDArray[np.float64]) -> None:
    """Draw the measured stem over the time, and the simulated stem as a dotted line on it."""
    some = thinned(len(recording))
    time = recording.time[some]
    axes.plot(time, recording.position[some] * 1e3, color=COLOURS[0], lw=1.2)
    axes.plot(time, simulated[some] * 1e3, "k:", lw=1.2)
    axes.set_ylabel("stem [mm]")
    axes.set_xlabel("time [s]")


def draw_signature(axes: Axes, cases: Sequence[Case]) -> None:
    """Draw the valve signature: stem position over the drive."""
    for case, colour in zip(cases, COLOURS, strict=False):
        recording, some = case.recording, thinned(len(case.recording))
        axes.plot(
            recording.drive[some] / recording.driven_by.size,
            recording.position[some] * 1e3,
            color=colour,
            lw=1.2,
            label=case.label,
        )
    axes.set_xlabel(cases[0].recording.driven_by.label)
    axes.set_ylabel("stem [mm]")
    axes.set_title("valve signature")


def _told(friction: Parameter) -> str:
    """Return the refined Coulomb friction and its verdict as text."""
    if math.isnan(friction.value):
        return f"$F_c$ {friction.verdict.value}"
    interval = f" ± {friction.half_width:.2g}" if friction.half_width > 0 else ""
    return f"$F_c$ = {friction.value:.4g}{interval} N: {friction.verdict.value}"


def draw_coulomb_sweep(axes: Axes, cases: Sequence[Case]) -> None:
    """Draw F_c over the threshold δv, the chosen threshold, and the refined F_c as a band."""
    levels = [0.0]
    for case, colour in zip(cases, COLOURS, strict=False):
        chosen, refined = case.chosen_coulomb_friction, case.friction
        axes.plot(case.thresholds, case.coulomb_friction, color=colour, lw=1.2)
        axes.plot(case.threshold, chosen, "o", color=colour, mec="black", ms=7, zorder=3)
        shown = chosen if math.isnan(refined.value) else refined.value
        if not math.isnan(refined.value):
            axes.axhline(refined.value, color=colour, ls="--", lw=1.0)
            axes.axhspan(*refined.interval, color=colour, alpha=0.2, lw=0)
        axes.annotate(
            _told(refined),
            (0.98, shown),
            xycoords=("axes fraction", "data"),
            xytext=(0, 5),
            textcoords="offset points",
            ha="right",
            bbox={"facecolor": "white", "alpha": 0.7, "linewidth": 0, "pad": 1},
        )
        levels += [chosen, shown]
    if max(levels) > 0:
        axes.set_ylim(0, 1.5 * max(levels))
    axes.set_ylabel("coulomb friction $F_c$ [N]")
    axes.tick_params(labelbottom=False)
    axes.set_title("δv sweep (● published choice, dashed: refined, with 95 % band)")


def draw_sigma_sweep(axes: Axes, cases: Sequence[Case]) -> None:
    """Draw σ_s over the threshold δv, with the chosen threshold marked."""
    for case, colour in zip(cases, COLOURS, strict=False):
        resolved = np.maximum(case.sigma, 1e-9 * np.nanmax(case.sigma))
        axes.semilogy(case.thresholds, resolved, color=colour, lw=1.2)
        axes.axvline(case.threshold, color=colour, ls=":", lw=1.2)
    axes.set_ylabel("$\\sigma_s$ [N]")
    axes.set_xlabel("threshold δv [m/s]")
