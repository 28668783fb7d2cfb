"""The identifier with a bug in its loop or in a timer, its worker busy, as a node to start."""

import sys
import time
from pathlib import Path

SCRIPT = Path(__file__)
RAISE = "raise"
"""Name of the file, in the node's working directory, that names where the bug is."""
LOOP, TIMER = "loop", "timer"
BUSY = 300.0
"""Time, s, for which the worker is busy."""

if __name__ == "__main__":
    from valve_friction_ros.nodes.identifier import node, workers

    def raising(name, method):
        def call(self, *arguments):
            if Path(RAISE).exists() and Path(RAISE).read_text() == name:
                raise ZeroDivisionError("a bug")
            return method(self, *arguments)

        return call

    one = node.Identifier
    one.poll = raising(LOOP, one.poll)
    one._publish_diagnostics = raising(TIMER, one._publish_diagnostics)
    workers.compile_methods = lambda: time.sleep(BUSY)
    sys.exit(node.main())
