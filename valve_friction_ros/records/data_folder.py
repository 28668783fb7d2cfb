"""Default folder of the files of nodes."""

import os
from pathlib import Path

__all__ = ["data_folder", "history_file"]


def data_folder() -> Path:
    """Return the package's folder under ROS_HOME, or under ~/.ros without it."""
    home = os.environ.get("ROS_HOME")
    return (Path(home) if home else Path.home() / ".ros") / "valve_friction_ros"


def history_file() -> Path:
    """Return the default file of the history."""
    return data_folder() / "history.sqlite"
