"""A report page: its content, and its rendering as one self-contained HTML file."""

import base64
import io
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import ClassVar, NamedTuple

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from valve_friction_ros.page_template import page_environment
from valve_friction_ros.reports.typography import typeset

__all__ = [
    "Block",
    "Colour",
    "Column",
    "Page",
    "Paragraph",
    "Picture",
    "Section",
    "Status",
    "Table",
    "render",
]

_DOTS_PER_INCH = 150
"""Resolution of the pictures. Chosen: sharp on paper, and about 100 kB each."""

_NARROW, _NARROW_DOTS = 3.7, 200
"""Width, inches, and resolution of a picture on a narrow screen: its text is 13 px high there."""

_WIDEST = 7.5
"""Width, inches, up to which a figure is laid out for a narrow screen."""


@dataclass(frozen=True)
class Paragraph:
    """Running text; special characters are escaped."""

    kind: ClassVar[str] = "paragraph"

    text: str


@dataclass(frozen=True)
class Column:
    """Heading of a column, and whether it holds numbers, which are aligned right."""

    title: str
    is_number: bool = False


@dataclass(frozen=True)
class Table:
    """Rows of text under headings, as many cells each as there are columns.

    The caption stands above the table; `marked` rows, counted from 0, are highlighted. Raises
    ValueError if a row has another number of cells, or a marked row does not exist.
    """

    kind: ClassVar[str] = "table"

    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""
    marked: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a table with missing cells."""
        for number, row in enumerate(self.rows):
            if len(row) != len(self.columns):
                raise ValueError(f"row {number} has {len(row)} cells for {len(self.columns)}")
        for number in self.marked:
            if not 0 <= number < len(self.rows):
                raise ValueError(f"the marked row {number} does not exist")


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure, its caption, and its description for readers who cannot see it.

    A figure that is wider than a narrow screen is laid out a second time for that, unless `narrow`
    takes its place there, or it is so wide that it has many panels.
    """

    kind: ClassVar[str] = "picture"

    figure: Figure = field(repr=False)
    caption: str
    alt: str
    narrow: Figure | None = field(default=None, repr=False)

    @cached_property
    def png(self) -> bytes:
        """The picture itself, drawn once."""
        return _drawn(self.figure, _DOTS_PER_INCH)

    @cached_property
    def narrow_png(self) -> bytes | None:
        """The picture for a narrow screen, with text of the same size, if there is one."""
        if self.narrow is not None:
            return _drawn(self.narrow, _NARROW_DOTS)
        width, height = self.figure.get_size_inches()
        if not _NARROW < width <= _WIDEST:
            return None
        self.figure.set_size_inches(_NARROW, height)
        try:
            return _drawn(self.figure, _NARROW_DOTS)
        finally:
            self.figure.set_size_inches(width, height)

    @property
    def is_half(self) -> bool:
        """Whether two such pictures stand beside each other on a wide page."""
        return self.figure.get_figwidth() <= _NARROW

    @property
    def source(self) -> str:
        """The picture as a data address (PNG, base64)."""
        return _address(self.png)

    @property
    def narrow_source(self) -> str:
        """The picture for a narrow screen as a data address; empty without one."""
        return "" if self.narrow_png is None else _address(self.narrow_png)


def _drawn(figure: Figure, resolution: int) -> bytes:
    stream = io.BytesIO()
    figure.set_dpi(resolution)
    # It lays out once; savefig does it twice.
    FigureCanvasAgg(figure).print_png(stream)  # type: ignore[no-untyped-call]
    return stream.getvalue()


def _address(png: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"


Block = Paragraph | Table | Picture
"""Part of a section."""


@dataclass(frozen=True)
class Section:
    """A heading and the blocks below it."""

    title: str
    blocks: tuple[Block, ...]


class Colour(Enum):
    """Colours of a status, each with the sign that tells it without colour."""

    GREEN = "✓"
    GREY = "?"
    AMBER = "!"
    RED = "✗"


class Status(NamedTuple):
    """The conclusion in a few words, and what it is called elsewhere."""

    colour: Colour
    words: str
    addition: str = ""


@dataclass(frozen=True)
class Page:
    """A page: title, status, one or two sentences with the conclusion, date, and the sections."""

    title: str
    lead: str
    sections: tuple[Section, ...]
    status: Status | None = None
    date: str = ""


def render(page: Page) -> str:
    """Return a page as one HTML file without scripts and without links to other files.

    It reads on a screen of any width, and prints on A4.
    """
    environment = page_environment("valve_friction_ros.reports")
    environment.filters["typeset"] = typeset
    return environment.get_template("page.html").render(page=page)
