# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""Requirements of the accuracy benchmark, and the tables of what it reached."""

import statistics
from collections import Counter
from collections.abc import Sequence

import numpy as np
from rich.table import Table

from benchmark.cases import (
    Case,
    Information,
    Outcome,
    wrong_claims,
)
from benchmark.harness.rows import Bound
from valve_friction_ros.identification import (
    Verdict,
)

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
