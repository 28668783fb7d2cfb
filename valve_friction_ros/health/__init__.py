"""Health of a valve: its baseline, its diagnosis, and the monitor of one valve; no ROS."""

from valve_friction_ros.health.baseline import Baseline, Ratio
from valve_friction_ros.health.diagnosis import (
    Diagnosis,
    FrictionLimits,
    Level,
    StatusSignal,
    dead_band,
    diagnose,
    percentage,
)
from valve_friction_ros.health.friction_monitor import (
    FrictionMonitor,
    IdentificationInput,
    MonitorSettings,
    identify_snapshot,
)

__all__ = [
    "Baseline",
    "Diagnosis",
    "FrictionLimits",
    "FrictionMonitor",
    "IdentificationInput",
    "Level",
    "MonitorSettings",
    "Ratio",
    "StatusSignal",
    "dead_band",
    "diagnose",
    "identify_snapshot",
    "percentage",
]
