"""All that the pages draw from."""

from dataclasses import dataclass

from valve_friction_ros.dashboard.graph import Operator, Signals, Visitors
from valve_friction_ros.dashboard.heard.plant import Plant
from valve_friction_ros.dashboard.kept import KeptHistory
from valve_friction_ros.dashboard.options import DashboardOptions

__all__ = ["Board"]


@dataclass(frozen=True)
class Board:
    """What a dashboard shows, and whom it asks.

    Attributes
    ----------
    options : DashboardOptions
        How it was started.
    plant : Plant
        The valves as they were heard.
    kept : KeptHistory
        Their history.
    operator : Operator
        Calls their services.
    signals : Signals
        Hears their signals.
    visitors : Visitors
        Knows who looks, and who may operate.
    """

    options: DashboardOptions
    plant: Plant
    kept: KeptHistory
    operator: Operator
    signals: Signals
    visitors: Visitors
