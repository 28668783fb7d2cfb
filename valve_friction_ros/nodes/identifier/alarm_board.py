# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The alarms of a valve: conditions, storage in the history, and requests by people."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from rclpy.parameter import Parameter
from std_srvs.srv import SetBool

from valve_friction_ros import history as database
from valve_friction_ros.health.alarm_conditions import ALARM_OF_SIDE, Delay, FrictionHold, shown_by
from valve_friction_ros.health.alarms import (
    NO_CONDITION,
    Alarm,
    AlarmAction,
    AlarmError,
    AlarmEvent,
    AlarmKind,
    AlarmRequest,
    Condition,
    alarm_summary,
    all_followed,
    all_requested,
)
from valve_friction_ros.health.friction_monitor import FrictionMonitor
from valve_friction_ros.health.levels import Finding, Level, StatusSignal
from valve_friction_ros.history.status_values import alarm_values
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.nodes.identifier.evidence_watch import EvidenceWatch
from valve_friction_ros.nodes.identifier.history_writer import HistoryWriter
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode, create_service
from valve_friction_ros.settings import NODES

if TYPE_CHECKING:
    from valve_friction_ros.history import AlarmSteps, HistoryFile

_RISE, _FALL = 15.0, 60.0
"""On-delay and off-delay of the alarm on unusable samples, s. Chosen within the initial delays of
15 to 60 s proposed by ISA-18.2."""
_SETTLE = 600.0
"""Off-delay of conditions shown by moves, s. Chosen: a loop makes some moves within it."""

_ASKED = ("alarm_kind", "alarm_who", "alarm_text", "alarm_hours")


class _Step:
    """A change of the history that records its effect on the alarms once it is made."""

    def __init__(self, make: Callable[["HistoryFile"], "AlarmSteps"]) -> None:
        self._make = make
        self.made: AlarmSteps | None = None
        self.refusal: AlarmError | None = None

    def __call__(self, file: "HistoryFile") -> None:
        try:
            self.made = self._make(file)
        except AlarmError as error:
            self.refusal = error


