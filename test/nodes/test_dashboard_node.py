# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The executable `dashboard`: how it starts, refuses to start, and ends."""

import socket
import subprocess
import sys

import pytest
from live_nodes import PROJECT
from local_server import free_port

pytest.importorskip("nicegui", reason="NiceGUI is not installed")

START = "from valve_friction_ros.nodes.start import dashboard; sys.exit(dashboard())"


def run(*arguments, before=""):
    """Run it; its exit code and what it says."""
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; {before}{START}", "--ros-args", *arguments],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    return done.returncode, done.stderr


@pytest.mark.parametrize(
    ("parameter", "words"),
    [
        ("host:='0.0.0.0'", "cannot start: host '0.0.0.0'"),
        ("time_zone:=Nowhere/Land", "cannot start: time_zone 'Nowhere/Land' is unknown"),
        ("prot:=8093", "has no parameter 'prot'"),
    ],
)
@pytest.mark.usefixtures("ros_environment")
def test_a_wrong_start_is_one_line(parameter, words):
    code, said = run("-p", parameter)
    assert code == 2
    assert words in said
    assert len(said.splitlines()) == 1


@pytest.mark.usefixtures("ros_environment")
def test_a_port_in_use_is_told():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        code, said = run("-p", f"port:={other.getsockname()[1]}")
    assert code == 2
    assert "give another port" in said


@pytest.mark.usefixtures("ros_environment")
def test_without_nicegui_it_says_what_to_install():
    code, said = run(before="sys.modules['nicegui'] = None; ")
    assert code == 2
    assert said.splitlines() == [
        "cannot start: the dashboard needs NiceGUI, which is not installed: "
        "run `pip install 'nicegui>=3.18,<4'`"
    ]


def test_sigterm_ends_it_cleanly(live):
    process = live.start("dashboard", {"port": free_port()}, namespace=None)
    live.client.wait_until(lambda: "ready: open" in process.errors + process.output, "the server")
    live.client.watched.clear()
    live.nodes.remove(process)
    process._process.terminate()
    assert process.exit_code() == 0
    assert "Traceback" not in process.errors
