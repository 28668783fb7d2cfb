"""The answer of a stem to its command in service: moves, deviation, hunting, blame; no ROS."""

from valve_friction_ros.response.blame import Cause
from valve_friction_ros.response.hunting import Hunting
from valve_friction_ros.response.monitor import ResponseMonitor
from valve_friction_ros.response.move import Move
from valve_friction_ros.response.summary import (
    FIGURES,
    SIZES,
    ResponseLimits,
    ResponseSummary,
    Spread,
    found,
    summarised,
)

__all__ = [
    "FIGURES",
    "SIZES",
    "Cause",
    "Hunting",
    "Move",
    "ResponseLimits",
    "ResponseMonitor",
    "ResponseSummary",
    "Spread",
    "found",
    "summarised",
]
