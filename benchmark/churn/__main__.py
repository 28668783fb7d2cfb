# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Let clients come and go against streaming nodes: python -m benchmark.churn, or `make churn`."""

import argparse
import contextlib
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmark.churn.crowd import Crowd
from benchmark.churn.places import nodes, process_of
from benchmark.churn.summary import hung_services, rows
from benchmark.harness.processes import Process, Usage
from benchmark.harness.rows import Row
from benchmark.harness.run import Ledger, endured, run_parser

_TURN = 0.05
_LOOK = 10.0
_SETTLED = 60.0
_HANG = 30.0
"""Time, s, in which a node that gives no answers may still end itself."""
_FROZEN = 1
"""Exit code of a node that has ended itself because it was frozen."""
_SHARED_MEMORY = Path("/dev/shm")  # noqa: S108 - where Fast DDS has its files


def _shared_memory() -> tuple[int, float]:
    """Return the number of Fast DDS's files and what they hold, MB."""
    sizes = []
    for file in _SHARED_MEMORY.glob("*fastrtps*"):
        with contextlib.suppress(FileNotFoundError):
            sizes.append(file.stat().st_blocks * 512)
    return len(sizes), sum(sizes) / 1e6


class _Plant:
    def __init__(self, folder: Path, ledger: Ledger) -> None:
        self._folder, self._ledger = folder, ledger
        self.processes: dict[str, Process] = {}

    def start(self, name: str) -> None:
        self.processes[name] = Process(nodes(self._folder)[name], self._folder / f"{name}.log")

    def watch(self, seconds: float, crowd: Crowd) -> None:
        """Let the crowd come and go until the time is over or a node has died."""
        self._ledger.add("run", seconds=seconds)
        begin = next_look = time.monotonic()
        first = dict(self.processes)
        early: dict[str, Usage] = {}
        most = (0, 0.0)
        while (elapsed := time.monotonic() - begin) < seconds:
            crowd.turn()
            if time.monotonic() > next_look:
                next_look += _LOOK
                most = max(most, _shared_memory(), key=lambda one: one[1])
                if self._have_died():
                    break
                if not early and elapsed > min(_SETTLED, seconds / 2):
                    early = {name: process.usage() for name, process in self.processes.items()}
            time.sleep(_TURN)
        for name, process in self.processes.items():
            if process is first[name] and process.exit_code() is None and name in early:
                self._note_usage(name, early[name], process.usage())
        self._ledger.add("shared memory", files=most[0], megabytes=most[1])

    def _note_usage(self, name: str, early: Usage, now: Usage) -> None:
        self._ledger.add(
            "node",
            name=name,
            cores=now.cores_since(early),
            early_memory=early.memory,
            memory=now.memory,
            early_threads=early.threads,
            threads=now.threads,
        )

    def _have_died(self) -> bool:
        """Note the nodes that are gone, and those that hang, with their stacks in their logs.

        A node that has ended itself, because it or its middleware was frozen, is started again, as
        launch and systemd do.
        """
        for service in hung_services(self._ledger.events(), time.time() - _HANG):
            hung = self.processes[process_of(service)]
            if hung.exit_code() is None:
                hung.write_stacks()
        codes = {name: process.exit_code() for name, process in self.processes.items()}
        for name, code in codes.items():
            if code == _FROZEN:
                self._ledger.add("ended itself", name=name)
                self.start(name)
            elif code is not None:
                self._ledger.add("died", name=name, code=code)
        return any(code not in (None, _FROZEN) for code in codes.values())

    def end(self, seconds: float) -> None:
        """End the nodes after some seconds, by either signal in turn."""
        for number, (name, process) in enumerate(self.processes.items()):
            if process.exit_code() is None:
                took = process.end((signal.SIGINT, signal.SIGTERM)[number % 2])
                code = process.exit_code()
                self._ledger.add("ending", node=name, alive=seconds, seconds=took, code=code)


def _live(options: argparse.Namespace, seconds: float, ledger: Ledger) -> Iterator[Row]:
    """Run the plant and the crowd, then end the plant."""
    crowd = Crowd(ledger, options.seed, options.at_once)
    plant = _Plant(options.folder, ledger)
    try:
        for name in nodes(options.folder):
            plant.start(name)
        crowd.begin(options.folder, seconds)
        plant.watch(seconds, crowd)
        crowd.end()
    finally:
        crowd.end(0.0)
        plant.end(seconds)
    return rows(ledger.events())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the churn; return 1 if a goal is missed."""
    parser = run_parser("churn", __doc__)
    parser.add_argument("--at-once", type=int, default=4, help="visitors at a time (%(default)s)")
    return endured("{} of churn", parser, arguments, _live)


if __name__ == "__main__":
    sys.exit(main())
