# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Node `identifier`: watches one valve and identifies its friction on demand."""

import contextlib
import math
import time
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from functools import partial
from typing import Any, Protocol

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType, JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.parameter import Parameter

from valve_friction_ros.health.alarms import AlarmKind
from valve_friction_ros.health.diagnosis import FrictionLimits
from valve_friction_ros.health.friction_monitor import FrictionMonitor, MonitorSettings
from valve_friction_ros.health.levels import Finding, Level, SurveyLimits, by_severity
from valve_friction_ros.health.measured import DIFFERENCES
from valve_friction_ros.health.valve_diagnosis import ValveLimits
from valve_friction_ros.health.valve_numbers import RefusedRecordError
from valve_friction_ros.history import HistoryError
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import STATED
from valve_friction_ros.identification.trust.plausible_units import require_valve_units
from valve_friction_ros.nodes.identifier.alarm_board import AlarmBoard
from valve_friction_ros.nodes.identifier.alerts import Alerts, FaultLog, log_level, webhook_from
from valve_friction_ros.nodes.identifier.baseline_in_force import BaselineInForce, baseline_from
from valve_friction_ros.nodes.identifier.evidence_watch import EvidenceWatch
from valve_friction_ros.nodes.identifier.history_writer import HistoryWriter, sender_with_rows
from valve_friction_ros.nodes.identifier.recordings import AlarmRecorder, BagSaver, ReportWriter
from valve_friction_ros.nodes.identifier.response_watch import ResponseWatch, StandstillWatch
from valve_friction_ros.nodes.identifier.status import (
    EstimateTopic,
    NumberTopics,
    estimate_status,
    fail,
    friction_status,
    stuck_status,
)
from valve_friction_ros.nodes.identifier.usage_watch import UsageWatch
from valve_friction_ros.nodes.identifier.valve_inputs import ValveInputs
from valve_friction_ros.nodes.identifier.workers import (
    Identification,
    Schedule,
    Workers,
    running_workers,
)
from valve_friction_ros.nodes.plumbing.managed_node import ManagedNode
from valve_friction_ros.nodes.plumbing.parameters import (
    declare_parameters,
    reject_invalid,
    values_of,
    valve_from,
    warn_of_columns,
)
from valve_friction_ros.nodes.plumbing.polled_node import create_service, lack_of_time
from valve_friction_ros.nodes.plumbing.running import run_nodes
from valve_friction_ros.nodes.plumbing.worker import InternalError, Readiness
from valve_friction_ros.settings import (
    IDENTIFICATION,
    NODES,
    VALVE,
    identification_from,
    survey_from,
)
from valve_friction_ros.streams import Arrivals, DataQuality, FaultKind, Intake, Signal
from valve_friction_ros.wording import Code, Statement, said, sentence

CHANGEABLE = tuple(one for one in NODES["identifier"] if not one.read_only)
"""Settings that can be changed while the node runs."""


def monitor_settings(values: Mapping[str, Any]) -> MonitorSettings:
    """Build the settings of the monitor from parameter values.

    Raises ValueError, which names the rule, if they violate a rule.
    """
    given = {one.name: values[one.name] for one in IDENTIFICATION if one.is_given(values[one.name])}
    stated = {name: values[name] for name in STATED if values[name] is not None}
    given["assumed_mass"] = stated.get("mass", values["assumed_mass"])
    return MonitorSettings(
        valve=valve_from(values),
        identification=identification_from(
            given,
            stated=stated,
            assumed=tuple(one.name for one in VALVE if values[one.name] is None),
        ),
        method=values["method"],
        limits=FrictionLimits(
            **{one.name: values[one.name] for one in fields(FrictionLimits) if one.compare},
            survey=SurveyLimits.of_packing(**survey_from(values)),
        ),
        window=values["window"],
        valve_limits=ValveLimits(**{one.name: values[one.name] for one in fields(ValveLimits)}),
    )


def _require_valid(values: Mapping[str, Any]) -> None:
    """Raise ValueError, which names the rule, if parameter values violate a rule."""
    settings = monitor_settings(values)
    how = settings.identification
    require_valve_units(settings.valve, {**how.stated, **how.fixed})
    baseline_from(values["baseline_coulomb_friction"])


