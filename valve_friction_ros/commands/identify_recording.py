"""Command `identify_recording`: identify a recorded CSV file or bag."""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from valve_friction_ros.commands.assessment_output import as_json, print_table
from valve_friction_ros.commands.formatting import OneLineParser
from valve_friction_ros.commands.identification_arguments import (
    add_identification_arguments,
    identification_settings,
)
from valve_friction_ros.commands.recording_arguments import (
    DIRECT_DRIVE,
    add_recording_arguments,
    described_valve,
    reading_options,
    require_one,
)
from valve_friction_ros.identification import (
    METHODS,
    Assessment,
    IdentificationSettings,
    Method,
    RefusalError,
)
from valve_friction_ros.model import Valve
from valve_friction_ros.monitoring.recorded_valve import RecordedValve
from valve_friction_ros.monitoring.recordings import read_recordings

__all__ = ["main"]

_EXIT_SOME_REFUSED = 1
_EXIT_REFUSED = 2


class _Result(NamedTuple):
    """A valve of the file, and what came of it."""

    recorded: RecordedValve
    outcome: Assessment | RefusalError


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(
        prog="identify_recording",
        description="Identify the Karnopp friction model from a recorded CSV file or bag.",
        epilog="All results are in SI units. Exit code 2: the file or the record was refused; of "
        "several valves in a bag all were; 1: some of them were.",
    )
    add_recording_arguments(parser)
    add_identification_arguments(parser)
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="draw the identification")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser


def _identified(
    recorded: RecordedValve,
    valve: Valve,
    identify: Method,
    settings: IdentificationSettings,
    window: int | None,
) -> Assessment | RefusalError:
    """Identify one valve, or return why not, with its name."""
    try:
        recording = recorded.recording()
    except RefusalError as refusal:
        return refusal
    try:
        return identify(recording, valve, settings, window)
    except RefusalError as refusal:
        return RefusalError(f"{recorded.label}: {refusal}")


def _results(options: argparse.Namespace) -> tuple[Valve, list[_Result]]:
    """Read and identify the valves of the file, and draw the one that is to be drawn."""
    reading = reading_options(options)
    description = described_valve(options, reading)
    settings = identification_settings(options, description.known)
    method = METHODS[options.method]
    if options.plot is not None:
        from valve_friction_ros import plots  # noqa: PLC0415 - slow to import

        plots.require_picture_file(options.plot)
    recorded = read_recordings(options.file, description.valve, reading)
    if options.plot is not None:
        require_one(recorded, "--plot draws")
    results = [
        _Result(each, _identified(each, description.valve, method, settings, options.window))
        for each in recorded
    ]
    if options.plot is not None and isinstance(results[0].outcome, Assessment):
        drive = plots.FORCE if description is DIRECT_DRIVE else plots.PRESSURE
        figure = plots.identification_figure(
            recorded[0].recording(), description.valve, results[0].outcome, drive
        )
        figure.savefig(options.plot)
    return description.valve, results


def _print_json(results: Sequence[_Result]) -> None:
    """Print the object of one valve; of several, an object of them by name."""
    answers = {
        recorded.name: {"error": str(outcome)}
        if isinstance(outcome, RefusalError)
        else as_json(outcome, recorded.notes)
        for recorded, outcome in results
    }
    answer = {"valves": answers} if len(results) > 1 else next(iter(answers.values()))
    print(json.dumps(answer, ensure_ascii=False, allow_nan=False))


def _print_tables(results: Sequence[_Result], valve: Valve) -> None:
    good = [(recorded, outcome) for recorded, outcome in results if isinstance(outcome, Assessment)]
    for number, (recorded, outcome) in enumerate(good):
        if len(results) > 1:
            print("\n" * (number > 0) + recorded.name)
        print_table(outcome, valve, recorded.notes)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = _parser().parse_args(arguments)
    try:
        valve, results = _results(options)
    except (ValueError, RefusalError, OSError) as error:
        print("identify_recording:", *str(error).splitlines(), file=sys.stderr)
        return _EXIT_REFUSED
    refusals = [result.outcome for result in results if isinstance(result.outcome, RefusalError)]
    if options.json and (len(results) > 1 or not refusals):
        _print_json(results)
    elif not options.json:
        _print_tables(results, valve)
    for refusal in refusals:
        print("identify_recording:", *str(refusal).splitlines(), file=sys.stderr)
    if not refusals:
        return 0
    return _EXIT_REFUSED if len(refusals) == len(results) else _EXIT_SOME_REFUSED


if __name__ == "__main__":
    sys.exit(main())
