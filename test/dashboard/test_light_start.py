"""What the dashboard does not load: a second of its start and 50 MB."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("nicegui", reason="NiceGUI is not installed")

PROGRAM = """
import sys
from pathlib import Path
import numpy as np
from valve_friction_ros.history.scattered_line import fit_line
import valve_friction_ros.dashboard.kept, valve_friction_ros.dashboard.board
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
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},  # as its executable starts it
    )
    loaded = set(done.stdout.split())
    assert "valve_friction_ros.history.trend" in loaded
    heavy = {"numba", "scipy.special", "scipy.linalg", "scipy.optimize", "scipy.signal",
             "matplotlib", "pandas", "tornado", "aiohttp"}  # fmt: skip
    assert not heavy & loaded
