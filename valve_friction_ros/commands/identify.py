"""Sub-command `identify`: identify the valves of a recorded CSV file or bag."""

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from valve_friction_ros.commands.arguments.fail_on import has_failed
from valve_friction_ros.commands.arguments.identification import (
    identification_settings,
    method_name,
)
from valve_friction_ros.commands.arguments.recording import (
    described,
    read_one,
    require_one,
)
from valve_friction_ros.commands.output.errors import ExitCode, complain
from valve_friction_ros.commands.output.identification_files import (
    baseline_from,
    identification_files,
)
from valve_friction_ros.commands.output.result_output import as_json, print_table
from valve_friction_ros.health import Diagnosis, Finding, Level, diagnose_valve
from valve_friction_ros.identification import (
    METHODS,
    IdentificationSettings,
    Method,
    RefusalError,
    Result,
)
from valve_friction_ros.model import Valve
from valve_friction_ros.outside_text import printable
from valve_friction_ros.records.recorded_valve import RecordedValve
from valve_friction_ros.records.recordings import read_recordings
from valve_friction_ros.records.stretch import Stretch

__all__ = ["REFUSALS", "run"]

REFUSALS = (RefusalError,)


class _Answer(NamedTuple):
    """A valve of the file, its result or refusal, its diagnosis and findings if asked for."""

    recorded: RecordedValve
    outcome: Result | RefusalError
    diagnosis: Diagnosis | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def levels(self) -> tuple[Level, ...]:
        """Levels of all that is known of the valve's health."""
        own = () if self.diagnosis is None else (self.diagnosis.level,)
        return (*own, *(one.level for one in self.findings))


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


def _print_json(results: Sequence[_Answer]) -> None:
    """Print the object of one valve; of several, an object of them by name."""
    answers = {
        recorded.name: {"error": str(outcome)}
        if isinstance(outcome, RefusalError)
        else as_json(outcome, recorded.notes, diagnosis, findings)
        for recorded, outcome, diagnosis, findings in results
    }
    answer = {"valves": answers} if len(results) > 1 else next(iter(answers.values()))
    print(json.dumps(answer, ensure_ascii=False, allow_nan=False))


def _print_tables(results: Sequence[_Answer]) -> None:
    printed = 0
    for recorded, outcome, diagnosis, findings in results:
        if isinstance(outcome, RefusalError):
            continue
        if len(results) > 1:
            print("\n" * (printed > 0) + printable(recorded.name))
        print_table(outcome, recorded.notes, diagnosis, findings)
        printed += 1


def _print(results: Sequence[_Answer], command: str, in_json: bool) -> int:
    """Print what was found and what was refused; return the exit code."""
    refusals = [result.outcome for result in results if isinstance(result.outcome, RefusalError)]
    if in_json and (len(results) > 1 or not refusals):
        _print_json(results)
    elif not in_json:
        _print_tables(results)
    for refusal in refusals:
        complain(command, refusal)
    if not refusals:
        return ExitCode.DONE
    return ExitCode.REFUSED if len(refusals) == len(results) else ExitCode.PARTLY


def run(options: argparse.Namespace) -> int:
    """Identify the valves of the file, print what was found, and write the files asked for."""
    description, reading = described(options.file, options.valve, options)
    valve = description.valve
    settings = identification_settings(options, description)
    method = METHODS[method_name(options, description.settings)]
    baseline, files = baseline_from(options), identification_files(options)
    if options.baseline_recording is not None:
        whole = replace(reading, stretch=Stretch())
        healthy = read_one(options.baseline_recording, valve, whole)
        baseline, files = files.compared_with(
            healthy, _identified(healthy, valve, method, settings)
        )
    recorded = read_recordings(options.file, valve, reading)
    files.require_one_valve(recorded)
    if baseline is not None:
        name = "coulomb-friction" if options.baseline_recording is None else "recording"
        require_one(recorded, f"--baseline-{name} is of")
    results = []
    for each in recorded:
        outcome = _identified(each, valve, method, settings)
        diagnosis: Diagnosis | None = None
        findings: tuple[Finding, ...] = ()
        if isinstance(outcome, Result) and (baseline is not None or options.fail_on is not None):
            diagnosis, findings = diagnose_valve(outcome, baseline)
        results.append(_Answer(each, outcome, diagnosis, findings))
    try:
        code = _print(results, options.command, options.json)
    finally:  # a closed output costs no picture, and a full disk no numbers
        for each, outcome, _, _ in results:
            if isinstance(outcome, Result):
                files.write(each, outcome, baseline)
    if options.fail_on is not None and baseline is None:
        complain(
            options.command,
            "--fail-on: there is no baseline, so no friction was compared: give "
            "--baseline-recording or --baseline-coulomb-friction",
        )
    levels = (level for each in results for level in each.levels)
    return ExitCode.ALARM if has_failed(options, levels) else code
