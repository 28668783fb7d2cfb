"""The identifier, where a folder of a certain name lies on a full disk, as a node to start."""

import resource
import sys
from pathlib import Path

SCRIPT = Path(__file__)
FULL = "full"
"""Name of the folder in which no file may grow."""

if __name__ == "__main__":
    from valve_friction_ros.monitoring import bag_writing
    from valve_friction_ros.nodes import identifier

    write_bag = bag_writing.write_bag

    def write_bag_if_there_is_room(folder, *arguments):
        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        if folder.name == FULL:
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
        try:
            return write_bag(folder, *arguments)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)

    bag_writing.write_bag = write_bag_if_there_is_room
    sys.exit(identifier.main())
