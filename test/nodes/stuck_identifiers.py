# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

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
    from valve_friction_ros.nodes.plumbing import running

    poll = Identifier.poll

    def poll_when_free(self):
        while Path(BLOCK).exists():
            time.sleep(0.05)
        poll(self)

    Identifier.poll = poll_when_free
    running.LOOP_LIMIT = LIMIT
    sys.exit(identifiers.main())
