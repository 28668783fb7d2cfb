"""Usage of a valve: distance, reversals, breakaways, time at each travel; no ROS."""

from valve_friction_ros.usage.counter import DEFAULT_BAND, UsageCounter
from valve_friction_ros.usage.limits import LimitState, UsageLimits, limit_states, warned_limits
from valve_friction_ros.usage.usage import BINS, Usage, total
from valve_friction_ros.usage.valve_usage import Pace, UsedDay, ValveUsage

__all__ = [
    "BINS",
    "DEFAULT_BAND",
    "LimitState",
    "Pace",
    "Usage",
    "UsageCounter",
    "UsageLimits",
    "UsedDay",
    "ValveUsage",
    "limit_states",
    "total",
    "warned_limits",
]
