"""An assessment as a table for people and as JSON for programs."""

import math
from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from valve_friction_ros.commands.formatting import two_digits
from valve_friction_ros.identification import (
    ASSESSED_UNITS,
    AssessedParameter,
    Assessment,
    Verdict,
)
from valve_friction_ros.model import Valve
from valve_friction_ros.monitoring import percentage

__all__ = ["as_json", "print_table"]


def _json_number(value: float) -> float | None:
    """JSON has no nan: null stands for it."""
    return value if math.isfinite(value) else None


def _parameter_as_json(parameter: AssessedParameter, published: float) -> dict[str, Any]:
    low, high = parameter.interval
    return {
        "value": _json_number(parameter.value),
        "standard_error": _json_number(parameter.standard_error),
        "interval": [_json_number(low), _json_number(high)],
        "verdict": parameter.verdict.value,
        "reason": parameter.reason,
        "published": _json_number(published),
        "unit": ASSESSED_UNITS[parameter.name],
        "fixed": parameter.verdict is Verdict.FIXED,
    }


def _published(assessment: Assessment, name: str) -> float:
    estimate = assessment.published
    return math.nan if estimate is None else estimate.values.get(name, math.nan)


def as_json(assessment: Assessment, notes: Sequence[str] = ()) -> dict[str, Any]:
    """Build the object that JSON shows of an assessment; `notes` join its warnings."""
    estimate = assessment.published or assessment.start
    misfit = assessment.misfit
    return {
        "parameters": {
            name: _parameter_as_json(parameter, _published(assessment, name))
            for name, parameter in assessment.parameters.items()
        },
        "threshold": estimate.threshold,
        "samples": estimate.samples,
        "sigma": _json_number(estimate.sigma),
        "r_squared": _json_number(estimate.r_squared),
        "window": estimate.settings.window,
        "chosen_window": assessment.start.settings.window,
        "fit": _json_number(assessment.force_fit if misfit is None else misfit.fit),
        "rms": None if misfit is None else misfit.rms,
        "systematic_misfit": None if misfit is None else misfit.systematic,
        "model_describes": None if misfit is None else misfit.describes,
        "warnings": [*notes, *_warnings(assessment)],
    }


def _warnings(assessment: Assessment) -> list[str]:
    """Warnings of the assessment, and of the published estimate beside it, each once."""
    published = () if assessment.published is None else assessment.published.warnings
    notes = (f"published estimate: {warning}" for warning in published)
    return list(dict.fromkeys((*assessment.warnings, *notes)))


def print_table(assessment: Assessment, valve: Valve, notes: Sequence[str] = ()) -> None:
    """Print an assessment for people; `notes` join its warnings."""
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
    console = Console(highlight=False, markup=False)
    console.print(table)
    console.print()
    for parameter in assessment.parameters.values():
        if parameter.reason and parameter.verdict is not Verdict.FIXED:
            console.print(f"{parameter.name} {parameter.verdict.value}: {parameter.reason}")
    estimate = assessment.published or assessment.start
    misfit = assessment.misfit
    if misfit is None:
        console.print(f"the regression reproduces {100 * assessment.force_fit:.2f} % of the force")
    else:
        share = valve.share_of_travel(misfit.rms)
        of_travel = f", {percentage(share)} of travel" if math.isfinite(share) else ""
        console.print(
            f"fit {100 * misfit.fit:.2f} %: the refined model's stem is {misfit.rms * 1e6:.3g} µm "
            f"rms from the measured one{of_travel}; "
            f"{misfit.systematic * 1e6:.3g} µm of it are not noise"
        )
    console.print(
        f"published: threshold δv {estimate.threshold:.4g} m/s, {estimate.samples} samples above "
        f"it, σ_s {estimate.sigma:.4g} N, R² {estimate.r_squared:.6f}, window "
        f"{estimate.settings.window} samples; refined from {assessment.start.settings.window}"
    )
    for warning in (*notes, *_warnings(assessment)):
        console.print(f"note: {warning}")
