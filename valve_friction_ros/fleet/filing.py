# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Results of recordings filed in a history, under the tag of the valve and the recording's time."""

import copy
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from valve_friction_ros.fleet.rows import Cell, diagnosis_cells
from valve_friction_ros.health import (
    Alarm,
    AlarmKind,
    Baseline,
    Diagnosis,
    Finding,
    FrictionHold,
    FrictionLimits,
    diagnose_valve,
)
from valve_friction_ros.health.alarm_conditions import ALARM_OF_SIDE, shown_by
from valve_friction_ros.health.friction_monitor import MonitorSettings
from valve_friction_ros.health.valve_numbers import valve_numbers
from valve_friction_ros.history import (
    HistoryEntry,
    HistoryFile,
    KeptBaseline,
    KeptValve,
    follow_alarms,
    read_alarms,
)
from valve_friction_ros.history.entry import Fit, Span, settings_text
from valve_friction_ros.identification import RefusalError, Result
from valve_friction_ros.streams.samples import nanoseconds

FILING = "filing"
"""What a row holds beside its columns until it is filed."""

DATED = 946_684_800.0
"""Time, s since 1970, from which a stamp is a date: the year 2000."""


def kept_valve(tag: str) -> KeptValve:
    """Return the valve of a tag, under the name that its identifier on ROS would have."""
    return KeptValve(f"/{re.sub(r'[^A-Za-z0-9]+', '_', tag).strip('_').lower()}/identifier", tag)


@dataclass(frozen=True, eq=False)
class Filing:
    """A result to be filed.

    Attributes
    ----------
    recording, tag : str
        The recording, and the tag of its valve.
    result : Result
        The result, without its pictures; its record is thinned.
    method : str
        Name of the method.
    """

    recording: str
    tag: str
    result: Result
    method: str

    @classmethod
    def of(cls, recording: str, tag: str, result: Result, method: str) -> "Filing | None":
        """Return what is filed of a result; None where its record has no date."""
        if not tag or result.recording.start_time < DATED:
            return None
        light = copy.copy(result)
        object.__setattr__(light, "stem", None)
        object.__setattr__(light, "exhibit", None)
        return cls(recording, tag, light, method)

    @property
    def span(self) -> Span:
        """First and last time of the record, ns."""
        begin = nanoseconds(self.result.recording.start_time)
        return Span(begin, begin + nanoseconds(self.result.recording.duration))


@dataclass(frozen=True)
class Filed:
    """What came of filing.

    Attributes
    ----------
    filed, known : int
        Results that were filed, and that had been before.
    baselines : tuple of str
        Tags whose first result became the baseline.
    cells : mapping of tuple of str to mapping of str to Cell
        Cells of the diagnosis against the baseline in force, by recording and tag.
    """

    filed: int
    known: int
    baselines: tuple[str, ...]
    cells: Mapping[tuple[str, str], Mapping[str, Cell]]


