# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Weeks of a valve in closed-loop service, to test the evidence from its moves: `make service`.

The plants come from `benchmark.reality`, which shares no code with the package. They have Stribeck
or bristle friction, and sensors with noise, converters and late stamps.
"""

import argparse
import contextlib
import math
import os
import secrets
import sys
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from rich.table import Table

from benchmark.harness.rows import Bound, bounds_table, in_parallel, judged, opened_console
from benchmark.service_plants import PLANTS, PREFIX
from benchmark.service_trial import Number, Task, Told, tried

_NAMES = ("sliding_friction", "static_friction", "dead_band")
_SPREAD = "alternating"
"""Valve with nearly constant set points: its dead band may have a wide interval."""


def _errors(numbers: Sequence[Number]) -> tuple[int, int, float, float, float]:
    """Return count, number withheld, median and largest error, and coverage."""
    known = [one for one in numbers if math.isfinite(one.value)]
    if not known:
        return len(numbers), len(numbers), math.nan, math.nan, math.nan
    errors = np.array([abs(one.value / one.truth - 1) for one in known])
    inside = np.mean([abs(one.value - one.truth) <= one.half_width for one in known])
    withheld = len(numbers) - len(known)
    return len(numbers), withheld, float(np.median(errors)), float(errors.max()), float(inside)


def _by_plant(told: Sequence[Told]) -> Iterator[tuple[str, list[Told]]]:
    for name in dict.fromkeys(one.task.plant for one in told):
        yield name, [one for one in told if one.task.plant == name]


def _of(told: Iterable[Told], name: str) -> list[Number]:
    return [number for one in told for number in one.numbers if number.name == name]


def _in_course(told: Sequence[Told], *courses: str) -> list[Told]:
    return [one for one in told if one.task.course in courses]


def _hourly(told: Sequence[Told]) -> Table:
    columns = ("valve", "number", "hours", "withheld", "median", "largest", "inside")
    table = Table(*columns, title="numbers of single hours, beside the truth")
    for plant, group in _by_plant(told):
        for name in _NAMES:
            count, withheld, *shares = _errors(_of(group, name))
            row = (f"{share:.1%}" for share in shares)
            table.add_row(plant, name, str(count), str(withheld), *row)
    return table


def _steady(told: Sequence[Told]) -> Table:
    table = Table("valve", "hours", "declared changes", "alarms", title="without change")
    for plant, group in _by_plant(_in_course(told, "steady")):
        counts = [(one.task.hours, one.changes, one.alarms) for one in group]
        table.add_row(plant, *(str(sum(column)) for column in zip(*counts, strict=True)))
    return table


def _grown(told: Sequence[Told]) -> Table:
    times = {
        "declared": "declared [h]",
        "alarmed": "alarm [h]",
        "alarmed_by_reference": "without baseline [h]",
    }
    columns = ("valve", "course", *times.values(), "dated", "early", "last error")
    table = Table(*columns, title="friction grows to 1.5 times")
    for course in ("step", "slow", "weeks"):
        for plant, group in _by_plant(_in_course(told, course)):
            last = [n for one in group for n in one.late if n.name == "sliding_friction"]
            table.add_row(
                plant,
                course,
                *(", ".join(f"{getattr(one, name):.2f}" for one in group) for name in times),
                ", ".join(str(one.dated) for one in group) if course == "step" else "",
                str(sum(one.changes + one.alarms for one in group)),
                f"{_errors(last)[3]:.1%}",
            )
    return table


def tables(told: Sequence[Told]) -> list[Table]:
    """Return errors and coverage, false declarations, and times to declare."""
    ordered = sorted(told, key=lambda one: (one.task.course, one.task.seed))
    return [_hourly(ordered), _steady(ordered), _grown(ordered)]


def _within(what: str, numbers: Sequence[Number]) -> Bound:
    """Require a number within 10 % of the truth in every hour."""
    _, withheld, _, largest, _ = _errors(numbers)
    met = withheld == 0 and largest <= 0.1
    return Bound(f"{what} within 10 %", f"worst {largest:.1%}, {withheld} withheld", met)


def _within_an_hour(what: str, hours: Sequence[float]) -> Bound:
    late = sum(not hour <= 1.0 for hour in hours)
    return Bound(f"1.5 times {what} within one hour", f"{late} of {len(hours)} later", not late)


def _covers(numbers: Sequence[Number]) -> bool:
    """Return whether 95 % lie inside their intervals; one outside is always allowed."""
    known = [one for one in numbers if math.isfinite(one.value)]
    outside = sum(abs(one.value - one.truth) > one.half_width for one in known)
    return outside <= max(1, 0.05 * len(known))


def bounds(told: Sequence[Told]) -> list[Bound]:
    """Return all requirements, with the figures reached."""
    steady, steps = _in_course(told, "steady"), _in_course(told, "step")
    slow = _in_course(told, "slow", "weeks")
    hours = sum(one.task.hours for one in steady)
    spread = [one for one in told if one.task.plant != _SPREAD]
    shares = [_errors(_of(told, name))[4] for name in _NAMES]
    groups = [_of(group, name) for _, group in _by_plant(told) for name in _NAMES]
    poor = sum(not _covers(one) for one in groups)
    false = sum(one.changes + one.alarms for one in told)
    inside = "at least 95 % inside their intervals, of each"
    return [
        _within("sliding friction, in every hour,", _of(told, _NAMES[0])),
        _within("dead band, where set points leave their place,", _of(spread, "dead_band")),
        Bound(f"{inside} number", f"{min(shares):.1%}", all(one >= 0.95 for one in shares)),
        Bound(f"{inside} valve and number", f"{poor} of {len(groups)} less", not poor),
        Bound(f"no false declaration in {hours} h, nor before a change", str(false), not false),
        _within_an_hour("declared", [one.declared for one in steps]),
        _within_an_hour("alarmed", [one.alarmed for one in steps]),
        _within_an_hour(
            "reached slowly, alarmed without a baseline,",
            [one.alarmed_by_reference for one in slow],
        ),
    ]


_BRIEF = ("low", "high", "graphite", "stick-slip")
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
    console, told = opened_console(), list[Told]()
    tasks = _tasks(options)
    console.print(f"first seed {min(task.seed for task in tasks)}", highlight=False)

    def note(one: Told) -> None:
        told.append(one)
        line = f"{len(told)}/{len(tasks)} {one.task.plant}, {one.task.course}, {one.task.hours} h"
        console.print(line, highlight=False)

    with contextlib.suppress(KeyboardInterrupt):  # the results so far are shown
        in_parallel("service", tried, ((task,) for task in tasks), options.jobs, note)
    for table in tables(told):
        console.print(table)
    found = bounds(told)
    console.print(bounds_table(found))
    return judged(found, console)


if __name__ == "__main__":
    sys.exit(main())
