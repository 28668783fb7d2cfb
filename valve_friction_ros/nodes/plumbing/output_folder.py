"""Files that a node writes on request, named by valve and time."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from rclpy.node import Node

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.records.data_folder import data_folder
from valve_friction_ros.streams import utc

__all__ = ["file_name", "output_folder", "valve_name"]


@contextlib.contextmanager
def output_folder(given: str, usual: str, content: str) -> Iterator[Path]:
    """Provide the folder that a parameter gives, or else the `usual` one in the data folder.

    Raises RefusalError, which names the `content` with its article, if the home directory in the
    path is unknown, or the block raises OSError.
    """
    try:
        folder = (Path(given) if given else data_folder() / usual).expanduser()
    except RuntimeError as error:  # pathlib's, where a home directory is unknown
        raise RefusalError(f"cannot write {content} into {given or '~/.ros'}: {error}") from None
    try:
        yield folder
    except OSError as error:
        cause = error.strerror or error
        raise RefusalError(f"cannot write {content} into {folder}: {cause}") from None


def valve_name(node: Node) -> str:
    """Name the node's valve as a part of file names."""
    return node.get_namespace().strip("/").replace("/", "_") or node.get_name()


def file_name(node: Node, stamp: int) -> str:
    """Name a file, without its ending, after the node's valve and a time (ns)."""
    return f"{valve_name(node)}_{utc(stamp):%Y%m%dT%H%M%SZ}"
