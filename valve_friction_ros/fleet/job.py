# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Identification of one recording, and the rows of its results."""

import contextlib
import copy
import hashlib
import re
import socket
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from valve_friction_ros import __version__
from valve_friction_ros.fleet.rows import (
    DATED,
    PAGE,
    Cell,
    diagnosis_cells,
    error_cells,
    report_name,
    result_cells,
)
from valve_friction_ros.health.alarm_conditions import ALARM_OF_SIDE, FrictionHold, shown_by
from valve_friction_ros.health.alarms import NO_CONDITION, Alarm, AlarmKind, Condition
from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.diagnosis import Diagnosis, FrictionLimits
from valve_friction_ros.health.friction_monitor import (
    MonitorSettings,
    diagnose_outcome,
    identify_recording,
)
from valve_friction_ros.health.levels import Level
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.standstill import HELD_FRICTION
from valve_friction_ros.health.valve_numbers import RefusedRecordError, valve_numbers
from valve_friction_ros.history import (
    HistoryEntry,
    HistoryFile,
    KeptBaseline,
    KeptValve,
    follow_alarms,
    read_alarms,
)
from valve_friction_ros.history.entry import Span, kept_of, settings_text
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.records.files import on_disk
from valve_friction_ros.records.recorded_valve import RecordedValve
from valve_friction_ros.records.recordings import ReadingOptions, read_recordings
from valve_friction_ros.streams import utc
from valve_friction_ros.streams.samples import nanoseconds

FILING = "filing"
"""Extra cell of a row until its result is filed."""


def kept_valve(tag: str) -> KeptValve:
    """Return the valve of a tag, under the name that its ROS identifier would have."""
    return KeptValve(f"/{re.sub(r'[^A-Za-z0-9]+', '_', tag).strip('_').lower()}/identifier", tag)


@dataclass(frozen=True, eq=False)
class Filing:
    """A result to be filed, under the tag of its valve.

    `span` is from the first to the last time of the record, ns. The `settings` hold the limits of
    the diagnosis. The `outcome` is the result, without its pictures, or the refusal of a test in
    which the stem did not move.
    """

    recording: str
    tag: str
    span: Span
    settings: MonitorSettings
    outcome: Result | RefusedRecordError

    @classmethod
    def of(
        cls,
        name: str,
        tag: str,
        settings: MonitorSettings,
        recording: Recording,
        outcome: Result | RefusedRecordError,
    ) -> "Filing | None":
        """Return what is filed of a recording.

        None where it has no date, or a refusal shows nothing of the friction.
        """
        if not tag or recording.start_time < DATED:
            return None
        if isinstance(outcome, RefusedRecordError):
            if HELD_FRICTION not in outcome.numbers:
                return None
        else:
            outcome = copy.copy(outcome)
            object.__setattr__(outcome, "stem", None)
            object.__setattr__(outcome, "exhibit", None)
        begin = nanoseconds(recording.start_time)
        span = Span(begin, begin + nanoseconds(recording.duration))
        return cls(name, tag, span, settings, outcome)


class Filed(NamedTuple):
    """Outcome of filing: numbers of results filed now and before, and tags that got a baseline.

    The cells are those of the diagnosis against the baseline in force, by recording and tag.
    """

    filed: int
    known: int
    baselines: tuple[str, ...]
    cells: Mapping[tuple[str, str], Mapping[str, Cell]]


