# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A sub-command as a process: exit code, one line of error, Ctrl-C and SIGTERM.

Ctrl-C during a sub-command raises an exception that is never swallowed; SIGTERM can do the same. A
process that a script starts with ``&`` ignores Ctrl-C, but never SIGTERM.
"""

import argparse
import contextlib
import errno
import os
import signal
import sys
import threading
from enum import IntEnum
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn, TextIO

from valve_friction_ros.commands.start import end_at_once
from valve_friction_ros.outside_text import printable

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
    """A parser that reports an error on one line and shows the usage only for ``--help``."""

    def error(self, message: str) -> NoReturn:
        """Print the error and end with exit code 2."""
        self.exit(ExitCode.REFUSED, f"{self.prog}: {message}; see --help\n")

    def _print_message(self, message: str, file: Any = None) -> None:
        """Print the help or an error; argparse would ignore a failure to write the help."""
        if file is None or file is sys.stderr:
            super()._print_message(message, file)
        else:
            file.write(message)


def silence(stream: TextIO) -> None:
    """Discard the buffer of `stream`, which Python would try to write again at exit."""
    with contextlib.suppress(OSError), Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), stream.fileno())


def flush_output() -> None:
    """Flush standard output; raises OSError once if this fails."""
    try:
        sys.stdout.flush()
    except OSError:
        silence(sys.stdout)
        raise


_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def _text(error: Exception | str) -> str:
    if not isinstance(error, OSError) or not error.strerror:
        return str(error)
    # Functions that write files name the file; those that print do not.
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
    except OSError:  # a full device or a closed pipe: there is nowhere else to report it
        silence(sys.stderr)


_REPEAT = 0.02
"""Time until a lost Ctrl-C is repeated, s: callbacks are shorter."""
_came: list[int] = []
"""Numbers of the signals received."""


def has_been_interrupted() -> bool:
    """Return whether Ctrl-C, or SIGTERM in its place, has been received."""
    return bool(_came)


def _repeat() -> None:
    threading.Timer(_REPEAT, os.kill, (os.getpid(), _came[-1])).start()


def _repeat_if_importing() -> None:
    """Repeat a signal swallowed by a library during its import, while the import continues."""
    frames = sys._current_frames()  # noqa: SLF001 - documented, for debuggers
    frame = frames.get(threading.main_thread().ident or 0)
    while frame is not None:
        if frame.f_globals.get("__name__") == "importlib._bootstrap":
            _repeat()
            return
        frame = frame.f_back


def _interrupt(number: int, _: FrameType | None) -> None:
    _came.append(number)
    threading.Timer(_REPEAT, _repeat_if_importing).start()
    raise KeyboardInterrupt  # pandas passes on an object only; the default handler sets none


def _interrupt_again(unraisable: "sys.UnraisableHookArgs") -> None:
    """Repeat a signal that Python has ignored because it came during a callback."""
    if _came and issubclass(unraisable.exc_type, KeyboardInterrupt):
        _repeat()
    else:
        sys.__unraisablehook__(unraisable)


def let_interrupt_raise() -> None:
    """Let Ctrl-C raise KeyboardInterrupt from now on, instead of ending the process at once."""
    if signal.getsignal(signal.SIGINT) is end_at_once:
        signal.signal(signal.SIGINT, _interrupt)
        sys.unraisablehook = _interrupt_again


def requests_raise() -> None:
    """Let SIGTERM raise KeyboardInterrupt from now on, even if Ctrl-C is ignored.

    The end of the terminal (SIGHUP) does the same, unless the process runs under ``nohup``.
    """
    signal.signal(signal.SIGTERM, _interrupt)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        signal.signal(signal.SIGHUP, _interrupt)
    sys.unraisablehook = _interrupt_again


class StopSignals:
    """Context in which Ctrl-C and SIGTERM are only recorded."""

    def __init__(self) -> None:
        self.received: int | None = None
        self._before: dict[signal.Signals, Any] = {}

    def _note(self, number: int, _: FrameType | None) -> None:
        self.received = number

    def wanted(self) -> bool:
        """Return whether a signal has been received."""
        return self.received is not None

    @property
    def exit_code(self) -> int:
        """Exit code of a process ended by the signal: 130 for Ctrl-C, 143 for SIGTERM."""
        return 128 + (self.received or 0)

    def __enter__(self) -> "StopSignals":
        for number in (signal.SIGINT, signal.SIGTERM):
            self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *_: object) -> None:
        """Restore the former handlers."""
        for number, handler in self._before.items():
            signal.signal(number, handler)
