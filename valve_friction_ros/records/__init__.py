"""Recordings in files, CSV and bags, and the valve file that describes them; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.records.recorded_valve import RecordedValve
    from valve_friction_ros.records.recordings import ReadingOptions, read_recordings
    from valve_friction_ros.records.stretch import Stretch
    from valve_friction_ros.records.valve_file import ValveFile, read_valve_file
else:
    __getattr__ = names_on_demand(__name__)

__all__ = [
    "ReadingOptions",
    "RecordedValve",
    "Stretch",
    "ValveFile",
    "read_recordings",
    "read_valve_file",
]
