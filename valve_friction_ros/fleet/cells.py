"""Cells of a table of text, which a spreadsheet shows as they are and never computes."""

__all__ = ["as_read", "harmless"]

_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""Beginnings of what a spreadsheet takes for a formula."""


def harmless(cell: object) -> object:
    """Return a cell; a text that looks like a formula gets an apostrophe before it."""
    is_formula = isinstance(cell, str) and cell.startswith(_FORMULA)
    return f"'{cell}" if is_formula else cell


def as_read(cell: str) -> str:
    """Return what `harmless` was given."""
    return cell[1:] if cell.startswith("'") and cell[1:].startswith(_FORMULA) else cell