class _WholeValve:
    """Reports the findings of the latest result, and each change with its interval; a `Watch`."""

    def __init__(self, monitor: FrictionMonitor) -> None:
        self._monitor = monitor

    def take(self, _: Arrivals) -> None:
        """Ignore samples: the identification uses them."""

    def findings(self) -> Sequence[Finding]:
        return self._monitor.findings

    def values(self) -> dict[str, str]:
        """Return the changes: for a ratio in percent, else in the unit of the number."""
        values = {}
        for name, change in self._monitor.changes.items():
            unit = DIFFERENCES.get(name, "%")
            for end in ("value", "low", "high"):
                number = getattr(change, end)
                key = f"{name} change {end}".removesuffix(" value")
                values[f"{key} [{unit}]"] = f"{100 * (number - 1) if unit == '%' else number:.6g}"
        return values


class Watch(Protocol):
    """Follows the samples of a valve, and adds to its diagnostics."""

    def take(self, arrivals: Arrivals) -> None:
        """Take samples about 20 times a second, in the executor's thread; must return quickly."""

    def findings(self) -> Sequence[Finding]:
        """Return the present findings; each raises the level of the valve if it is more severe."""

    def values(self) -> Mapping[str, str]:
        """Return values of the diagnostics, with the unit of a number in its key."""


_DIAGNOSTIC_PERIOD = 1.0
_PROCESSES = 1
"""Largest number of processes that identify for the executable."""
_CLEARED = said(Code.CLEARED_AS_STAMPS_GO_BACK)
_TELLING = "diagnostics"


