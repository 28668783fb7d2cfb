"""Streams of samples: what arrives, what is buffered, and the uniform record of both; no ROS."""

from valve_friction_ros.streams.arrivals import COLUMNS, Arrivals, Kind, rows_arrived
from valve_friction_ros.streams.dates import DAY, utc, utc_day, utc_minute, utc_second
from valve_friction_ros.streams.losses import LossCounter, Losses
from valve_friction_ros.streams.record_buffer import Complaints, RecordBuffer, Snapshot
from valve_friction_ros.streams.samples import Samples, nanoseconds
from valve_friction_ros.streams.uniform_grid import uniform_recording

__all__ = [
    "COLUMNS",
    "DAY",
    "Arrivals",
    "Complaints",
    "Kind",
    "LossCounter",
    "Losses",
    "RecordBuffer",
    "Samples",
    "Snapshot",
    "nanoseconds",
    "rows_arrived",
    "uniform_recording",
    "utc",
    "utc_day",
    "utc_minute",
    "utc_second",
]
