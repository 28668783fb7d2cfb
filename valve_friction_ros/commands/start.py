"""Entry point of the command `valve_friction`, light enough to be interrupted at once."""

import importlib
import os
import signal
import sys
from types import FrameType

__all__ = ["end_at_once", "main"]

_INTERRUPTED = 128 + signal.SIGINT


def end_at_once(*_: int | FrameType | None) -> None:
    """End the process with one line: nothing has begun that would have to be cleaned up."""
    words = " ".join(["valve_friction", *sys.argv[1:2]])
    try:
        os.write(2, f"{words}: interrupted\n".encode())
    finally:
        os._exit(_INTERRUPTED)


def main() -> int:
    """Run the command; Ctrl-C while it is still being imported ends it at once."""
    # An exception in the midst of an import may be lost there.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, end_at_once)
    code: int = importlib.import_module("valve_friction_ros.commands.main").main()
    return code
