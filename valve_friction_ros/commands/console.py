# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Consoles for printing results, and the display of progress."""

import errno
import os
import sys

from rich.console import Console
from rich.progress import Progress, ProgressColumn

_PRINTED_WIDTH = 120
"""Width of output to a file or a pipe, columns."""


class OutputConsole(Console):
    """A console that raises an error for a closed output; rich would silently end the process."""

    def on_broken_pipe(self) -> None:
        """Reraise the error."""
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))


def shown_progress(*columns: str | ProgressColumn) -> Progress:
    """Return a display of progress on stderr, if that is a terminal; it vanishes at its end."""
    console = OutputConsole(stderr=True, highlight=False, markup=False, soft_wrap=True)
    return Progress(*columns, console=console, transient=True, disable=not console.is_terminal)


def plain_console() -> Console:
    """Return a console that prints plain text, as wide as the terminal if there is one."""
    width = None if sys.stdout.isatty() else _PRINTED_WIDTH
    return OutputConsole(width=width, highlight=False, markup=False)
