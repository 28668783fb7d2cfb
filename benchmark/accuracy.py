# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Run the benchmark: python -m benchmark.accuracy, or `make accuracy`."""

import argparse
import json
import multiprocessing
import os
import statistics
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from benchmark.bounds import (
    GROWTH,
    AlarmCounts,
    alarm_bounds,
    by_case,
    case_bounds,
    coverage_bounds,
    default_bounds,
    diagnosed,
    emps_bounds,
)
from benchmark.cases import CONDITIONS, EXCITATIONS, NOISES, PLANTS, Case
from benchmark.harness.rows import Bound
from benchmark.report import bounds_table, cases_table, draw, information_table
from benchmark.runs import Information, Outcome, information, run
from valve_friction_ros.identification import DEFAULT_METHOD

PARTS = ("cases", "coverage", "default", "alarms", "emps", "information", "timing")

_FIRST_COVERAGE_SEED = 10_000
_FIRST_GROWN_SEED = 20_000
_TIMED_RUNS = 5
_WIDTH_OF_A_FILE = 150


@dataclass
class Results:
    """Results of all parts of the benchmark.

    Attributes
    ----------
    outcomes, coverage, default : list of Outcome
        Outcomes of the cases and of the coverage records by the method ``bench``, and of the main
        noise at 1 kHz by the default method.
    alarms : AlarmCounts or None
        Alarms of the two monitored valves.
    bounds : list of Bound
        All requirements that were checked.
    information : list of Information
        Best accuracy that any method could reach on the square wave.
    seconds : dict of str to float
        Median time of one identification, by valve and method.
    """

    outcomes: list[Outcome] = field(default_factory=list)
    coverage: list[Outcome] = field(default_factory=list)
    default: list[Outcome] = field(default_factory=list)
    alarms: AlarmCounts | None = None
    bounds: list[Bound] = field(default_factory=list)
    information: list[Information] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="accuracy", description=__doc__)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS, help="what to run")
    parser.add_argument("--seeds", type=int, default=20, help="records of the square wave")
    parser.add_argument("--other-seeds", type=int, default=3, help="records of all other cases")
    parser.add_argument("--coverage", type=int, default=200, help="records for the coverage")
    parser.add_argument("--alarms", type=int, default=1000, help="identifications for the alarms")
    parser.add_argument("--grown", type=int, default=100, help="pairs of a valve that has grown")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--output", type=Path, default=Path("accuracy"), help="name of the files")
    return parser


def _all_cases() -> list[Case]:
    return [
        Case(plant, excitation, noise, condition)
        for plant in PLANTS
        for excitation in EXCITATIONS
        for noise in NOISES
        for condition in CONDITIONS
    ]


def _seeds_of(case: Case, options: argparse.Namespace) -> int:
    if case.noise == "clean":
        return 1
    is_main = (case.excitation, case.condition) == ("square", "1 kHz")
    if is_main and case.plant.is_karnopp and case.noise in ("28.6 µm", "60 µm"):
        return int(options.seeds)
    return int(options.other_seeds)


