"""Command `identify_recording`: identify a recorded CSV file."""

import argparse
import json
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rich.console import Console
from rich.table import Table

from valve_friction_ros.commands.formatting import OneLineParser, two_digits
from valve_friction_ros.commands.valve_file import ValveFile, read_valve_file
from valve_friction_ros.identification import (
    ASSESSED_UNITS,
    FIXABLE,
    AssessedParameter,
    Assessment,
    IdentificationSettings,
    RefusalError,
    Verdict,
    assess,
)
from valve_friction_ros.model import Valve
from valve_friction_ros.monitoring import percentage
from valve_friction_ros.monitoring.csv_recording import CsvColumns, drive_column, read_recording

__all__ = ["main"]

_EXIT_REFUSED = 2
_DIRECT_DRIVE = ValveFile(Valve(diaphragm_area=1.0), MappingProxyType({}))
"""A machine without a diaphragm: 1 Pa of "pressure" is 1 N of force."""


def _parser() -> argparse.ArgumentParser:
    defaults = IdentificationSettings()
    parser = OneLineParser(
        prog="identify_recording",
        description="Identify the Karnopp friction model from a recorded CSV file.",
        epilog="All values are in SI units. Exit code 2: the file or the record was refused.",
    )
    parser.add_argument("file", type=Path, metavar="FILE.csv", help="recording, may be gzipped")
    parser.add_argument(
        "--valve",
        type=Path,
        metavar="FILE.yaml",
        help="diaphragm_area, pressure_reference, travel …; needed unless the file holds force_n",
    )
    parser.add_argument(
        "--fix",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help=f"take a parameter as known ({', '.join(FIXABLE)}); NAME alone: from the valve file",
    )
    parser.add_argument(
        "--position-bias",
        type=float,
        metavar="M",
        help="x̄ of (10) in m: the paper's form of four columns, F_0 = k·x̄",
    )
    parser.add_argument(
        "--window",
        type=int,
        help=f"derivative window d, samples, for both estimates; by default {defaults.window} for "
        "the published one, and chosen from the noise of the record for the refined one",
    )
    parser.add_argument(
        "--order", type=int, default=defaults.order, help="polynomial order n (%(default)s)"
    )
    for name in ("time", "position", "pressure", "force"):
        header = getattr(CsvColumns(), name)
        parser.add_argument(
            f"--{name}-column", default=header, metavar="HEADER", help="column header (%(default)s)"
        )
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="draw the identification")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser


def _fixed(entries: Sequence[str], known: Mapping[str, float]) -> dict[str, float]:
    fixed = {}
    for entry in entries:
        name, separator, text = entry.partition("=")
        name = name.strip()
        if name in fixed:
            raise ValueError(f"--fix {name} is given twice")
        if separator:
            try:
                fixed[name] = float(text)
            except ValueError:
                raise ValueError(f"--fix {entry}: {text!r} is not a number") from None
        elif name in known:
            fixed[name] = known[name]
        else:
            raise ValueError(
                f"--fix {name}: give a value, as {name}=VALUE, or a valve file with it"
            )
    return fixed


def _valve(options: argparse.Namespace, columns: CsvColumns) -> ValveFile:
    if options.valve is not None:
        return read_valve_file(options.valve)
    if drive_column(options.file, columns) == columns.pressure:
        raise ValueError("pressure needs the diaphragm_area: give a valve file by --valve")
    return _DIRECT_DRIVE


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


def _as_json(assessment: Assessment) -> dict[str, Any]:
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
        "warnings": _warnings(assessment),
    }


def _warnings(assessment: Assessment) -> list[str]:
    """Warnings of the assessment, and of the published estimate beside it, each once."""
    published = () if assessment.published is None else assessment.published.warnings
    notes = (f"published estimate: {warning}" for warning in published)
    return list(dict.fromkeys((*assessment.warnings, *notes)))


def _print_table(assessment: Assessment, valve: Valve) -> None:
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
    for warning in _warnings(assessment):
        console.print(f"note: {warning}")


def _run(options: argparse.Namespace) -> tuple[Assessment, Valve]:
    columns = CsvColumns(
        options.time_column, options.position_column, options.pressure_column, options.force_column
    )
    description = _valve(options, columns)
    settings = IdentificationSettings(
        window=IdentificationSettings().window if options.window is None else options.window,
        order=options.order,
        fixed=_fixed(options.fix, description.known),
        position_bias=options.position_bias,
        assumed_mass=description.known.get("mass", IdentificationSettings().assumed_mass),
    )
    if options.plot is not None:
        from valve_friction_ros import plots  # noqa: PLC0415 - slow to import

        plots.require_picture_file(options.plot)
    recording = read_recording(options.file, description.valve, columns)
    try:
        assessment = assess(recording, description.valve, settings, options.window)
    except RefusalError as refusal:
        raise RefusalError(f"{options.file}: {refusal}") from None
    if options.plot is not None:
        drive = plots.FORCE if description is _DIRECT_DRIVE else plots.PRESSURE
        figure = plots.identification_figure(recording, description.valve, assessment, drive)
        figure.savefig(options.plot)
    return assessment, description.valve


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = _parser().parse_args(arguments)
    try:
        assessment, valve = _run(options)
    except (ValueError, RefusalError, OSError) as error:
        print("identify_recording:", *str(error).splitlines(), file=sys.stderr)
        return _EXIT_REFUSED
    if options.json:
        print(json.dumps(_as_json(assessment), ensure_ascii=False, allow_nan=False))
    else:
        _print_table(assessment, valve)
    return 0


if __name__ == "__main__":
    sys.exit(main())
