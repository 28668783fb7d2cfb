"""How commands speak: errors on one line, numbers without an exponent."""

import argparse
import math
import sys
from typing import NoReturn

__all__ = ["OneLineParser", "complain", "json_number", "two_digits"]


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


def json_number(value: float) -> float | None:
    """Return `value`, or None, JSON's null, where it is not finite: JSON has no nan."""
    return value if math.isfinite(value) else None


def two_digits(value: float) -> str:
    """Write a size with two digits, or all of its whole ones, and without an exponent."""
    return f"{value:.0f}" if value >= 100 else f"{value:.2g}"
