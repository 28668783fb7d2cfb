# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The identifier with a bug in its loop, in a timer or at its start, as a node to start.

With the name of several identifiers the bug is in that of the valve fv_102.
"""

import sys
import time
from pathlib import Path

SCRIPT = Path(__file__)
SEVERAL = SCRIPT.with_name("raising_identifiers.py")
RAISE = "raise"
"""Name of the file, in the node's working directory, that names where the bug is."""
LOOP, TIMER, BEGINNING = "loop", "timer", "beginning"
BUSY = 300.0
"""Time, s, for which the worker is busy."""


def break_identifiers(places=("/fv_101",)):
    """Put the bugs into the identifiers of some namespaces."""
    from valve_friction_ros.nodes.identifier import node

    def raising(name, method):
        def call(self, *arguments):
            is_it = self.get_namespace() in places and Path(RAISE).exists()
            if is_it and Path(RAISE).read_text() == name:
                raise ZeroDivisionError("a bug")
            return method(self, *arguments)

        return call

    one = node.Identifier
    one.configure = raising(BEGINNING, one.configure)
    one.poll = raising(LOOP, one.poll)
    one._publish_diagnostics = raising(TIMER, one._publish_diagnostics)


if __name__ == "__main__":
    from valve_friction_ros.nodes.identifier import node, workers

    break_identifiers()
    workers.compile_methods = lambda: time.sleep(BUSY)
    node._PROCESSES = 0
    sys.exit(node.main())
