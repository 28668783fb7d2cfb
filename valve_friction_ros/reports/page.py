"""A report page: its content, and its rendering as one self-contained HTML file."""

import base64
import io
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

__all__ = ["Block", "Column", "Page", "Paragraph", "Picture", "Section", "Table", "render"]

_DOTS_PER_INCH = 130
"""Resolution of the pictures. Chosen: sharp on paper, and about 100 kB each."""


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
    """A figure, its caption, and its description for readers who cannot see it."""

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
"""Part of a section."""


@dataclass(frozen=True)
class Section:
    """A heading and the blocks below it."""

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Page:
    """A page: its title, one or two sentences with the conclusion, and the sections."""

    title: str
    lead: str
    sections: tuple[Section, ...]


def render(page: Page) -> str:
    """Return a page as one HTML file without scripts and without links to other files.

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
