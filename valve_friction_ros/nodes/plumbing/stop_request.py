"""Ctrl-C and SIGTERM: the loop is asked to end, and a process whose loop does not end is ended."""

import faulthandler
import os
import signal
import socket
import sys
import threading
from types import TracebackType

__all__ = ["StopRequest"]

_PATIENCE = 2.5
"""Time, s, from the request to the end of the process at the latest."""
_REQUESTS = (signal.SIGINT, signal.SIGTERM)


class StopRequest:
    """Whether Ctrl-C or SIGTERM has come, as long as the context lasts.

    A handler that raised could strike within rclpy's own code, and rclpy's own handler shuts the
    context down under a callback that is still publishing. So the request is only noted.

    A loop that is stuck in foreign code never runs Python's handlers. Python writes each signal
    into a socket even then, and a thread that reads there ends the process, if the context has not
    ended by itself 2.5 s later.

    Attributes
    ----------
    has_come : bool
        Whether the loop shall end.
    is_followed : bool
        Set by the loop when it has ended, and only the clean-up is left.
    """

    def __init__(self) -> None:
        self.has_come = self.is_followed = False
        self._has_ended = threading.Event()
        self._reader, self._writer = socket.socketpair()
        self._writer.setblocking(False)

    def __enter__(self) -> "StopRequest":
        for request in _REQUESTS:
            signal.signal(request, self._note)
        self._before = signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)
        threading.Thread(target=self._enforce, name="stop", daemon=True).start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        signal.set_wakeup_fd(self._before)
        self._has_ended.set()
        self._writer.close()  # ends the thread, if no request has come

    def _note(self, *_: object) -> None:
        self.has_come = True

    def _enforce(self) -> None:
        """Wait for a request, then for the end; in a thread of its own."""
        while number := self._reader.recv(1):
            if number[0] in _REQUESTS:
                break
        if self._has_ended.wait(_PATIENCE) or not number:
            return
        if not self.is_followed:
            line = f"stuck: it did not end within {_PATIENCE:g} s of the request, and is left so"
            print(line, file=sys.stderr)  # noqa: T201
            faulthandler.dump_traceback()
        os._exit(0 if self.is_followed else 1)
