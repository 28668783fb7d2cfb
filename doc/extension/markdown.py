"""Pieces of the pages that are written from the code: text of a person as Markdown."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

__all__ = ["Entry", "definition_list", "escaped"]


class Entry(NamedTuple):
    """A word of the reference, what it is, and what it means; the last two are Markdown."""

    term: str
    facts: str
    meaning: str


def escaped(text: str) -> str:
    """Write text of a person so that Markdown shows it as it is."""
    for mark in ("\\", "<", "*", "|", "[", "]"):
        text = text.replace(mark, "\\" + mark)
    return text


def definition_list(entries: Iterable[Entry]) -> Iterator[str]:
    """Write entries as a list of definitions, one line each."""
    for entry in entries:
        yield f"`{entry.term}`"
        if entry.facts:
            yield f": {entry.facts}"
            yield ""
            yield f"  {entry.meaning}"
        else:
            yield f": {entry.meaning}"
        yield ""
