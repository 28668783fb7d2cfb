"""The stroke test from which the friction of a valve will be known best; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.planning.conditions import AIMS, Conditions, Limits
    from valve_friction_ros.planning.friction_range import (
        FrictionRange,
        known_friction,
        unknown_friction,
    )
    from valve_friction_ros.planning.remarks import plan_remarks
    from valve_friction_ros.planning.search import StrokePlan, plan_test
    from valve_friction_ros.planning.stroke_test import Pattern, StrokeTest
else:
    __getattr__ = names_on_demand(__name__)

__all__ = [
    "AIMS",
    "Conditions",
    "FrictionRange",
    "Limits",
    "Pattern",
    "StrokePlan",
    "StrokeTest",
    "known_friction",
    "plan_remarks",
    "plan_test",
    "unknown_friction",
]
