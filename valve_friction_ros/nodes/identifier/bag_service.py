"""``~/save``: the identifier's buffer as a bag."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from rclpy.node import Node

from valve_friction_ros.health import FrictionMonitor
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.identifier.parameters import SAVE_FOLDER
from valve_friction_ros.nodes.plumbing.background import done_in
from valve_friction_ros.nodes.plumbing.output_folder import file_name, output_folder
from valve_friction_ros.records.bags.libraries import bag_libraries
from valve_friction_ros.records.bags.topics import StreamNames
from valve_friction_ros.records.valve_keys import SETTINGS

__all__ = ["saved_bag"]


async def saved_bag(
    node: Node, monitor: FrictionMonitor, names: StreamNames, worker: ThreadPoolExecutor
) -> Path:
    """Write what the buffer holds now as a bag, in a thread of `worker`; return its path.

    Raises RefusalError if it cannot be written, or the libraries that bags need are not there.
    """
    given = node.get_parameter(SAVE_FOLDER.name).value
    name = file_name(node, node.get_clock().now().nanoseconds)
    snapshot, settings = monitor.input()
    described = {name: node.get_parameter(name).value for name in SETTINGS}

    def write() -> Path:
        # Costs memory and time at the start, and most nodes never save.
        try:
            with bag_libraries():
                from valve_friction_ros.records.bags.writing import write_bag  # noqa: PLC0415
        except ValueError as error:
            raise RefusalError(str(error)) from None

        with output_folder(given, "saved", "a bag") as folder:
            return write_bag(folder, name, snapshot, names, settings.valve, described)

    return await done_in(worker, write)
