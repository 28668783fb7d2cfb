"""The identifiers with a loop that stands still as long as a test wants, as a node to start."""

import sys
import time
from pathlib import Path

SCRIPT = Path(__file__)
BLOCK = "block"
"""Name of the file, in the node's working directory, during whose existence the loop stands."""
LIMIT = 2.0
"""Time, s, after which the loop counts as stuck: less than the usual ten seconds."""

if __name__ == "__main__":
    from valve_friction_ros.nodes import identifiers
    from valve_friction_ros.nodes.identifier.node import Identifier
    from valve_friction_ros.nodes.plumbing import watchdog

    poll = Identifier.poll

    def poll_when_free(self):
        while Path(BLOCK).exists():
            time.sleep(0.05)
        poll(self)

    Identifier.poll = poll_when_free
    watchdog.LOOP_LIMIT = LIMIT
    sys.exit(identifiers.main())
