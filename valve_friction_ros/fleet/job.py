"""One recording to identify, and the rows of its results."""

import hashlib
import socket
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path

from valve_friction_ros import __version__
from valve_friction_ros.fleet.report_files import PAGE, report_name
from valve_friction_ros.fleet.row import Cell, error_cells, result_cells
from valve_friction_ros.health import Baseline, diagnose_valve
from valve_friction_ros.identification import (
    IdentificationSettings,
    RefusalError,
    Result,
    method_named,
)
from valve_friction_ros.model import Valve
from valve_friction_ros.records.recorded_valve import RecordedValve
from valve_friction_ros.records.recordings import ReadingOptions, read_recordings
from valve_friction_ros.records.stores import on_disk

__all__ = ["Job", "Options", "identify_job", "identify_job_elsewhere"]


@dataclass(frozen=True)
class Options:
    """With what a recording is identified, and compared: `baselines` by the names of its valves."""

    valve: Valve
    reading: ReadingOptions
    method: str
    settings: IdentificationSettings
    baselines: Mapping[str, Baseline] = field(default_factory=dict)

    def fingerprint(self) -> str:
        """Return a digest of all options and of the version of the package."""
        settings = [
            (field.name, getattr(self.settings, field.name))
            for field in fields(self.settings)
            if field.name not in ("fixed", "stated")
        ]
        everything = (
            __version__,
            self.valve,
            self.reading,
            self.method,
            settings,
            sorted(self.settings.fixed.items()),
            sorted(self.settings.stated.items()),
            sorted(self.baselines.items(), key=lambda one: one[0]),
        )
        return hashlib.blake2b(repr(everything).encode(), digest_size=8).hexdigest()


@dataclass(frozen=True)
class Job:
    """A recording and how to identify it, to be handed to another process, here or elsewhere.

    `name` is that of the recording in its folder; `reports` is where its reports will be written,
    if they are wanted.
    """

    path: Path
    name: str
    options: Options
    reports: Path | None = None


def _report(
    job: Job, recorded: RecordedValve, result: Result, baseline: Baseline | None
) -> Mapping[str, Cell]:
    """Make the report of a valve; it is written where the results are."""
    if job.reports is None:
        return {}

    from valve_friction_ros import reports  # noqa: PLC0415 - slow to import

    record = reports.IdentifiedRecord(
        name=" ".join(filter(None, (job.name, recorded.name))),
        source=recorded.label,
        result=result,
        baseline=baseline,
        notes=recorded.notes,
    )
    return {
        "report": f"{job.reports.name}/{report_name(job.name, recorded.name)}",
        PAGE: reports.render(reports.identification_report(record)),
    }


def _cells(job: Job, recorded: RecordedValve) -> Mapping[str, Cell]:
    options = job.options
    try:
        recording = recorded.recording()
        identify = method_named(options.method)
        result = identify(recording, options.valve, options.settings)
    except RefusalError as refusal:
        return error_cells(recorded.name, str(refusal), job.path)
    baseline = options.baselines.get(recorded.name)
    diagnosis, found = diagnose_valve(result, baseline)
    cells = result_cells(recorded.name, result, diagnosis, recorded.notes, found)
    return {**cells, **_report(job, recorded, result, baseline)}


def identify_job(job: Job) -> list[Mapping[str, Cell]]:
    """Read and identify a recording.

    Returns the cells of a row for each valve, at least one, in the order of the file; a refusal has
    its reason under ``error``. A page of a report goes with its row.
    """
    try:
        with on_disk(job.path) as path:
            recorded = read_recordings(path, job.options.valve, job.options.reading)
            return [_cells(job, replace(each, path=job.path)) for each in recorded]
    except (ValueError, RefusalError, OSError) as error:
        return [error_cells("", str(error), job.path)]
    except Exception as error:  # noqa: BLE001 - one bad recording must not end the others
        return [error_cells("", f"unexpected {type(error).__name__}: {error}", job.path)]


def identify_job_elsewhere(job: Job) -> list[Mapping[str, Cell]]:
    """Do the same on another machine, which may not see the recording at all."""
    try:
        is_there = job.path.exists()
    except Exception:  # noqa: BLE001 - whoever reads it says what is the matter
        is_there = True
    if is_there:
        return identify_job(job)
    reason = (
        f"{job.path} is not there on {socket.gethostname()}: give all workers the folder under "
        "this path, or put it into an object store"
    )
    return [error_cells("", reason, job.path)]
