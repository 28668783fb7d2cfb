"""Figures of records and identifications; no ROS."""

from valve_friction_ros.figures.case import Case
from valve_friction_ros.figures.friction_figure import friction_figure, identification_figure
from valve_friction_ros.figures.panels import draw_curves
from valve_friction_ros.figures.picture import require_picture_file, save_picture
from valve_friction_ros.figures.plan_figure import plan_figure
from valve_friction_ros.figures.trend_figure import trend_figure
from valve_friction_ros.figures.validation_figure import validation_figure

__all__ = [
    "Case",
    "draw_curves",
    "friction_figure",
    "identification_figure",
    "plan_figure",
    "require_picture_file",
    "save_picture",
    "trend_figure",
    "validation_figure",
]
