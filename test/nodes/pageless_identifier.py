"""The identifier with a fault in what writes the page of a report, as a node to start."""

import sys
from pathlib import Path

SCRIPT = Path(__file__)

if __name__ == "__main__":
    from valve_friction_ros import reports
    from valve_friction_ros.nodes.identifier import node

    def fail(*_):
        raise ZeroDivisionError("nobody foresaw it")

    reports.write_report = fail
    sys.exit(node.main())
