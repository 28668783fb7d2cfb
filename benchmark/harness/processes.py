# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Start, end and observe processes: resource use, output, and stacks when they hang."""

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, NamedTuple

CODES = (0, -signal.SIGINT, -signal.SIGTERM)
"""Exit codes of a node after a signal; a signal before Python handles it gives its own code."""
PATIENCE = 20.0
"""Time, s, after a signal until a process is considered hung."""
_STACKS_PATIENCE = 60.0
_START_PATIENCE = 90.0
"""Time for a process to reach the expected state, s."""
_TICKS, _PAGE = os.sysconf("SC_CLK_TCK"), os.sysconf("SC_PAGE_SIZE")


def module(name: str, *arguments: str) -> list[str]:
    """Return the command that runs a Python module."""
    return [sys.executable, "-m", name, *arguments]


def node(executable: str, *arguments: str) -> list[str]:
    """Return the command that runs a node of the package."""
    return [str(Path(sys.executable).with_name(executable)), "--ros-args", *arguments]


def parameters(**values: object) -> list[str]:
    """Return the arguments that set node parameters."""
    return [word for name, value in values.items() for word in ("-p", f"{name}:={value}")]


def free_port(address: str = "127.0.0.1") -> int:
    """Return a free port on this machine."""
    with socket.socket() as tried:
        tried.bind((address, 0))
        return tried.getsockname()[1]


def processor_seconds(process: int) -> float:
    """Return the processor time used by all threads of a process, s."""
    text = Path(f"/proc/{process}/stat").read_text(encoding="ascii")
    fields = text.rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS


def resident_megabytes(process: int) -> float:
    """Return the resident memory of a process, MB."""
    text = Path(f"/proc/{process}/statm").read_text(encoding="ascii")
    return int(text.split()[1]) * _PAGE / 1e6


class Usage(NamedTuple):
    """Resource use of a process at a time, s: processor time, s, and memory, MB."""

    time: float
    processor: float
    memory: float

    def cores_since(self, earlier: "Usage") -> float:
        """Return the mean number of cores used since then."""
        return (self.processor - earlier.processor) / (self.time - earlier.time)


class Process(contextlib.AbstractContextManager["Process"]):
    """A running program, which ends with its `with` block.

    Its output, and the stacks of all threads if it hangs, go to the file `log`. Without a log, its
    output is read here, and its input stays open until the end.
    """

    def __init__(
        self,
        command: Sequence[str],
        log: Path | None = None,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self.command, self._log, self.begin = command, log, time.monotonic()
        given = (os.environ if environment is None else environment) | {"PYTHONFAULTHANDLER": "1"}
        with self._output() as stream:
            self._process = subprocess.Popen(
                command,
                env=given,
                stdin=subprocess.DEVNULL if log else subprocess.PIPE,
                stdout=stream or subprocess.PIPE,
                stderr=stream,
                text=True,
                start_new_session=True,
            )
        self.pid = self._process.pid

    def _output(self) -> contextlib.AbstractContextManager[IO[bytes] | None]:
        return self._log.open("ab") if self._log else contextlib.nullcontext()

    def __exit__(self, *_: object) -> None:
        self.end()

    @property
    def output(self) -> IO[str]:
        """Output stream of a process without a log."""
        assert self._process.stdout is not None  # noqa: S101 - it was asked for
        return self._process.stdout

    def said(self) -> str:
        """Return the content of the log."""
        return self._log.read_text("utf-8", "replace") if self._log else ""

    def exit_code(self) -> int | None:
        """Return the exit code; None while the process runs."""
        return self._process.poll()

    def require_running(self) -> None:
        """Raise RuntimeError if the process has ended."""
        if (code := self.exit_code()) is not None:
            raise RuntimeError(f"{self.command} ended with {code}; it said {self.said()}")

    def wait_for(self, words: str) -> float:
        """Wait until these words are in the log; return the time since the start, s."""
        return self.wait_until(lambda: words in self.said(), words)

    def wait_until(self, is_met: Callable[[], bool], what: str) -> float:
        """Wait for a condition while the process runs; return the time since the start, s."""
        while not is_met():
            self.require_running()
            if time.monotonic() > self.begin + _START_PATIENCE:
                raise RuntimeError(f"{self.command}: no {what!r}; it said {self.said()}")
            time.sleep(0.01)
        return time.monotonic() - self.begin

    def send(self, request: signal.Signals) -> None:
        """Send a signal without waiting."""
        self._process.send_signal(request)

    def kill(self) -> None:
        """Kill the process, and wait until it is gone."""
        self._process.kill()
        self._process.communicate()

    def end(self, request: signal.Signals = signal.SIGTERM) -> float | None:
        """Send a signal; return the time until the process ends, s.

        If the process hangs, write its stacks, kill it and return None.
        """
        begin = time.monotonic()
        self._process.send_signal(request)
        try:
            self._process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            self.write_stacks()
            return None
        return time.monotonic() - begin

    def write_stacks(self) -> None:
        """Write the Python stacks of all threads, and C stacks if gdb exists; then kill."""
        debugger = ("gdb", "-p", str(self.pid), "-batch", "-ex", "thread apply all bt")
        with self._output() as stream, contextlib.suppress(subprocess.TimeoutExpired):
            if shutil.which(debugger[0]):
                subprocess.run(
                    debugger, stdout=stream, stderr=stream, timeout=_STACKS_PATIENCE, check=False
                )
        self._process.send_signal(signal.SIGABRT)  # Python's handler writes its stacks
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.communicate(timeout=_STACKS_PATIENCE)
        self.kill()

    def usage(self) -> Usage:
        """Return the resource use so far."""
        processor, memory = processor_seconds(self.pid), resident_megabytes(self.pid)
        return Usage(time.monotonic(), processor, memory)

    def proportional(self) -> float:
        """Return the proportional set size, MB: shared memory is divided among its processes."""
        text = Path(f"/proc/{self.pid}/smaps_rollup").read_text(encoding="ascii")
        (line,) = (one for one in text.splitlines() if one.startswith("Pss:"))
        return int(line.split()[1]) * 1024 / 1e6


@contextlib.contextmanager
def running(processes: list[Process]) -> Iterator[list[Process]]:
    """Provide a list of processes, and end them on exit, the newest first."""
    try:
        yield processes
    finally:
        for one in reversed(processes):
            one.end()
