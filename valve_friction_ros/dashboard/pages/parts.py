"""Parts of the pages: chips, cards, tables and lists of values."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager

from nicegui import ui

from valve_friction_ros.dashboard.heard.status_keys import Entry
from valve_friction_ros.dashboard.pages.theme import element

_LONG = 40
"""Characters from which a value stands below its name."""

__all__ = ["EntryList", "card", "chip", "retitle", "table", "text"]


def text(tag: str, words: str, css: str = "") -> ui.element:
    """Make an element with a text, which is never markup."""
    with element(tag, css) as made:
        ui.label(words)
    return made


def retitle(made: ui.element, words: str) -> None:
    """Change the text of an element that `text` has made."""
    label = made.default_slot.children[0]
    if isinstance(label, ui.label):
        label.set_text(words)


def chip(state: str, word: str, letter: str = "") -> ui.element:
    """Show a state by a colour, a word and, where it has one, its letter of NE 107."""
    with element("span", f"vf-chip vf-{state}") as made:
        if letter:
            text("b", letter, "vf-ne")
        ui.label(word)
    return made


@contextmanager
def card(title: str, css: str = "", note: str = "") -> Iterator[ui.element]:
    """Draw a card with a heading, and provide its body."""
    with element("section", f"vf-card {css}", aria_label=title):
        with element("header", "vf-card-head"):
            text("h2", title)
            if note:
                text("small", note)
        with element("div", "vf-card-body") as body:
            yield body


def table(
    titles: Sequence[str], rows: Iterable[Sequence[str]], numeric: Sequence[int] = (), css: str = ""
) -> ui.element:
    """Draw a table of texts; columns of numbers are set to the right."""
    with element("table", f"vf-list {css}") as made:
        with element("thead"), element("tr"):
            for column, title in enumerate(titles):
                text("th", title, "vf-n" if column in numeric else "").props["scope"] = "col"
        with element("tbody"):
            for row in rows:
                with element("tr"):
                    for column, words in enumerate(row):
                        text("td", words, "vf-n" if column in numeric else "")
    return made


class EntryList:
    """Values with their names and units; only what has changed is drawn anew.

    Parameters
    ----------
    empty : str
        What is said where there are none.
    """

    def __init__(self, empty: str) -> None:
        self._empty = empty
        self._body = element("div", "vf-entries")
        self._names: tuple[str, ...] | None = None
        self._values: list[ui.label] = []

    def show(self, entries: Sequence[Entry]) -> None:
        """Show these values."""
        names = tuple(one.name for one in entries)
        if names != self._names:
            self._names = names
            self._draw(entries)
        for label, entry in zip(self._values, entries, strict=True):
            label.set_text(f"{entry.text} {entry.unit}".strip())

    def _draw(self, entries: Sequence[Entry]) -> None:
        self._body.clear()
        self._values = []
        with self._body:
            if not entries:
                text("p", self._empty, "vf-none")
                return
            with element("dl", "vf-dl"):
                for entry in entries:
                    text("dt", entry.name)
                    long = len(entry.text) > _LONG
                    with element("dd", "vf-dd-long" if long else ""):
                        self._values.append(ui.label(""))