class Identifier(ManagedNode):
    """Collects pressure and stem position, identifies on request, and publishes the diagnosis.

    The identification runs in its own thread on a copy of the buffer while the executor continues.
    Its callback awaits the result, so only the thread of the executor accesses the monitor.

    Add it to any executor of rclpy. Raises rclpy's exceptions for a parameter of wrong type or
    range, and ValueError for a parameter that violates a rule.

    Parameters
    ----------
    workers : Workers, optional
        Threads shared by the identifiers of one process; by default its own.
    namespace : str, optional
        Namespace of the valve, if it is not given by a ROS argument.
    **named
        Further arguments of `rclpy.node.Node`, such as `context` and `parameter_overrides`.
    """

    def __init__(
        self, workers: Workers | None = None, namespace: str | None = None, **named: Any
    ) -> None:
        super().__init__("identifier", namespace=namespace, **named)
        with self.removed_if_refused():
            declare_parameters(self, NODES["identifier"])
        reject_invalid(self, CHANGEABLE, _require_valid)
        self.add_post_set_parameters_callback(self._take_parameters)
        self._shared_workers = workers
        self._status_name = f"{self.get_fully_qualified_name()}: friction"
        place = self.get_namespace().strip("/") or self.get_name()
        self._tag = self.get_parameter("valve_tag").value or place
        self.begin()

    def await_others(self) -> None:
        """Take the rows of the valve from the server, which may be away, before `configure`."""
        with contextlib.suppress(ValueError, HistoryError):  # `configure` tells them
            if (sender := sender_with_rows(self, self._tag)) is not None:
                self.opened_before.callback(sender.end)

    def configure(self) -> None:
        """Create all parts that monitor the valve, from the parameters."""
        workers = self._shared_workers or self.opened.enter_context(running_workers())
        self._workers = workers
        warn_of_columns(self)
        values = values_of(self, CHANGEABLE)
        _require_valid(values)
        webhook = webhook_from(self.get_parameter("webhook_url").value)
        self._monitor = FrictionMonitor(monitor_settings(values))
        self._bags = BagSaver(self, self._monitor)
        self._diagnostics_publisher = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        joint = self.get_parameter("joint").value
        self._quality = DataQuality(self._monitor.settings.valve)
        self._fault_log = FaultLog(self)
        self._inputs = ValveInputs(self, joint, self._take_samples, self._drop_damaged)
        pressure, stem, _ = self._inputs.names
        self._readiness = Readiness(self, workers.identify, f"identifies {pressure} and {stem}")
        self._logged_level = Level.OK
        self._estimate_topic = EstimateTopic(self, self.get_parameter("estimate_topic").value)
        results = NumberTopics(self)
        self._identification = Identification(self, self._monitor, results, workers)
        self._schedule = Schedule(self, self._identify_as_scheduled, ReentrantCallbackGroup())
        self._history = HistoryWriter(self, self._monitor, self._tag, workers.history)
        self.opened.callback(self._history.close)
        earlier = self._history.prepare()
        self._evidence = EvidenceWatch(self, self._monitor, self._history, workers.evidence)
        self.opened.callback(self._evidence.close)
        self._baseline = BaselineInForce(
            self, self._monitor, self._history, self._evidence, self._level
        )
        self._baseline.begin()
        if earlier is not None:
            self._monitor.remember(earlier, self._history.known_numbers(earlier))
            results.publish(earlier, self._monitor)
        self._history.read_trend()
        self._usage = UsageWatch(self, self._monitor, self._history)
        self.opened.callback(self._usage.close)
        self._monitor.renew(self._usage.usage().renewal)
        self._response = ResponseWatch(self, self._monitor, self._history)
        self.opened.callback(self._response.close)
        self._reports = ReportWriter(
            self, self._monitor, self._history, self._usage, self._response, workers.apart
        )
        self._alarm = AlarmRecorder(
            self, self._monitor, self._history, self._reports, workers.files
        )
        whole_valve, standstill = _WholeValve(self._monitor), StandstillWatch(self._monitor)
        self._watches: tuple[Watch, ...] = (
            whole_valve,
            standstill,
            self._evidence,
            self._usage,
            self._response,
        )
        self._watch_of: dict[AlarmKind, Watch] = {
            AlarmKind.WHOLE_VALVE: whole_valve,
            AlarmKind.STUCK: standstill,
            AlarmKind.POSITIONER: self._response,
        }
        self._board = AlarmBoard(self, self._monitor, self._history, self._evidence)
        self._alerts = Alerts(self, workers, self._history, self._level(), webhook)
        for name, work, failure in (
            ("identify", self._identify, ""),
            ("save", self._save, "the buffer was not saved"),
            ("report", self._report, "no report was written"),
            ("set_baseline", partial(self._shown, self._baseline.set), ""),
            ("restore_baseline", partial(self._shown, self._baseline.restore), ""),
            ("clear", self._clear, ""),
            ("reset_usage", partial(self._shown, self._reset_usage), ""),
        ):
            create_service(self, f"~/{name}", work, failure, is_dated=name != "clear")
        steady = Clock(clock_type=ClockType.STEADY_TIME)  # sim time may never start, or stop
        self.create_timer(_DIAGNOSTIC_PERIOD, self._tell, clock=steady)
        jumps = self.get_clock().create_jump_callback(
            JumpThreshold(
                min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=True
            ),
            post_callback=self.exclusive(self._on_time_jump),
        )
        self.opened.callback(jumps.unregister)

    def poll(self) -> None:
        """Take the samples that have arrived."""
        self._inputs.take()
        self._readiness.look()

    def overdue(self) -> str | None:
        """Describe running work that exceeds its time limit, or return None."""
        if not self.is_configured:
            return None
        limit = self.get_parameter("identification_limit").value
        identify = self._workers.identify
        busy, thread = max(
            (0.0 if identify.is_preparing else identify.busy_for(), "identifications"),
            (self._workers.files.busy_for(), "bags and reports"),
            (self._workers.evidence.busy_for(), "moves in service"),
        )
        if busy <= limit:
            return None
        return (
            f"the thread of {thread} has been busy for {busy:.0f} s, beyond identification_limit "
            f"({limit:g} s): restart the node"
        )

    def stuck_status(self, problem: str) -> DiagnosticStatus:
        """Return the status of a valve that is not monitored."""
        return stuck_status(self._status_name, self._tag, problem)

    def _take_samples(self, arrivals: Arrivals) -> None:
        if not self.is_active:
            return
        arrivals = self._monitor.buffer.in_order(arrivals)
        intake = self._monitor.buffer.add_arrivals(arrivals)
        self._identification.follow()
        self._judge(arrivals, intake)
        plausible = arrivals.plausible()
        for watch in self._watches:
            watch.take(plausible)
        if intake.cleared is not None:
            self._fault_log.note(_CLEARED, intake.cleared, time.monotonic())

    def _drop_damaged(self, signal: Signal, count: int) -> None:
        self._judge(Arrivals.joined(()), self._monitor.buffer.drop_damaged(signal, count))

    def _judge(self, arrivals: Arrivals, intake: Intake) -> None:
        now = self.get_clock().now().nanoseconds  # 0: simulated time has not started
        tolerance = self.get_parameter("clock_tolerance").value
        self._quality.see(arrivals, intake, time.monotonic(), now or None, tolerance)

    def _take_parameters(self, changes: list[Parameter]) -> None:
        if not self.is_configured:
            return
        self._inputs.take(is_all=True)
        self._monitor.change_settings(monitor_settings(values_of(self, CHANGEABLE)))
        self._quality.valve = self._monitor.settings.valve
        self._usage.follow_parameters()
        self._evidence.follow_parameters()
        self._baseline.follow_parameter(changes)
        self._schedule.follow()

    def _on_time_jump(self, jump: TimeJump) -> None:
        seconds = jump.delta.nanoseconds / 1e9
        cause = said(Code.TIME_JUMPED, seconds=-seconds) if seconds else said(Code.CLOCK_CHANGED)
        self._inputs.take(is_all=True)
        self._monitor.buffer.clear(cause)
        self._quality.forget_stamps()
        self._evidence.forget_samples()
        cleared = said(Code.BUFFER_CLEARED, because=cause)
        self._fault_log.note(said(Code.TIME_JUMPS), cleared, time.monotonic())

    async def _identify(self) -> str:
        """Identify the buffer, and store the result or the refusal; return the diagnosis."""
        self._inputs.take(is_all=True)
        record, refused = self._identification.record(), None
        self._board.is_requested = True
        try:
            await self._identification.run(record)
        except RefusalError as refusal:
            refused, self._board.is_requested = refusal, False
            self._monitor.refuse(refusal)
            self.get_logger().warning(f"identification refused: {refusal}")
        except InternalError:
            self._board.is_requested = False
            self._publish_diagnostics()
            raise
        answer = "; ".join(
            (
                *self._silence(),  # the cause if there are no samples
                str(refused or self._monitor.diagnosis().message),
                *(one.message for one in by_severity(self._monitor.findings)),
            )
        )
        await self._history.keep(record, refused)
        self._publish_diagnostics()
        if refused is not None:
            raise RefusalError(answer)
        return answer

    async def _identify_as_scheduled(self) -> None:
        """Identify the buffer; a record that cannot be identified does not change the estimate.

        A refusal is stored only if its record has changed the findings on the valve.
        """
        self._inputs.take(is_all=True)
        before, refused = self._found(), None
        if self._identification.has_nothing_new:
            self._schedule.stall()
            return
        try:
            record = self._identification.record()
            await self._identification.run(record)
        except (RefusalError, InternalError) as error:
            self._schedule.skip(str(error))
            if isinstance(error, RefusalError):
                self._monitor.skip(error)
            if not isinstance(error, RefusedRecordError) or self._found() == before:
                return
            refused = error
        else:
            self._schedule.succeed()
        await self._history.keep(record, refused)
        self._publish_diagnostics()

    def _found(self) -> tuple[Finding | None, ...]:
        """Return the findings of records other than identified friction."""
        return (*self._monitor.findings, self._monitor.held)

    async def _save(self) -> str:
        self._inputs.take(is_all=True)
        return str(await self._bags.saved(self._inputs.names, self._workers.files))

    async def _report(self) -> str:
        return str(await self._reports.written(self._workers.files))

    async def _shown(self, work: Callable[[], Awaitable[str]]) -> str:
        answer = await work()
        self._publish_diagnostics()
        return answer

    async def _clear(self) -> str:
        self._inputs.take(is_all=True)
        self._monitor.buffer.clear(said(Code.CLEARED_ON_REQUEST))
        self._evidence.forget_samples()
        return "the buffer is empty; the estimate and the baseline are kept"

    async def _reset_usage(self) -> str:
        self._inputs.take(is_all=True)
        self._evidence.renew()
        self._response.renew()
        self._monitor.renew(self.get_clock().now().nanoseconds)
        return await self._usage.reset()

    def _silence(self) -> list[str]:
        if problem := lack_of_time(self):
            return [problem]
        return self._inputs.problems(self.get_parameter("input_timeout").value)

    def _faults(self) -> dict[Statement, Statement]:
        """Return the faults of the data, by fixed name, with their full statements.

        Faults of the clock are judged differently for a replayed recording, which has old stamps.
        """
        now = time.monotonic()
        found = self._quality.faults(now)
        if any(one.kind is FaultKind.CLOCK for one in found) and self._inputs.is_played():
            self._quality.forget_clocks()
            found = self._quality.faults(now)
        valve, joint = self._quality.valve, self._inputs.names.joint
        return {one.what: one.statement(valve, joint) for one in found}

    def _data_values(self) -> dict[str, str]:
        """Return the time for which each input has had no usable sample."""
        now, values = time.monotonic(), dict[str, str]()
        pressure, stem = (self._quality.unusable(one, now) for one in Signal)
        if math.isfinite(pressure):
            values["usable_pressure_age [s]"] = f"{pressure:.1f}"
        if math.isfinite(stem):
            values["usable_position_age [s]"] = f"{stem:.1f}"
        return values

    def _level(self) -> Level:
        return self._worst(one for watch in self._watches for one in watch.findings())

    def _worst(self, findings: Iterable[Finding]) -> Level:
        """Return the highest level of the diagnosis of friction and the findings."""
        return max([self._monitor.diagnosis().level, *(one.level for one in findings)])

    def _tell(self) -> None:
        """Publish the diagnostics, or a bug in them."""
        with self.guarded(_TELLING):
            self._publish_diagnostics()
        if (bug := self._failures.get(_TELLING)) is None:
            return
        status = self.stuck_status(bug)
        self._estimate_topic.publish(status)
        self._publish(status)

    def _publish(self, status: DiagnosticStatus) -> None:
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics_publisher.publish(message)

    def _publish_diagnostics(self) -> None:
        self._inputs.take()
        self._inputs.follow_publishers()
        now = self.get_clock().now()
        self._history.settle()
        found = {watch: watch.findings() for watch in self._watches}
        findings = [finding for some in found.values() for finding in some]
        faults = self._faults()
        unusable = [*self._silence(), *map(sentence, faults.values())]
        of_data = [*unusable, *map(str, filter(None, [self._monitor.refusals_problem]))]
        refusals = map(str, filter(None, [self._monitor.refusals_beside_diagnosis]))
        self._board.follow(
            {kind: found[watch] for kind, watch in self._watch_of.items()},
            of_data,
            self._usage.usage().renewal,
            time.monotonic(),
        )
        estimate = estimate_status(
            self._monitor,
            self._status_name,
            self._history.valve.tag,
            findings,
            self._history.trend,
            self._board.values(),
        )
        self._estimate_topic.publish(estimate)
        del found[self._usage]  # the life of a packing is not seen in samples
        level = self._worst(finding for some in found.values() for finding in some)
        self._alarm.follow(level, estimate.message, self._inputs.names)
        upkeep = [*self._history.problems, *filter(None, [self._history.conflict])]
        status = friction_status(
            estimate,
            self._monitor,
            now.nanoseconds,
            [*filter(None, [self.overdue()]), *self._evidence.problems, *unusable, *refusals],
            upkeep,
            {
                **{key: value for one in self._watches for key, value in one.values().items()},
                **self._baseline.values(),
                **self._alarm.values(),
                **self._inputs.values(),
                **self._history.values(),
                **self._schedule.values(),
                **self._readiness.values(),
                **self._data_values(),
            },
            findings,
            is_watched=not unusable,
        )
        if failures := (*self.failures, *self._evidence.failures):
            fail(status, failures)
        beside = self._usage.findings()
        self._alerts.follow(
            status,
            self._monitor.diagnosis(),
            findings,
            self._board.alarms,
            max([Level.OK, *(one.level for one in beside), *[Level.WARN] * bool(upkeep)]),
        )
        self._logged_level = log_level(self, self._logged_level, status)
        self._fault_log.follow(faults, time.monotonic())
        if self._readiness.is_slow:
            status.message += f"; {self._readiness.problem}"
        self._publish(status)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node."""
    with running_workers(_PROCESSES) as workers:
        return run_nodes(lambda: [Identifier(workers)], arguments)
