"""Ctrl-C while a sub-command runs: an exception, which is not lost where others would lose it.

SIGTERM can do the same. A process that a script starts by ``&`` has Ctrl-C ignored, never SIGTERM.
"""

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from valve_friction_ros.commands.start import end_at_once

__all__ = ["has_been_interrupted", "interrupt_raises", "sigterm_raises"]

_REPEAT = 0.02
"""Time until a lost Ctrl-C is repeated, s: callbacks are shorter."""
_came: list[int] = []
"""Numbers of the signals that have come."""


def has_been_interrupted() -> bool:
    """Return whether Ctrl-C has come, or SIGTERM in its place."""
    return bool(_came)


def _repeat() -> None:
    threading.Timer(_REPEAT, os.kill, (os.getpid(), _came[-1])).start()


def _repeat_if_importing() -> None:
    """Repeat a signal that a library has caught while it was imported: it is imported still."""
    frames = sys._current_frames()  # noqa: SLF001 - documented, for debuggers
    frame = frames.get(threading.main_thread().ident or 0)
    while frame is not None:
        if frame.f_globals.get("__name__") == "importlib._bootstrap":
            _repeat()
            return
        frame = frame.f_back


def _interrupt(number: int, frame: FrameType | None) -> None:
    _came.append(number)
    threading.Timer(_REPEAT, _repeat_if_importing).start()
    signal.default_int_handler(number, frame)


def _interrupt_again(unraisable: "sys.UnraisableHookArgs") -> None:
    """Repeat a signal that Python ignores, since it came within a callback."""
    if _came and issubclass(unraisable.exc_type, KeyboardInterrupt):
        _repeat()
    else:
        sys.__unraisablehook__(unraisable)


@contextmanager
def interrupt_raises() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt, where it would end the process at once."""
    if signal.getsignal(signal.SIGINT) is end_at_once:
        signal.signal(signal.SIGINT, _interrupt)
        sys.unraisablehook = _interrupt_again
    yield


def sigterm_raises() -> None:
    """Let SIGTERM raise KeyboardInterrupt from now on, also where Ctrl-C is ignored."""
    signal.signal(signal.SIGTERM, _interrupt)
    sys.unraisablehook = _interrupt_again
