# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Tables of the simulated services."""

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmark.service.trial import Number, Told

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


def _within(numbers: Sequence[Number]) -> bool:
    """Return whether every hour has a number within 10 % of the truth."""
    _, withheld, _, largest, _ = _errors(numbers)
    return withheld == 0 and largest <= 0.1


def _covers(numbers: Sequence[Number]) -> bool:
    """Return whether 95 % lie inside their intervals; one outside is always allowed."""
    known = [one for one in numbers if math.isfinite(one.value)]
    outside = sum(abs(one.value - one.truth) > one.half_width for one in known)
    return outside <= max(1, 0.05 * len(known))


def bounds_met(told: Sequence[Told], console: Console) -> bool:
    """Print whether each bound is met; return whether all are."""
    every = [[_of(group, name) for name in _NAMES] for _, group in _by_plant(told)]
    steady, steps = _in_course(told, "steady"), _in_course(told, "step")
    slow = _in_course(told, "slow", "weeks")
    hours = sum(one.task.hours for one in steady)
    spread = _of([one for one in told if one.task.plant != _SPREAD], "dead_band")
    found = (
        ("sliding friction within 10 %, in every hour", _within(_of(told, _NAMES[0]))),
        ("dead band within 10 %, where set points leave their place", _within(spread)),
        (
            "at least 95 % inside their intervals, of each number",
            all(_errors(_of(told, name))[4] >= 0.95 for name in _NAMES),
        ),
        (
            "at least 95 % inside their intervals, of each valve and number",
            all(_covers(one) for numbers in every for one in numbers),
        ),
        (
            f"no false declaration in {hours} h, nor before a change",
            not any(one.changes + one.alarms for one in told),
        ),
        ("1.5 times declared within one hour", all(one.declared <= 1.0 for one in steps)),
        ("1.5 times alarmed within one hour", all(one.alarmed <= 1.0 for one in steps)),
        (
            "1.5 times reached slowly alarmed within one hour, without a baseline",
            all(one.alarmed_by_reference <= 1.0 for one in slow),
        ),
    )
    for what, met in found:
        console.print(f"{'met   ' if met else 'MISSED'} {what}", highlight=False)
    return all(met for _, met in found)
