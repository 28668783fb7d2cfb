"""Changes of a valve's level, as alerts to a webhook."""

import math
import time
from collections.abc import Sequence

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rclpy.node import Node

from valve_friction_ros.alerts import URL_VARIABLE, Alert, AlertSender, Secrets, Webhook
from valve_friction_ros.health import Diagnosis, Finding, Level, StatusSignal, leading_ratio
from valve_friction_ros.nodes.identifier.history_writer import HistoryWriter
from valve_friction_ros.nodes.identifier.service_parameters import (
    WEBHOOK_PERIOD,
    WEBHOOK_URL,
)

__all__ = ["Alerts"]

_NE_107 = "NE 107"


class Alerts:
    """Follows the diagnostics of a valve, posts each change of level, and says what went wrong.

    It begins with the level that the history says was told last: so a restart alone is no change,
    and what waited when the process was killed is told. Without one it begins with `level`, that
    of the valve at the start. After a restart `webhook_period` goes by first, in which inputs come
    and levels settle.
    """

    def __init__(
        self,
        node: Node,
        sender: AlertSender,
        history: HistoryWriter,
        level: Level,
        webhook: Webhook | None,
    ) -> None:
        self._node, self._history, self._webhook = node, history, webhook
        self._outbox = sender.outbox()
        self._outbox.address(webhook)
        if (
            webhook is not None
            and (all_of := Secrets.from_environment()).going_to(webhook) != all_of
        ):
            node.get_logger().warning(
                f"no token is sent to {webhook}, as that of the environment goes only to the "
                f"address of {URL_VARIABLE}: name the address there, not by {WEBHOOK_URL.name}"
            )
        self._kept = history.told_level()
        self._told = level if self._kept is None else self._kept
        self._told_at = -math.inf if self._kept is None else time.monotonic()

    def follow(
        self, status: DiagnosticStatus, diagnosis: Diagnosis, findings: Sequence[Finding]
    ) -> None:
        """Post the level of a status if it has changed; then add to it what became of alerts.

        The level rests on the diagnosis of the friction, and on what else is found on the valve.

        What is wrong with the alerts themselves raises the level afterwards, and is not posted.
        """
        if self._webhook is None:
            return
        level, period = Level(status.level[0]), self._node.get_parameter(WEBHOOK_PERIOD.name).value
        if self._kept is None:
            self._keep(self._told)
        now = time.monotonic()
        if level != self._told and now - self._told_at >= period:
            self._outbox.put(self._alert(status, level, leading_ratio(diagnosis, findings, level)))
            self._told, self._told_at = level, now
        self._mark(status, str(self._webhook))

    def _keep(self, level: Level) -> None:
        """Keep the level that was told last, unless it is kept."""
        if level != self._kept:
            self._kept = level
            self._history.keep_told_level(level)

    def _alert(self, status: DiagnosticStatus, level: Level, ratio: float) -> Alert:
        values = {entry.key: entry.value for entry in status.values}
        return Alert(
            valve=self._history.valve.tag,
            node=self._node.get_fully_qualified_name(),
            old_level=self._told,
            new_level=level,
            ne_107=values[_NE_107],
            message=status.message,
            friction_ratio=ratio,
        )

    def _mark(self, status: DiagnosticStatus, place: str) -> None:
        state = self._outbox.state()
        if state.settled is not None:
            self._keep(state.settled)
        values = {
            "webhook": place,
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
