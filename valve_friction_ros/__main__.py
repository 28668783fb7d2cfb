"""The command `valve_friction`, as ``python -m valve_friction_ros`` runs it."""

import sys

from valve_friction_ros.commands.start import main

if __name__ == "__main__":
    sys.exit(main())
