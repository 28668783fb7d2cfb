"""Tables of the report, in the paper's units."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from valve_friction_ros.identification import StepMetrics
from valve_friction_ros.reports import Column, Table
from valve_friction_ros.reproduction import paper
from valve_friction_ros.reproduction.checks.check import Check, written
from valve_friction_ros.reproduction.checks.parameter_checks import NOTATION
from valve_friction_ros.reproduction.figures.record_figures import packing_name
from valve_friction_ros.reproduction.programme import BenchResult, Comparison, Programme

__all__ = [
    "check_table",
    "noise_table",
    "parameter_table",
    "rivals_table",
    "signature_table",
    "step_summary_table",
    "step_table",
    "validation_table",
]


def check_table(checks: Sequence[Check], caption: str = "") -> Table:
    """List checks; mismatches are marked, with their reasons."""
    rows = tuple(
        (
            "✓" if one.matched else "✗",
            one.name,
            one.paper,
            one.ours,
            one.criterion if one.matched else f"{one.criterion}. Not matched: {one.why}.",
        )
        for one in checks
    )
    titles = ("", "compared", "paper", "here", "criterion")
    marked = tuple(number for number, one in enumerate(checks) if not one.matched)
    return Table(tuple(map(Column, titles)), rows, caption, marked)


def signature_table(results: Sequence[BenchResult]) -> Table:
    """Show k, x̄ and dead zone of valve signatures with standard errors."""
    rows = []
    for one in results:
        signature = one.identified.signature
        errors = signature.standard_errors
        rows.append(
            (
                one.bench.name,
                f"{signature.spring_constant:.0f} ± {written(errors['spring_constant'], 2)}",
                written(paper.SIGNATURE_SPRING.get(one.bench.name, math.nan), 6),
                f"{one.bench.truth.spring_constant:.0f}",
                f"{signature.position_bias * 1e3:.4f} ± "
                f"{written(errors['position_bias'] * 1e3, 1)}",
                written(paper.SIGNATURE_BIAS.get(one.bench.name, math.nan) * 1e3, 3),
                f"{one.bench.position_bias * 1e3:.4f}",
                f"{signature.dead_zone / 1e3:.2f}",
                f"{len(signature.upward_points)} + {len(signature.downward_points)}",
            )
        )
    titles = (
        "k of (15) [N/m]",
        "paper",
        "truth",
        "x̄ of (14) [mm]",
        "paper",
        "truth",
        "dead zone [kPa]",
        "points P1 + P2",
    )
    columns = (Column("packing"), *(Column(title, is_number=True) for title in titles))
    return Table(columns, tuple(rows), "(14) to (16); ± one standard error, between the strokes")


def _interval(parameter: Mapping[str, Any]) -> str:
    value, width, verdict = (parameter[key] for key in ("value", "half_width", "verdict"))
    if value is None:
        return str(verdict)
    return f"{written(value)} ± {written(width, 2)}" if width else f"{written(value)} ({verdict})"


def parameter_table(result: BenchResult) -> Table:
    """Show Table 1 for one packing: paper, truth and the three estimates."""
    found, name = result.identified, result.bench.name
    results = (found.force_balance, found.refined, found.own_preload)
    shown = [one.to_dict()["parameters"] for one in results]
    rows = []
    for key, (symbol, unit) in NOTATION.items():
        published = found.published.values[key]
        model_1 = written(published)
        if key == "mass":
            regressed = found.free.chosen_estimates["mass"]
            model_1 = written(regressed)
            if key in found.published.fixed:
                model_1 += " (not determined)"
        rows.append(
            (
                f"{symbol} [{unit}]",
                *(
                    written(getattr(model[name], key)) if name in model else "–"
                    for model in (paper.MODEL_1, paper.MODEL_2)
                ),
                written(getattr(result.bench.truth, key)),
                model_1,
                *(_interval(parameters[key]) for parameters in shown),
            )
        )
    titles = (
        "paper, model 1",
        "paper, model 2",
        "truth",
        "model 1",
        "model 2",
        "refined",
        "refined, own F_0",
    )
    columns = (Column("parameter"), *(Column(title, is_number=True) for title in titles))
    return Table(columns, tuple(rows), f"{packing_name(result)}; ± half the 95 % interval")


def validation_table(models: Mapping[str, Comparison], caption: str) -> Table:
    """Show fit, rms and largest error of each model."""
    rows = tuple(
        (
            name,
            f"{100 * one.validation.fit:.4f}",
            written(1e6 * one.validation.rms, 3),
            written(1e6 * one.validation.maximum_error, 3),
            written(1e6 * one.true_rms, 3),
            written(1e6 * one.true_maximum, 3),
        )
        for name, one in models.items()
    )
    titles = (
        "fit [%]",
        "rms error [µm]",
        "largest [µm]",
        "rms, noise-free stem [µm]",
        "largest, noise-free stem [µm]",
    )
    columns = (Column("model"), *(Column(title, is_number=True) for title in titles))
    return Table(columns, rows, caption)


def rivals_table(programme: Programme) -> Table:
    """Show the rms errors of both models over the seeds."""
    rows = tuple(
        (
            one.packing,
            one.excitation,
            *(
                f"{written(1e6 * min(errors), 2)} to {written(1e6 * max(errors), 2)}"
                for errors in (one.model_1, one.model_2)
            ),
            f"{one.wins} of {len(one.model_1)}",
        )
        for one in programme.scatter.rivals
    )
    columns = (
        Column("packing"),
        Column("excitation"),
        Column("model 1, rms [µm]", is_number=True),
        Column("model 2, rms [µm]", is_number=True),
        Column("model 1 closer", is_number=True),
    )
    return Table(columns, rows, "Other seeds of the noise; errors against the noise-free stem")


def noise_table(programme: Programme) -> Table:
    """Show mean and deviation of model 1 by level of noise."""
    rows = tuple(
        (
            one.packing,
            written(1e6 * one.noise.position, 3),
            written(one.noise.pressure, 3),
            *(f"{written(one.mean[key])} ± {written(one.deviation[key], 2)}" for key in one.mean),
        )
        for one in programme.scatter.levels
    )
    titles = ("stem [µm]", "pressure [Pa]", "m [kg]", "F_v [N·s/m]", "F_c [N]", "k [N/m]")
    columns = (Column("packing"), *(Column(title, is_number=True) for title in titles))
    return Table(
        columns,
        rows,
        "Model 1, as regressed with the true x̄, by standard deviation of the sensor noise; "
        "± one standard deviation over the seeds",
    )


def step_table(result: BenchResult) -> Table:
    """Show the response to each step of the ISA test."""
    rows = tuple(_step_row(step) for step in result.steps.steps)
    titles = (
        "begins [s]",
        "step [%]",
        "stem [%]",
        "gain",
        "T_d [s]",
        "T63 [s]",
        "T86 [s]",
        "overshoot [%]",
    )
    columns = (*(Column(title, is_number=True) for title in titles), Column("stem"))
    return Table(columns, rows, f"{packing_name(result)}; in percent of pressure range and travel")


def _step_row(step: StepMetrics) -> tuple[str, ...]:
    return (
        f"{step.time:.1f}",
        f"{step.input_change:+.2f}",
        f"{step.output_change:+.2f}" if step.moved else "0",
        f"{step.gain:.3f}" if step.moved else "0",
        *(f"{value:.3f}" if step.moved else "–" for value in (step.dead_time, step.t63, step.t86)),
        f"{100 * step.overshoot:.1f}" if step.moved else "–",
        "moved" if step.moved else "stayed",
    )


def step_summary_table(results: Sequence[BenchResult]) -> Table:
    """Show dead band and resolution of the ISA test, and the dead band that friction predicts."""
    rows = []
    for one in results:
        expected = 2 * one.bench.truth.static_friction / one.bench.valve.force_per_drive
        band, resolution = one.steps.dead_band, one.steps.resolution
        rows.append(
            (
                one.bench.name,
                f"{band.ignored:.2f} to {band.answered:.2f}",
                f"{100 * expected / paper.PRESSURE_SPAN:.2f}",
                f"{resolution.ignored:.2f} to {resolution.answered:.2f}",
                f"{sum(step.moved for step in one.steps.steps)} of {len(one.steps.steps)}",
            )
        )
    titles = ("dead band [%]", "2·F_s/S_a [%]", "resolution [%]", "steps that moved the stem")
    columns = (Column("packing"), *(Column(title, is_number=True) for title in titles))
    return Table(columns, tuple(rows), "Dead band and resolution lie between the two values")
