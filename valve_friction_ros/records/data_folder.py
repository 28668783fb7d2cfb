# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Default folder of the files of nodes."""

import contextlib
import os
from pathlib import Path


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
