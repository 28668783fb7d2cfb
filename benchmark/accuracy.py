# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The full check of the accuracy requirements of an identification: `make accuracy`."""

import argparse
import json
import os
import statistics
import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmark.cases import (
    CONDITIONS,
    EXCITATIONS,
    NOISES,
    PLANTS,
    Case,
    Information,
    Outcome,
    information,
    run,
    wrong_claims,
)
from benchmark.harness.rows import (
    Bound,
    bounds_table,
    in_parallel,
    judged,
    new_file,
    opened_console,
)
from valve_friction_ros.identification import DEFAULT_METHOD, Verdict

COVERAGE = (0.90, 0.99)
"""Required range of the share of records whose 95 % interval covers the truth."""

FORCE_BOUND = 0.05

_SQUARE = {
    "coulomb_friction": 0.01,
    "viscous_friction": 0.05,
    "spring_constant": 0.001,
    "static_friction": 0.02,
}


def by_case(outcomes: Sequence[Outcome]) -> dict[Case, list[Outcome]]:
    """Group outcomes by case, in order of first occurrence."""
    groups: dict[Case, list[Outcome]] = {}
    for outcome in outcomes:
        groups.setdefault(outcome.case, []).append(outcome)
    return groups


def worst(outcomes: Sequence[Outcome], name: str) -> float:
    """Return the largest error of a parameter over the records with a value; nan without any."""
    errors = [abs(outcome.errors.get(name, np.nan)) for outcome in outcomes]
    known = [error for error in errors if not np.isnan(error)]
    return max(known) if known else float("nan")


def coverage_of(outcomes: Sequence[Outcome], name: str) -> tuple[float, int]:
    """Return the share of intervals that cover the truth, and the number of intervals."""
    held = [
        abs(outcome.errors[name]) <= outcome.half_widths[name]
        for outcome in outcomes
        if not np.isnan(outcome.errors.get(name, np.nan))
    ]
    return (float(np.mean(held)) if held else float("nan")), len(held)


def _title(case: Case) -> str:
    return f"{case.plant_name}, {case.excitation}, {case.noise}, {case.condition}"


def _all_within(outcomes: Sequence[Outcome], name: str, bound: float) -> Bound:
    """Require a value within the bound for every record."""
    errors = np.array([abs(outcome.errors.get(name, np.nan)) for outcome in outcomes])
    within = int(np.count_nonzero(errors <= bound))
    what = f"{_title(outcomes[0].case)}: {name} within {bound:.1%}"
    reached = f"{within} of {errors.size}, worst {worst(outcomes, name):.2%}"
    return Bound(what, reached, within == errors.size)


def _square_bounds(outcomes: Sequence[Outcome]) -> list[Bound]:
    case = outcomes[0].case
    if not case.plant.is_karnopp or (case.excitation, case.condition) != ("square", "1 kHz"):
        return []
    if case.noise == "28.6 µm":
        names = [name for name in _SQUARE if name != "static_friction" or _slips(case)]
        return [_all_within(outcomes, name, _SQUARE[name]) for name in names]
    if case.noise == "60 µm":
        return [_all_within(outcomes, "coulomb_friction", 0.02)]
    return []


def _slips(case: Case) -> bool:
    parameters = case.plant.parameters
    return parameters.static_friction > parameters.coulomb_friction


def _force_bound(outcomes: Sequence[Outcome]) -> list[Bound]:
    """Bound the friction force wherever F_c was not withheld."""
    case = outcomes[0].case
    hard = not case.plant.is_karnopp or case.condition == "100 Hz" or case.excitation[:2] == "in"
    withheld = Verdict.NOT_IDENTIFIABLE.value
    errors = [
        outcome.force_error
        for outcome in outcomes
        if not outcome.refusal and outcome.verdicts["coulomb_friction"] != withheld
    ]
    if not hard or not errors:
        return []
    what = f"{_title(case)}: friction force within {FORCE_BOUND:.0%}"
    reached = f"worst {max(errors):.2%} of {len(errors)} answers in {len(outcomes)}"
    return [Bound(what, reached, max(errors) <= FORCE_BOUND)]


def _claims(outcomes: Sequence[Outcome]) -> list[Bound]:
    wrong = [name for outcome in outcomes for name in wrong_claims(outcome)]
    counts = ", ".join(f"{name} {wrong.count(name)}×" for name in dict.fromkeys(wrong))
    what = f"{_title(outcomes[0].case)}: identified is within 5 % and 3 intervals"
    return [Bound(what, counts or "always", not wrong)]


