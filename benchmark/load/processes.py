# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The processes of the load test: each a module of Python, with what it uses and what it says."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from benchmark.churn.places import parameter_words
from benchmark.process_usage import processor_seconds, resident_megabytes

__all__ = ["Process", "node_arguments", "running"]

PATIENCE = 90.0
"""Time for a process to say what is waited for, s."""


def node_arguments(namespace: str, parameters: Mapping[str, object]) -> list[str]:
    """Return the arguments of a node's executable."""
    words = ["--ros-args", "--log-level", "info"]
    if namespace:
        words += ["-r", f"__ns:={namespace}"]
    return words + parameter_words(**parameters)


class Process:
    """A module that runs; what it says goes into a file.

    Parameters
    ----------
    module : str
        Its name.
    arguments : sequence of str
        Its arguments.
    log : Path
        File of what it says.
    """

    def __init__(self, module: str, arguments: Sequence[str], log: Path) -> None:
        self.name, self._log = module, log
        self.begin = time.monotonic()
        with log.open("wb") as stream:
            self._process = subprocess.Popen(
                [sys.executable, "-m", module, *arguments],
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        self.pid = self._process.pid

    def wait_for(self, words: str) -> float:
        """Wait until it has said these words; return the time since its start, s.

        Raises RuntimeError where it ends before, or does not say them in time.
        """
        return self.wait_until(lambda: words in self._log.read_text(errors="replace"), words)

    def wait_until(self, is_met: Callable[[], bool], what: str) -> float:
        """Wait until something is so, while it runs; return the time since its start, s."""
        while not is_met():
            if self._process.poll() is not None or time.monotonic() > self.begin + PATIENCE:
                raise RuntimeError(f"{self.name}: no {what!r}; it said {self._log.read_text()}")
            time.sleep(0.01)
        return time.monotonic() - self.begin

    def processor(self) -> float:
        """Return the processor time that all its threads have used, s."""
        return processor_seconds(self.pid)

    def memory(self) -> float:
        """Return the memory that it has in use, MB."""
        return resident_megabytes(self.pid)

    def open_files(self) -> int:
        """Return the number of its open files and sockets."""
        return len(os.listdir(f"/proc/{self.pid}/fd"))  # noqa: PTH208 - only their number

    def threads(self) -> int:
        """Return the number of its threads."""
        return len(os.listdir(f"/proc/{self.pid}/task"))  # noqa: PTH208

    def kill(self) -> None:
        """End it as a crash would."""
        self._process.kill()
        self._process.wait()

    def end(self) -> int:
        """End it as a person would; return its exit code, that of SIGKILL if it hangs."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)
            try:
                self._process.wait(20.0)
            except subprocess.TimeoutExpired:
                self.kill()
        return self._process.returncode


@contextlib.contextmanager
def running(processes: list[Process]) -> Iterator[list[Process]]:
    """Provide a list of processes that are ended at the end, the newest first."""
    try:
        yield processes
    finally:
        for one in reversed(processes):
            one.end()
