# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Common parts of figures: page, record data, panels in the paper's units, and picture files."""

import io
import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from valve_friction_ros.identification.drawing import Curve, Drawing, Panel
from valve_friction_ros.identification.result import Result, StemComparison
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.records.files import write_whole
from valve_friction_ros.wording import with_width

_TITLE_WIDTH, _NOTE_WIDTH = 95, 130
"""Characters per line of title and notes; they fill the width of the figure."""

_MOST_NOTES = 3
"""Notes on a figure; more would leave too little room for the panels."""

_LEGEND_PAD = 0.2
"""Padding above and below the legend of a figure, in font sizes."""


class _Shown(Figure):
    """A figure that a notebook shows even without pyplot."""

    def _repr_png_(self) -> bytes:
        content = io.BytesIO()
        self.savefig(content, format="png")
        return content.getvalue()


def titled_figure(title: str, notes: Sequence[str] = ()) -> Figure:
    """Return an empty figure with a wrapped title above it and the first notes below it.

    The title comes from this package. Notes may contain text from outside, which is never parsed as
    maths.
    """
    figure = _Shown(figsize=(11, 8.5), layout="constrained", dpi=110)
    title = title.replace(" %", "\N{NO-BREAK SPACE}%")  # textwrap does not break it
    figure.suptitle(
        textwrap.fill(title, _TITLE_WIDTH), fontsize=12, fontweight="bold", x=0.02, ha="left"
    )
    if notes:
        shown = [f"note: {note}" for note in notes]
        if len(notes) > _MOST_NOTES + 1:  # a line on one note would be as long as the note
            hidden = len(notes) - _MOST_NOTES
            shown[_MOST_NOTES:] = [f"and {hidden} more notes, which the command prints"]
        lines = "\n".join(textwrap.fill(one, _NOTE_WIDTH) for one in shown)
        text = figure.supxlabel(lines, fontsize=9, x=0.02, ha="left")
        text.set_parse_math(False)
    return figure


def dress(panels: Iterable[Axes]) -> None:
    """Give panels a faint grid, and remove the top and right sides of the frame."""
    for axes in panels:
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)


def labelled_in(panels: Iterable[Axes]) -> dict[str, Artist]:
    """Return the legend entries of panels by label, each label once."""
    return {
        label: handle
        for axes in panels
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }


def legend_above(
    figure: Figure, entries: Mapping[str, Artist], columns: int, place: str = "center"
) -> None:
    """Put a legend at the upper edge of a figure without a title, and the panels below it.

    `place` is left, center or right. This works with matplotlib 3.6, which cannot place a legend
    outside the panels by itself.
    """
    legend = figure.legend(
        list(entries.values()),
        list(entries),
        loc=f"upper {place}",
        ncols=columns,
        frameon=False,
        borderaxespad=_LEGEND_PAD,
    )
    pad = 2 * _LEGEND_PAD * legend.prop.get_size_in_points() / 72 * figure.dpi
    share = (legend.get_window_extent().height + pad) / figure.bbox.height
    figure.set_layout_engine("constrained", rect=(0, 0, 1, 1 - share))


@dataclass(frozen=True, eq=False)
class Case:
    """A record and the drawable parts of its identification.

    Attributes
    ----------
    label : str
        Name in the legend.
    recording : Recording
        Drive and stem position.
    drawing : Drawing
        Additions by the method.
    stem : StemComparison or None
        Simulated and measured stem position.
    """

    label: str
    recording: Recording = field(repr=False)
    drawing: Drawing = field(repr=False)
    stem: StemComparison | None = field(default=None, repr=False)

    @classmethod
    def of(cls, label: str, result: Result) -> "Case":
        """Return the case of a result."""
        return cls(label, result.recording, result.drawing, result.stem)


def _format(path: Path) -> str:
    return path.suffix.lstrip(".").lower()


def require_picture_file(path: Path) -> None:
    """Refuse an unsuitable picture file before the work begins.

    Raises ValueError if the ending is not a picture format, or the folder does not exist.
    """
    endings = Figure().canvas.get_supported_filetypes()
    if _format(path) not in endings:
        raise ValueError(
            f"{path}: the extension is not a picture format; choose .png, .pdf or .svg"
        )
    if not path.parent.is_dir():
        raise ValueError(f"{path}: there is no folder {path.parent}: create it, or choose another")


def save_picture(figure: Figure, path: Path) -> None:
    """Save a figure to a file in the format of its ending.

    Raises OSError, which names `path`, if it cannot be written; no partial picture remains.
    """
    content = io.BytesIO()
    figure.savefig(content, format=_format(path))
    write_whole(path, content.getvalue())


COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""Colours of Okabe and Ito, which colour-blind readers can distinguish."""


SYMBOLS = {"coulomb_friction": "F_c", "viscous_friction": "F_v", "spring_constant": "k"}
"""Symbols of the parameters that figures name."""

_PALE = 0.4
"""Opacity of a curve; another curve drawn on it remains visible, in print too."""

_LEAST_TICKS = 3
"""Minimum number of ticks for a readable logarithmic axis."""

_MOST_POINTS = 20_000
"""Maximum number of points to draw per record. Chosen: ten per pixel of width keep the peaks."""


def thinned(size: int) -> slice:
    """Return the samples of a record to draw."""
    return slice(None, None, max(1, size // _MOST_POINTS))


def draw_record(drive_axes: Axes, stem_axes: Axes, cases: Sequence[Case]) -> None:
    """Draw drive and stem position over the time since the start of the first record."""
    origin = cases[0].recording.start_time
    for case, colour in zip(cases, COLOURS, strict=False):
        recording = case.recording
        some = thinned(len(recording))
        time = (recording.time + recording.start_time - origin)[some]
        drive_axes.plot(
            time, recording.drive[some] / recording.driven_by.size, color=colour, lw=1.2
        )
        is_alone = case.stem is None
        stem_axes.plot(
            time,
            recording.position[some] * 1e3,
            color=colour,
            label=case.label,
            lw=1.2 if is_alone else 3.2,
            alpha=1.0 if is_alone else _PALE,
        )
        if case.stem is not None:
            few = thinned(case.stem.simulated.size)
            model_time = (case.stem.time + recording.start_time - origin)[few]
            stem_axes.plot(model_time, case.stem.simulated[few] * 1e3, "k:", lw=1.3)
            stem_axes.set_title(case.drawing.stem_title, loc="right", fontsize="small")
        draw_curves(stem_axes, case.drawing.stem, 1.0)
    drive_axes.set_ylabel(cases[0].recording.driven_by.label)
    stem_axes.set_ylabel("stem [mm]")
    stem_axes.set_xlabel("time [s]")


def draw_curves(
    axes: Axes, curves: Sequence[Curve], x_unit: float, marker_colour: str = "black"
) -> None:
    """Draw curves of a method on the stem position, mm, over an x axis in units of `x_unit`."""
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
    """Draw the valve signature: stem position over drive, with the additions of the method."""
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
    symbol = SYMBOLS.get(parameter.name, parameter.name)
    if math.isnan(parameter.value):
        return f"${symbol}$ {parameter.verdict.value}"
    value = f"{with_width(parameter.value, parameter.half_width)} {parameter.unit}"
    return f"${symbol}$ = {value}: {parameter.verdict.value}"


def _draw_level(axes: Axes, level: Parameter, colour: str) -> list[float]:
    """Draw a parameter with its interval as a band, and return its value if it has one."""
    if math.isnan(level.value):
        return []
    axes.axhline(level.value, color=colour, ls="--", lw=1.0)
    axes.axhspan(*level.interval, color=colour, alpha=0.2, lw=0)
    return [level.value]


def _tell_levels(axes: Axes, panels: Mapping[str, Panel]) -> None:
    """Write parameters with their verdicts into the upper left corner, clear of the sweeps."""
    told = [(colour, _told(one.level)) for colour, one in panels.items() if one.level is not None]
    for row, (colour, words) in enumerate(told):
        axes.annotate(
            words,
            (0.0, 1.0),
            xycoords="axes fraction",
            xytext=(6, -4 - 14 * row),
            textcoords="offset points",
            va="top",
            color="black" if len(told) == 1 else colour,
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


def _draw_curve(axes: Axes, curve: Curve, colour: str, label: str) -> None:
    """Draw a curve with its intervals: a band around a line, error bars at markers."""
    x, y = curve.scaled(1.0, 1.0)
    half_width = None if curve.half_width is None else np.asarray(curve.half_width)
    if not curve.is_line:
        size = 7 if half_width is None else 5
        axes.errorbar(
            x,
            y,
            half_width,
            fmt=curve.style,
            color=colour,
            mec="black",
            ms=size,
            capsize=3,
            zorder=3,
            label=label,
        )
        return
    axes.plot(x, y, curve.style, color=colour, lw=1.2, label=label)
    if half_width is not None:
        axes.fill_between(x, y - half_width, y + half_width, color=colour, alpha=0.2, lw=0)


def draw_panel(axes: Axes, panels: Mapping[str, Panel]) -> None:
    """Draw the same panel of one or several cases, each in its colour."""
    levels, labels = [0.0], {""}
    for colour, panel in panels.items():
        for curve in panel.curves:
            label = "" if curve.label in labels else curve.label
            labels.add(curve.label)
            _draw_curve(axes, curve, colour, label)
            if not curve.is_line:
                levels += np.asarray(curve.y).tolist()
        if panel.chosen is not None:
            axes.axvline(panel.chosen, color=colour, ls=":", lw=1.2)
        if panel.level is not None:
            levels += _draw_level(axes, panel.level, colour)
    first = next(iter(panels.values()))
    _tell_levels(axes, panels)
    if first.level is not None and max(levels) > 0:
        axes.set_ylim(0, 1.5 * max(levels))
    if first.is_logarithmic:
        _make_logarithmic(axes)
    if len(labels) > 1:
        axes.legend(loc="best", frameon=False, fontsize="small")
    axes.set_ylabel(first.y_label)
    axes.set_title(first.title)
    axes.set_xlabel(first.x_label)


def draw_panels(axes: Mapping[str, Axes], cases: Sequence[Sequence[Panel]]) -> None:
    """Draw panels by name for the cases that have them; only the lowest panel has an x label."""
    for name, place in axes.items():
        found = {
            colour: panel
            for colour, panels in zip(COLOURS, cases, strict=False)
            for panel in panels
            if panel.name == name
        }
        draw_panel(place, found)
    for place in list(axes.values())[:-1]:
        place.set_xlabel("")
        place.tick_params(labelbottom=False)
