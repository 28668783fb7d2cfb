"""The names that valve files and the parameter files of nodes share."""

from dataclasses import fields

from valve_friction_ros.identification import CALIBRATION, FIXABLE
from valve_friction_ros.model import Valve

__all__ = ["COLUMNS", "GEOMETRY", "NODE_NAMES", "SETTINGS", "VALVE_KEYS", "is_known"]

GEOMETRY = tuple(field.name for field in fields(Valve))
"""What describes the valve."""

COLUMNS = "columns"
"""The section about tables of samples."""

SETTINGS = (
    "method",
    "derivative_window",
    "polynomial_order",
    "position_bias",
    "assumed_mass",
    "timing_uncertainty",
    *CALIBRATION,
    *(f"fixed.{name}" for name in FIXABLE),
)
"""What nodes and commands identify with."""

_IDENTIFIER_ONLY = (
    "window",
    "period",
    "joint",
    "valve_tag",
    "input_timeout",
    "clock_tolerance",
    "identification_limit",
    "baseline_coulomb_friction",
    "baseline_in_alarm",
    "warn_ratio",
    "error_ratio",
    "low_ratio",
    "save_folder",
    "save_megabytes",
    "report_folder",
    "history_file",
    "history_url",
    "history_days",
    "number_topics",
    "command_unit",
    "deviation_limit",
    "dead_time_limit",
    "t86_limit",
    "webhook_url",
    "webhook_period",
    "counting_dead_band",
    "air_to",
    "travel_limit",
    "reversal_limit",
    "alarm_recording",
    "alarm_folder",
    "alarm_recordings",
    "alarm_megabytes",
    "alarm_pause",
    "spring_change",
    "spring_failure",
    "preload_change",
    "slip_change",
    "viscous_factor",
    "asymmetry_change",
    "stop_change",
    "noise_factor",
    "lag_change",
)
_OTHER_NODES = (
    "valves",
    "identification_processes",
    "parameter_services",
    "position_noise",
    "noise_seed",
    "time_jitter",
    "excitation",
    "low",
    "high",
    "file",
    "file_minimum",
    "file_maximum",
    "file_rate",
    "sample_rate",
    "speed",
    "converter_lag",
    "pressure_noise",
    "host",
    "host_names",
    "accounts_file",
    "certificate_file",
    "key_file",
    "session_hours",
    "session_file",
    "port",
    "time_zone",
    "silence",
)

VALVE_KEYS = (*GEOMETRY, *FIXABLE, *SETTINGS, *_IDENTIFIER_ONLY)
"""Keys of a valve file beside `COLUMNS`; commands have no use for those of the identifier only."""

NODE_NAMES = frozenset((*VALVE_KEYS, *_OTHER_NODES))
"""Parameters that a node of this package has."""

_OF_ROS = ("use_sim_time", "start_type_description_service")


def is_known(name: str) -> bool:
    """Return whether a node of this package, or rclpy for it, reads a parameter."""
    return (
        name in NODE_NAMES or name in _OF_ROS or name.startswith((f"{COLUMNS}.", "qos_overrides"))
    )
