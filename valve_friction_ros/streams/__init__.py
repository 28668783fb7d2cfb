"""Streams of samples: what arrives, what is buffered, and the uniform record of both; no ROS."""

from valve_friction_ros.streams.arrivals import COLUMNS, Arrivals, Kind, rows_arrived
from valve_friction_ros.streams.data_quality import DataFault, DataQuality, FaultKind
from valve_friction_ros.streams.dates import DAY, utc, utc_day, utc_minute, utc_second
from valve_friction_ros.streams.losses import LossCounter, Losses
from valve_friction_ros.streams.record_buffer import (
    Intake,
    RecordBuffer,
    SampleFault,
    Signal,
    Snapshot,
)
from valve_friction_ros.streams.samples import Samples, nanoseconds
from valve_friction_ros.streams.uniform_grid import uniform_recording

__all__ = [
    "COLUMNS",
    "DAY",
    "Arrivals",
    "DataFault",
    "DataQuality",
    "FaultKind",
    "Intake",
    "Kind",
    "LossCounter",
    "Losses",
    "RecordBuffer",
    "SampleFault",
    "Samples",
    "Signal",
    "Snapshot",
    "nanoseconds",
    "rows_arrived",
    "uniform_recording",
    "utc",
    "utc_day",
    "utc_minute",
    "utc_second",
]