class AlarmBoard:
    """Follows the alarms of a valve, and offers the services for people to handle them.

    The alarms are those of the history; without one, or while it cannot be written, those of this
    run.
    """

    def __init__(
        self,
        node: PolledNode,
        monitor: FrictionMonitor,
        history: HistoryWriter,
        evidence: EvidenceWatch,
    ) -> None:
        self._node, self._monitor, self._history = node, monitor, history
        self._evidence = evidence
        self.alarms: dict[AlarmKind, Alarm] = history.look_up(database.read_alarms) or {}
        """The alarms by kind, without those never raised."""
        moves = evidence.evidence
        self._hold = FrictionHold(
            {side: self._condition(kind) for side, kind in ALARM_OF_SIDE.items()},
            moves.until if moves.moves else None,
        )
        self._delays = {
            AlarmKind.STUCK: Delay(0.0, _FALL, self._condition(AlarmKind.STUCK)),
            AlarmKind.DATA_QUALITY: Delay(_RISE, _FALL, self._condition(AlarmKind.DATA_QUALITY)),
            AlarmKind.POSITIONER: Delay(0.0, _SETTLE, self._condition(AlarmKind.POSITIONER)),
        }
        self._identified: int | None = None
        self.is_requested = False
        """Whether somebody asked for the next identification: its 95 % interval then decides."""
        self._under_way: _Step | None = None
        self._on_record = dict(self.alarms)
        if not node.tells_parameters:
            return  # a request needs the parameter alarm_who
        for name in ("acknowledge", "shelve", "unshelve", "comment"):
            ask = partial(self._ask, AlarmAction[name.upper()])
            create_service(node, f"~/{name}", ask, is_dated=True)
        create_service(node, "~/out_of_service", self._switch, kind=SetBool, is_dated=True)

    def _condition(self, kind: AlarmKind) -> Condition:
        return self.alarms[kind].condition if kind in self.alarms else NO_CONDITION

    # Conditions of the valve

    def follow(
        self,
        found: Mapping[AlarmKind, Sequence[Finding]],
        faults: Sequence[str],
        renewal: int,
        now: float,
    ) -> None:
        """Update the alarms from the findings by kind and the faults of the data.

        `renewal` is the time at which the packing was renewed, ns; `now` is s of a monotonic clock.
        """
        self._settle()
        time = self._node.get_clock().now().nanoseconds
        if not time:  # simulated time has not started
            return
        conditions = {
            **self._frictions(renewal),
            AlarmKind.WHOLE_VALVE: self._whole_valve(found[AlarmKind.WHOLE_VALVE]),
        }
        fault = Condition(Level.WARN, StatusSignal.CHECK_FUNCTION, "; ".join(faults))
        shown = {
            AlarmKind.STUCK: shown_by(found[AlarmKind.STUCK]),
            AlarmKind.POSITIONER: shown_by(found[AlarmKind.POSITIONER]),
            AlarmKind.DATA_QUALITY: fault if faults else NO_CONDITION,
        }
        for kind, condition in shown.items():
            delay = self._delays[kind] = self._delays[kind].seen(condition, now)
            conditions[kind] = delay.shown
        if events := all_followed(self.alarms, conditions, time):
            self._take(events)
            valve, days = self._history.valve, self._days
            self._under_way = _Step(
                lambda file: database.follow_alarms(file, valve, conditions, time, days)
            )
            self._history.keep_soon(self._under_way)

    @property
    def _days(self) -> float:
        return float(self._node.get_parameter("history_days").value)

    def _take(self, events: Sequence[AlarmEvent]) -> None:
        self.alarms |= {one.alarm.kind: one.alarm for one in events}
        for one in events:
            line = f"alarm {one.alarm.kind.words} {one.action.value}"
            if one.who:
                line += f" by {one.who}"
            if one.text:
                line += f", comment: {one.text}"
            elif one.alarm.is_active:
                line += f"{', condition' if one.who else ''}: {one.alarm.message}"
            self._node.get_logger().info(line)

    def _settle(self) -> None:
        """Adopt the alarms of the history once our change is written: others write there too."""
        step = self._under_way
        if step is not None and step.made is not None:
            self.alarms = dict(step.made.alarms)
            self._under_way = None
        if self._under_way is None:
            self.alarms |= self._history.alarm_news()
        if self._under_way is None or self._history.path is None or self._history.problems:
            self._on_record = dict(self.alarms)

    def _frictions(self, renewal: int) -> dict[AlarmKind, Condition]:
        """Update the friction conditions after a new identification or new moves."""
        monitor, evidence = self._monitor, self._evidence.evidence
        limits = monitor.settings.limits
        before, self._hold = self._hold, self._hold.based_on((monitor.baseline, limits, renewal))
        if before.basis is not None and before.basis != self._hold.basis:
            self._identified = None
        stamp, until = monitor.stamp, monitor.seen_until
        if stamp is not None and until is not None and stamp not in (self._identified, 0):
            elapsed = None
            if self._identified is not None and not self.is_requested:
                elapsed = stamp - self._identified
            self._identified, self.is_requested = stamp, False
            if stamp > renewal:
                self._hold = self._hold.looked(monitor.diagnosis(), until, limits, elapsed)
        before_moves = self._hold.until
        if evidence.moves and (before_moves is None or evidence.until > before_moves):
            found = self._evidence.diagnosis
            if found is not None:
                elapsed = None if before_moves is None else evidence.until - before_moves
                self._hold = self._hold.looked(found, evidence.until, limits, elapsed)
        return {kind: self._hold.conditions[side] for side, kind in ALARM_OF_SIDE.items()}

    def _whole_valve(self, findings: Sequence[Finding]) -> Condition:
        """Return the condition beyond friction; it falls only if nothing can have changed."""
        worst, before = shown_by(findings), self._condition(AlarmKind.WHOLE_VALVE)
        if worst.level >= before.level or not self._monitor.may_have_changed():
            return worst
        return before

    # Requests by people

    async def _switch(self, is_out: bool) -> str:
        return await self._ask(AlarmAction.TAKE_OUT if is_out else AlarmAction.PUT_BACK)

    async def _ask(self, action: AlarmAction) -> str:
        """Carry out the request in the parameters, which apply to one request."""
        values = {name: self._node.get_parameter(name).value for name in _ASKED}
        kind = None if values["alarm_kind"] == "all" else AlarmKind(values["alarm_kind"])
        self._forget()
        if not values["alarm_who"].strip():
            raise RefusalError("the parameter alarm_who is empty: set it to your name")
        try:
            request = AlarmRequest(
                action, values["alarm_who"], values["alarm_text"], 3600 * values["alarm_hours"]
            )
            return await self._made(kind, request)
        except AlarmError as error:
            raise RefusalError(str(error)) from None

    def _forget(self) -> None:
        initial = {one.name: one.default for one in NODES["identifier"] if one.name in _ASKED}
        self._node.set_parameters([Parameter(name, value=one) for name, one in initial.items()])

    async def _made(self, kind: AlarmKind | None, request: AlarmRequest) -> str:
        time = self._node.get_clock().now().nanoseconds
        valve, days = self._history.valve, self._days
        step = _Step(lambda file: database.request_alarms(file, valve, kind, request, time, days))
        await self._history.keep_change(step)
        if step.refusal is not None:
            raise step.refusal
        if step.made is None:  # not stored, or not yet
            events = all_requested(self.alarms, kind, request, time)
        else:
            events, self.alarms = step.made.events, dict(step.made.alarms)
            self._under_way = None  # it was made earlier
        self._take(events)
        self._on_record = dict(self.alarms)
        return alarm_summary(one.alarm for one in events) + self._history.reservation

    # Diagnostics

    def values(self) -> dict[str, str]:
        """Return the state of each alarm, with details of those that are not normal.

        A state is published once it is in the history: a kill then takes nothing back.
        """
        return alarm_values(self._on_record)
