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
from valve_friction_ros.monitoring.history_entry import (
    FrictionPoint,
    HistoryEntry,
    KeptBaseline,
    KeptValve,
    entry_of,
)
from valve_friction_ros.monitoring.history_file import HistoryError, HistoryFile
from valve_friction_ros.monitoring.record_buffer import Complaints, RecordBuffer, Snapshot
from valve_friction_ros.monitoring.resampling import uniform_recording
from valve_friction_ros.monitoring.samples import Samples, nanoseconds
from valve_friction_ros.monitoring.trend import MONTH, Crossing, Limit, Trend, trend_of
from valve_friction_ros.monitoring.valve_history import (
    ValveHistory,
    current_trend,
    valve_histories,
)

__all__ = [
    "COLUMNS",
    "MONTH",
    "Arrivals",
    "Baseline",
    "Complaints",
    "Crossing",
    "Diagnosis",
    "FrictionLimits",
    "FrictionMonitor",
    "FrictionPoint",
    "HistoryEntry",
    "HistoryError",
    "HistoryFile",
    "KeptBaseline",
    "KeptValve",
    "Kind",
    "Level",
    "Limit",
    "MonitorSettings",
    "Ratio",
    "RecordBuffer",
    "Samples",
    "Snapshot",
    "StatusSignal",
    "Trend",
    "ValveHistory",
    "current_trend",
    "dead_band",
    "diagnose",
    "entry_of",
    "identify_snapshot",
    "nanoseconds",
    "percentage",
    "rows_arrived",
    "trend_of",
    "uniform_recording",
    "valve_histories",
]
