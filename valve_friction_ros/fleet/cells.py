"""Cells of a table of text, which a spreadsheet shows as they are and never computes."""

__all__ = ["as_read", "harmless"]

_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""Beginnings of what a spreadsheet takes for a formula."""


def _is_formula(text: str) -> bool:
    return text.lstrip("'").startswith(_FORMULA)


def harmless(cell: object) -> object:
    """Return a cell; a text that looks like a formula gets an apostrophe before it."""
    return f"'{cell}" if isinstance(cell, str) and _is_formula(cell) else cell


def as_read(cell: str) -> str:
    """Return what `harmless` was given."""
    return cell[1:] if cell.startswith("'") and _is_formula(cell) else cell
