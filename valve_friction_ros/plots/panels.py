"""Panels of the figures, each drawn on given axes in the paper's units: kPa, mm, m/s, N."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from valve_friction_ros.plots.case import Case

__all__ = ["COLOURS", "draw_coulomb_sweep", "draw_record", "draw_sigma_sweep", "draw_signature"]

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""Told apart by colour-blind readers too."""

_MOST_POINTS = 20_000
"""Points drawn of a record; more would not be seen."""


def _thinned(size: int) -> slice:
    return slice(None, None, max(1, size // _MOST_POINTS))


def draw_record(pressure_axes: Axes, stem_axes: Axes, cases: Sequence[Case]) -> None:
    """Draw pressure and stem position over the time since the first record began."""
    origin = cases[0].recording.start_time
    for case, colour in zip(cases, COLOURS, strict=False):
        recording = case.recording
        some = _thinned(len(recording))
        time = (recording.time + recording.start_time - origin)[some]
        pressure_axes.plot(
            time, recording.pressure[some] / case.drive.pascals, color=colour, lw=1.2
        )
        stem_axes.plot(time, recording.position[some] * 1e3, color=colour, label=case.label, lw=1.2)
    pressure_axes.set_ylabel(cases[0].drive.label)
    pressure_axes.tick_params(labelbottom=False)
    stem_axes.set_ylabel("stem [mm]")
    stem_axes.set_xlabel("time [s]")


def draw_signature(axes: Axes, cases: Sequence[Case]) -> None:
    """Draw the valve signature: stem position over pressure."""
    for case, colour in zip(cases, COLOURS, strict=False):
        some = _thinned(len(case.recording))
        axes.plot(
            case.recording.pressure[some] / case.drive.pascals,
            case.recording.position[some] * 1e3,
            color=colour,
            lw=1.2,
            label=case.label,
        )
    axes.set_xlabel(cases[0].drive.label)
    axes.set_ylabel("stem [mm]")
    axes.set_title("valve signature")


def draw_coulomb_sweep(axes: Axes, cases: Sequence[Case]) -> None:
    """Draw F_c over the threshold δv, with the chosen threshold marked."""
    for case, colour in zip(cases, COLOURS, strict=False):
        chosen = case.chosen_coulomb_friction
        axes.plot(case.thresholds, case.coulomb_friction, color=colour, lw=1.2)
        axes.plot(case.threshold, chosen, "o", color=colour, mec="black", ms=7, zorder=3)
        axes.annotate(
            f"$F_c$ = {chosen:.1f} N",
            (case.threshold, chosen),
            xytext=(4, 8),
            textcoords="offset points",
        )
    highest = max(case.chosen_coulomb_friction for case in cases)
    if highest > 0:
        axes.set_ylim(0, 1.5 * highest)
    axes.set_ylabel("coulomb friction $F_c$ [N]")
    axes.tick_params(labelbottom=False)
    axes.set_title("δv sweep (● chosen threshold)")


def draw_sigma_sweep(axes: Axes, cases: Sequence[Case]) -> None:
    """Draw σ_s over the threshold δv, with the chosen threshold marked."""
    for case, colour in zip(cases, COLOURS, strict=False):
        resolved = np.maximum(case.sigma, 1e-9 * np.nanmax(case.sigma))
        axes.semilogy(case.thresholds, resolved, color=colour, lw=1.2)
        axes.axvline(case.threshold, color=colour, ls=":", lw=1.2)
    axes.set_ylabel("$\\sigma_s$ [N]")
    axes.set_xlabel("threshold δv [m/s]")
