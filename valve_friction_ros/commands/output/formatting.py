"""How commands speak: errors on one line, numbers without an exponent."""

import argparse
import math
import sys
from typing import NoReturn

from rich.console import Console

__all__ = ["OneLineParser", "complain", "json_number", "plain_console", "two_digits"]

_PRINTED_WIDTH = 120
"""Columns of what goes into a file or a pipe, which has no width of its own."""


class OneLineParser(argparse.ArgumentParser):
    """A parser that tells an error on one line; the usage is behind ``--help``."""

    def error(self, message: str) -> NoReturn:
        """Print the error and end with exit code 2."""
        self.exit(2, f"{self.prog}: {message}; see --help\n")


def complain(command: str, error: Exception) -> None:
    """Print an error on one line of stderr; of the system's: the file and the cause."""
    told = str(error)
    if isinstance(error, OSError) and error.strerror:
        told = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    print(f"{command}:", *told.splitlines(), file=sys.stderr)


def plain_console() -> Console:
    """Return a console that prints text as it is, as wide as the terminal if there is one."""
    width = None if sys.stdout.isatty() else _PRINTED_WIDTH
    return Console(width=width, highlight=False, markup=False)


def json_number(value: float) -> float | None:
    """Return `value`, or None, JSON's null, where it is not finite: JSON has no nan."""
    return value if math.isfinite(value) else None


def two_digits(value: float) -> str:
    """Write a size with two digits, or all of its whole ones, and without an exponent."""
    return f"{value:.0f}" if value >= 100 else f"{value:.2g}"
