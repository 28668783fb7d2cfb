"""Figures of records and identifications; no ROS."""

from valve_friction_ros.plots.case import FORCE, PRESSURE, Case, DriveScale
from valve_friction_ros.plots.friction_figure import friction_figure, identification_figure
from valve_friction_ros.plots.picture import require_picture_file

__all__ = [
    "FORCE",
    "PRESSURE",
    "Case",
    "DriveScale",
    "friction_figure",
    "identification_figure",
    "require_picture_file",
]
