"""Recordings in files, CSV and bags, and the valve file that describes them; no ROS."""

from valve_friction_ros.records.recorded_valve import RecordedValve
from valve_friction_ros.records.recordings import ReadingOptions, read_recordings
from valve_friction_ros.records.stretch import Stretch
from valve_friction_ros.records.valve_file import ValveFile, read_valve_file

__all__ = [
    "ReadingOptions",
    "RecordedValve",
    "Stretch",
    "ValveFile",
    "read_recordings",
    "read_valve_file",
]
