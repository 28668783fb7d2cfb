"""Who may see the dashboard, and who may operate by it.

Only ``gate.py`` and ``guard.py`` import the libraries of the pages.
"""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.dashboard.access.access import Access
    from valve_friction_ros.dashboard.access.accounts import Account, Role, accounts_from
    from valve_friction_ros.dashboard.access.log_in import LogIn, Refusal
    from valve_friction_ros.dashboard.access.passwords import HashedPassword
    from valve_friction_ros.dashboard.access.sessions import Sessions
else:
    __getattr__ = names_on_demand(__name__)

__all__ = [
    "Access",
    "Account",
    "HashedPassword",
    "LogIn",
    "Refusal",
    "Role",
    "Sessions",
    "accounts_from",
]
