"""Default folder of the files of nodes."""

import contextlib
import os
from pathlib import Path

__all__ = ["data_folder", "history_file"]


def data_folder() -> Path:
    """Return the package's folder under ROS_HOME, or under ~/.ros without it.

    Where the home directory is not known, the path begins with ``~``.
    """
    home = os.environ.get("ROS_HOME") or Path("~/.ros")
    folder = Path(home) / "valve_friction_ros"
    with contextlib.suppress(RuntimeError):
        return folder.expanduser()
    return folder


def history_file() -> Path:
    """Return the default file of the history."""
    return data_folder() / "history.sqlite"
