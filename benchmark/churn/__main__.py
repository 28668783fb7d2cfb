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
from benchmark.churn.endurance import add_run_arguments, endured
from benchmark.churn.ledger import Ledger
from benchmark.churn.places import nodes, process_of
from benchmark.churn.processes import FROZEN, NodeProcess, Usage
from benchmark.churn.summary import hung_services, rows
from benchmark.speed.rows import Row

__all__ = ["main"]

_TURN = 0.05
_LOOK = 10.0
_SETTLED = 60.0
_HANG = 30.0
"""Time, s, in which a node that gives no answers may still end itself."""
_SHARED_MEMORY = Path("/dev/shm")  # noqa: S108 - where Fast DDS has its files


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="churn", description=__doc__)
    add_run_arguments(parser)
    parser.add_argument("--at-once", type=int, default=4, help="visitors at a time (%(default)s)")
    return parser


def _shared_memory() -> tuple[int, float]:
    """Return the number of Fast DDS's files and what they hold, MB."""
    sizes = []
    for file in _SHARED_MEMORY.glob("*fastrtps*"):
        with contextlib.suppress(FileNotFoundError):
            sizes.append(file.stat().st_blocks * 512)
    return len(sizes), sum(sizes) / 1e6


def _run(folder: Path, seconds: float, crowd: Crowd, ledger: Ledger) -> None:
    """Run the plant and the crowd, then end the plant."""
    processes: dict[str, NodeProcess] = {}
    try:
        for name, node in nodes(folder).items():
            processes[name] = NodeProcess(node, folder / f"{name}.log")
        crowd.begin(folder, seconds)
        _watch(processes, folder, seconds, crowd, ledger)
        crowd.end()
    finally:
        crowd.end(0.0)
        for number, (name, process) in enumerate(processes.items()):
            if process.exit_code() is None:
                took = process.end((signal.SIGINT, signal.SIGTERM)[number % 2])
                code = process.exit_code()
                ledger.add("ending", node=name, alive=seconds, seconds=took, code=code)


def _watch(
    processes: dict[str, NodeProcess], folder: Path, seconds: float, crowd: Crowd, ledger: Ledger
) -> None:
    """Let the crowd come and go until the time is over or a node has died."""
    ledger.add("run", seconds=seconds)
    begin = next_look = time.monotonic()
    first = dict(processes)
    early: dict[str, Usage] = {}
    most = (0, 0.0)
    while (elapsed := time.monotonic() - begin) < seconds:
        crowd.turn()
        if time.monotonic() > next_look:
            next_look += _LOOK
            most = max(most, _shared_memory(), key=lambda one: one[1])
            if _have_died(processes, folder, ledger):
                break
            if not early and elapsed > min(_SETTLED, seconds / 2):
                early = {name: process.usage() for name, process in processes.items()}
        time.sleep(_TURN)
    for name, process in processes.items():
        if process is first[name] and process.exit_code() is None and name in early:
            ledger.add("node", name=name, **process.usage().since(early[name]))
    ledger.add("shared memory", files=most[0], megabytes=most[1])


def _have_died(processes: dict[str, NodeProcess], folder: Path, ledger: Ledger) -> bool:
    """Note the nodes that are gone, and those that hang, with their stacks in their logs.

    A node that has ended itself, because it or its middleware was frozen, is started again, as
    launch and systemd do.
    """
    for service in hung_services(list(ledger.events()), time.time() - _HANG):
        hung = processes[process_of(service)]
        if hung.exit_code() is None:
            hung.write_stacks()
    has_died = False
    for name, process in processes.items():
        code = process.exit_code()
        if code == FROZEN:
            ledger.add("ended itself", name=name)
            processes[name] = NodeProcess(nodes(folder)[name], process.log)
        elif code is not None:
            ledger.add("died", name=name, code=code)
            has_died = True
    return has_died


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the churn; return 1 if a goal is missed."""
    options = _parser().parse_args(arguments)

    def live(folder: Path, seconds: float, seed: int, ledger: Ledger) -> Iterator[Row]:
        _run(folder, seconds, Crowd(ledger, seed, options.at_once), ledger)
        return rows(list(ledger.events()))

    return endured("churn", f"{options.minutes:g} minutes of churn", options, live)


if __name__ == "__main__":
    sys.exit(main())
