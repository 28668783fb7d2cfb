"""The page of a figure: its size, its title, the style of its panels."""

import textwrap
from collections.abc import Iterable

from matplotlib.axes import Axes
from matplotlib.figure import Figure

__all__ = ["dress", "titled_figure"]

_TITLE_WIDTH = 95
"""Characters of a line of the title, which fill the width of the figure."""


def titled_figure(title: str) -> Figure:
    """Return an empty figure with `title`, wrapped, above it."""
    figure = Figure(figsize=(11, 8.5), layout="constrained", dpi=110)
    figure.suptitle(
        textwrap.fill(title, _TITLE_WIDTH), fontsize=12, fontweight="bold", x=0.02, ha="left"
    )
    return figure


def dress(panels: Iterable[Axes]) -> None:
    """Give panels a faint grid, and remove the sides of the frame without a scale."""
    for axes in panels:
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
