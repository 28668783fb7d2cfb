# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Entries of the history: identifications and baselines of a valve."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from valve_friction_ros import __version__
from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.comparison import carried
from valve_friction_ros.health.diagnosis import EarlierEstimate
from valve_friction_ros.health.friction_monitor import FrictionMonitor, MonitorSettings
from valve_friction_ros.health.levels import Level
from valve_friction_ros.health.measured import DatedNumber, Measured
from valve_friction_ros.health.valve_numbers import RefusedRecordError
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.rendering import parameter_mapping, plain
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.identification.trust.verdict import Parameter, Verdict
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.streams.record_buffer import Snapshot

_MOST_SAMPLES = 2000
"""Most samples of a stored record. Chosen: the loop of forty strokes is smooth, in 16 kB."""

_ENDLESS = 1e300
"""Half width, N, from which an interval carries no information."""


class KeptValve(NamedTuple):
    """A valve: fully qualified name of its identifier, and tag in the plant."""

    name: str
    tag: str


class Span(NamedTuple):
    """First and last stamp of a record, ns."""

    begin: int
    end: int


class Fit(NamedTuple):
    """How well a model reproduces its record; nan if unknown."""

    share: float = math.nan
    """Share of the stem motion that the model reproduces; of the force without a spring."""
    rms: float = math.nan
    """Distance between simulated and measured stem, m."""
    systematic: float = math.nan
    """Part of that distance that is not noise, m."""


@dataclass(frozen=True)
class AlarmRecording:
    """The record saved when the level of a valve rose.

    Attributes
    ----------
    time : int
        When the level rose, ns since 1970 (UTC).
    level : Level
        The level from then on.
    path : Path
        The bag, with the report page in its folder; it may have been removed since.
    message : str
        The diagnosis at that time.
    """

    time: int
    level: Level
    path: Path
    message: str

    def to_dict(self) -> dict[str, Any]:
        """Return a mapping of plain values; the time is ns since 1970 (UTC)."""
        return {
            "time": self.time,
            "level": self.level.name,
            "path": str(self.path),
            "message": self.message,
        }


@dataclass(frozen=True)
class KeptBaseline:
    """A baseline and its source: one change of the baseline in force.

    Attributes
    ----------
    baseline : Baseline
        The friction of the healthy valve.
    time : int
        When it was set, ns since 1970 (UTC).
    since : int
        When its result was identified, ns: a new trend begins there.
    record : Recording or None
        Its record, thinned (`thin`), for pictures; None if unknown.
    replaced : Baseline or None
        The baseline in force before; None without one, or if unknown.
    by : str
        The service that set it.
    level : Level or None
        Level of the diagnosis when it was set; None if unknown.
    withdrawn : bool
        Whether this change withdrew the baseline, so that none is in force.
    """

    baseline: Baseline
    time: int
    since: int
    record: Recording | None = field(default=None, repr=False, compare=False)
    replaced: Baseline | None = None
    by: str = "set_baseline"
    level: Level | None = None
    withdrawn: bool = False

    @property
    def in_force(self) -> Baseline | None:
        """The baseline in force from then on."""
        return None if self.withdrawn else self.baseline

    def to_dict(self) -> dict[str, Any]:
        """Return it as a mapping of plain values, SI units; times are ns since 1970 (UTC)."""
        return {
            "time": self.time,
            "since": self.since,
            "set_by": self.by,
            "level": None if self.level is None else self.level.name,
            **_frictions_of("baseline", self.in_force),
            **_frictions_of("replaced", self.replaced),
        }

    @staticmethod
    def thin(record: Recording) -> Recording:
        """Return at most `_MOST_SAMPLES` samples of a record, evenly spaced."""
        step = -(-len(record) // _MOST_SAMPLES)
        return Recording(
            record.sample_period * step,
            record.drive[::step],
            record.position[::step],
            record.start_time,
            driven_by=record.driven_by,
        )


def _frictions_of(name: str, baseline: Baseline | None) -> dict[str, Any]:
    sliding = None if baseline is None else baseline.sliding
    return {
        name: None if baseline is None else baseline.coulomb_friction,
        f"{name}_half_width": None if baseline is None else baseline.half_width,
        f"{name}_sliding": None if sliding is None else dict(vars(sliding)),
    }


@dataclass(frozen=True, kw_only=True)
class HistoryEntry(EarlierEstimate):
    """One identification, successful or refused: an `EarlierEstimate` and what is stored with it.

    The parameters of a refusal are empty.

    Attributes
    ----------
    valve : KeptValve
        The valve.
    span : Span or None
        Time of its record; None for an empty buffer.
    method : str
        The method actually used, never an automatic choice.
    settings : str
        Settings of the identification, a JSON object (`settings_text`).
    fit : Fit
        How well the model reproduces the record.
    warnings : tuple of str
        Limitations of the numbers.
    refusal : str
        Cause of the refusal; empty for a success.
    version : str
        Version of this software.
    """

    valve: KeptValve
    span: Span | None
    method: str
    settings: str
    fit: Fit = field(default_factory=Fit)
    warnings: tuple[str, ...] = ()
    refusal: str = ""
    version: str = __version__

    def __post_init__(self) -> None:
        """Refuse an entry that is neither or both of success and refusal."""
        if bool(self.parameters) == bool(self.refusal):
            raise ValueError("an entry holds either parameters or the reason of a refusal")
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))

    @property
    def friction(self) -> Parameter | None:
        """The Coulomb friction; None for a refusal."""
        return self.parameters.get("coulomb_friction")

    def to_dict(self) -> dict[str, Any]:
        """Return the entry as a mapping of plain values, SI units; times are ns since 1970 (UTC).

        Values from a result have the keys of `Result.to_dict`.
        """
        begin, end = self.span or (None, None)
        return {
            "time": self.time,
            "begin": begin,
            "end": end,
            "method": self.method,
            "parameters": {name: parameter_mapping(one) for name, one in self.parameters.items()},
            "sliding_speed": plain(self.sliding_speed),
            "fit": plain(self.fit.share),
            "rms": plain(self.fit.rms),
            "systematic_misfit": plain(self.fit.systematic),
            "warnings": list(self.warnings),
            "diagnosis": self.diagnosis.to_dict(),
            **_frictions_of("baseline", self.baseline),
            "limits": plain(self.limits.ratios),
            "refusal": self.refusal,
            "settings": json.loads(self.settings),
            "software_version": self.version,
        }

    def point(self, baseline: Baseline | None = None) -> DatedNumber | None:
        """Return the point of this entry in a trend against a baseline (`friction_point`)."""
        return friction_point(
            self.time, self.parameters, self.sliding_speed, baseline, self.numbers
        )

    def is_at_other_speed(self, baseline: Baseline | None) -> bool:
        """Return whether its sliding friction is known, but not at the speed of a baseline."""
        one = self.parameters.get(SLIDING)
        return one is not None and one.value > 0 and self.point(baseline) is None


