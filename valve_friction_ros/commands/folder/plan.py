"""What `identify-folder` has to do: each recording with its valve, and what is done already."""

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from valve_friction_ros.commands.arguments.identification import (
    identification_settings,
    method_name,
)
from valve_friction_ros.commands.arguments.recording import described
from valve_friction_ros.fleet import (
    Baselines,
    Entry,
    Findings,
    FoundRecording,
    Job,
    Options,
    ResultsFile,
)
from valve_friction_ros.records.recordings import ReadingOptions
from valve_friction_ros.records.stores import explained, on_disk
from valve_friction_ros.records.valve_file import ValveFile

__all__ = ["Plan", "forget_stale", "make_plan"]

_VALVE_FILE = "valve.yaml"


@dataclass(frozen=True)
class Plan:
    """What is to be done with a recording: the job, or why it cannot be done.

    `content` and `settings` are fingerprints of its files and of its options.
    """

    name: str
    content: str
    settings: str
    job: Job | str


def _valve_file(found: FoundRecording, common: Path | None) -> Path | None:
    """Choose the description that is nearest to a recording."""
    beside = found.path.parent
    places = [beside / f"{found.stem}.{_VALVE_FILE}", beside / _VALVE_FILE]
    if found.path.is_dir():
        places.insert(1, found.path / _VALVE_FILE)
    return next((place for place in places if place.exists()), common)


def make_plan(
    findings: Findings,
    options: argparse.Namespace,
    baselines: Baselines,
    reports: Path | None,
) -> Iterator[Plan]:
    """Plan each recording, in the order of their names; `reports` is the folder of the reports."""

    @cache
    def described_by(valve_file: Path) -> tuple[ValveFile, ReadingOptions]:
        with on_disk(valve_file) as file:
            return described(file, file, options)

    def plan(found: FoundRecording) -> Plan:
        content = ""
        try:
            with explained(found.path):
                content = found.content()
                valve_file = _valve_file(found, options.valve)
                description, reading = (
                    described(found.path, None, options)
                    if valve_file is None
                    else described_by(valve_file)
                )
            wanted = Options(
                description.valve,
                reading,
                method_name(options, description.settings),
                identification_settings(options, description),
                baselines.of(found.name),
            )
        except (ValueError, OSError) as error:
            return Plan(found.name, content, "", str(error))
        job = Job(found.path, found.name, wanted, reports)
        return Plan(found.name, content, wanted.fingerprint(), job)

    return map(plan, findings.recordings)


def _is_current(entry: Entry, plan: Plan) -> bool:
    return (entry.content, entry.settings) == (plan.content, plan.settings)


def _has_reports(entry: Entry, plan: Plan) -> bool:
    """Return whether the reports of an entry are there, if they are wanted."""
    if not isinstance(plan.job, Job) or plan.job.reports is None:
        return True
    beside = plan.job.reports.parent
    return all(
        row["error"] or (row["report"] and (beside / str(row["report"])).is_file())
        for row in entry.rows
    )


def forget_stale(
    results: ResultsFile, plans: Mapping[str, Plan], options: argparse.Namespace
) -> tuple[list[Plan], int]:
    """Drop the rows that do not hold any more; return what is left, and how many were dropped.

    With ``redo`` good rows of other options may go; with ``retry_failed`` refused recordings are
    tried again, and so are those whose reports are missing.

    Raises ValueError if good rows were made with other options and may not go.
    """
    done, others = set(), 0
    for entry in results.entries():
        plan = plans.get(entry.recording)
        if plan is None:
            continue
        if _is_current(entry, plan):
            if _has_reports(entry, plan) and not (options.retry_failed and entry.failed):
                done.add(entry.recording)
        elif entry.content == plan.content and entry.settings != plan.settings:
            others += not entry.refused
    if others and not options.redo:
        raise ValueError(
            f"{results.path}: {others} recordings in it were identified with other options, "
            "another valve file, baseline or version: give another --output, or --redo to replace "
            "them"
        )
    dropped = results.keep(lambda entry: entry.recording not in plans or entry.recording in done)
    return [plan for plan in plans.values() if plan.name not in done], dropped
