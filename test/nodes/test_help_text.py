# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""``--help`` of the nodes: how to run them, and their parameters, without starting ROS."""

import signal
import subprocess
import sys

import pytest
import yaml
from live_nodes import PROJECT

_START = """
import sys
import rclpy
def refuse(*_, **__):
    raise AssertionError("ROS was started")
rclpy.init = refuse
from valve_friction_ros.nodes import start
sys.exit(getattr(start, sys.argv[1])())
"""


@pytest.mark.parametrize("option", ["-h", "--help"])
@pytest.mark.parametrize(
    ("node", "parameter", "default"),
    [
        ("identifier", "window", 60.0),
        ("identifiers", "valves", [""]),
        ("simulator", "joint", "stem"),
        ("pressure_source", "excitation", "square"),
        ("stroke_player", "silence", 1.0),
    ],
)
def test_help_ends_well_and_names_the_parameters(node, parameter, default, option):
    done = subprocess.run(
        [sys.executable, "-c", _START, node, option],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, "")
    first, *rest = done.stdout.splitlines()
    assert first.startswith(f"usage: {node} [--ros-args ")
    listed = yaml.safe_load("\n".join(line for line in rest if line.startswith("  ")))
    assert listed[parameter] == default


def test_help_that_nobody_reads_ends_in_silence():
    """As in `identifier --help | head -1`."""
    node = subprocess.Popen(
        [sys.executable, "-c", _START, "simulator", "--help"],
        cwd=PROJECT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    node.stdout.close()
    assert node.stderr.read() == ""
    node.stderr.close()
    assert node.wait(60) == -signal.SIGPIPE
