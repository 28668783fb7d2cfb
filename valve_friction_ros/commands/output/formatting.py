"""Consoles that results are printed on."""

import errno
import os
import sys

from rich.console import Console

__all__ = ["OutputConsole", "plain_console"]

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
