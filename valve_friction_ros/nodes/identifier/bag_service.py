# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""``~/save``: the identifier's buffer as a bag."""

import shutil
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from rclpy.node import Node

from valve_friction_ros.health import FrictionMonitor
from valve_friction_ros.identification import STATED, RefusalError
from valve_friction_ros.model import Valve
from valve_friction_ros.nodes.plumbing.output_folder import (
    OutputFolder,
    file_name,
    require_room,
    valve_name,
)
from valve_friction_ros.nodes.plumbing.worker import done_in
from valve_friction_ros.records.bags.topics import StreamNames, bag_libraries
from valve_friction_ros.settings import IDENTIFICATION
from valve_friction_ros.streams import Snapshot


class BagSaver:
    """Writes what the buffer holds as bags, as long as they have room.

    Raises ValueError if the folder cannot be used.
    """

    def __init__(self, node: Node, monitor: FrictionMonitor) -> None:
        self._node, self._monitor = node, monitor
        given = node.get_parameter("save_folder").value
        self._folder = OutputFolder(given, "saved", "a bag")

    async def saved(self, names: StreamNames, worker: ThreadPoolExecutor) -> Path:
        """Write what the buffer holds now, in a thread of `worker`; return the path of the bag.

        Raises RefusalError if it cannot be written or has no room, or the libraries that bags need
        are not there.
        """
        node, valve = self._node, valve_name(self._node)
        name = file_name(node, node.get_clock().now().nanoseconds)
        room = 1e6 * node.get_parameter("save_megabytes").value
        snapshot, settings = self._monitor.input()
        write_into = bag_writer(node, settings.valve, names)

        def write() -> Path:
            with self._folder.opened() as folder:
                require_room(folder, valve, room)
                path = write_into(folder, name, snapshot, None)
                try:
                    require_room(folder, valve, room, is_there=True)
                except RefusalError:
                    shutil.rmtree(path)
                    raise
                return path

        return await done_in(worker, write)


def bag_writer(
    node: Node, valve: Valve, names: StreamNames
) -> Callable[[Path, str, Snapshot, Path | None], Path]:
    """Return what writes a snapshot as a bag into a folder, by a name, in any thread.

    The last argument is a bag that it replaces, if any. It returns the path of the bag, and raises
    RefusalError if the libraries that bags need are not there or the snapshot is empty, and
    OSError.
    """
    names_of = (*(one.name for one in IDENTIFICATION), *STATED)
    described = {name: node.get_parameter(name).value for name in names_of}
    described = {name: value for name, value in described.items() if value is not None}

    def write(folder: Path, name: str, snapshot: Snapshot, replaced: Path | None) -> Path:
        # Costs memory and time at the start, and most nodes never save.
        try:
            with bag_libraries():
                from valve_friction_ros.records.bags.writing import write_bag  # noqa: PLC0415
        except ValueError as error:
            raise RefusalError(str(error)) from None

        return write_bag(folder, name, snapshot, names, valve, described, replaced)

    return write
