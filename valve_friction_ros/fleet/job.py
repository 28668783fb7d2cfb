# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One recording to identify, and the rows of its results."""

import hashlib
import socket
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from valve_friction_ros import __version__
from valve_friction_ros.fleet.filing import DATED, FILING, Filing, kept_valve
from valve_friction_ros.fleet.rows import PAGE, Cell, error_cells, report_name, result_cells
from valve_friction_ros.health import Baseline, FrictionLimits, diagnose_valve
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
from valve_friction_ros.streams import utc


@dataclass(frozen=True)
class Options:
    """With what a recording is identified, and compared: `baselines` by the names of its valves.

    `tag` is that of its valve, where it is known.
    """

    valve: Valve
    reading: ReadingOptions
    method: str
    settings: IdentificationSettings
    baselines: Mapping[str, Baseline] = field(default_factory=dict)
    tag: str = ""
    limits: FrictionLimits = field(default_factory=FrictionLimits)

    def fingerprint(self) -> str:
        """Return a digest of all options and of the version of the package."""
        apart = ("fixed", "stated")
        settings = [each for each in vars(self.settings).items() if each[0] not in apart]
        everything = (
            __version__,
            self.valve,
            self.reading,
            self.method,
            self.limits.survey,
            settings,
            sorted(self.settings.fixed.items()),
            sorted(self.settings.stated.items()),
            sorted(self.baselines.items(), key=lambda one: one[0]),
            *filter(None, [self.tag]),
        )
        return hashlib.blake2b(repr(everything).encode(), digest_size=8).hexdigest()


@dataclass(frozen=True)
class Job:
    """A recording and how to identify it, to be handed to another process, here or elsewhere.

    `name` is that of the recording in its folder; `reports` is where its reports will be written,
    if they are wanted; `is_filed` asks for what a history keeps of the result, and `baseline` is
    that of the history.
    """

    path: Path
    name: str
    options: Options
    reports: Path | None = None
    is_filed: bool = False
    baseline: Baseline | None = None


def _report(
    job: Job, recorded: RecordedValve, result: Result, baseline: Baseline | None
) -> Mapping[str, Cell]:
    """Make the report of a valve; it is written where the results are."""
    if job.reports is None:
        return {}

    from valve_friction_ros import reports  # noqa: PLC0415 - slow to import

    record = reports.IdentifiedRecord(
        name=job.options.tag or " ".join(filter(None, (job.name, recorded.name))),
        source=recorded.label,
        result=result,
        baseline=baseline,
        limits=job.options.limits,
        notes=recorded.notes,
        zone=job.options.reading.columns.time_zone,
    )
    return {
        "report": f"{job.reports.name}/{_dated(job, result)}{report_name(job.name, recorded.name)}",
        PAGE: reports.render(reports.identification_report(record)),
    }


def _dated(job: Job, result: Result) -> str:
    """Return how the name of a report begins by which the dashboard finds it; empty without tag."""
    if not job.options.tag or result.recording.start_time < DATED:
        return ""
    stem = kept_valve(job.options.tag).name.strip("/").removesuffix("/identifier")
    return f"{stem}_{utc(1e9 * result.recording.start_time):%Y%m%dT%H%M%SZ}_"


def _cells(job: Job, recorded: RecordedValve) -> Mapping[str, Cell]:
    options = job.options
    name = options.tag or recorded.name
    try:
        recording = recorded.recording()
        identify = method_named(options.method)
        result = identify(recording, options.valve, options.settings)
    except RefusalError as refusal:
        return error_cells(name, str(refusal), job.path)
    baseline = options.baselines.get(name) or job.baseline
    diagnosis, found = diagnose_valve(result, baseline, options.limits)
    cells: dict[str, Any] = result_cells(name, result, diagnosis, recorded.notes, found)
    if job.is_filed:
        cells[FILING] = Filing.of(job.name, options.tag, result, options.method)
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
        return [error_cells(job.options.tag, str(error), job.path)]
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