def trended(baseline: Baseline | None) -> str:
    """Return the name of the friction whose trend is compared with a baseline."""
    has_sliding = baseline is not None and baseline.sliding is not None
    return SLIDING if has_sliding else "coulomb_friction"


def friction_point(
    time: int,
    parameters: Mapping[str, Parameter],
    speed: float,
    baseline: Baseline | None,
    numbers: Mapping[str, Measured],
) -> DatedNumber | None:
    """Return the point of an identification in a trend, or None.

    If the baseline has a sliding friction, the point is the sliding friction converted to its
    speed; else F_c. The interval excludes the calibration, which is common to all points and the
    baseline. Only an identified or weak friction gives a point: a fixed friction was not measured,
    and a friction that is not identifiable has no value.
    """
    one = parameters.get(trended(baseline))
    if one is not None:
        one = one.without_calibration
    if one is None or one.verdict not in (Verdict.IDENTIFIED, Verdict.WEAK):
        return None
    if not 0 <= one.half_width < _ENDLESS:
        return None
    if baseline is None or baseline.sliding is None:
        return DatedNumber(time, one.value, one.half_width)
    now = carried(parameters, speed, baseline.sliding, numbers)
    return None if now is None else DatedNumber(time, now.value, now.half_width)


def span_of(snapshot: Snapshot) -> Span | None:
    """First and last stamp of both signals of a snapshot."""
    ends = [
        (int(signal.stamps[0]), int(signal.stamps[-1]))
        for signal in (snapshot.pressure, snapshot.position)
        if signal.stamps.size
    ]
    return Span(min(ends)[0], max(end for _, end in ends)) if ends else None


def settings_text(settings: MonitorSettings) -> str:
    """Return the settings of an identification as JSON; equal settings give equal text."""
    content = {
        "valve": vars(settings.valve),
        "identification": vars(settings.identification),
        "window": settings.window,
    }
    return json.dumps(plain(content), sort_keys=True, allow_nan=False)


def entry_of(
    monitor: FrictionMonitor,
    valve: KeptValve,
    snapshot: Snapshot,
    settings: MonitorSettings,
    time: int,
    refusal: RefusalError | None = None,
) -> HistoryEntry:
    """Describe the identification that a monitor has just accepted, or that was refused.

    Parameters
    ----------
    monitor : FrictionMonitor
        Holds the result and the diagnosis.
    valve : KeptValve
        The valve.
    snapshot : Snapshot
        The record.
    settings : MonitorSettings
        Settings of this identification; the settings in force may have changed since.
    time : int
        Now, ns.
    refusal : RefusalError, optional
        Why the record was refused; without one the monitor holds its result.
    """
    outcome = refusal or monitor.result
    return HistoryEntry(
        time=time,
        valve=valve,
        span=span_of(snapshot),
        method=settings.method,
        diagnosis=monitor.diagnosis(time),
        limits=monitor.settings.limits,
        baseline=monitor.baseline,
        settings=settings_text(settings),
        **({} if outcome is None else kept_of(outcome, monitor.known.of_latest)),
    )


def kept_of(outcome: Result | RefusalError, numbers: Mapping[str, Measured]) -> dict[str, Any]:
    """Return the fields of an entry that hold a result, with its `numbers`, or a refusal."""
    if isinstance(outcome, RefusedRecordError):
        return {"refusal": str(outcome), "numbers": outcome.numbers}
    if isinstance(outcome, RefusalError):
        return {"refusal": str(outcome)}
    of_stem = math.nan if outcome.misfit is None else outcome.misfit.of_stem
    return {
        "parameters": outcome.parameters,
        "fit": Fit(outcome.fit, outcome.rms, of_stem),
        "warnings": outcome.warnings,
        "sliding_speed": outcome.sliding_speed,
        "numbers": numbers,
    }
