# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The identifier with an identification that lasts as long as a test wants, as a node to start."""

import sys
from pathlib import Path

SCRIPT = Path(__file__)
FINISH = "finish"
"""Name of the file, in the node's working directory, that lets an identification end."""

if __name__ == "__main__":
    from valve_friction_ros.nodes.identifier import node, workers

    identify_once = workers.identify_with_numbers

    def identify_again_and_again(*arguments):
        while True:
            estimate = identify_once(*arguments)
            if Path(FINISH).exists():
                return estimate

    workers.identify_with_numbers = identify_again_and_again
    node._PROCESSES = 0
    sys.exit(node.main())
