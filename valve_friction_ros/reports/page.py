"""A report page: what stands on it, and how it becomes one self-contained HTML file."""

import base64
import io
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

__all__ = ["Block", "Column", "Page", "Paragraph", "Picture", "Section", "Table", "render"]

_DOTS_PER_INCH = 130


@dataclass(frozen=True)
class Paragraph:
    """Running text; it is escaped, so that any character can stand in it."""

    kind: ClassVar[str] = "paragraph"

    text: str


@dataclass(frozen=True)
class Column:
    """Heading of a column, and whether it holds numbers, which stand at the right."""

    title: str
    is_number: bool = False


@dataclass(frozen=True)
class Table:
    """Rows of text under headings.

    Attributes
    ----------
    columns : tuple of Column
        From left to right.
    rows : tuple of tuple of str
        As many cells each as there are columns.
    caption : str
        Stands above the table; empty for none.
    marked : tuple of int
        Rows to be noticed, counted from 0.

    Raises
    ------
    ValueError
        If a row has another number of cells, or a marked row is not there.
    """

    kind: ClassVar[str] = "table"

    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""
    marked: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a table with holes."""
        for number, row in enumerate(self.rows):
            if len(row) != len(self.columns):
                raise ValueError(f"row {number} has {len(row)} cells for {len(self.columns)}")
        for number in self.marked:
            if not 0 <= number < len(self.rows):
                raise ValueError(f"there is no row {number} to mark")


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure, drawn into the page.

    Attributes
    ----------
    figure : Figure
        What is drawn.
    caption : str
        Stands below the picture.
    alt : str
        Says what is to be seen, for those who cannot see it.
    """

    kind: ClassVar[str] = "picture"

    figure: Figure = field(repr=False)
    caption: str
    alt: str

    @cached_property
    def png(self) -> bytes:
        """The picture itself, drawn once."""
        stream = io.BytesIO()
        self.figure.savefig(stream, format="png", dpi=_DOTS_PER_INCH)
        return stream.getvalue()

    @property
    def source(self) -> str:
        """The picture as a data address (PNG, base64)."""
        return f"data:image/png;base64,{base64.b64encode(self.png).decode('ascii')}"


Block = Paragraph | Table | Picture
"""What a section is made of."""


@dataclass(frozen=True)
class Section:
    """A heading and what stands below it."""

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Page:
    """A page: its title, one or two sentences that say it all, and the sections."""

    title: str
    lead: str
    sections: tuple[Section, ...]


def render(page: Page) -> str:
    """Return a page as one HTML file that needs no other: no scripts, no addresses.

    It reads on a screen of any width, and prints on A4.
    """
    environment = Environment(
        loader=PackageLoader("valve_friction_ros.reports", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template("page.html").render(page=page)
