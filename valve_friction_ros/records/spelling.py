"""Names that nobody knows, and the nearest one that somebody does."""

import difflib
from collections.abc import Iterable

__all__ = ["nearest", "resembling"]

_MOST_NAMED = 12
"""Names in a message. Chosen: it stays readable."""

_RESEMBLES = 0.8
"""Likeness (difflib) of a misspelled name. Chosen: two letters of ten may differ."""


def resembling(name: str, known: Iterable[str]) -> list[str]:
    """Return the known name that a misspelled one resembles, if there is one."""
    return difflib.get_close_matches(name, known, n=1, cutoff=_RESEMBLES)


def nearest(name: object, known: Iterable[str]) -> str:
    """Return the end of a message about an unknown name: the nearest known one, or all of few."""
    names = list(known)
    text = str(name)[:100]
    close = difflib.get_close_matches(text, names, n=1)
    if not close:  # such as position for position_column
        close = [each for each in names if text and text in each.split("_")][:1]
    if close:
        return f"did you mean {close[0]!r}?"
    more = ", …" if len(names) > _MOST_NAMED else ""
    return f"known are {', '.join(names[:_MOST_NAMED])}{more}"
