"""The executable `dashboard`, as ``python -m valve_friction_ros.nodes.dashboard`` runs it."""

import sys

from valve_friction_ros.nodes.start import dashboard

if __name__ == "__main__":
    sys.exit(dashboard())
