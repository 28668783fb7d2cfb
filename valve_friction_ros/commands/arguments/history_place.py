"""Where a history is: a file, or a server by its address."""

import argparse
import os
from pathlib import Path

from valve_friction_ros.history import URL_VARIABLE, HistoryServer, is_url
from valve_friction_ros.records.data_folder import history_file

__all__ = ["PLACE", "history_place", "usual_history"]

PLACE = "FILE.sqlite|URL"
"""How the help calls it."""


def history_place(text: str) -> Path | HistoryServer:
    """Read a path, or the address of a server."""
    if not is_url(text):
        return Path(text)
    try:
        return HistoryServer(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def usual_history() -> str:
    """Return the address of the server that the environment names, else the file of the nodes."""
    return os.environ.get(URL_VARIABLE, "").strip() or str(history_file())
