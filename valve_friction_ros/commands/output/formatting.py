"""Consoles, and numbers without an exponent."""

import errno
import math
import os
import sys

from rich.console import Console

__all__ = ["OutputConsole", "json_number", "plain_console", "two_digits"]

_PRINTED_WIDTH = 120
"""Columns of what goes into a file or a pipe, which has no width of its own."""


class OutputConsole(Console):
    """A console for which a closed output is an error; rich would end the process in silence."""

    def on_broken_pipe(self) -> None:
        """Raise the error again."""
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))


def plain_console() -> Console:
    """Return a console that prints text as it is, as wide as the terminal if there is one."""
    width = None if sys.stdout.isatty() else _PRINTED_WIDTH
    return OutputConsole(width=width, highlight=False, markup=False)


def json_number(value: float) -> float | None:
    """Return `value`, or None, JSON's null, where it is not finite: JSON has no nan."""
    return value if math.isfinite(value) else None


def two_digits(value: float) -> str:
    """Write a size with two digits, or all of its whole ones, and without an exponent."""
    return f"{value:.0f}" if value >= 100 else f"{value:.2g}"
