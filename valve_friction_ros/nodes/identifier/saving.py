"""The identifier's buffer, saved as a bag on request."""

from collections.abc import Callable
from datetime import datetime, timezone
from pathlib import Path

from rclpy.node import Node

from valve_friction_ros.health import FrictionMonitor
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.plumbing.parameters import ParameterSpec
from valve_friction_ros.records.bags.topics import StreamNames
from valve_friction_ros.records.data_folder import data_folder

__all__ = ["SAVE_FOLDER", "saving"]

SAVE_FOLDER = ParameterSpec(
    "save_folder",
    "",
    "Folder that ~/save writes bags into [-]; empty: valve_friction_ros/saved under ROS_HOME, or "
    "under ~/.ros",
)


def _folder(told: str) -> Path:
    return Path(told).expanduser() if told else data_folder() / "saved"


def _name(node: Node) -> str:
    """Name of a bag: valve and time."""
    now = datetime.fromtimestamp(node.get_clock().now().nanoseconds / 1e9, timezone.utc)
    valve = node.get_namespace().strip("/").replace("/", "_") or node.get_name()
    return f"{valve}_{now:%Y%m%dT%H%M%SZ}"


def saving(node: Node, monitor: FrictionMonitor, names: StreamNames) -> Callable[[], Path]:
    """Take what the buffer holds now, and return what writes it as a bag, in any thread.

    What is returned raises RefusalError with the reason if it cannot be written.
    """
    told, name = node.get_parameter(SAVE_FOLDER.name).value, _name(node)
    snapshot, settings = monitor.buffer.snapshot(), monitor.settings

    def save() -> Path:
        # Costs memory and time at the start, and most nodes never save.
        from valve_friction_ros.records.bags.writing import write_bag  # noqa: PLC0415

        mass = settings.identification.assumed_mass
        try:
            return write_bag(_folder(told), name, snapshot, names, settings.valve, mass)
        except OSError as error:
            cause = error.strerror or error
            raise RefusalError(f"cannot write a bag into {_folder(told)}: {cause}") from None
        except RuntimeError as error:  # a home that cannot be found
            raise RefusalError(f"cannot write a bag into {told or '~/.ros'}: {error}") from None

    return save
