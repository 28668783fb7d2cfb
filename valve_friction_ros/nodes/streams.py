"""Quality of service of the topics, in one place."""

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

__all__ = ["LATCHED", "STREAM", "qos_overrides"]

STREAM = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=20_000,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
)
"""Sensor streams: deep enough for 20 s at 1 kHz while the receiver is busy."""

LATCHED = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""Results: a late subscriber receives the last one."""


def qos_overrides() -> QoSOverridingOptions:
    """Let history, depth and reliability be overridden by ``qos_overrides.…`` parameters."""
    return QoSOverridingOptions.with_default_policies()
