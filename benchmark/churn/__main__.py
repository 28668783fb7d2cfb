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
import os
import random
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from benchmark.churn.summary import hung_services, rows
from benchmark.churn.visitor import audit, nodes, process_of, visit
from benchmark.harness.processes import CODES, Process, Usage
from benchmark.harness.rows import Row
from benchmark.harness.run import Ledger, endured, run_parser

_PAUSE = 1.2
"""Mean time between arrivals of visitors, s."""
_KILLED = 0.3
"""Share of visitors that are killed at a random instant."""
_LONGEST_LIFE = 5.0
"""Longest time until they are killed, s."""
_VISIT_LIMIT = 120.0
"""Time, s, after which a visitor is considered hung."""
_ENDING_PAUSE = 10.0
_FIRST_SECONDS = 3.0
_LONGEST_RUN = 12.0


def _forked(work: Callable[[], None], ledger: Ledger, name: str) -> int:
    """Run some work in a forked child; return its process ID."""
    child = os.fork()
    if child:
        return child
    code = 1
    try:
        work()
        code = 0
    except BaseException as error:  # noqa: BLE001 - a child must never go on as its parent
        ledger.add("broken", name=name, error=repr(error), trace=traceback.format_exc())
    finally:
        os._exit(code)


def _endings(ledger: Ledger, folder: Path, seed: int, seconds: float) -> None:
    """Start nodes in turn, and end each at a random time, often in its first seconds."""
    chance, until, number = random.Random(seed), time.monotonic() + seconds, 0
    kinds = nodes(folder, "/fv_301", ("/fv_401", "/fv_402"))
    while time.monotonic() < until:
        number += 1
        name = chance.choice(sorted(kinds))
        log = folder / f"ending_{number}_{name}.log"
        process = Process(kinds[name], log)
        within = _FIRST_SECONDS if chance.random() < 0.6 else _LONGEST_RUN
        time.sleep(alive := chance.uniform(0.0, within))
        request = chance.choice((signal.SIGINT, signal.SIGTERM))
        took, code = process.end(request), process.exit_code()
        known = {"node": name, "request": request.name, "alive": alive, "seconds": took}
        words = "" if code in CODES else process.said()[-2000:]
        ledger.add("ending", **known, code=code, words=words)
        if code in CODES:
            log.unlink()
        time.sleep(chance.uniform(0.0, _ENDING_PAUSE))


class Crowd:
    """The visitors that come and go.

    Its process must not start ROS itself, because it is forked repeatedly.
    """

    def __init__(self, ledger: Ledger, seed: int, at_once: int) -> None:
        self._ledger, self._at_once = ledger, at_once
        self._chance = random.Random(seed)
        self._visitors: dict[int, tuple[float, bool]] = {}
        """Present visitors: end of the visit, and whether they are killed then."""
        self._others: list[int] = []
        self._count, self._next = 0, 0.0

    def begin(self, folder: Path, seconds: float) -> None:
        """Start the auditor, and the process that ends nodes."""
        seed = self._chance.randrange(2**31)
        works = {
            "audit": lambda: audit(self._ledger, seconds),
            "endings": lambda: _endings(self._ledger, folder, seed, seconds),
        }
        self._others = [_forked(work, self._ledger, name) for name, work in works.items()]

    def turn(self) -> None:
        """Kill visitors that are due, note those that have left, and start others."""
        now = time.monotonic()
        for child, (until, is_killed) in list(self._visitors.items()):
            ended, status = os.waitpid(child, os.WNOHANG)
            if not ended and now > until:
                self._kill(child, "killed" if is_killed else "hung")
            elif ended:
                self._ledger.add("visit", end="gone" if status == 0 else f"status {status}")
            if ended or now > until:
                del self._visitors[child]
        if len(self._visitors) < self._at_once and now > self._next:
            self._next = now + self._chance.expovariate(1 / _PAUSE)
            self._let_one_come(now)

    def _kill(self, child: int, end: str) -> None:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        self._ledger.add("visit", end=end)

    def _let_one_come(self, now: float) -> None:
        self._count += 1
        number, seed = self._count, self._chance.randrange(2**63)
        is_killed = self._chance.random() < _KILLED
        life = self._chance.uniform(0.0, _LONGEST_LIFE) if is_killed else _VISIT_LIMIT
        child = _forked(
            lambda: visit(self._ledger, number, random.Random(seed)), self._ledger, "visitor"
        )
        self._visitors[child] = now + life, is_killed

    def end(self, patience: float = _VISIT_LIMIT) -> None:
        """Wait until all processes are done; kill those that remain."""
        until = time.monotonic() + patience
        children = [*self._visitors, *self._others]
        self._visitors, self._others = {}, []
        for child in children:
            while os.waitpid(child, os.WNOHANG)[0] == 0:
                if time.monotonic() > until:
                    self._kill(child, "hung")
                    break
                time.sleep(0.1)


_TURN = 0.05
_LOOK = 10.0
_SETTLED = 60.0
_HANG = 30.0
"""Time, s, for a node that no longer answers to end itself."""
_FROZEN = 1
"""Exit code of a node that has ended itself because it was frozen."""
_SHARED_MEMORY = Path("/dev/shm")  # noqa: S108 - where Fast DDS has its files


def _shared_memory() -> tuple[int, float]:
    """Return number and total size, MB, of the files of Fast DDS."""
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
        """Let the crowd come and go until the time is up or a node has died."""
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
        """Note dead and hung nodes; hung nodes write their stacks to their logs.

        A node that has ended itself because it or its middleware was frozen is restarted, as launch
        and systemd do.
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
        """End the nodes after some seconds, by SIGINT and SIGTERM in turn."""
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
