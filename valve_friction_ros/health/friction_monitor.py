# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The monitor of one valve, without ROS: buffer, last result, baseline, diagnosis."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from valve_friction_ros.health.baseline import Baseline, BaselineLack, Lack
from valve_friction_ros.health.diagnosis import (
    Diagnosis,
    EarlierEstimate,
    Estimate,
    FrictionLimits,
    FrictionState,
    StandingAlarm,
    diagnose,
    diagnose_again,
)
from valve_friction_ros.health.levels import Finding, Level, StatusSignal
from valve_friction_ros.health.measured import Measured, valve_changes
from valve_friction_ros.health.standstill import held_finding, held_numbers
from valve_friction_ros.health.valve_diagnosis import (
    KnownNumbers,
    ValveDiagnosis,
    ValveLimits,
    diagnose_valve,
    qualified,
)
from valve_friction_ros.health.valve_numbers import (
    RefusedRecordError,
    numbers_of_refused,
    valve_numbers,
)
from valve_friction_ros.identification.methods import method_named
from valve_friction_ros.identification.refusal import LittleMotionError, RefusalError
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import (
    DEFAULT_METHOD,
    IdentificationSettings,
    current_name,
)
from valve_friction_ros.model.checks import require_positive
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams.record_buffer import RecordBuffer, Snapshot
from valve_friction_ros.wording import Code, Statement, said


def raised(diagnosis: Diagnosis, time: int) -> StandingAlarm | None:
    """Return the friction alarm raised by a record that was identified at `time`, ns, if any."""
    if diagnosis.state.side is None:
        return None
    dated = said(Code.DATED, of=diagnosis.statement, time=time)
    return StandingAlarm(diagnosis.level, diagnosis.status_signal, diagnosis.state, dated, time)


def followed(
    alarm: StandingAlarm, latest: Diagnosis, limits: FrictionLimits
) -> StandingAlarm | None:
    """Return what remains of an alarm after the next record, whose own diagnosis is `latest`.

    It is the same alarm if that record leaves its level possible; a WARN if it rules out the
    ERROR but not the WARN; None if it rules out both, or raises as severe an alarm itself.
    """
    side = alarm.state.side
    if side is None:
        return None
    left = min(alarm.level, latest.possible(side, limits))
    if left is Level.OK or (latest.state.side is side and latest.state.level >= left):
        return None
    return limited(alarm, left)


def limited(alarm: StandingAlarm, level: Level) -> StandingAlarm:
    """Return an alarm lowered to a level, WARN or ERROR, if it exceeds it."""
    if alarm.level <= level or alarm.state.side is None:
        return alarm
    state = FrictionState.moved(alarm.state.side, level)
    return replace(alarm, level=level, status_signal=state.status_signal, state=state)


def standing(alarm: StandingAlarm | None, latest: Diagnosis) -> Diagnosis:
    """Return the diagnosis of a valve whose latest record has not cleared an alarm.

    It states the dated alarm and the latest record, and has the ratio of the latest record.
    """
    if alarm is None:
        return latest
    code = Code.STANDS_UNCOMPARED if latest.ratio is None else Code.STANDS_UNCERTAIN
    is_worse = latest.level > alarm.level
    level, signal = (
        (latest.level, latest.status_signal) if is_worse else (alarm.level, alarm.status_signal)
    )
    return Diagnosis(
        level,
        signal,
        said(code, alarm=alarm.statement, latest=latest.statement),
        latest.ratio,
        alarm.state,
        alarm=alarm,
        latest=latest,
    )


MOST_SAMPLES = 65_536
"""Most samples per signal in an identification; longer records are averaged. Chosen: the usual
window of 60 s at 1 kHz is not averaged, and the default method takes about a second."""

_REFUSED = 3
"""Refusals in a row that make a fault. Chosen: one or two bad records may be chance."""


@dataclass(frozen=True)
class MonitorSettings:
    """Settings of a monitor: its valve, its identification, its limits.

    Attributes
    ----------
    valve : Valve
        Geometry and sensor range.
    identification : IdentificationSettings
        Settings of the identification.
    method : str
        Name of the method of identification, among `METHODS`; a former name is replaced.
    limits : FrictionLimits
        Bounds of the friction.
    window : float
        Length of the buffered and identified record, s.
    valve_limits : ValveLimits
        Bounds of the other changes of the valve.
    """

    valve: Valve
    identification: IdentificationSettings = field(default_factory=IdentificationSettings)
    method: str = DEFAULT_METHOD
    limits: FrictionLimits = field(default_factory=FrictionLimits)
    window: float = 60.0
    valve_limits: ValveLimits = field(default_factory=ValveLimits)

    def __post_init__(self) -> None:
        method_named(self.method)
        object.__setattr__(self, "method", current_name(self.method))
        require_positive("window", self.window)


