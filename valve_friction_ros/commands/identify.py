"""Command `identify_recording`: identify a recorded CSV file or bag."""

import argparse
import json
import sys
from collections.abc import Sequence
from typing import NamedTuple

from valve_friction_ros.commands.arguments.identification import (
    add_identification_arguments,
    identification_settings,
)
from valve_friction_ros.commands.arguments.recording import (
    add_recording_arguments,
    described_valve,
    reading_options,
    require_one,
)
from valve_friction_ros.commands.output.assessment_output import as_json, print_table
from valve_friction_ros.commands.output.formatting import OneLineParser, complain
from valve_friction_ros.commands.output.identification_files import (
    add_file_arguments,
    baseline_from,
    identification_files,
)
from valve_friction_ros.health import Diagnosis, diagnose
from valve_friction_ros.identification import (
    METHODS,
    IdentificationSettings,
    Method,
    RefusalError,
    Result,
)
from valve_friction_ros.model import Valve
from valve_friction_ros.records.recorded_valve import RecordedValve
from valve_friction_ros.records.recordings import read_recordings

__all__ = ["main"]

_EXIT_SOME_REFUSED = 1
_EXIT_REFUSED = 2


class _Result(NamedTuple):
    """A valve of the file, what came of it, and its diagnosis where it has a baseline."""

    recorded: RecordedValve
    outcome: Result | RefusalError
    diagnosis: Diagnosis | None = None


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(
        prog="identify_recording",
        description="Identify the Karnopp friction model from a recorded CSV file or bag.",
        epilog="All results are in SI units. Exit code 2: the file or the record was refused; of "
        "several valves in a bag all were; 1: some of them were.",
    )
    add_recording_arguments(parser)
    add_identification_arguments(parser)
    add_file_arguments(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser


def _identified(
    recorded: RecordedValve,
    valve: Valve,
    identify: Method,
    settings: IdentificationSettings,
) -> Result | RefusalError:
    """Identify one valve, or return why not, with its name."""
    try:
        recording = recorded.recording()
    except RefusalError as refusal:
        return refusal
    try:
        return identify(recording, valve, settings)
    except RefusalError as refusal:
        return recorded.refused(refusal)


def _results(options: argparse.Namespace) -> list[_Result]:
    """Read and identify the valves of the file, and write the files that are to be written."""
    reading = reading_options(options)
    description = described_valve(options, reading)
    settings = identification_settings(options, description.known)
    method = METHODS[options.method]
    baseline, files = baseline_from(options), identification_files(options)
    valve = description.valve
    recorded = read_recordings(options.file, valve, reading)
    files.require_one_valve(recorded)
    if baseline is not None:
        require_one(recorded, "--baseline-coulomb-friction is of")
    results = []
    for each in recorded:
        outcome = _identified(each, valve, method, settings)
        diagnosis = None
        if isinstance(outcome, Result):
            files.write(each, description, outcome, baseline)
            diagnosis = diagnose(outcome, valve, baseline) if baseline is not None else None
        results.append(_Result(each, outcome, diagnosis))
    return results


def _print_json(results: Sequence[_Result]) -> None:
    """Print the object of one valve; of several, an object of them by name."""
    answers = {
        recorded.name: {"error": str(outcome)}
        if isinstance(outcome, RefusalError)
        else as_json(outcome, recorded.notes, diagnosis)
        for recorded, outcome, diagnosis in results
    }
    answer = {"valves": answers} if len(results) > 1 else next(iter(answers.values()))
    print(json.dumps(answer, ensure_ascii=False, allow_nan=False))


def _print_tables(results: Sequence[_Result]) -> None:
    printed = 0
    for recorded, outcome, diagnosis in results:
        if isinstance(outcome, RefusalError):
            continue
        if len(results) > 1:
            print("\n" * (printed > 0) + recorded.name)
        print_table(outcome, recorded.notes, diagnosis)
        printed += 1


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = _parser().parse_args(arguments)
    try:
        results = _results(options)
    except (ValueError, RefusalError, OSError) as error:
        complain("identify_recording", error)
        return _EXIT_REFUSED
    refusals = [result.outcome for result in results if isinstance(result.outcome, RefusalError)]
    if options.json and (len(results) > 1 or not refusals):
        _print_json(results)
    elif not options.json:
        _print_tables(results)
    for refusal in refusals:
        complain("identify_recording", refusal)
    if not refusals:
        return 0
    return _EXIT_REFUSED if len(refusals) == len(results) else _EXIT_SOME_REFUSED


if __name__ == "__main__":
    sys.exit(main())