def _mass(outcomes: Sequence[Outcome]) -> list[Bound]:
    if outcomes[0].case.noise == "clean":
        return []
    shown = sum(
        outcome.verdicts.get("mass") not in (None, Verdict.NOT_IDENTIFIABLE.value)
        for outcome in outcomes
    )
    return [Bound(f"{_title(outcomes[0].case)}: mass refused", f"shown {shown}×", not shown)]


def case_bounds(outcomes: Sequence[Outcome]) -> list[Bound]:
    """Check every bound that applies to the outcomes of one case."""
    checks = (_square_bounds, _force_bound, _claims, _mass)
    return [bound for check in checks for bound in check(outcomes)]


def default_bounds(outcomes: Sequence[Outcome]) -> list[Bound]:
    """Check that the default method makes no wrong claim in one case."""
    bounds = [bound for check in (_claims, _mass) for bound in check(outcomes)]
    return [replace(bound, what=f"default method, {bound.what}") for bound in bounds]


def coverage_bounds(outcomes: Sequence[Outcome]) -> list[Bound]:
    """Check the coverage of each parameter with a true value in one case."""
    case = outcomes[0].case
    names = ["coulomb_friction", "viscous_friction", "spring_constant", "spring_preload"]
    if _slips(case):
        names.append("static_friction")
    bounds = []
    for name in names:
        share, answers = coverage_of(outcomes, name)
        what = f"{case.plant_name}: 95 % interval of {name} covers 90 to 99 % of records"
        met = COVERAGE[0] <= share <= COVERAGE[1]
        bounds.append(Bound(what, f"{share:.1%} of {answers}", met))
    return bounds


_SHOWN = ("coulomb_friction", "viscous_friction", "spring_constant", "static_friction")
_LETTERS = {"identified": "i", "weak": "w", "not identifiable": "n", "fixed": "f"}


def _percent(share: float) -> str:
    return "–" if np.isnan(share) else f"{100 * share:.2f}"


def _verdicts(outcomes: Sequence[Outcome], name: str) -> str:
    counts = Counter(
        _LETTERS[outcome.verdicts[name]] for outcome in outcomes if name in outcome.verdicts
    )
    return "".join(f"{count}{letter}" for letter, count in sorted(counts.items()))


def _row(outcomes: Sequence[Outcome]) -> list[str]:
    case = outcomes[0].case
    cells = [case.plant_name, case.excitation, case.noise, case.condition, str(len(outcomes))]
    cells.append(str(sum(bool(outcome.refusal) for outcome in outcomes) or ""))
    for name in _SHOWN:
        covered, answers = coverage_of(outcomes, name)
        text = f"{_percent(worst(outcomes, name))} {_verdicts(outcomes, name)}"
        cells.append(text + (f" {100 * covered:.0f}%" if answers > 1 else ""))
    forces = [outcome.force_error for outcome in outcomes if not np.isnan(outcome.force_error)]
    cells.append(_percent(max(forces)) if forces else "–")
    cells.append(f"{statistics.median(outcome.seconds for outcome in outcomes):.1f}")
    missed = [bound for bound in case_bounds(outcomes) if not bound.met]
    cells.append(f"[red]{len(missed)} missed[/]" if missed else "[green]met[/]")
    return cells


def cases_table(outcomes: Sequence[Outcome]) -> Table:
    """Tabulate worst error, verdicts and coverage of each parameter, with a row per case."""
    columns = ("valve", "excitation", "noise", "rate", "n", "refused", "F_c", "F_v", "k", "F_s")
    title = "worst error in %, verdicts (i identified, w weak, n not identifiable), coverage"
    table = Table(*columns, "force %", "s", "bounds", title=title)
    for group in by_case(outcomes).values():
        table.add_row(*_row(group))
    return table


def information_table(limits: Sequence[Information]) -> Table:
    """Tabulate the smallest standard errors that any method can have, in %."""
    title = "least standard error in %: pressure known exactly … by its samples alone"
    columns = ("coulomb_friction", "viscous_friction", "spring_constant", "spring_preload")
    table = Table("valve", "noise", *columns, title=title)
    for one in limits:
        cells = [
            f"{_percent(one.pressure_known[name])} … {_percent(one.pressure_measured[name])}"
            for name in columns
        ]
        table.add_row(one.plant_name, one.noise, *cells)
    return table


