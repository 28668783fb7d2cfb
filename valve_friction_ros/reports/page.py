# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A report page: its content, and its rendering as one self-contained HTML file."""

import base64
import html
import io
import re
import tempfile
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import ClassVar, NamedTuple

from jinja2.filters import do_mark_safe
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from valve_friction_ros.outside_text import page_environment
from valve_friction_ros.records.files import disk_trouble, write_whole

_SYMBOL = re.compile(r"(?<![\w.])([FPRSTakv]|σ|R²)_(ref|[a-z0-9])(?!\w|\.\w)")
_MINUS = re.compile(r"(?<![\w.-])-(?=\d)")


class Verbatim(str):
    """Text from outside, such as a file name, shown unchanged."""

    __slots__ = ()


def typeset(text: str) -> str:
    """Escape a text, and typeset F_c with a subscript and -1 with a minus sign."""
    escaped = html.escape(text)
    if not isinstance(text, Verbatim):
        escaped = _MINUS.sub("−", _SYMBOL.sub(r"\1<sub>\2</sub>", escaped))
    return do_mark_safe(escaped)


_DOTS_PER_INCH = 150
"""Resolution of the pictures. Chosen: sharp on paper, and about 100 kB each."""

_NARROW, _NARROW_DOTS = 3.7, 200
"""Width, inches, and resolution of a picture for a narrow screen, where its text is 13 px high."""

_WIDEST = 7.5
"""Largest width, inches, of a figure that is laid out again for a narrow screen."""


@dataclass(frozen=True)
class Paragraph:
    """Running text; special characters are escaped."""

    kind: ClassVar[str] = "paragraph"

    text: str


@dataclass(frozen=True)
class Column:
    """Heading of a column; numbers are aligned right."""

    title: str
    is_number: bool = False


@dataclass(frozen=True)
class PageTable:
    """Rows of text under headings, with one cell per column.

    The caption is printed above the table. `marked` rows, counted from 0, are highlighted.
    """

    kind: ClassVar[str] = "table"

    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""
    marked: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure, its caption, and a description for readers who cannot see it.

    A narrow screen shows `narrow` instead, if given. Otherwise a figure that is too wide is laid
    out again for the narrow screen, unless it is so wide that it has many panels.
    """

    kind: ClassVar[str] = "picture"

    figure: Figure = field(repr=False)
    caption: str
    alt: str
    narrow: Figure | None = field(default=None, repr=False)

    @cached_property
    def png(self) -> bytes:
        """The picture as PNG, drawn once."""
        return _drawn(self.figure, _DOTS_PER_INCH)

    @cached_property
    def narrow_png(self) -> bytes | None:
        """The picture for a narrow screen, with text of the same size, or None."""
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
        """Whether a wide page shows two such pictures side by side."""
        return self.figure.get_figwidth() <= _NARROW


def _drawn(figure: Figure, resolution: int) -> bytes:
    stream = io.BytesIO()
    figure.set_dpi(resolution)
    # This computes the layout once; savefig does it twice.
    FigureCanvasAgg(figure).print_png(stream)  # type: ignore[no-untyped-call]
    return stream.getvalue()


def _address(png: bytes) -> str:
    """Return a picture as a data address."""
    return f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"


Block = Paragraph | PageTable | Picture
"""Part of a section."""


@dataclass(frozen=True)
class Section:
    """A heading and the blocks below it."""

    title: str
    blocks: tuple[Block, ...]


class Colour(Enum):
    """Colours of a status, each with a sign that needs no colour."""

    GREEN = "✓"
    GREY = "?"
    AMBER = "!"
    RED = "✗"


class Conclusion(NamedTuple):
    """The conclusion in a few words, with an explanation such as its NE 107 signal."""

    colour: Colour
    words: str
    addition: str = ""


@dataclass(frozen=True)
class Page:
    """A page: title, status, conclusion in one or two sentences, date, and sections."""

    title: str
    lead: str
    sections: tuple[Section, ...]
    status: Conclusion | None = None
    date: str = ""


def render(page: Page) -> str:
    """Return a page as one HTML file without scripts or links to other files.

    It is readable on a screen of any width, and prints on A4.
    """
    environment = page_environment("valve_friction_ros.reports")
    environment.filters |= {"typeset": typeset, "address": _address}
    return environment.get_template("page.html").render(page=page)


_ENDINGS = (".html", ".htm")


def require_report_file(path: Path) -> None:
    """Refuse an unsuitable report file before the work begins.

    Raises ValueError if the ending is not .html, or if the folder does not exist or is not
    writable; the message names it.
    """
    if path.suffix.lower() not in _ENDINGS:
        raise ValueError(f"{path}: a report is an HTML page: give it a name that ends in .html")
    if not path.parent.is_dir():
        raise ValueError(f"{path}: there is no folder {path.parent}: create it, or choose another")
    if path.is_dir():
        raise ValueError(f"{path}: this is a folder: give the report another name")
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        cause = disk_trouble(error)
        raise ValueError(f"{path}: cannot write into {path.parent}: {cause}") from None


def write_report(page: Page, path: Path) -> None:
    """Write a page as one HTML file, atomically: a reader never finds part of it.

    Raises OSError if it cannot be written; an existing file then remains unchanged.
    """
    write_whole(path, render(page).encode())
