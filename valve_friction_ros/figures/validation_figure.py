"""The figure of a validation: measured and simulated stem, residual, and pressure."""

import math

from matplotlib.figure import Figure

from valve_friction_ros.figures.case import Case
from valve_friction_ros.figures.page import dress, titled_figure
from valve_friction_ros.figures.panels import COLOURS, draw_record, thinned
from valve_friction_ros.health import percentage
from valve_friction_ros.identification import Drawing, Validation
from valve_friction_ros.model import Valve

__all__ = ["validation_figure"]


def validation_figure(validation: Validation, valve: Valve) -> Figure:
    """Draw measured and simulated stem over the time, the residual, and the drive.

    Parameters
    ----------
    validation : Validation
        Record and simulated stem.
    valve : Valve
        Gives the travel, for the title.

    Returns
    -------
    Figure
        To be saved or shown; no global state of matplotlib is touched.
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
    case = Case("", recording, drawing, validation.simulated)
    draw_record(panels["pressure"], panels["stem"], [case])
    panels["residual"].plot(time, validation.residual[some] * 1e3, color=COLOURS[1], lw=0.9)
    panels["residual"].set_ylabel("simulated −\nmeasured [mm]")
    panels["stem"].set_xlabel("")
    panels["pressure"].set_xlabel("time [s]")
    dress(panels.values())
    return figure
