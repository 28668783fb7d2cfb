# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the dashboard does not load: a second of its start and 50 MB."""

import subprocess
import sys

import pytest

pytest.importorskip("nicegui", reason="NiceGUI is not installed")

PROGRAM = """
import sys
from pathlib import Path
import numpy as np
from valve_friction_ros.history.trend import fit_line
import valve_friction_ros.dashboard.history_cache, valve_friction_ros.dashboard.context
import valve_friction_ros.dashboard.charts
import valve_friction_ros.nodes.dashboard.node

days = np.arange(9.0)
fit_line(days, 1.0 + 0.1 * days + 0.01 * np.cos(9 * days), np.full(9, 0.001)).half_width(3.0)
print(*sorted(sys.modules))
"""


def test_no_numeric_library_but_numpy():
    pytest.importorskip("rclpy", reason="needs ROS")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    loaded = set(done.stdout.split())
    assert "valve_friction_ros.history.trend" in loaded
    heavy = {"numba", "scipy.special", "scipy.linalg", "scipy.optimize", "scipy.signal",
             "matplotlib", "pandas", "tornado", "aiohttp"}  # fmt: skip
    assert not heavy & loaded
