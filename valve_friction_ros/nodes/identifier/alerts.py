# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Changes of the level of a valve: logged once at start and end, and sent to a webhook."""

import math
import time
from collections.abc import Mapping, Sequence

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rclpy.node import Node

from valve_friction_ros import history as database
from valve_friction_ros.alerts import URL_VARIABLE, Alert, Outbox, Secrets, Webhook
from valve_friction_ros.health.alarms import Alarm, AlarmKind, AlarmState
from valve_friction_ros.health.diagnosis import Diagnosis, leading_ratio
from valve_friction_ros.health.levels import Finding, Level, StatusSignal
from valve_friction_ros.nodes.identifier.history_writer import HistoryWriter
from valve_friction_ros.nodes.identifier.workers import Workers
from valve_friction_ros.wording import Statement, sentence

_CALM = 10.0
"""Time, s, without a fault after which it is logged as over. Chosen: an intermittent fault is one
fault."""


def log_level(node: Node, before: Level, status: DiagnosticStatus) -> Level:
    """Log the level of a status if it differs from the one before; return it."""
    level, log = Level(status.level[0]), node.get_logger()
    if level == before:
        return level
    line = f"level {before.name} → {level.name}: {status.message}"
    # rclpy requires that a line of code always logs with the same severity.
    if level is Level.OK:
        log.info(line)
    elif level is Level.WARN:
        log.warning(line)
    else:
        log.error(line)
    return level


class FaultLog:
    """Logs the start of a fault, and its end once it has been over for a while.

    Times are s of a monotonic clock.
    """

    def __init__(self, node: Node) -> None:
        self._log = node.get_logger()
        self._begun: dict[Statement, float] = {}
        self._seen: dict[Statement, float] = {}
        self._repeated: dict[Statement, int] = {}

    def follow(self, faults: Mapping[Statement, Statement], now: float) -> None:
        """Take the present faults: the fixed name of each, and its statement with figures."""
        for what, statement in faults.items():
            if what not in self._begun:
                self._begun[what] = now
                self._log.warning(sentence(statement))
            self._seen[what] = now
        for what in [one for one, seen in self._seen.items() if now - seen >= _CALM]:
            again = self._repeated.pop(what, 0)
            lasted = self._seen.pop(what) - self._begun.pop(what)
            times = f", seen {again + 1} times" if again else ""
            self._log.info(f"ended after {lasted:.0f} s{times}: {what}")

    def note(self, what: Statement, statement: Statement, now: float) -> None:
        """Take a momentary event; a repetition soon after it belongs to the same fault."""
        if what in self._begun:
            self._repeated[what] = self._repeated.get(what, 0) + 1
        self.follow({what: statement}, now)


_NE_107 = "NE 107"


def webhook_from(url: str) -> Webhook | None:
    """Return the webhook given by the parameter, else by the environment, or None.

    Raises ValueError if its address, or the token in the environment, is invalid.
    """
    webhook = Webhook.at(url) if url else Webhook.from_environment()
    if webhook is not None:
        Secrets.from_environment()
    return webhook


class Alerts:
    """Follows the diagnostics of a valve, posts each change of level, and reports failures.

    It starts from the level last reported according to the history. A restart alone is therefore
    not a change, and a change that was pending when the process was killed is reported. Without a
    history it starts from `level`, that of the valve at the start. After a restart it first waits
    for `webhook_period`, during which inputs arrive and levels settle.
    """

    def __init__(
        self,
        node: Node,
        workers: Workers,
        history: HistoryWriter,
        level: Level,
        webhook: Webhook | None,
    ) -> None:
        self._node, self._history, self._desk = node, history, workers.digest
        self._outbox = None if webhook is None else workers.alerts.outbox(webhook)
        if (
            webhook is not None
            and (all_of := Secrets.from_environment()).going_to(webhook) != all_of
        ):
            node.get_logger().warning(
                f"no token is sent to {webhook}, because the token in the environment goes only "
                f"to the address in {URL_VARIABLE}: set the address there instead of webhook_url"
            )
        self._kept = history.look_up(database.read_told_level)
        self._told = level if self._kept is None else self._kept
        self._told_at = -math.inf if self._kept is None else time.monotonic()

    def follow(
        self,
        status: DiagnosticStatus,
        diagnosis: Diagnosis,
        findings: Sequence[Finding],
        alarms: Mapping[AlarmKind, Alarm],
        beside: Level = Level.OK,
    ) -> None:
        """Post the level of a status if it has changed; then add the state of the alerts to it.

        The level follows from the diagnosis of friction and the other findings on the valve. While
        an alarm is shelved or out of service, the level is that of the other alarms and of findings
        without an alarm (`beside`), so that nobody is notified of a shelved alarm.

        Problems of the alerts themselves raise the level afterwards, and are not posted.
        """
        if self._outbox is None:
            return
        level = Level(status.level[0])
        if any(one.state.is_suppressed for one in alarms.values()):
            told = (one.condition.level for one in alarms.values() if one.is_told)
            level = min(level, max([beside, *told]))
        period = self._node.get_parameter("webhook_period").value
        if self._kept is None:
            self._keep(self._told)
        now = time.monotonic()
        if level != self._told and now - self._told_at >= period:
            self._outbox.put(
                self._alert(status, level, leading_ratio(diagnosis, findings, level), alarms)
            )
            self._told, self._told_at = level, now
        self._put_digest(self._outbox, alarms)
        self._mark(status, self._outbox)

    def _put_digest(self, outbox: Outbox, alarms: Mapping[AlarmKind, Alarm]) -> None:
        """Pass the alarms to the digest; the first valve for which it is due posts it for all."""
        hour = self._node.get_parameter("webhook_digest").value
        valve = self._history.valve.tag, self._node.get_fully_qualified_name()
        letter = self._desk.hear(outbox.webhook, hour, valve, alarms, time.time())
        if letter is not None:
            outbox.put(letter)

    def _keep(self, level: Level) -> None:
        if level != self._kept:
            self._kept, valve = level, self._history.valve
            self._history.keep_soon(lambda file: database.keep_told_level(file, valve, level))

    def _alert(
        self,
        status: DiagnosticStatus,
        level: Level,
        ratio: float,
        alarms: Mapping[AlarmKind, Alarm],
    ) -> Alert:
        values = {entry.key: entry.value for entry in status.values}
        return Alert(
            valve=self._history.valve.tag,
            node=self._node.get_fully_qualified_name(),
            old_level=self._told,
            new_level=level,
            ne_107=values[_NE_107],
            message=status.message,
            friction_ratio=ratio,
            alarms={
                kind.value: one.state.value
                for kind, one in alarms.items()
                if one.state is not AlarmState.NORMAL
            },
        )

    def _mark(self, status: DiagnosticStatus, outbox: Outbox) -> None:
        state = outbox.state()
        if state.settled is not None:
            self._keep(state.settled)
        values = {
            "webhook": str(outbox.webhook),
            "webhook delivered": str(state.delivered),
            "webhook waiting": str(state.waiting),
            "webhook given up": str(state.given_up),
            "webhook problem": state.problem or "",
        }
        status.values += [KeyValue(key=key, value=value) for key, value in values.items()]
        if state.lost is None:
            return
        status.message += f"; {state.lost}"
        if Level(status.level[0]) < Level.WARN:
            status.level = bytes([Level.WARN])
            signal = next(entry for entry in status.values if entry.key == _NE_107)
            signal.value = StatusSignal.MAINTENANCE_REQUIRED.value
