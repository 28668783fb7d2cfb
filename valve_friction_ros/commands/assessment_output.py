"""How an assessment is told: as an object of JSON, and as a table."""

import math
from collections.abc import Sequence
from functools import singledispatch
from typing import Any

from rich.table import Table

from valve_friction_ros.commands.formatting import json_number, plain_console, two_digits
from valve_friction_ros.health import Diagnosis, percentage
from valve_friction_ros.identification import (
    ASSESSED_UNITS,
    AssessedParameter,
    Assessment,
    ForceBalanceAssessment,
    SweepAssessment,
    Verdict,
)
from valve_friction_ros.model import Valve

__all__ = ["as_json", "print_table"]


def _parameter_as_json(parameter: AssessedParameter, published: float) -> dict[str, Any]:
    low, high = parameter.interval
    return {
        "value": json_number(parameter.value),
        "standard_error": json_number(parameter.standard_error),
        "interval": [json_number(low), json_number(high)],
        "verdict": parameter.verdict.value,
        "reason": parameter.reason,
        "published": json_number(published),
        "unit": ASSESSED_UNITS[parameter.name],
        "fixed": parameter.verdict is Verdict.FIXED,
    }


def _published(assessment: Assessment, name: str) -> float:
    estimate = assessment.published
    return math.nan if estimate is None else estimate.values.get(name, math.nan)


def _diagnosis_as_json(diagnosis: Diagnosis) -> dict[str, Any]:
    ratio = diagnosis.ratio
    return {
        "level": diagnosis.level.name,
        "ne_107": diagnosis.status_signal.value,
        "message": diagnosis.message,
        "ratio": None if ratio is None else json_number(ratio.value),
        "ratio_interval": None
        if ratio is None
        else [json_number(ratio.low), json_number(ratio.high)],
    }


def as_json(
    assessment: Assessment, notes: Sequence[str] = (), diagnosis: Diagnosis | None = None
) -> dict[str, Any]:
    """Build the object that JSON shows of an assessment.

    `notes` join its warnings; `diagnosis` is there when there is one.
    """
    misfit = assessment.misfit
    told = {} if diagnosis is None else {"diagnosis": _diagnosis_as_json(diagnosis)}
    return {
        "method": assessment.method,
        "parameters": {
            name: _parameter_as_json(parameter, _published(assessment, name))
            for name, parameter in assessment.parameters.items()
        },
        **_evidence(assessment),
        "chosen_window": assessment.window,
        "fit": json_number(assessment.fit),
        "rms": json_number(assessment.rms),
        "systematic_misfit": None if misfit is None else misfit.systematic,
        "model_describes": None if misfit is None else misfit.describes,
        "warnings": [*notes, *assessment.all_warnings],
        **told,
    }


@singledispatch
def _evidence(assessment: Assessment) -> dict[str, Any]:
    """Return what is particular to a method."""
    raise NotImplementedError(type(assessment))


@_evidence.register
def _(assessment: SweepAssessment) -> dict[str, Any]:
    estimate = assessment.published or assessment.start
    return {
        "threshold": estimate.threshold,
        "samples": estimate.samples,
        "sigma": json_number(estimate.sigma),
        "r_squared": json_number(estimate.r_squared),
        "window": estimate.settings.window,
    }


@_evidence.register
def _(assessment: ForceBalanceAssessment) -> dict[str, Any]:
    signature = assessment.signature
    return {
        "position_bias": signature.position_bias,
        "dead_zone": signature.dead_zone,
        "dead_zone_share": signature.dead_zone_share,
        "breakaway_points": [
            {"direction": stroke.direction, **stroke.breakaway._asdict()}
            for stroke in signature.strokes
            if stroke.breakaway is not None
        ],
    }


def print_table(
    assessment: Assessment,
    valve: Valve,
    notes: Sequence[str] = (),
    diagnosis: Diagnosis | None = None,
) -> None:
    """Print an assessment for people; `notes` join its warnings, and a `diagnosis` ends it."""
    table = Table(
        "parameter",
        "value",
        "± 95 %",
        "unit",
        "verdict",
        "published",
        box=None,
        header_style="bold",
    )
    for column in (1, 2, 5):
        table.columns[column].justify = "right"
    for name, parameter in assessment.parameters.items():
        published = _published(assessment, name)
        table.add_row(
            name,
            "–" if math.isnan(parameter.value) else f"{parameter.value:.6g}",
            two_digits(parameter.half_width) if parameter.half_width > 0 else "",
            ASSESSED_UNITS[name],
            parameter.verdict.value,
            "" if math.isnan(published) else f"{published:.6g}",
        )
    console = plain_console()
    console.print(table)
    console.print()
    for parameter in assessment.parameters.values():
        if parameter.reason and parameter.verdict is not Verdict.FIXED:
            console.print(f"{parameter.name} {parameter.verdict.value}: {parameter.reason}")
    for line in _summary(assessment, valve):
        console.print(line)
    for warning in (*notes, *assessment.all_warnings):
        console.print(f"note: {warning}")
    if diagnosis is not None:
        console.print(f"{diagnosis.level.name}: {diagnosis.message}")


def _distance(rms: float, valve: Valve) -> str:
    share = valve.share_of_travel(rms)
    of_travel = f", {percentage(share)} of travel" if math.isfinite(share) else ""
    return f"{rms * 1e6:.3g} µm rms from the measured one{of_travel}"


@singledispatch
def _summary(assessment: Assessment, _: Valve) -> list[str]:
    """Tell the fit, and what is particular to a method."""
    raise NotImplementedError(type(assessment))


@_summary.register
def _(assessment: SweepAssessment, valve: Valve) -> list[str]:
    estimate, misfit = assessment.published or assessment.start, assessment.misfit
    if misfit is None:
        fit = f"the regression reproduces {100 * assessment.fit:.2f} % of the force"
    else:
        fit = (
            f"fit {100 * misfit.fit:.2f} %: the refined model's stem is "
            f"{_distance(misfit.rms, valve)}; {misfit.systematic * 1e6:.3g} µm of it are not noise"
        )
    return [
        fit,
        f"published: threshold δv {estimate.threshold:.4g} m/s, {estimate.samples} samples above "
        f"it, σ_s {estimate.sigma:.4g} N, R² {estimate.r_squared:.6f}, window "
        f"{estimate.settings.window} samples; refined from {assessment.window}",
    ]


@_summary.register
def _(assessment: ForceBalanceAssessment, valve: Valve) -> list[str]:
    signature = assessment.signature
    upward, downward = signature.upward_points, signature.downward_points
    return [
        f"fit {100 * assessment.fit:.2f} %: the model's stem is {_distance(assessment.rms, valve)}",
        f"signature: {len(upward)} strokes up and {len(downward)} down, bias x̄ "
        f"{signature.position_bias * 1e3:.4g} mm, dead zone {signature.dead_zone * 1e-3:.4g} kPa, "
        f"{percentage(signature.dead_zone_share)} of the pressure's span",
    ]
