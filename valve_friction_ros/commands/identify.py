# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-command `identify`: identify the valves of a recorded CSV file or bag."""

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any, NamedTuple

from valve_friction_ros import figures
from valve_friction_ros.commands.arguments import require_outputs
from valve_friction_ros.commands.arguments.identification import (
    has_failed,
    identification_settings,
    method_name,
    survey_limits,
)
from valve_friction_ros.commands.arguments.recording import (
    described,
    identifying_progress,
    read_one,
    reading_progress,
    require_one,
    save_columns,
)
from valve_friction_ros.commands.process import ExitCode, complain
from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.diagnosis import Diagnosis, FrictionLimits
from valve_friction_ros.health.friction_monitor import (
    MonitorSettings,
    diagnose_outcome,
    identify_recording,
)
from valve_friction_ros.health.levels import Finding, Level, Survey
from valve_friction_ros.health.valve_numbers import RefusedRecordError
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.result import Result
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.outside_text import printable
from valve_friction_ros.records.recorded_valve import RecordedValve, Stretch
from valve_friction_ros.records.recordings import ReadingOptions, read_recordings
from valve_friction_ros.wording import in_zone


def _baseline_from(options: argparse.Namespace) -> Baseline | None:
    friction, width = options.baseline_coulomb_friction, options.baseline_half_width
    if options.baseline_recording is not None and (friction, width) != (None, None):
        raise ValueError("--baseline-recording provides the baseline: give no other baseline")
    if friction is None:
        if width is not None:
            raise ValueError(
                "--baseline-half-width: give the baseline itself with --baseline-coulomb-friction"
            )
        return None
    return Baseline(friction, 0.0 if width is None else width)


def _dated(path: Path, zone: str) -> str:
    """Return the time of the last change of a file, in words; empty if it is not a file."""
    if not path.is_file():
        return ""
    changed = datetime.fromtimestamp(path.stat().st_mtime, timezone.utc)
    return f"its file was last changed {in_zone(changed, zone)}"