def _in_parallel(
    title: str, work: Callable[..., Any], tasks: Sequence[Any], jobs: int, console: Console
) -> list[Any]:
    """Run all tasks in `jobs` processes, with results in order and a progress bar."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    context = multiprocessing.get_context("spawn")
    with (
        Progress(*columns, console=console) as progress,
        ProcessPoolExecutor(jobs, context) as pool,
    ):
        results: Iterable[Any] = pool.map(work, *zip(*tasks, strict=True))
        return list(progress.track(results, total=len(tasks), description=title))


def _timing(results: Results, _: argparse.Namespace, __: Console) -> None:
    for name in PLANTS:
        case = Case(name, "square", "28.6 µm", "1 kHz")
        case.record(0)
        for method in (DEFAULT_METHOD, "bench"):
            results.seconds[f"{name}, {method}"] = statistics.median(
                run(case, seed, method).seconds for seed in range(_TIMED_RUNS)
            )


def _coverage(results: Results, options: argparse.Namespace, console: Console) -> None:
    plants = [name for name, plant in PLANTS.items() if plant.is_karnopp]
    tasks = [
        (Case(name, "square", "28.6 µm", "1 kHz"), _FIRST_COVERAGE_SEED + seed)
        for name in plants
        for seed in range(options.coverage)
    ]
    results.coverage = _in_parallel("coverage", run, tasks, options.jobs, console)
    for group in by_case(results.coverage).values():
        results.bounds += coverage_bounds(group)


def _default(results: Results, options: argparse.Namespace, console: Console) -> None:
    tasks = [
        (Case(plant, excitation, "28.6 µm", "1 kHz"), seed)
        for plant in PLANTS
        for excitation in EXCITATIONS
        for seed in range(options.other_seeds)
    ]
    work = partial(run, method=DEFAULT_METHOD)
    results.default = _in_parallel("default", work, tasks, options.jobs, console)
    for group in by_case(results.default).values():
        results.bounds += default_bounds(group)
    console.print(cases_table(results.default))


def _alarms(results: Results, options: argparse.Namespace, console: Console) -> None:
    unchanged = [(1.0, seed) for seed in range(options.alarms)]
    grown = [(GROWTH, _FIRST_GROWN_SEED + seed) for seed in range(2 * options.grown)]
    found = _in_parallel("alarms", diagnosed, [*unchanged, *grown], options.jobs, console)
    healthy, tight = found[: len(unchanged)], found[len(unchanged) :]
    declared = ["high" in (tight[i].side, tight[i + 1].side) for i in range(0, len(tight), 2)]
    ratios = [one.ratio for one in healthy], [one.ratio for one in tight]
    results.alarms = AlarmCounts([one.side for one in healthy], declared, ratios)
    results.bounds += alarm_bounds(results.alarms)


def _cases(results: Results, options: argparse.Namespace, console: Console) -> None:
    tasks = [(case, seed) for case in _all_cases() for seed in range(_seeds_of(case, options))]
    results.outcomes = _in_parallel("cases", run, tasks, options.jobs, console)
    for group in by_case(results.outcomes).values():
        results.bounds += case_bounds(group)
    console.print(cases_table(results.outcomes))


def _emps(results: Results, _: argparse.Namespace, console: Console) -> None:
    bounds = emps_bounds()
    if bounds is None:
        console.print("EMPS is skipped: its record is not here")
    else:
        results.bounds += bounds


def _information(results: Results, _: argparse.Namespace, console: Console) -> None:
    results.information = [
        information(name, noise)
        for name, plant in PLANTS.items()
        if plant.is_karnopp
        for noise in NOISES
        if noise != "clean"
    ]
    console.print(information_table(results.information))


_RUNS: Mapping[str, Callable[[Results, argparse.Namespace, Console], None]] = {
    "timing": _timing,
    "emps": _emps,
    "coverage": _coverage,
    "default": _default,
    "alarms": _alarms,
    "cases": _cases,
    "information": _information,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the requested parts; return 1 if a bound is missed."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if not options.output.parent.is_dir():
        parser.error(f"{options.output}: there is no folder {options.output.parent}")
    console = Console(width=None if sys.stdout.isatty() else _WIDTH_OF_A_FILE)
    results = Results()
    for name, part in _RUNS.items():
        if name in options.parts:
            part(results, options, console)
    console.print(bounds_table(results.bounds))
    for name, seconds in results.seconds.items():
        console.print(f"{name}: {seconds:.2f} s to identify 52 s at 1 kHz")
    output = options.output
    output.with_suffix(".json").write_text(
        json.dumps(asdict(results), indent=1, ensure_ascii=False), encoding="utf-8"
    )
    draw(results.outcomes, results.coverage, results.alarms, output.with_suffix(".png"))
    missed = [bound for bound in results.bounds if not bound.met]
    for bound in missed:
        console.print(f"[red]missed[/] {bound.what}: {bound.reached}", soft_wrap=True)
    console.print(f"{len(results.bounds) - len(missed)} of {len(results.bounds)} bounds are met")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