class IdentificationInput(NamedTuple):
    """A copy of the buffer, and the settings for its identification."""

    snapshot: Snapshot
    settings: MonitorSettings


def identify_with_numbers(
    snapshot: Snapshot, settings: MonitorSettings
) -> tuple[Result, dict[str, Measured]]:
    """Return the result of `identify_snapshot` and its numbers of the valve."""
    result = identify_snapshot(snapshot, settings)
    return result, valve_numbers(result)


def identify_snapshot(snapshot: Snapshot, settings: MonitorSettings) -> Result:
    """Identify a snapshot of the buffer; any thread may do so, as no monitor is involved.

    More than `MOST_SAMPLES` samples of a signal are averaged (`Snapshot.thinned`), which bounds the
    work at any rate and window. The evidence of the result then states the averaging.

    Raises RefusedRecordError with the cause, and with the cause of a recent clearing of the buffer.
    """
    thin, count = snapshot.thinned(MOST_SAMPLES)
    try:
        result = identify_recording(thin.recording(), settings)
    except RefusalError as refusal:
        cleared = snapshot.cleared_because
        why = "" if cleared is None else f" (the buffer was cleared: {cleared})"
        if not isinstance(refusal, RefusedRecordError):
            refusal = RefusedRecordError.of(refusal, {})
        raise RefusedRecordError(f"{refusal}{why}", refusal.numbers, refusal.is_fault) from refusal
    if count == 1:
        return result
    told = f"the record consists of averages of {count} successive samples"
    evidence = {**result.evidence, "averaged_samples": count}
    return replace(result, evidence=evidence, findings=(*result.findings, told))


def identify_recording(recording: Recording, settings: MonitorSettings) -> Result:
    """Identify a recording by the method and settings of its valve.

    Raises RefusedRecordError with what the record shows nevertheless. Of a stem that did not move,
    that is the friction which held it (`held_numbers`).
    """
    valve, how = settings.valve, settings.identification
    try:
        return method_named(settings.method)(recording, valve, how)
    except RefusalError as refusal:
        numbers = numbers_of_refused(recording, valve, how)
        if isinstance(refusal, LittleMotionError):
            numbers |= held_numbers(recording, valve)
        raise RefusedRecordError.of(refusal, numbers) from refusal


def diagnose_outcome(
    outcome: Result | RefusedRecordError, baseline: Baseline | None, settings: MonitorSettings
) -> ValveDiagnosis:
    """Compare a result with a baseline (`diagnose_valve`), or what held the stem in a refused test.

    The diagnosis of any other refusal is OK, and unknown.
    """
    limits = settings.limits
    if not isinstance(outcome, RefusedRecordError):
        return diagnose_valve(outcome, baseline, limits)
    held = baseline and held_finding(outcome.numbers, baseline, settings.valve, limits)
    if not held:
        return ValveDiagnosis(_no_estimate(str(outcome)), ())
    return ValveDiagnosis(Diagnosis(held.level, held.status_signal, held.statement, None), ())


def _no_estimate(reason: str | Statement) -> Diagnosis:
    return Diagnosis.of(FrictionState.UNKNOWN, said(Code.NO_ESTIMATE, reason=reason))


class _Raised(NamedTuple):
    """Origin of the active alarm.

    It is an estimate with its time, ns, or an alarm stored by an earlier run. `most` is the highest
    level that later records leave.
    """

    time: int
    estimate: Estimate | None
    kept: StandingAlarm | None = None
    most: Level = Level.ERROR


