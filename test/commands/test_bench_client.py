# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The client of the bench and the processes around it."""

import contextlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from valve_friction_ros.commands.demo.bench import (
    NodeProcess,
    quick_discovery,
    running_nodes,
)
from valve_friction_ros.nodes.plumbing.rclpy_private import PROFILES

NAMES = ("ROS_AUTOMATIC_DISCOVERY_RANGE", PROFILES)


def test_what_a_client_is_told(ros_environment):
    """Two nodes and a client as processes: every failure has its reason, and all end well."""
    done = subprocess.run(
        [sys.executable, Path(__file__).with_name("bench_visit.py")],
        capture_output=True,
        text=True,
        timeout=90,
        check=False,
        env=ros_environment,
    )
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    told = json.loads(done.stdout)
    assert told["before"] == [0.0, None, ""]
    assert told["identify"].startswith("identify: no ")
    assert "actuator_pressure" in told["identify"]
    assert told["clear"]
    assert told["impossible"].startswith("simulator refused: ")
    assert "static_friction" in told["impossible"]
    assert told["possible"] is None
    assert told["absent node"] == (
        "no answer of /fv_7/nobody/set_parameters_atomically within 0.1 s"
    )
    assert told["absent service"] == (
        "/fv_7/identifier/dance is not there: start the identifier of this valve"
    )
    assert "actuator_pressure" in told["message"]
    assert told["estimate_valid"] == "false"
    assert told["exit codes"] == [0, 0]


class TestQuickDiscovery:
    def test_stays_on_this_machine(self, monkeypatch):
        for name in NAMES:
            monkeypatch.delenv(name, raising=False)
        found = quick_discovery()
        assert set(found) == set(NAMES)
        assert found["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
        assert Path(found[PROFILES]).is_file()

    @pytest.mark.parametrize("name", NAMES)
    def test_what_the_user_has_set_stays(self, monkeypatch, name):
        for other in NAMES:
            monkeypatch.delenv(other, raising=False)
        monkeypatch.setenv(name, "of the user")
        assert set(quick_discovery()) == set(NAMES) - {name}
        assert os.environ[name] == "of the user"


def test_processes_end_with_the_context_even_after_an_error():
    """An unknown node ends by itself at once, or is ended."""
    node = NodeProcess("no_such_node", {})
    with contextlib.suppress(ZeroDivisionError), running_nodes([node, node], "fv_7") as processes:
        1 / 0  # noqa: B018
    assert len(processes) == 2
    assert all(process.returncode is not None for process in processes)
