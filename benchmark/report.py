# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The results as tables."""

import statistics
from collections import Counter
from collections.abc import Sequence

import numpy as np
from rich.table import Table

from benchmark.bounds import Bound, by_case, case_bounds, coverage_of, worst
from benchmark.information import Information
from benchmark.runs import Outcome

__all__ = ["bounds_table", "cases_table", "information_table"]

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
    """Tabulate worst error, verdicts and coverage of each parameter, a row a case."""
    table = Table(
        title="worst error in %, verdicts (i identified, w weak, n not identifiable), coverage"
    )
    columns = ("valve", "excitation", "noise", "rate", "n", "refused")
    for column in (*columns, "F_c", "F_v", "k", "F_s", "force %", "s", "bounds"):
        table.add_column(column)
    for group in by_case(outcomes).values():
        table.add_row(*_row(group))
    return table


def bounds_table(bounds: Sequence[Bound]) -> Table:
    """Tabulate the requirements, those that hold for many cases only where they are missed."""
    table = Table(title="requirements")
    for column in ("requirement", "reached", ""):
        table.add_column(column)
    for bound in bounds:
        if not (bound.met and bound.reached in ("always", "shown 0×")):
            mark = "[green]met[/]" if bound.met else "[red]missed[/]"
            table.add_row(bound.what, bound.reached, mark)
    return table


def information_table(limits: Sequence[Information]) -> Table:
    """Tabulate the smallest standard errors that any method can have, in %."""
    table = Table(title="least standard error in %: pressure known exactly … by its samples alone")
    columns = ("coulomb_friction", "viscous_friction", "spring_constant", "spring_preload")
    for column in ("valve", "noise", *columns):
        table.add_column(column)
    for one in limits:
        cells = [
            f"{_percent(one.pressure_known[name])} … {_percent(one.pressure_measured[name])}"
            for name in columns
        ]
        table.add_row(one.plant_name, one.noise, *cells)
    return table