def filed_before(place: Path, tags: Iterable[str]) -> set[tuple[str, int]]:
    """Return what a history holds: tags with the second at which a record begins.

    Raises HistoryError if it cannot be read.
    """
    if not place.exists():
        return set()
    names = {kept_valve(tag).name: tag for tag in tags}
    entries = HistoryFile(place).entries(list(names), 0, 2**63 - 1)
    return {
        (names[one.valve.name], one.span.begin // 10**9)
        for one in entries
        if one.span is not None and one.valve.name in names
    }


class _Alarms:
    """Follows the alarms of a valve by the records that are filed, each at the time of its end.

    A record from before the last one that was filed tells nothing of now.
    """

    def __init__(self, history: HistoryFile, valve: KeptValve) -> None:
        self._history, self._valve = history, valve
        alarms = read_alarms(history, valve.name)
        last = history.last_success(valve.name)
        shown = {
            side: alarms.get(kind, Alarm(kind)).condition for side, kind in ALARM_OF_SIDE.items()
        }
        self._hold = FrictionHold(shown, None if last is None else last.time)

    def follow(self, diagnosis: Diagnosis, findings: Iterable[Finding], time: int) -> None:
        """Take the diagnosis of a record that ended at a time, ns."""
        if self._hold.until is not None and time <= self._hold.until:
            return
        self._hold = replace(self._hold.looked(diagnosis, time, FrictionLimits()), until=time)
        conditions = {kind: self._hold.conditions[side] for side, kind in ALARM_OF_SIDE.items()}
        conditions[AlarmKind.WHOLE_VALVE] = shown_by(findings)
        follow_alarms(self._history, self._valve, conditions, time)


def baseline_kept(place: Path, tag: str) -> Baseline | None:
    """Return the baseline that a history holds of a tag, if any.

    Raises HistoryError if it cannot be read.
    """
    kept = HistoryFile(place).baseline(kept_valve(tag).name) if tag and place.exists() else None
    return None if kept is None else kept.baseline


def file_results(place: Path, filings: Iterable[Filing], first_is_baseline: bool) -> Filed:
    """File results in the order of their times.

    Parameters
    ----------
    place : Path
        The history, a file; it is made if it is missing.
    filings : iterable of Filing
        The results; one whose record is in the history already is left as it is.
    first_is_baseline : bool
        Whether the first result of a valve without a baseline becomes its baseline.

    Raises
    ------
    HistoryError
        If it cannot be read or written.
    """
    history = HistoryFile(place)
    history.prepare()
    ordered = sorted(filings, key=lambda one: one.span)
    before = filed_before(place, {one.tag for one in ordered})
    in_force: dict[str, Baseline | None] = {}
    alarms: dict[str, _Alarms] = {}
    begun: list[str] = []
    cells: dict[tuple[str, str], Mapping[str, Cell]] = {}
    known = 0
    for one in ordered:
        valve = kept_valve(one.tag)
        if one.tag not in in_force:
            kept = history.baseline(valve.name)
            in_force[one.tag] = None if kept is None else kept.baseline
            alarms[one.tag] = _Alarms(history, valve)
        if in_force[one.tag] is None and first_is_baseline:
            in_force[one.tag] = _begin(history, valve, one)
            begun += [one.tag] if in_force[one.tag] is not None else []
        baseline = in_force[one.tag]
        diagnosis, findings = diagnose_valve(one.result, baseline)
        cells[one.recording, one.tag] = diagnosis_cells(diagnosis, findings)
        if (one.tag, one.span.begin // 10**9) in before:
            known += 1
            continue
        result = one.result
        settings = MonitorSettings(
            result.valve,
            result.settings,
            one.method,
            window=max(result.recording.duration, result.recording.sample_period),
        )
        history.add(
            HistoryEntry(
                time=one.span.end,
                valve=valve,
                span=one.span,
                method=result.method,
                diagnosis=diagnosis,
                limits=FrictionLimits(),
                baseline=baseline,
                settings=settings_text(settings),
                parameters=result.parameters,
                fit=Fit(
                    result.fit,
                    result.rms,
                    float("nan") if result.misfit is None else result.misfit.of_stem,
                ),
                warnings=result.warnings,
                sliding_speed=result.sliding_speed,
                numbers=valve_numbers(result),
            )
        )
        alarms[one.tag].follow(diagnosis, findings, one.span.end)
    return Filed(len(ordered) - known, known, tuple(begun), cells)


def _begin(history: HistoryFile, valve: KeptValve, one: Filing) -> Baseline | None:
    """Make the first result of a valve its baseline; None where it cannot be one."""
    try:
        baseline = Baseline.of(one.result)
    except RefusalError:
        return None
    record = KeptBaseline.thin(one.result.recording)
    kept = KeptBaseline(baseline, one.span.end, one.span.end, record, by="identify-folder")
    history.set_baseline(valve, kept)
    return baseline