_FIRST_COVERAGE_SEED = 10_000
_KARNOPP = [name for name, plant in PLANTS.items() if plant.is_karnopp]

_Found = tuple[Sequence[Outcome | Information], list[Bound]]
"""What a part has measured, and its requirements with the figures reached."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="accuracy", description=__doc__)
    parts = sorted(_RUNS)
    parser.add_argument("--parts", nargs="+", choices=parts, default=parts, help="what to run")
    parser.add_argument("--seeds", type=int, default=20, help="records of the square wave")
    parser.add_argument("--other-seeds", type=int, default=3, help="records of all other cases")
    parser.add_argument("--coverage", type=int, default=200, help="records for the coverage")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--output", type=new_file, default=Path("accuracy"), help="of the JSON")
    return parser


def _seeds_of(case: Case, options: argparse.Namespace) -> int:
    if case.noise == "clean":
        return 1
    is_main = (case.excitation, case.condition) == ("square", "1 kHz")
    if is_main and case.plant.is_karnopp and case.noise in ("28.6 µm", "60 µm"):
        return int(options.seeds)
    return int(options.other_seeds)


def _judged_by_case(
    outcomes: Sequence[Outcome], bounds_of: Callable[[Sequence[Outcome]], list[Bound]]
) -> _Found:
    groups = by_case(outcomes).values()
    return outcomes, [bound for group in groups for bound in bounds_of(group)]


def _coverage(options: argparse.Namespace, _: Console) -> _Found:
    """Identify the main noise at 1 kHz by `bench`, often enough to count its intervals."""
    tasks = [
        (Case(name, "square", "28.6 µm", "1 kHz"), _FIRST_COVERAGE_SEED + seed)
        for name in _KARNOPP
        for seed in range(options.coverage)
    ]
    return _judged_by_case(in_parallel("coverage", run, tasks, options.jobs), coverage_bounds)


def _default(options: argparse.Namespace, console: Console) -> _Found:
    """Identify the main noise at 1 kHz by the default method."""
    tasks = [
        (Case(plant, excitation, "28.6 µm", "1 kHz"), seed)
        for plant, excitation in product(PLANTS, EXCITATIONS)
        for seed in range(options.other_seeds)
    ]
    work = partial(run, method=DEFAULT_METHOD)
    outcomes = in_parallel("default", work, tasks, options.jobs)
    console.print(cases_table(outcomes))
    return _judged_by_case(outcomes, default_bounds)


def _cases(options: argparse.Namespace, console: Console) -> _Found:
    """Identify all combinations of plant, excitation, noise and sampling by `bench`."""
    cases = [Case(*names) for names in product(PLANTS, EXCITATIONS, NOISES, CONDITIONS)]
    tasks = [(case, seed) for case in cases for seed in range(_seeds_of(case, options))]
    outcomes = in_parallel("cases", run, tasks, options.jobs)
    console.print(cases_table(outcomes))
    return _judged_by_case(outcomes, case_bounds)


def _information(_: argparse.Namespace, console: Console) -> _Found:
    """Compute the best accuracy that any method could reach on the square wave."""
    noises = [noise for noise in NOISES if noise != "clean"]
    found = [information(name, noise) for name, noise in product(_KARNOPP, noises)]
    console.print(information_table(found))
    return found, []


_RUNS: Mapping[str, Callable[[argparse.Namespace, Console], _Found]] = {
    "coverage": _coverage,
    "default": _default,
    "cases": _cases,
    "information": _information,
}


def _is_worth_a_line(bound: Bound) -> bool:
    """Return whether to show a bound; those of many cases only where they are missed."""
    return not bound.met or bound.reached not in ("always", "shown 0×")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the requested parts; return 1 if a bound is missed."""
    options, console = _parser().parse_args(arguments), opened_console()
    bounds: list[Bound] = []
    content: dict[str, list[dict[str, object]]] = {}
    for name, part in _RUNS.items():
        if name in options.parts:
            found, of_part = part(options, console)
            content[name] = list(map(asdict, found))
            bounds += of_part
    content["bounds"] = list(map(asdict, bounds))
    console.print(bounds_table(filter(_is_worth_a_line, bounds)))
    options.output.with_suffix(".json").write_text(
        json.dumps(content, indent=1, ensure_ascii=False), encoding="utf-8"
    )
    return judged(bounds, console)


if __name__ == "__main__":
    sys.exit(main())
