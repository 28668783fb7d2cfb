# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Where nothing can be written and no home is known: a start, or one line that says what to set."""

import pytest
from live_nodes import Domain, NodeProcess, values_of

from valve_friction_ros.records.files import data_folder


def end_of(domain, folder, name, **parameters):
    process = NodeProcess(name, domain, folder, parameters)
    try:
        return process.exit_code(), process.errors.splitlines()[-1]
    finally:
        process.kill()


@pytest.fixture
def domain():
    used = Domain()
    yield used
    used.release()


def test_no_place_for_the_log(domain, tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_LOG_DIR", "/proc/nowhere")
    code, line = end_of(domain, tmp_path, "simulator")
    assert code == 2
    assert line.startswith("cannot start: ")
    assert line.endswith(": set ROS_LOG_DIR to a folder that can be written")


def test_no_home_for_the_history(domain, tmp_path):
    code, line = end_of(domain, tmp_path, "identifier", history_file="'~nobody-such/x'")
    assert code == 2
    assert "cannot start: history_file ~nobody-such/x: Could not determine home" in line
    assert line.endswith("Set HOME or ROS_HOME, or name another file")


def test_without_a_home_the_folder_says_so(monkeypatch):
    monkeypatch.delenv("ROS_HOME", raising=False)
    monkeypatch.delenv("HOME", raising=False)
    monkeypatch.setattr("os.getuid", lambda: 4_242_424)  # in no list of users
    assert str(data_folder()) == "~/.ros/valve_friction_ros"


def test_compiled_code_without_a_place_is_said(live, tmp_path):
    code = (
        "import sys; from valve_friction_ros.model import compiled; "
        "compiled._without_cache.add('one'); "
        "from valve_friction_ros.nodes import simulator; "
        "import valve_friction_ros.nodes.plumbing.worker as r; r._QUICK = 0.0; "
        "import time; "
        "simulator.compile_kernels = lambda: time.sleep(1.0); sys.exit(simulator.main())"
    )
    script = tmp_path / "simulator_without_cache.py"
    script.write_text(code.replace("; ", "\n"))
    process = live.start("simulator", script=script)
    live.client.wait_until(lambda: "ready: " in process.errors, "the ready line")
    assert "at each start, because no folder for it can be written" in process.errors
    assert "set NUMBA_CACHE_DIR" in process.errors


def test_diagnostics_say_that_it_prepares(live, tmp_path):
    script = tmp_path / "slow_preparation.py"
    script.write_text(
        "import sys, time\n"
        "from pathlib import Path\n"
        "import valve_friction_ros.nodes.plumbing.worker as readiness\n"
        "from valve_friction_ros.nodes.identifier import node, workers\n"
        "readiness._QUICK = 0.0\n"
        "def prepare():\n"
        "    while not Path('prepared').exists():\n"
        "        time.sleep(0.05)\n"
        "workers.compile_methods = prepare\n"
        "node._PROCESSES = 0\n"
        "sys.exit(node.main())\n"
    )
    process = live.start("identifier", {"input_timeout": 600.0}, script=script)
    status = live.client.next_status()
    assert values_of(status)["preparing"].startswith("preparing: numeric code is compiled")
    assert status.message.endswith(values_of(status)["preparing"])
    assert "ready: " not in process.errors
    (tmp_path / "prepared").touch()
    status = live.client.next_status(lambda one: "preparing" not in values_of(one), "its end")
    assert "preparing" not in status.message
    assert "ready: " in process.errors