class _Answer(NamedTuple):
    """A valve of the file, its result or refusal, and its diagnosis and findings if requested."""

    recorded: RecordedValve
    outcome: Result | RefusalError
    diagnosis: Diagnosis | None = None
    findings: tuple[Finding, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Build the JSON object of the valve; it includes the diagnosis if there is one."""
        if isinstance(self.outcome, RefusalError):
            return {"error": str(self.outcome)}
        shown = self.outcome.to_dict()
        shown["warnings"] = [*self.recorded.notes, *shown["warnings"]]
        if self.diagnosis is None:
            return shown
        findings = [one.to_dict() for one in self.findings]
        return shown | {"diagnosis": self.diagnosis.to_dict(), "findings": findings}


def _identified(
    recorded: RecordedValve, settings: MonitorSettings, baseline: Baseline | None = None
) -> _Answer:
    """Identify one valve, or return why not, with its name.

    A test that did not move the stem shows what held it, if there is a baseline.
    """
    try:
        recording = recorded.recording()
    except RefusalError as refusal:
        return _Answer(recorded, refusal)
    try:
        result = identify_recording(recording, settings)
    except RefusedRecordError as refusal:
        held, _ = diagnose_outcome(refusal, baseline, settings)
        if held.level is Level.OK:
            return _Answer(recorded, recorded.refused(refusal))
        shown = RefusalError(f"{refusal}; {held}")
        return _Answer(recorded, recorded.refused(shown), held)
    return _Answer(recorded, result, *diagnose_outcome(result, baseline, settings))


def _of_healthy(
    options: argparse.Namespace, settings: MonitorSettings, reading: ReadingOptions
) -> tuple[Baseline, Recording]:
    """Return the baseline of the healthy valve, and its record."""
    whole = replace(reading, stretch=Stretch(), beside=())
    recorded = read_one(options.baseline_recording, settings.valve, whole)
    outcome = _identified(recorded, settings).outcome
    if isinstance(outcome, RefusalError):
        raise outcome
    try:
        return Baseline.of(outcome), outcome.recording
    except RefusalError as refusal:
        raise recorded.refused(refusal) from None


def _write_files(
    options: argparse.Namespace,
    tag: str,
    recorded: RecordedValve,
    result: Result,
    baseline: Baseline | None,
    healthy: Recording | None,
    limits: FrictionLimits,
    zone: str,
) -> None:
    """Write the requested files, with times in a zone; raises OSError, which names the file."""
    if options.plot is not None:
        figures.save_picture(figures.identification_figure(result), options.plot)
    if options.report is not None:
        from valve_friction_ros import reports  # noqa: PLC0415 - slow to import

        record = reports.IdentifiedRecord(
            name=tag or recorded.name.strip("/") or recorded.path.name,
            source=recorded.label,
            result=result,
            baseline=baseline,
            notes=recorded.notes,
            limits=limits,
            dated=_dated(recorded.path, zone),
            zone=zone,
            healthy=healthy,
        )
        reports.write_report(reports.identification_report(record), options.report)


def _print_tables(answers: Sequence[_Answer]) -> None:
    """Print the results for people, each with its notes, diagnosis and findings."""
    gap = ""
    for recorded, outcome, diagnosis, findings in answers:
        if isinstance(outcome, RefusalError):
            continue
        if len(answers) > 1:
            print(gap + printable(recorded.name))
            gap = "\n"
        print(outcome.summary())
        for note in recorded.notes:
            print(f"note: {printable(note)}")
        for finding in filter(None, (diagnosis, *findings)):
            print(finding)


def _print(answers: Sequence[_Answer], command: str, in_json: bool) -> int:
    """Print results and refusals; return the exit code.

    JSON is the object of a single valve, or an object with several valves by name.
    """
    refusals = [one.outcome for one in answers if isinstance(one.outcome, RefusalError)]
    if in_json and (len(answers) > 1 or not refusals):
        objects = {one.recorded.name: one.as_json() for one in answers}
        shown = {"valves": objects} if len(answers) > 1 else next(iter(objects.values()))
        print(json.dumps(shown, ensure_ascii=False, allow_nan=False))
    elif not in_json:
        _print_tables(answers)
    for refusal in refusals:
        complain(command, refusal)
    if not refusals:
        return ExitCode.DONE
    return ExitCode.REFUSED if len(refusals) == len(answers) else ExitCode.PARTLY


def run(options: argparse.Namespace) -> int:
    """Identify the valves of the file, print the results, and write the requested files."""
    description, reading = described(options.file, options.valve, options)
    valve = description.valve
    settings = MonitorSettings(
        valve,
        identification_settings(options, description),
        method_name(options, description.settings),
        survey_limits(options, description),
    )
    baseline = _baseline_from(options)
    require_outputs(picture=options.plot)
    if options.report is not None:
        from valve_friction_ros.reports import require_report_file  # noqa: PLC0415 - slow to import

        require_report_file(options.report)
    healthy: Recording | None = None
    if options.baseline_recording is not None:
        baseline, healthy = _of_healthy(options, settings, reading)
    with reading_progress():
        recorded = read_recordings(options.file, valve, reading)
    save_columns(options, reading)
    given = "coulomb-friction" if healthy is None else "recording"
    for of_one, purpose in (
        (options.plot, "--plot draws"),
        (options.report, "--report is of"),
        (baseline, f"--baseline-{given} is of"),
    ):
        if of_one is not None:
            require_one(recorded, purpose)
    answers = []
    with identifying_progress(len(recorded)) as done:
        for each in recorded:
            answer = _identified(each, settings, baseline)
            own = answer.diagnosis
            tells = baseline is not None or (own is not None and own.survey is not Survey.UNKNOWN)
            if not tells and options.fail_on is None:
                answer = answer._replace(diagnosis=None)
            answers.append(answer)
            done()
    try:
        code = _print(answers, options.command, options.json)
    finally:  # a closed output must not prevent the pictures, nor a full disk the numbers
        for each, outcome, _, _ in answers:
            if isinstance(outcome, Result):
                zone = reading.columns.time_zone
                limits = settings.limits
                tag = description.tag
                _write_files(options, tag, each, outcome, baseline, healthy, limits, zone)
    if options.fail_on is not None and baseline is None:
        complain(
            options.command,
            "--fail-on: no baseline, so friction was not compared: give --baseline-recording or "
            "--baseline-coulomb-friction",
        )
    told = (found for each in answers for found in (each.diagnosis, *each.findings))
    levels = (found.level for found in told if found is not None)
    return ExitCode.ALARM if has_failed(options, levels) else code
