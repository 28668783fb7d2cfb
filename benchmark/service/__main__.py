# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Weeks of valves in closed-loop service: python -m benchmark.service, or `make service`."""

import argparse
import math
import os
import secrets
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed

from rich.console import Console

from benchmark.service.course import Task
from benchmark.service.plants import PLANTS, PREFIX
from benchmark.service.report import bounds_met, tables
from benchmark.service.trial import Told, tried

_BRIEF = ("low", "high", "graphite", "stick-slip")
_WIDTH_OF_A_FILE = 150
_STEP_HOURS, _SLOW_HOURS, _WEEKS_HOURS = 12, 40, 8 * 7 * 24
_QUIET = "stick-slip"
"""Valve with friction that grows over eight weeks."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="service", description=__doc__)
    parser.add_argument(
        "--hours", type=int, default=1000, help="hours without change, over all valves and seeds"
    )
    parser.add_argument("--seeds", type=int, default=2, help="services of each valve")
    parser.add_argument("--brief", action="store_true", help="four valves, not all")
    parser.add_argument("--plants", nargs="+", choices=[*PLANTS], help="only these valves")
    parser.add_argument(
        "--drawn", type=int, default=10, help="valves drawn from the seed, besides (%(default)s)"
    )
    parser.add_argument("--seed", type=int, default=0, help="first seed (%(default)s)")
    parser.add_argument(
        "--held-out", action="store_true", help="a first seed that was never used before"
    )
    parser.add_argument("--no-slow", action="store_true", help="leave out friction that creeps up")
    parser.add_argument(
        "--jobs", type=int, default=os.cpu_count() or 1, help="processes (%(default)s)"
    )
    return parser


def _tasks(options: argparse.Namespace) -> list[Task]:
    names = list(options.plants or (_BRIEF if options.brief else PLANTS))
    first = secrets.randbelow(2**30) if options.held_out else options.seed
    seeds = range(first, first + options.seeds)
    valves = [(name, seed) for seed in seeds for name in names]
    valves += [(f"{PREFIX} {first + number}", first) for number in range(options.drawn)]
    steady = math.ceil(options.hours / len(valves))
    courses = [("step", _STEP_HOURS), ("steady", steady)]
    if not options.no_slow:
        courses.append(("slow", _SLOW_HOURS))
    tasks = [Task(name, hours, seed, one) for one, hours in courses for name, seed in valves]
    if _QUIET in names and not options.no_slow:
        tasks.insert(0, Task(_QUIET, _WEEKS_HOURS, first, "weeks"))
    return tasks


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the requested tasks; return 1 if a bound is missed."""
    options = _parser().parse_args(arguments)
    console = Console(width=None if sys.stdout.isatty() else _WIDTH_OF_A_FILE)
    tasks = _tasks(options)
    console.print(f"first seed {min(task.seed for task in tasks)}", highlight=False)
    told: list[Told] = []
    with ProcessPoolExecutor(options.jobs) as pool:
        pending = [pool.submit(tried, task) for task in tasks]
        try:
            for future in as_completed(pending):
                told.append(future.result())
                task = told[-1].task
                line = f"{len(told)}/{len(tasks)} {task.plant}, {task.course}, {task.hours} h"
                console.print(line, highlight=False)
        except KeyboardInterrupt:  # show the results so far
            pool.shutdown(wait=False, cancel_futures=True)
    for table in tables(told):
        console.print(table)
    return 0 if bounds_met(told, console) else 1


if __name__ == "__main__":
    sys.exit(main())
