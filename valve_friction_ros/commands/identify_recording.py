"""Command `identify_recording`: identify a recorded CSV file."""

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from valve_friction_ros.commands.assessment_output import as_json, print_table
from valve_friction_ros.commands.formatting import OneLineParser
from valve_friction_ros.commands.recording_arguments import (
    DIRECT_DRIVE,
    add_recording_arguments,
    described_valve,
    read_one,
    reading_options,
)
from valve_friction_ros.identification import (
    DEFAULT_METHOD,
    FIXABLE,
    METHODS,
    Assessment,
    IdentificationSettings,
    RefusalError,
)
from valve_friction_ros.model import Valve

__all__ = ["main"]

_EXIT_REFUSED = 2


def _parser() -> argparse.ArgumentParser:
    defaults = IdentificationSettings()
    parser = OneLineParser(
        prog="identify_recording",
        description="Identify the Karnopp friction model from a recorded CSV file.",
        epilog="All values are in SI units. Exit code 2: the file or the record was refused.",
    )
    add_recording_arguments(parser)
    parser.add_argument(
        "--method",
        choices=[*METHODS],
        default=DEFAULT_METHOD,
        help="sweep: several fast strokes; force_balance: a valve signature, two periods or more "
        "of a slow triangle (%(default)s)",
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
        help=f"derivative window d, samples, for both estimates of the sweep; by default "
        f"{defaults.window} for the published one, and chosen from the noise of the record for the "
        "refined one and for the force balance",
    )
    parser.add_argument(
        "--order", type=int, default=defaults.order, help="polynomial order n (%(default)s)"
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


def _run(options: argparse.Namespace) -> tuple[Assessment, Valve]:
    reading = reading_options(options)
    description = described_valve(options, reading)
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
    recording = read_one(options.file, description.valve, reading)
    try:
        assessment = METHODS[options.method](recording, description.valve, settings, options.window)
    except RefusalError as refusal:
        raise RefusalError(f"{options.file}: {refusal}") from None
    if options.plot is not None:
        drive = plots.FORCE if description is DIRECT_DRIVE else plots.PRESSURE
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
        print(json.dumps(as_json(assessment), ensure_ascii=False, allow_nan=False))
    else:
        print_table(assessment, valve)
    return 0


if __name__ == "__main__":
    sys.exit(main())
