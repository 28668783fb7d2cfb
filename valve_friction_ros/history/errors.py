"""The error of a history that cannot be read or written."""

__all__ = ["HistoryError", "RowRefusedError"]


class HistoryError(Exception):
    """The history cannot be read or written; the message names it, the cause and a remedy."""


class RowRefusedError(HistoryError):
    """A server refuses a row by its content, and would do so each time."""
