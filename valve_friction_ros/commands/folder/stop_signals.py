"""Ctrl-C and SIGTERM, noted until the command can stop."""

import signal
from types import FrameType, TracebackType
from typing import Any

__all__ = ["StopSignals"]


class StopSignals:
    """While it is entered, Ctrl-C and SIGTERM are noted and do nothing else."""

    def __init__(self) -> None:
        self.received: int | None = None
        self._before: dict[signal.Signals, Any] = {}

    def _note(self, number: int, _: FrameType | None) -> None:
        self.received = number

    def wanted(self) -> bool:
        """Return whether one of them has come."""
        return self.received is not None

    @property
    def exit_code(self) -> int:
        """Exit code of a process that one of them ended: 130 after Ctrl-C, 143 after SIGTERM."""
        return 128 + (self.received or 0)

    def __enter__(self) -> "StopSignals":
        for number in (signal.SIGINT, signal.SIGTERM):
            self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Restore the former handlers."""
        for number, handler in self._before.items():
            signal.signal(number, handler)
