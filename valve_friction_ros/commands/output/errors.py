"""How every sub-command reports an error: one line on stderr, and an exit code."""

import argparse
import contextlib
import errno
import os
import signal
import sys
from enum import IntEnum
from pathlib import Path
from typing import Any, NoReturn, TextIO

from valve_friction_ros.outside_text import printable

__all__ = [
    "PROGRAM",
    "ExitCode",
    "OneLineParser",
    "complain",
    "flush_output",
    "silence",
]

PROGRAM = "valve_friction"


class ExitCode(IntEnum):
    """Exit codes of all sub-commands."""

    DONE = 0
    PARTLY = 1
    """Some recordings were refused, the demonstration was off its tolerances, or a copy differs."""
    REFUSED = 2
    """An option, a file or all recordings were refused, or a file could not be written."""
    ALARM = 3
    """A diagnosis reached ``--fail-on``, or a fit is below ``--fail-below``."""
    INTERRUPTED = 128 + signal.SIGINT
    OUTPUT_CLOSED = 128 + signal.SIGPIPE


class OneLineParser(argparse.ArgumentParser):
    """A parser that reports an error on one line; the usage is behind ``--help``."""

    def error(self, message: str) -> NoReturn:
        """Print the error and end with exit code 2."""
        self.exit(ExitCode.REFUSED, f"{self.prog}: {message}; see --help\n")

    def _print_message(self, message: str, file: Any = None) -> None:
        """Print the help or an error; argparse would ignore that the help cannot be written."""
        if file is None or file is sys.stderr:
            super()._print_message(message, file)
        else:
            file.write(message)


def silence(stream: TextIO) -> None:
    """Discard what `stream` still holds, which Python would try to write again at its end."""
    with contextlib.suppress(OSError), Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), stream.fileno())


def flush_output() -> None:
    """Write what was printed; raises OSError where that fails, once."""
    try:
        sys.stdout.flush()
    except OSError:
        silence(sys.stdout)
        raise


_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def _text(error: Exception | str) -> str:
    if not isinstance(error, OSError) or not error.strerror:
        return str(error)
    # Functions that write files name them; those that print do not.
    place = error.filename or ("standard output" if error.errno in _FULL else "")
    return f"{place}: {error.strerror}" if place else error.strerror


def complain(command: str, error: Exception | str) -> None:
    """Print an error on one line of stderr; an OSError is reduced to the file and the cause.

    `command` is the sub-command, or an empty string.
    """
    speaker = " ".join(filter(None, (PROGRAM, command)))
    try:
        lines = _text(error).splitlines()
        print(f"{speaker}:", *map(printable, lines), file=sys.stderr)
    except OSError:  # a full device, or a closed pipe: there is nowhere else to say it
        silence(sys.stderr)
