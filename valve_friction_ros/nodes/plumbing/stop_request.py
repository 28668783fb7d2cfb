# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Ctrl-C and SIGTERM: the loop is asked to end, and a process whose loop does not end is ended."""

import faulthandler
import os
import signal
import socket
import sys

from valve_friction_ros.nodes.plumbing.worker import Companion

_PATIENCE = 2.5
"""Time, s, from the request to the end of the process at the latest."""
_REQUESTS = (signal.SIGINT, signal.SIGTERM)


class StopRequest(Companion):
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
        super().__init__("stop")
        self.has_come = self.is_followed = False
        self._reader, self._writer = socket.socketpair()
        self._writer.setblocking(False)

    def begin(self) -> None:
        """Take the signals."""
        for request in _REQUESTS:
            signal.signal(request, self._note)
        self._before = signal.set_wakeup_fd(self._writer.fileno(), warn_on_full_buffer=False)

    def end(self) -> None:
        """Give the signals back."""
        signal.set_wakeup_fd(self._before)
        self._writer.close()  # ends the thread, if no request has come

    def _note(self, *_: object) -> None:
        self.has_come = True

    def run(self) -> None:
        """Wait for a request, then for the end."""
        while number := self._reader.recv(1):
            if number[0] in _REQUESTS:
                break
        if self.has_ended.wait(_PATIENCE) or not number:
            return
        if not self.is_followed:
            line = f"stuck: it did not end within {_PATIENCE:g} s of the request, and is left so"
            print(line, file=sys.stderr)  # noqa: T201
            faulthandler.dump_traceback()
        os._exit(0 if self.is_followed else 1)
