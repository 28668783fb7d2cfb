"""Alerts: a change of a valve's level, told to a webhook; no ROS."""

from valve_friction_ros.alerts.alert import Alert
from valve_friction_ros.alerts.posting import DeliveryError, post
from valve_friction_ros.alerts.sender import AlertSender, Outbox, OutboxState
from valve_friction_ros.alerts.webhook import SIGNATURE, URL_VARIABLE, Secrets, Webhook, signature

__all__ = [
    "SIGNATURE",
    "URL_VARIABLE",
    "Alert",
    "AlertSender",
    "DeliveryError",
    "Outbox",
    "OutboxState",
    "Secrets",
    "Webhook",
    "post",
    "signature",
]
