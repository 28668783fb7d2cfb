"""``~/save``: the identifier's buffer as a bag."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from rclpy.node import Node

from valve_friction_ros.health import FrictionMonitor
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import Valve
from valve_friction_ros.nodes.identifier.parameters import SAVE_FOLDER
from valve_friction_ros.nodes.plumbing.background import done_in
from valve_friction_ros.nodes.plumbing.output_folder import file_name, output_folder
from valve_friction_ros.records.bags.libraries import bag_libraries
from valve_friction_ros.records.bags.topics import StreamNames
from valve_friction_ros.records.valve_keys import SETTINGS
from valve_friction_ros.streams import Snapshot

__all__ = ["bag_writer", "saved_bag"]


async def saved_bag(
    node: Node, monitor: FrictionMonitor, names: StreamNames, worker: ThreadPoolExecutor
) -> Path:
    """Write what the buffer holds now as a bag, in a thread of `worker`; return its path.

    Raises RefusalError if it cannot be written, or the libraries that bags need are not there.
    """
    given = node.get_parameter(SAVE_FOLDER.name).value
    name = file_name(node, node.get_clock().now().nanoseconds)
    snapshot, settings = monitor.input()
    write_into = bag_writer(node, settings.valve, names)

    def write() -> Path:
        with output_folder(given, "saved", "a bag") as folder:
            return write_into(folder, name, snapshot, None)

    return await done_in(worker, write)


def bag_writer(
    node: Node, valve: Valve, names: StreamNames
) -> Callable[[Path, str, Snapshot, Path | None], Path]:
    """Return what writes a snapshot as a bag into a folder, by a name, in any thread.

    The last argument is a bag that it replaces, if any. It returns the path of the bag, and raises
    RefusalError if the libraries that bags need are not there or the snapshot is empty, and
    OSError.
    """
    described = {name: node.get_parameter(name).value for name in SETTINGS}

    def write(folder: Path, name: str, snapshot: Snapshot, replaced: Path | None) -> Path:
        # Costs memory and time at the start, and most nodes never save.
        try:
            with bag_libraries():
                from valve_friction_ros.records.bags.writing import write_bag  # noqa: PLC0415
        except ValueError as error:
            raise RefusalError(str(error)) from None

        return write_bag(folder, name, snapshot, names, valve, described, replaced)

    return write
