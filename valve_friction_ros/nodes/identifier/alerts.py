"""Changes of a valve's level, as alerts to a webhook."""

import math
import time

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rclpy.node import Node

from valve_friction_ros.alerts import Alert, AlertSender
from valve_friction_ros.health import Level, StatusSignal
from valve_friction_ros.nodes.identifier.service_parameters import (
    WEBHOOK_PERIOD,
    WEBHOOK_URL,
    webhook_from,
)
from valve_friction_ros.nodes.plumbing.parameters import values_of

__all__ = ["Alerts"]

_NE_107 = "NE 107"


class Alerts:
    """Follows the diagnostics of a valve, posts each change of level, and says what went wrong.

    It begins with the level that is kept, so that a restart alone is no change.
    """

    def __init__(self, node: Node, sender: AlertSender, tag: str, level: Level) -> None:
        self._node, self._tag = node, tag
        self._outbox = sender.outbox()
        self._told = level
        self._told_at = -math.inf

    def follow(self, status: DiagnosticStatus) -> None:
        """Post the level of a status if it has changed; then add to it what became of alerts.

        What is wrong with the alerts themselves raises the level afterwards, and is not posted.
        """
        values = values_of(self._node, (WEBHOOK_URL, WEBHOOK_PERIOD))
        webhook, period = webhook_from(values), values[WEBHOOK_PERIOD.name]
        self._outbox.address(webhook)
        level = Level(status.level[0])
        if webhook is None:
            self._told, self._told_at = level, -math.inf
            return
        now = time.monotonic()
        if level != self._told and now - self._told_at >= period:
            self._outbox.put(self._alert(status, level))
            self._told, self._told_at = level, now
        self._mark(status, str(webhook))

    def _alert(self, status: DiagnosticStatus, level: Level) -> Alert:
        values = {entry.key: entry.value for entry in status.values}
        return Alert(
            valve=self._tag,
            node=self._node.get_fully_qualified_name(),
            old_level=self._told,
            new_level=level,
            ne_107=values[_NE_107],
            message=status.message,
            friction_ratio=float(values.get("friction_ratio", math.nan)),
        )

    def _mark(self, status: DiagnosticStatus, place: str) -> None:
        state = self._outbox.state()
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
