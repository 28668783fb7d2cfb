"""The identifier with a fault that nobody foresaw, mended by a file, as a node to start."""

import sys
from pathlib import Path

SCRIPT = Path(__file__)
MENDED = "mended"
"""Name of the file, in the node's working directory, that takes the fault away."""

if __name__ == "__main__":
    from valve_friction_ros.nodes.identifier import identification, node

    identify = identification.identify_snapshot

    def identify_or_fail(*arguments):
        if not Path(MENDED).exists():
            raise ZeroDivisionError("nobody\nforesaw it")
        return identify(*arguments)

    identification.identify_snapshot = identify_or_fail
    sys.exit(node.main())
