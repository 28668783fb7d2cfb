# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The results as tables and as one figure."""

import statistics
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.table import Table

from benchmark.bounds import (
    COVERAGE,
    FORCE_BOUND,
    AlarmCounts,
    by_case,
    case_bounds,
    coverage_of,
    worst,
)
from benchmark.harness.rows import Bound
from benchmark.runs import Information, Outcome
from valve_friction_ros.health import FrictionLimits

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


def bounds_table(bounds: Sequence[Bound]) -> Table:
    """Tabulate the requirements; list those for many cases only where they are missed."""
    table = Table("requirement", "reached", "", title="requirements")
    for bound in bounds:
        if not (bound.met and bound.reached in ("always", "shown 0×")):
            mark = "[green]met[/]" if bound.met else "[red]missed[/]"
            table.add_row(bound.what, bound.reached, mark)
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


_COLOURS = {"clean": "#999999", "10 µm": "#0072B2", "28.6 µm": "#009E73", "60 µm": "#D55E00"}
_SYMBOLS = {
    "coulomb_friction": "$F_c$",
    "viscous_friction": "$F_v$",
    "static_friction": "$F_s$",
    "spring_constant": "$k$",
    "spring_preload": "$F_0$",
}
_LIMITS = {
    "coulomb_friction": 1.0,
    "viscous_friction": 5.0,
    "spring_constant": 0.1,
    "static_friction": 2.0,
}
_RESOLVED = 1e-3


def draw(
    outcomes: Sequence[Outcome],
    coverage: Sequence[Outcome],
    alarms: AlarmCounts | None,
    path: Path,
) -> None:
    """Draw errors, coverage, friction forces and alarms; panels of parts not run stay empty."""
    figure = Figure(figsize=(14, 11), layout="constrained")
    (errors, covered), (forces, ratios) = figure.subplots(2, 2)
    figure.suptitle("Accuracy of the method bench on simulated valves")
    _draw_errors(errors, [*outcomes, *coverage])
    _draw_coverage(covered, coverage)
    _draw_forces(forces, outcomes)
    _draw_alarms(ratios, alarms)
    figure.savefig(path, dpi=110)


def _is_main(outcome: Outcome) -> bool:
    case = outcome.case
    named = (case.excitation, case.noise, case.condition)
    return case.plant.is_karnopp and named == ("square", "28.6 µm", "1 kHz")


def _draw_errors(axes: Axes, outcomes: Sequence[Outcome]) -> None:
    """Draw all errors at the main noise, over their limits."""
    groups = by_case([outcome for outcome in outcomes if _is_main(outcome)])
    labels: list[str] = []
    for case, group in groups.items():
        for name, limit in _LIMITS.items():
            errors = [100 * outcome.errors.get(name, np.nan) / limit for outcome in group]
            if np.isnan(errors).all():
                continue
            spread = np.linspace(-0.3, 0.3, len(errors))
            axes.plot(len(labels) + spread, errors, ".", color=_COLOURS["28.6 µm"], ms=3)
            labels.append(f"{case.plant_name}\n{_SYMBOLS[name]}\n±{limit:g} %")
    axes.axhspan(-1, 1, color="0.92", zorder=0)
    axes.set_xticks(range(len(labels)), labels, fontsize=7)
    axes.set_ylabel("error over what is allowed [1]")
    axes.set_title("square wave, 28.6 µm / 165 Pa, 1 kHz: every record (grey: allowed)")


def _draw_coverage(axes: Axes, outcomes: Sequence[Outcome]) -> None:
    labels: list[str] = []
    for case, group in by_case(outcomes).items():
        for name, symbol in _SYMBOLS.items():
            share, answers = coverage_of(group, name)
            if answers < len(group) / 2:
                continue
            error = np.sqrt(max(share * (1 - share), 0.25 / answers) / answers)
            axes.errorbar(
                len(labels), 100 * share, 100 * error, fmt="o", color="#0072B2", capsize=3
            )
            labels.append(f"{case.plant_name}\n{symbol}")
    axes.axhspan(100 * COVERAGE[0], 100 * COVERAGE[1], color="0.92", zorder=0)
    axes.set_ylim(top=101)
    axes.set_xticks(range(len(labels)), labels, fontsize=7)
    axes.set_ylabel("records whose 95 % interval holds the truth [%]")
    axes.set_title("coverage of the intervals (grey: required; bars: ± 1 standard error)")


def _draw_forces(axes: Axes, outcomes: Sequence[Outcome]) -> None:
    """Draw the worst error of the friction force, with a column per valve and excitation."""
    columns = list(dict.fromkeys((one.case.plant_name, one.case.excitation) for one in outcomes))
    for index, (noise, colour) in enumerate(_COLOURS.items()):
        for condition, marker in (("1 kHz", "o"), ("100 Hz", "x")):
            chosen = [
                one
                for one in outcomes
                if (one.case.noise, one.case.condition) == (noise, condition) and not one.refusal
            ]
            places = [
                columns.index((one.case.plant_name, one.case.excitation)) + 0.18 * index - 0.27
                for one in chosen
            ]
            errors = [max(100 * one.force_error, _RESOLVED) for one in chosen]
            label = f"{noise}, {condition}"
            axes.semilogy(
                places, errors, marker, color=colour, ms=4, ls="", mfc="none", label=label
            )
    axes.axhline(100 * FORCE_BOUND, color="black", lw=1)
    axes.set_xticks(
        range(len(columns)), [f"{one}, {two}" for one, two in columns], rotation=60, ha="right"
    )
    axes.tick_params(axis="x", labelsize=8)
    axes.set_ylabel("worst error of the friction force [%]")
    axes.set_title("friction force over the speeds of the record (line: 5 %)")
    if outcomes:
        axes.legend(fontsize=7, ncols=4)


def _draw_alarms(axes: Axes, alarms: AlarmCounts | None) -> None:
    limits = FrictionLimits()
    if alarms is not None:
        for ratios, label, colour in zip(
            alarms.ratios, ("unchanged", "grown to 1.5 ×"), ("#0072B2", "#D55E00"), strict=True
        ):
            axes.hist(
                ratios,
                bins=np.arange(0.4, 1.8, 0.005).tolist(),
                color=colour,
                label=label,
                log=True,
            )
        axes.legend()
    for limit in (limits.low_ratio, limits.warn_ratio):
        axes.axvline(limit, color="black", lw=1)
    axes.set_xlabel("coulomb friction over its baseline [1]")
    axes.set_ylabel("identifications")
    axes.set_title("low-friction valve watched at 28.6 µm / 165 Pa (lines: alarm limits)")
