"""The dashboard: a plant's valves in a browser; no ROS.

The files here hold what is shown, and import no library of pages; ``pages/`` draws it by NiceGUI.
"""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.dashboard.graph import Answer, Operator, Signals, Visitors
    from valve_friction_ros.dashboard.heard.plant import Plant
    from valve_friction_ros.dashboard.heard.status_reading import ESSENTIAL_KEYS, view_of
    from valve_friction_ros.dashboard.heard.valve_view import Status, Unread, ValveView
    from valve_friction_ros.dashboard.options import DashboardOptions
    from valve_friction_ros.dashboard.selection import Selection, selected
else:
    __getattr__ = names_on_demand(__name__)

__all__ = [
    "ESSENTIAL_KEYS",
    "Answer",
    "DashboardOptions",
    "Operator",
    "Plant",
    "Selection",
    "Signals",
    "Status",
    "Unread",
    "ValveView",
    "Visitors",
    "selected",
    "view_of",
]
