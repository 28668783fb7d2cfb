"""The dashboard: a plant's valves in a browser; no ROS.

The files here hold what is shown, and import no library of pages; ``pages/`` draws it by NiceGUI.
"""

from valve_friction_ros.dashboard.graph import Answer, Operator, Signals, Visitors
from valve_friction_ros.dashboard.options import DashboardOptions
from valve_friction_ros.dashboard.plant import Plant
from valve_friction_ros.dashboard.selection import Selection, selected
from valve_friction_ros.dashboard.valve_view import Status, ValveView, view_of

__all__ = [
    "Answer",
    "DashboardOptions",
    "Operator",
    "Plant",
    "Selection",
    "Signals",
    "Status",
    "ValveView",
    "Visitors",
    "selected",
    "view_of",
]
