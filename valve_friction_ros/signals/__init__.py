"""One signal: its noise, its smoothing, its windows; no ROS."""

from valve_friction_ros.signals.conditioned_record import ConditionedRecord, condition
from valve_friction_ros.signals.derivatives import Derivatives, differentiate
from valve_friction_ros.signals.measured_record import MeasuredRecord, measured
from valve_friction_ros.signals.noise import sensor_noise

__all__ = [
    "ConditionedRecord",
    "Derivatives",
    "MeasuredRecord",
    "condition",
    "differentiate",
    "measured",
    "sensor_noise",
]
