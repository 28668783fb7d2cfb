"""The identifier's buffer, saved as a bag on request."""

from collections.abc import Callable
from datetime import datetime, timezone
from pathlib import Path

from rclpy.node import Node

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.monitoring import FrictionMonitor
from valve_friction_ros.monitoring.bag_topics import StreamNames
from valve_friction_ros.nodes.data_folder import data_folder
from valve_friction_ros.nodes.parameters import ParameterSpec

__all__ = ["SAVE_FOLDER", "saving"]

SAVE_FOLDER = ParameterSpec(
    "save_folder",
    "",
    "Folder that ~/save writes bags into [-]; empty: valve_friction_ros/saved under ROS_HOME, or "
    "under ~/.ros",
)


def _place(node: Node) -> tuple[Path, str]:
    """Return the folder, and a name that tells valve and time."""
    told = node.get_parameter(SAVE_FOLDER.name).value
    folder = Path(told).expanduser() if told else data_folder() / "saved"
    now = datetime.fromtimestamp(node.get_clock().now().nanoseconds / 1e9, timezone.utc)
    valve = node.get_namespace().strip("/").replace("/", "_") or node.get_name()
    return folder, f"{valve}_{now:%Y%m%dT%H%M%SZ}"


def saving(node: Node, monitor: FrictionMonitor, names: StreamNames) -> Callable[[], Path]:
    """Take what the buffer holds now, and return what writes it as a bag, in any thread.

    What is returned raises RefusalError with the reason if it cannot be written.
    """
    folder, name = _place(node)
    snapshot, settings = monitor.buffer.snapshot(), monitor.settings

    def save() -> Path:
        # Costs memory and time at the start, and most nodes never save.
        from valve_friction_ros.monitoring.bag_writing import write_bag  # noqa: PLC0415

        try:
            mass = settings.identification.assumed_mass
            return write_bag(folder, name, snapshot, names, settings.valve, mass)
        except OSError as error:
            cause = error.strerror or error
            raise RefusalError(f"cannot write a bag into {folder}: {cause}") from None

    return save
