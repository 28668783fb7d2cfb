"""One signal: its noise, its smoothing, its windows; no ROS."""

from valve_friction_ros.signals.conditioned_record import ConditionedRecord, condition
from valve_friction_ros.signals.derivative_window import fitting_window
from valve_friction_ros.signals.noise import sensor_noise

__all__ = ["ConditionedRecord", "condition", "fitting_window", "sensor_noise"]