class FrictionMonitor:
    """The monitor of one valve.

    Parameters
    ----------
    settings : MonitorSettings
        Valve, identification, limits and window.

    Attributes
    ----------
    settings : MonitorSettings
        The settings in force (`change_settings`).
    buffer : RecordBuffer
        Buffer of both signals over the window.
    result : Result or None
        The latest result; a refusal leaves it in place.
    earlier : EarlierEstimate or None
        The estimate from before the monitor began; None once there is a result.
    stamp : int or None
        Time of the latest result or of the earlier estimate, ns.
    known : KnownNumbers
        Numbers of the valve besides its friction, including those of earlier records.
    refusal : str or None
        Why the latest identification was refused; None if it was not.
    internal_error : str or None
        The latest bug in an identification, until one succeeds.
    """

    def __init__(self, settings: MonitorSettings) -> None:
        self.settings = settings
        self.buffer = RecordBuffer(settings.valve, settings.window)
        self.result: Result | None = None
        self.earlier: EarlierEstimate | None = None
        self.stamp: int | None = None
        self.known = KnownNumbers()
        self.refusal: str | None = None
        self.internal_error: str | None = None
        self._raised: _Raised | None = None
        self._refused, self._refused_last = 0, ""
        self._baseline: Baseline | None = None

    @property
    def baseline(self) -> Baseline | None:
        """The healthy valve; setting it drops numbers older than the latest result."""
        return self._baseline

    @baseline.setter
    def baseline(self, baseline: Baseline | None) -> None:
        self._baseline, self.known = baseline, self.known.since(self.stamp)
        self._raised = None
        self._follow_alarm()

    @property
    def seen_until(self) -> int | None:
        """End of the latest result's record by its stamps, or time of the earlier estimate.

        Both are ns since 1970 (UTC), as for the moves in service.
        """
        if self.result is None:
            return self.stamp
        recording = self.result.recording
        return round((recording.start_time + recording.duration) * 1e9)

    @property
    def estimate(self) -> Estimate | None:
        """The latest result, or else the earlier estimate."""
        return self.result or self.earlier

    @property
    def changes(self) -> dict[str, Measured]:
        """Changes of the known numbers since the baseline; empty without a baseline."""
        baseline = self.baseline
        return {} if baseline is None else valve_changes(self.known.numbers, baseline.numbers)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Changes of the valve besides its friction (`KnownNumbers.findings`)."""
        settings = self.settings
        return self.known.findings(self.baseline, settings.valve, settings.valve_limits)

    @property
    def held(self) -> Finding | None:
        """Finding that the latest test exceeded the friction limits without moving the stem."""
        baseline, settings = self.baseline, self.settings
        if baseline is None:
            return None
        return held_finding(self.known.of_latest, baseline, settings.valve, settings.limits)

    def may_have_changed(self) -> bool:
        """Return whether more than friction may have changed (`KnownNumbers.may_differ`)."""
        baseline, settings = self.baseline, self.settings
        if baseline is None or not baseline.numbers:
            return False
        return self.known.may_differ(baseline, settings.valve, settings.valve_limits)

    @property
    def common_factor(self) -> Measured | None:
        """Common factor of change of spring and friction, if there is one."""
        return self.known.common_factor(self.baseline, self.settings.valve_limits)

    def change_settings(self, settings: MonitorSettings) -> None:
        """Apply new settings; a new window or valve clears the buffer.

        A new valve keeps only the numbers of the latest record.
        """
        if settings.valve != self.settings.valve:
            self.known = self.known.only_latest()
            self._raised = None
            self._follow_alarm()
        if (settings.valve, settings.window) != (self.settings.valve, self.settings.window):
            self.buffer = RecordBuffer(settings.valve, settings.window)
            self.buffer.clear(said(Code.CLEARED_AS_SETTINGS))
        self.settings = settings

    def input(self) -> IdentificationInput:
        """Return a copy of the buffer with the present settings."""
        return IdentificationInput(self.buffer.snapshot(), self.settings)

    def remember(self, earlier: EarlierEstimate, known: KnownNumbers | None = None) -> None:
        """Continue with an estimate from before the monitor began, until there is a result.

        The numbers `known` from earlier records continue, too.
        """
        self.earlier, self.stamp = earlier, earlier.time
        self.known = (known or KnownNumbers()).with_record(earlier.numbers, earlier.time)
        alarm = earlier.diagnosis.alarm
        if alarm is not None and self.baseline in (None, earlier.baseline):
            self._raised = _Raised(alarm.time, None, alarm)
        self._follow_alarm()

    def renew(self, time: int) -> None:
        """Start with a packing renewed at `time`, ns: alarms of older records clear.

        The diagnosis of the latest record by itself stays until the next record.
        """
        if self._raised is not None and self._raised.time <= time:
            self._raised = None

    def accept(
        self, result: Result, stamp: int, numbers: Mapping[str, Measured] | None = None
    ) -> None:
        """Store a result found at `stamp`, ns, with its `valve_numbers` if already computed."""
        self.result, self.earlier, self.stamp = result, None, stamp
        found = valve_numbers(result) if numbers is None else numbers
        self.known = self.known.followed_by(found, stamp)
        self.refusal = self.internal_error = None
        self._refused = 0
        self._follow_alarm()

    def _follow_alarm(self) -> None:
        """Let the latest estimate raise, keep or clear an alarm."""
        latest = self.estimate
        if latest is None or self.stamp is None:
            return
        own, alarm = self._diagnosis_of(latest), self._alarm()
        left = None if alarm is None else followed(alarm, own, self.settings.limits)
        if left is not None and self._raised is not None:
            self._raised = self._raised._replace(most=left.level)
        else:
            self._raised = None if own.state.side is None else _Raised(self.stamp, latest)

    def _alarm(self) -> StandingAlarm | None:
        """Return the active alarm, by the present baseline and limits."""
        if self._raised is None:
            return None
        time, estimate, alarm, most = self._raised
        if estimate is not None:
            alarm = raised(self._diagnosis_of(estimate), time)
        return None if alarm is None else limited(alarm, most)

    def learn(self, numbers: Mapping[str, Measured], stamp: int) -> None:
        """Store the numbers of the valve from a refused record, found at `stamp`, ns."""
        if numbers:
            self.known = self.known.followed_by(numbers, stamp)

    def refuse(self, refusal: RefusalError) -> None:
        """Store the refusal of an identification."""
        self.refusal = str(refusal)
        self.skip(refusal)

    def skip(self, refusal: RefusalError) -> None:
        """Count a refusal without changing the diagnosis.

        A record with too little motion is not a fault, nor does it clear one.
        """
        if isinstance(refusal, RefusedRecordError) and refusal.is_fault:
            self._refused, self._refused_last = self._refused + 1, str(refusal)

    @property
    def refusals_problem(self) -> Statement | None:
        """Statement of repeated refusals with the latest reason; None if there are too few."""
        if self._refused < _REFUSED:
            return None
        return said(Code.REFUSED_REPEATEDLY, count=self._refused, reason=self._refused_last)

    @property
    def refusals_beside_diagnosis(self) -> Statement | None:
        """The same, for a text with the diagnosis: that has the reason, if it is the same."""
        if self._refused < _REFUSED or self.refusal != self._refused_last:
            return self.refusals_problem
        return said(Code.REFUSED_REPEATEDLY, count=self._refused, reason=None)

    def result_as_baseline(self) -> Baseline:
        """Return the frictions of the latest result, without making them the baseline.

        Raises RefusalError if there is no result, or `Baseline.of` refuses it.
        """
        if self.result is None:
            raise RefusalError("the valve has no result to take as baseline: identify it first")
        return Baseline.of(self.result)

    def baseline_lacks(self) -> tuple[BaselineLack, ...]:
        """Return the conditions of a baseline that the latest result fails."""
        if self.result is None:
            return (BaselineLack("result", Lack.RESULT),)
        return Baseline.lacks(self.result)

    def diagnosis(self, now: int | None = None, is_watched: bool = True) -> Diagnosis:
        """Return the diagnosis by the latest result, also after a refusal; OK without a result.

        The diagnosis of an earlier estimate states its age at `now`, ns, if given. For a valve that
        is not monitored, because its samples cannot be used, a normal state is in the past tense.
        A bug in an identification raises the level to ERROR until an identification succeeds.
        """
        diagnosis = self._diagnosis_by_result(now, is_watched)
        if self.internal_error is None:
            return diagnosis
        failed = said(Code.FAILED, error=self.internal_error, of=diagnosis.statement)
        if diagnosis.level >= Level.ERROR:
            return replace(diagnosis, statement=failed)
        return Diagnosis(Level.ERROR, StatusSignal.CHECK_FUNCTION, failed, diagnosis.ratio)

    def _diagnosis_by_result(self, now: int | None, is_watched: bool) -> Diagnosis:
        if (estimate := self.estimate) is None:
            return _no_estimate(self.refusal or said(Code.NOTHING_IDENTIFIED))
        diagnosis = self._with_alarm(estimate)
        if not is_watched:
            diagnosis = diagnosis.of_before(self.stamp if self.earlier is None else None)
        if self.earlier is not None and now is not None:
            aged = said(Code.AGED, of=diagnosis.statement, age=now - self.earlier.time)
            diagnosis = replace(diagnosis, statement=aged)
        if self.refusal is None:
            return diagnosis
        refused = said(Code.REFUSED, reason=self.refusal, of=diagnosis.statement)
        return replace(diagnosis, statement=refused)

    def _with_alarm(self, estimate: Estimate) -> Diagnosis:
        """Return the diagnosis by the latest estimate, with the alarm that it does not clear."""
        latest = self._diagnosis_of(estimate)
        if self._raised is not None and self._raised.estimate is estimate:
            return latest
        return standing(self._alarm(), latest)

    def _diagnosis_of(self, estimate: Estimate) -> Diagnosis:
        valve, limits = self.settings.valve, self.settings.limits
        if isinstance(estimate, Result):
            found = diagnose(estimate, valve, self.baseline, limits)
        else:
            kept = estimate.diagnosis.own
            found = diagnose_again(estimate, kept, valve, self.baseline, limits)
        return qualified(found, self.common_factor, valve)