def filed_before(place: Path, tags: Iterable[str]) -> set[tuple[str, int]]:
    """Return the records in a history: tag, and second in which the record begins.

    Raises HistoryError if the history cannot be read.
    """
    if not place.exists():
        return set()
    names = {kept_valve(tag).name: tag for tag in tags}
    entries = HistoryFile(place).entries(list(names), 0)
    return {
        (names[one.valve.name], one.span.begin // 10**9)
        for one in entries
        if one.span is not None and one.valve.name in names
    }


class _Alarms:
    """Updates the alarms of a valve from its filed records, each at the end of the record.

    A record older than the last filed record does not change the alarms. A number that a record
    does not show keeps its earlier value: nothing was repaired.
    """

    def __init__(self, history: HistoryFile, valve: KeptValve) -> None:
        self._history, self._valve = history, valve
        alarms = read_alarms(history, valve.name)
        self._whole = alarms.get(AlarmKind.WHOLE_VALVE, Alarm(AlarmKind.WHOLE_VALVE)).condition
        last = history.last_success(valve.name)
        shown = {
            side: alarms.get(kind, Alarm(kind)).condition for side, kind in ALARM_OF_SIDE.items()
        }
        self._hold = FrictionHold(shown, None if last is None else last.time)

    def follow(self, diagnosis: Diagnosis, filing: Filing, kept: KeptBaseline | None) -> None:
        """Take the diagnosis of a filed record, dated at its end; `kept` is the baseline."""
        time = filing.span.end
        if self._hold.until is not None and time <= self._hold.until:
            return
        looked = self._hold.looked(diagnosis, time, filing.settings.limits)
        self._hold = replace(looked, until=time)
        if isinstance(filing.outcome, RefusedRecordError):
            held = Condition(diagnosis.level, diagnosis.status_signal, diagnosis.message)
            conditions = {} if diagnosis.level is Level.OK else {AlarmKind.STUCK: held}
        else:
            conditions = {kind: self._hold.conditions[side] for side, kind in ALARM_OF_SIDE.items()}
            conditions[AlarmKind.WHOLE_VALVE] = self._whole_valve(filing, kept)
            conditions[AlarmKind.STUCK] = NO_CONDITION
        follow_alarms(self._history, self._valve, conditions, time)

    def _whole_valve(self, filing: Filing, kept: KeptBaseline | None) -> Condition:
        """Return the condition beyond friction; it falls only if nothing can have changed."""
        if kept is None:
            return NO_CONDITION
        valve, limits, baseline = filing.settings.valve, filing.settings.valve_limits, kept.baseline
        since = min(kept.since, filing.span.end)
        known = self._history.known_numbers(self._valve.name, valve, since)
        worst = shown_by(known.findings(baseline, valve, limits))
        if worst.level >= self._whole.level or not known.may_differ(baseline, valve, limits):
            self._whole = worst
        return self._whole


def baseline_kept(place: Path | None, tag: str) -> Baseline | None:
    """Return the baseline of a tag from a history; None without history, tag or baseline.

    Raises HistoryError if the history cannot be read.
    """
    if place is None or not tag or not place.exists():
        return None
    kept = HistoryFile(place).baseline(kept_valve(tag).name)
    return None if kept is None else kept.baseline


def file_results(place: Path, filings: Iterable[Filing], first_is_baseline: bool) -> Filed:
    """File results in the order of their times.

    Parameters
    ----------
    place : Path
        The history file, created if missing.
    filings : iterable of Filing
        The results; a record that is already in the history is not filed again.
    first_is_baseline : bool
        Whether the first result of a valve without a baseline becomes its baseline.

    Raises
    ------
    HistoryError
        If the history cannot be read or written.
    """
    history = HistoryFile(place)
    history.prepare()
    ordered = sorted(filings, key=lambda one: one.span)
    before = filed_before(place, {one.tag for one in ordered})
    in_force: dict[str, KeptBaseline | None] = {}
    alarms: dict[str, _Alarms] = {}
    begun: list[str] = []
    cells: dict[tuple[str, str], Mapping[str, Cell]] = {}
    known = 0
    for one in ordered:
        valve = kept_valve(one.tag)
        if one.tag not in in_force:
            in_force[one.tag] = history.baseline(valve.name)
            alarms[one.tag] = _Alarms(history, valve)
        if in_force[one.tag] is None and first_is_baseline:
            in_force[one.tag] = _begin(history, valve, one)
            begun += [one.tag] if in_force[one.tag] is not None else []
        kept = in_force[one.tag]
        baseline = None if kept is None else kept.baseline
        diagnosis, findings = diagnose_outcome(one.outcome, baseline, one.settings)
        numbers: Mapping[str, Measured] = {}
        if isinstance(one.outcome, RefusedRecordError):
            cells[one.recording, one.tag] = _held_cells(diagnosis)
        else:
            cells[one.recording, one.tag] = diagnosis_cells(diagnosis, findings)
            numbers = valve_numbers(one.outcome)
        if (one.tag, one.span.begin // 10**9) in before:
            known += 1
            continue
        history.add(
            HistoryEntry(
                time=one.span.end,
                valve=valve,
                span=one.span,
                method=one.settings.method,
                diagnosis=diagnosis,
                limits=one.settings.limits,
                baseline=baseline,
                settings=settings_text(one.settings),
                **kept_of(one.outcome, numbers),
            )
        )
        alarms[one.tag].follow(diagnosis, one, kept)
    return Filed(len(ordered) - known, known, tuple(begun), cells)


def _begin(history: HistoryFile, valve: KeptValve, one: Filing) -> KeptBaseline | None:
    """Make the first result of a valve its baseline; None where it cannot be one."""
    if isinstance(one.outcome, RefusedRecordError):
        return None
    try:
        baseline = Baseline.of(one.outcome)
    except RefusalError:
        return None
    record = KeptBaseline.thin(one.outcome.recording)
    kept = KeptBaseline(baseline, one.span.end, one.span.end, record, by="identify-folder")
    history.set_baseline(valve, kept)
    return kept


@dataclass(frozen=True)
class Options:
    """Options of the identification and comparison of a recording.

    `baselines` are keyed by the names of its valves. `tag` is the tag of its valve, if known.
    """

    valve: Valve
    reading: ReadingOptions
    method: str
    settings: IdentificationSettings
    baselines: Mapping[str, Baseline] = field(default_factory=dict)
    tag: str = ""
    limits: FrictionLimits = field(default_factory=FrictionLimits)

    def fingerprint(self) -> str:
        """Return a digest of all options and of the package version."""
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
    """A recording and how to identify it, for another process on this machine or elsewhere.

    `name` is the name of the recording in its folder. `reports` is the folder of its reports, if
    wanted. `is_filed` requests the result for a history, and `baseline` comes from the history.
    `beside` are further files with signals of its valve.
    """

    path: Path
    name: str
    options: Options
    reports: Path | None = None
    is_filed: bool = False
    baseline: Baseline | None = None
    beside: tuple[Path, ...] = ()


def _report(
    job: Job, recorded: RecordedValve, result: Result, baseline: Baseline | None
) -> Mapping[str, Cell]:
    """Return the report of a valve as cells; the process that collects the results writes it."""
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
    """Return the prefix by which the dashboard finds a report; empty without tag or date."""
    if not job.options.tag or result.recording.start_time < DATED:
        return ""
    stem = kept_valve(job.options.tag).name.strip("/").removesuffix("/identifier")
    return f"{stem}_{utc(1e9 * result.recording.start_time):%Y%m%dT%H%M%SZ}_"


def _held_cells(diagnosis: Diagnosis) -> Mapping[str, Cell]:
    """Fill the cells of a refused valve with what held its stem, if that is an alarm."""
    return diagnosis_cells(diagnosis) if diagnosis.level > Level.OK else {}


def _cells(job: Job, recorded: RecordedValve) -> Mapping[str, Cell]:
    options = job.options
    name = options.tag or recorded.name
    stated = options.baselines
    baseline = stated.get(name) or stated.get(recorded.name) or job.baseline
    try:
        recording = recorded.recording()
    except RefusalError as refusal:
        return error_cells(name, str(refusal), job.path)
    settings = MonitorSettings(
        options.valve,
        options.settings,
        options.method,
        options.limits,
        window=max(recording.duration, recording.sample_period),
    )
    outcome: Result | RefusedRecordError
    cells: dict[str, Any]
    try:
        outcome = identify_recording(recording, settings)
    except RefusedRecordError as refusal:
        outcome = refusal
    diagnosis, found = diagnose_outcome(outcome, baseline, settings)
    if isinstance(outcome, RefusedRecordError):
        cells = {**error_cells(name, str(outcome), job.path), **_held_cells(diagnosis)}
    else:
        cells = dict(result_cells(name, outcome, diagnosis, recorded.notes, found))
        cells |= _report(job, recorded, outcome, baseline)
    if job.is_filed:
        cells[FILING] = Filing.of(job.name, options.tag, settings, recording, outcome)
    return cells


def identify_job(job: Job) -> list[Mapping[str, Cell]]:
    """Read and identify a recording.

    Returns the cells of one row per valve, at least one row, in the order of the file. A refusal
    has its reason under ``error``. The page of a report is a cell of its row.
    """
    try:
        with contextlib.ExitStack() as fetched:
            path, *beside = (fetched.enter_context(on_disk(one)) for one in (job.path, *job.beside))
            reading = replace(job.options.reading, beside=tuple(beside))
            recorded = read_recordings(path, job.options.valve, reading)
            return [_cells(job, replace(each, path=job.path)) for each in recorded]
    except (ValueError, RefusalError, OSError) as error:
        files = ", ".join(map(str, (job.path, *job.beside)))
        return [error_cells(job.options.tag, str(error).removeprefix(f"{files}: "), job.path)]
    except Exception as error:  # noqa: BLE001 - one bad recording must not end the others
        return [error_cells("", f"unexpected {type(error).__name__}: {error}", job.path)]


def identify_job_elsewhere(job: Job) -> list[Mapping[str, Cell]]:
    """Identify a recording on another machine, which may not have access to it."""
    try:
        is_there = job.path.exists()
    except Exception:  # noqa: BLE001 - whoever reads it says what is the matter
        is_there = True
    if is_there:
        return identify_job(job)
    reason = (
        f"{job.path} does not exist on {socket.gethostname()}: give all workers the folder under "
        "this path, or put it into an object store"
    )
    return [error_cells("", reason, job.path)]
