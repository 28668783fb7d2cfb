"""The executable `identifier`, as ``python -m valve_friction_ros.nodes.identifier`` runs it."""

import sys

from valve_friction_ros.nodes.start import identifier

if __name__ == "__main__":
    sys.exit(identifier())
