# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Nodes as processes: how they end, what they hold, and where they hang."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from benchmark.churn.places import Node
from benchmark.process_usage import processor_seconds, resident_megabytes

__all__ = ["CODES", "FROZEN", "PATIENCE", "NodeProcess", "Usage"]

CODES = (0, -signal.SIGINT, -signal.SIGTERM)
"""Exit codes of a node that was told to end; those of the signals before Python minds them."""
FROZEN = 1
"""Exit code of a node that has ended itself because it was frozen."""
PATIENCE = 20.0
"""Time, s, after which a process that was told to end is hung."""
_STACKS_PATIENCE = 60.0
_EXECUTABLES = Path(sys.executable).parent


class Usage(NamedTuple):
    """What a process has used until a time (s): processor time (s), memory (MB), threads."""

    time: float
    processor: float
    memory: float
    threads: int

    def since(self, earlier: "Usage") -> dict[str, float]:
        """Return the cores used since then, and memory and threads then and now."""
        return {
            "cores": (self.processor - earlier.processor) / (self.time - earlier.time),
            "early_memory": earlier.memory,
            "memory": self.memory,
            "early_threads": earlier.threads,
            "threads": self.threads,
        }


class NodeProcess:
    """A node that runs, and writes its log into a file.

    Parameters
    ----------
    node : Node
        What is run.
    log : Path
        File of its output, with the stacks of all its threads if it hangs.
    """

    def __init__(self, node: Node, log: Path) -> None:
        self.log = log
        with log.open("ab") as stream:
            self._process = subprocess.Popen(
                [_EXECUTABLES / node.executable, "--ros-args", *node.arguments],
                env=os.environ | {"PYTHONFAULTHANDLER": "1"},
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def exit_code(self) -> int | None:
        """Return the exit code; None while it runs."""
        return self._process.poll()

    def send(self, request: signal.Signals) -> None:
        """Send a signal, and wait for nothing."""
        self._process.send_signal(request)

    def kill(self) -> None:
        """Kill it, and see it gone."""
        self._process.kill()
        self._process.wait()

    def end(self, request: signal.Signals) -> float | None:
        """Send a signal; return the time to the end of the process, s.

        A process that hangs leaves its stacks in its log and is killed; None is returned.
        """
        begin = time.monotonic()
        self._process.send_signal(request)
        try:
            self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.write_stacks()
            return None
        return time.monotonic() - begin

    def write_stacks(self) -> None:
        """Write the stacks of all threads, of C where gdb is there and of Python; kill it."""
        debugger: Sequence[str] = ("gdb", "-p", str(self._process.pid), "-batch", "-ex")
        if shutil.which(debugger[0]):
            with self.log.open("ab") as stream:
                subprocess.run(
                    [*debugger, "thread apply all bt"],
                    stdout=stream,
                    stderr=subprocess.STDOUT,
                    timeout=_STACKS_PATIENCE,
                    check=False,
                )
        self._process.send_signal(signal.SIGABRT)  # Python's handler writes its stacks
        try:
            self._process.wait(_STACKS_PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def usage(self) -> Usage:
        """Return what it has used so far, and what it holds."""
        process = self._process.pid
        return Usage(
            time.monotonic(),
            processor_seconds(process),
            resident_megabytes(process),
            len(list(Path(f"/proc/{process}/task").iterdir())),
        )
