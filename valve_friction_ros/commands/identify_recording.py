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

from valve_friction_ros.commands.valve_file import ValveFile, read_valve_file
from valve_friction_ros.identification import (
    FIXABLE,
    UNITS,
    Estimate,
    IdentificationSettings,
    RefusalError,
    identify,
)
from valve_friction_ros.model import Valve
from valve_friction_ros.monitoring.csv_recording import CsvColumns, drive_column, read_recording

__all__ = ["main"]

_EXIT_REFUSED = 2
_DIRECT_DRIVE = ValveFile(Valve(diaphragm_area=1.0), MappingProxyType({}))
"""A machine without a diaphragm: 1 Pa of "pressure" is 1 N of force."""


def _parser() -> argparse.ArgumentParser:
    defaults = IdentificationSettings()
    parser = argparse.ArgumentParser(
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
        default=defaults.window,
        help="derivative window d, samples (%(default)s)",
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


def _as_json(estimate: Estimate) -> dict[str, Any]:
    return {
        "parameters": {
            name: {
                "value": _json_number(value),
                "unit": UNITS[name],
                "fixed": name in estimate.fixed,
            }
            for name, value in estimate.values.items()
        },
        "threshold": estimate.threshold,
        "samples": estimate.samples,
        "sigma": _json_number(estimate.sigma),
        "r_squared": _json_number(estimate.r_squared),
        "window": estimate.settings.window,
        "warnings": list(estimate.warnings),
    }


def _print_table(estimate: Estimate) -> None:
    table = Table("parameter", "value", "unit", "", box=None, header_style="bold")
    table.columns[1].justify = "right"
    for name, value in estimate.values.items():
        note = "fixed" if name in estimate.fixed else ""
        table.add_row(name, f"{value:.6g}", UNITS[name], note)
    console = Console()
    console.print(table)
    console.print(
        f"\nthreshold δv {estimate.threshold:.4g} m/s, {estimate.samples} samples above it, "
        f"σ_s {estimate.sigma:.4g} N, R² {estimate.r_squared:.6f}, "
        f"window {estimate.settings.window} samples",
        highlight=False,
    )
    for warning in estimate.warnings:
        console.print(f"note: {warning}", highlight=False)


def _run(options: argparse.Namespace) -> Estimate:
    columns = CsvColumns(
        options.time_column, options.position_column, options.pressure_column, options.force_column
    )
    description = _valve(options, columns)
    settings = IdentificationSettings(
        window=options.window,
        order=options.order,
        fixed=_fixed(options.fix, description.known),
        position_bias=options.position_bias,
        assumed_mass=description.known.get("mass", 0.0),
    )
    if options.plot is not None:
        from valve_friction_ros import plots  # noqa: PLC0415 - slow to import

        plots.require_picture_file(options.plot)
    recording = read_recording(options.file, description.valve, columns)
    try:
        estimate = identify(recording, description.valve, settings)
    except RefusalError as refusal:
        raise RefusalError(f"{options.file}: {refusal}") from None
    if options.plot is not None:
        drive = plots.FORCE if description is _DIRECT_DRIVE else plots.PRESSURE
        figure = plots.identification_figure(recording, description.valve, estimate, drive)
        figure.savefig(options.plot)
    return estimate


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = _parser().parse_args(arguments)
    try:
        estimate = _run(options)
    except (ValueError, RefusalError, OSError) as error:
        print("identify_recording:", *str(error).splitlines(), file=sys.stderr)
        return _EXIT_REFUSED
    if options.json:
        print(json.dumps(_as_json(estimate), ensure_ascii=False, allow_nan=False))
    else:
        _print_table(estimate)
    return 0


if __name__ == "__main__":
    sys.exit(main())
