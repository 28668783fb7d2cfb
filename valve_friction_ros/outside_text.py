"""Text from files, topics and tags, made harmless where it is shown."""

from typing import Any

__all__ = ["cell", "printable"]

_LONGEST = 10_000
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""What a spreadsheet takes for the begin of a formula."""


def printable(text: str, most: int = _LONGEST) -> str:
    """Return text whose control characters, which a terminal would obey, are written out."""
    short = text if len(text) <= most else f"{text[:most]}…"
    if short.isprintable():
        return short
    return "".join(mark if mark.isprintable() else ascii(mark)[1:-1] for mark in short)


def cell(value: Any) -> Any:
    """Return the value of a CSV cell; a text that would be a formula begins with a quote mark."""
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value
