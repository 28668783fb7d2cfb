"""The page of a figure: its size, its title, the style of its panels."""

import io
import textwrap
from collections.abc import Iterable, Mapping, Sequence

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

__all__ = ["dress", "labelled_in", "legend_above", "titled_figure"]

_TITLE_WIDTH, _NOTE_WIDTH = 95, 130
"""Characters of a line of the title and of the notes, which fill the width of the figure."""

_MOST_NOTES = 3
"""Notes on a figure; more would take the room of the panels."""

_LEGEND_PAD = 0.2
"""Room above and below the legend of a figure, in heights of its letters."""


class _Shown(Figure):
    """A figure that a notebook shows, also where nobody has imported pyplot."""

    def _repr_png_(self) -> bytes:
        content = io.BytesIO()
        self.savefig(content, format="png")
        return content.getvalue()


def titled_figure(title: str, notes: Sequence[str] = ()) -> Figure:
    """Return an empty figure with `title`, wrapped, above it, and the first notes below it.

    The title is of this package; notes may hold text from outside, which is never read as maths.
    """
    figure = _Shown(figsize=(11, 8.5), layout="constrained", dpi=110)
    title = title.replace(" %", "\N{NO-BREAK SPACE}%")  # which textwrap leaves whole
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
    """Give panels a faint grid, and remove the sides of the frame without a scale."""
    for axes in panels:
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)


def labelled_in(panels: Iterable[Axes]) -> dict[str, Artist]:
    """Return what a legend of panels lists, by its label, each label once."""
    return {
        label: handle
        for axes in panels
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }


def legend_above(
    figure: Figure, entries: Mapping[str, Artist], columns: int, place: str = "center"
) -> None:
    """Put a legend at the upper edge of a figure without a title, and its panels below it.

    `place` is left, center or right. Needs no more than matplotlib 3.6, to which a legend outside
    the panels is unknown.
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
