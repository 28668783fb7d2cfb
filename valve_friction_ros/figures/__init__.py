"""Figures of records and identifications; no ROS."""

from valve_friction_ros.figures.case import Case
from valve_friction_ros.figures.friction_figure import friction_figure, identification_figure
from valve_friction_ros.figures.picture import require_picture_file, save_picture
from valve_friction_ros.figures.signature_figure import draw_breakaway_points, signature_figure
from valve_friction_ros.figures.trend_figure import trend_figure
from valve_friction_ros.figures.validation_figure import validation_figure

__all__ = [
    "Case",
    "draw_breakaway_points",
    "friction_figure",
    "identification_figure",
    "require_picture_file",
    "save_picture",
    "signature_figure",
    "trend_figure",
    "validation_figure",
]
