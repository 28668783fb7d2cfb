# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Realistic valves and sensors, to test an identification: `make reality`.

The benchmark shares no code with the package under test: its plants are written independently, with
finer steps than the package's simulator. Only the module `package` calls it.
"""

import argparse
import os
import secrets
import sys
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path

from rich.console import Console

from benchmark.harness.rows import in_parallel, new_file
from benchmark.reality.motions import Kind
from benchmark.reality.records import Case
from benchmark.reality.report import bounds, report
from benchmark.reality.trial import Row, Task, tried

_PROCESSES = 2
_PARTS = ("plain", "stickslip", "alarms")
_RECORDS, _BRIEF = (50, 24, 12), (4, 2, 1)
"""Records of each motion in each part, by default and in brief."""

_SLIPPING = (Kind.SQUARE, Kind.RAMP, Kind.LEVELS, Kind.MULTISINE, Kind.HUNTING)
_WATCHED = (Kind.SQUARE, Kind.RAMP, Kind.LEVELS, Kind.MULTISINE, Kind.LOOP, Kind.FROM_MIDDLE)
_RESERVE = 2.2
"""Factor by which the friction of a monitored valve may grow: the benchmark doubles it."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="reality", description=__doc__)
    kinds = [kind.value for kind in Kind]
    parser.add_argument("--records", type=int, metavar="N", help="of each motion, in each part")
    parser.add_argument("--motions", nargs="+", default=kinds, choices=kinds, help="default: all")
    parser.add_argument("--only", nargs="+", default=_PARTS, choices=_PARTS, help="default: all")
    parser.add_argument("--brief", action="store_true", help="few records of each motion")
    parser.add_argument("--entropy", type=int, metavar="N", help="repeat a run; else it is drawn")
    parser.add_argument("--jobs", type=int, default=min(_PROCESSES, os.cpu_count() or 1))
    parser.add_argument(
        "--limit", type=float, default=60.0, metavar="S", help="processor time for one record"
    )
    parser.add_argument("--out", type=new_file, default=Path("reality.jsonl"), help="the rows")
    return parser


def _tasks(options: argparse.Namespace, entropy: int) -> Iterator[Task]:
    counts = dict(zip(_PARTS, _BRIEF if options.brief else _RECORDS, strict=True))
    motions = [Kind(motion) for motion in options.motions]
    for place, part in enumerate(_PARTS):
        some = {"plain": motions, "stickslip": _SLIPPING, "alarms": _WATCHED}[part]
        special = {"plain": {}, "stickslip": {"slips": True}, "alarms": {"reserve": _RESERVE}}[part]
        for number in range(options.records or counts[part]):
            for motion in motions:
                if part in options.only and motion in some:
                    case = Case(entropy + place, motion, number, **special)
                    yield Task(part, case, options.limit)


def _run(options: argparse.Namespace, console: Console) -> list[Row]:
    """Run all tasks, and write each row as it arrives."""
    entropy = secrets.randbits(32) if options.entropy is None else options.entropy
    console.print(f"--entropy {entropy}")
    with options.out.open("w", encoding="utf-8") as file:

        def write(rows: Iterable[Row]) -> None:
            file.writelines(row.as_line() + "\n" for row in rows)
            file.flush()

        tasks = ((task,) for task in _tasks(options, entropy))
        return list(chain.from_iterable(in_parallel("reality", tried, tasks, options.jobs, write)))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the requested parts; return 1 if a bound is missed."""
    options = _parser().parse_args(arguments)
    console = Console(soft_wrap=True, highlight=False, markup=False)
    rows = _run(options, console)
    motions = [kind.value for kind in Kind]
    rows.sort(key=lambda row: (_PARTS.index(row.part), motions.index(row.motion)))
    for line in report(rows):
        console.print(line)
    return 0 if all(one.met for one in bounds(rows)) else 1


if __name__ == "__main__":
    sys.exit(main())
