# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The identifier where some folders lie on a full or a slow disk, as a node to start."""

import resource
import sys
import time
from pathlib import Path

SCRIPT = Path(__file__)
FULL = "full"
"""Name of the folder in which no file may grow."""
SLOW = "slow"
"""Name of the folder in which a bag takes until `FINISH` lies beside the folder."""
FINISH = "finish"

if __name__ == "__main__":
    from valve_friction_ros.nodes.identifier import node as identifier
    from valve_friction_ros.records.bags import writing as bag_writing

    write_bag = bag_writing.write_bag

    def write_bag_to_such_a_disk(folder, *arguments):
        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        if folder.name == FULL:
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
        while folder.name == SLOW and not (folder.parent / FINISH).exists():
            time.sleep(0.01)
        try:
            return write_bag(folder, *arguments)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)

    bag_writing.write_bag = write_bag_to_such_a_disk
    sys.exit(identifier.main())
