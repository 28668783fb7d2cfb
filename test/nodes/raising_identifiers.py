"""Identifiers of several valves, of which that of fv_102 has a bug, as a node to start."""

import sys

from raising_identifier import break_identifiers

if __name__ == "__main__":
    from valve_friction_ros.nodes import identifiers

    break_identifiers(("/fv_102",))
    sys.exit(identifiers.main())
