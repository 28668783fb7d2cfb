"""The figure of a valve signature: the record, the loop and its breakaway points."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from valve_friction_ros.figures.page import dress, titled_figure
from valve_friction_ros.figures.panels import COLOURS, draw_drive, draw_stem, thinned
from valve_friction_ros.identification import (
    Result,
    SignatureStroke,
    ValveSignature,
)
from valve_friction_ros.model import Drive, Recording, Valve

__all__ = ["draw_breakaway_points", "draw_signature_loop", "signature_figure"]


def draw_breakaway_points(
    axes: Axes, signature: ValveSignature, drive: Drive, colour: str = "black"
) -> None:
    """Mark P1 and P2 of every stroke on axes of stem position over the drive."""
    ways = (("$P_1$", "^", signature.upward_points), ("$P_2$", "v", signature.downward_points))
    for label, marker, points in ways:
        axes.plot(
            [point.drive / drive.size for point in points],
            [point.position * 1e3 for point in points],
            marker,
            color=colour,
            mec="white",
            ms=9,
            zorder=4,
            label=label,
        )


def draw_signature_loop(
    axes: Axes,
    recording: Recording,
    valve: Valve,
    signature: ValveSignature,
) -> None:
    """Draw the valve signature with P1 and P2, and the lines of the sliding stem.

    Parameters
    ----------
    axes : Axes
        To draw on.
    recording : Recording
        Drive and stem position.
    valve : Valve
        Converts forces into the drive.
    signature : ValveSignature
        The signature of the recording.
    """
    some = thinned(len(recording))
    drive = recording.driven_by
    axes.plot(
        recording.drive[some] / drive.size, recording.position[some] * 1e3, color=COLOURS[0], lw=1.2
    )
    for stroke, colour in zip(_first_of_each_way(signature), COLOURS[1:], strict=False):
        place = stroke.sliding.position[[0, -1]]
        level = float(
            np.mean(stroke.sliding.force - signature.spring_constant * stroke.sliding.position)
        )
        line = valve.actuator_drive(level + signature.spring_constant * place) / drive.size
        label = f"slides {'up' if stroke.direction > 0 else 'down'}, slope $S_a$/k"
        axes.plot(line, place * 1e3, "--", color=colour, lw=1.6, label=label)
    draw_breakaway_points(axes, signature, drive)
    axes.set_xlabel(drive.label)
    axes.set_ylabel("stem [mm]")
    width = signature.dead_zone / drive.size
    axes.set_title(
        f"valve signature: dead zone {width:.4g} {drive.unit}, "
        f"x̄ {signature.position_bias * 1e3:.3g} mm"
    )
    axes.legend(loc="upper left", frameon=False)


def signature_figure(result: Result, title: str) -> Figure:
    """Draw a recording, its valve signature with P1 and P2, and the lines of the sliding stem.

    Parameters
    ----------
    result : Result
        A result with a valve signature.
    title : str
        Printed above the panels.

    Returns
    -------
    Figure
        To be saved or shown; no global state of matplotlib is touched.
    """
    figure = titled_figure(title)
    panels = figure.subplot_mosaic(
        [["pressure"], ["stem"], ["signature"]], height_ratios=[1, 1.2, 2.8]
    )
    panels["stem"].sharex(panels["pressure"])
    recording, signature = result.recording, result.signature
    if signature is None or result.stem is None:
        raise ValueError(f"the method {result.method} has no valve signature to draw")
    draw_drive(panels["pressure"], recording, COLOURS[0])
    panels["pressure"].tick_params(labelbottom=False)
    draw_stem(panels["stem"], recording, result.stem.simulated)
    points = [stroke.breakaway for stroke in signature.strokes if stroke.breakaway is not None]
    panels["stem"].plot(
        [point.time for point in points],
        [point.position * 1e3 for point in points],
        "o",
        color="black",
        mec="white",
        zorder=4,
    )
    panels["stem"].set_title("stem (dotted: model; ●: breakaway)", loc="right", fontsize="small")
    draw_signature_loop(panels["signature"], recording, result.valve, signature)
    dress(panels.values())
    return figure


def _first_of_each_way(signature: ValveSignature) -> list[SignatureStroke]:
    return [way[0] for way in signature.ways]
