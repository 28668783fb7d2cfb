"""Monitoring of a valve: stream buffers, baseline and diagnosis; no ROS."""

from valve_friction_ros.monitoring.arrivals import COLUMNS, Arrivals, Kind, rows_arrived
from valve_friction_ros.monitoring.baseline import Baseline, Ratio
from valve_friction_ros.monitoring.diagnosis import (
    Diagnosis,
    FrictionLimits,
    Level,
    StatusSignal,
    dead_band,
    diagnose,
    percentage,
)
from valve_friction_ros.monitoring.friction_monitor import (
    FrictionMonitor,
    MonitorSettings,
    identify_snapshot,
)
from valve_friction_ros.monitoring.record_buffer import Complaints, RecordBuffer, Snapshot
from valve_friction_ros.monitoring.resampling import uniform_recording
from valve_friction_ros.monitoring.samples import Samples, nanoseconds

__all__ = [
    "COLUMNS",
    "Arrivals",
    "Baseline",
    "Complaints",
    "Diagnosis",
    "FrictionLimits",
    "FrictionMonitor",
    "Kind",
    "Level",
    "MonitorSettings",
    "Ratio",
    "RecordBuffer",
    "Samples",
    "Snapshot",
    "StatusSignal",
    "dead_band",
    "diagnose",
    "identify_snapshot",
    "nanoseconds",
    "percentage",
    "rows_arrived",
    "uniform_recording",
]
