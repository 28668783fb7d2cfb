# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `call`: services of a live node without the command `ros2`."""

import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from faulty_identifier import BEGUN, FINISH, faulty
from live_nodes import NAMESPACE, PROJECT
from records import quick_record

from valve_friction_ros.commands.main import run
from valve_friction_ros.model import HIGH_FRICTION


def start(domain, *arguments):
    """Start the command in a domain."""
    path = os.pathsep.join(filter(None, [str(PROJECT), os.environ.get("PYTHONPATH")]))
    return subprocess.Popen(
        [sys.executable, "-m", "valve_friction_ros", "call", *arguments],
        env=os.environ | {"ROS_DOMAIN_ID": str(domain.number), "PYTHONPATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def ended(process):
    """Exit code, stdout and stderr."""
    out, err = process.communicate(timeout=300)
    return process.returncode, out, err


@pytest.fixture(scope="module")
def bench(shared):
    """A domain with an identifier, which does not end an identification without a file."""
    (shared.folder / FINISH).touch()
    shared.start_identifier(script=faulty("slow"))
    return shared


@pytest.fixture
def call(monkeypatch, capsys):
    """Function of a domain and arguments: exit code, stdout and stderr of the command, run here."""

    def call(domain, *arguments):
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain.number))
        try:
            code = run(["call", *arguments])
        except SystemExit as end:
            code = end.code
        return (code, *capsys.readouterr())

    return call


def test_all_services(bench, call):
    client, call = bench.client, partial(call, bench.domain)
    assert call("fv_101", "clear") == (
        0,
        "the buffer is empty; the estimate and the baseline are kept\n",
        "",
    )
    code, out, err = call(NAMESPACE, "identify")
    assert (code, out) == (2, "")
    assert err.startswith("valve_friction call: /fv_101/identifier: ")
    assert err.count("\n") == 1

    message = client.identified(quick_record())
    assert call(NAMESPACE, "identify", "--fail-on", "warn") == (0, f"OK: {message}\n", "")
    code, out, err = call(f"{NAMESPACE}/identifier", "set_baseline")
    assert (code, err) == (0, "")
    assert out.startswith("baseline: Coulomb friction ")
    code, out, err = call(NAMESPACE, "save")
    assert (code, err) == (0, "")
    saved = Path(out.strip())
    assert saved.parent == bench.folder / "valve_friction_ros" / "saved"  # ROS_HOME is the folder
    assert saved.exists()

    message = client.identified(quick_record(HIGH_FRICTION))
    assert call(NAMESPACE, "identify") == (0, f"ERROR: {message}\n", "")
    assert call(NAMESPACE, "identify", "--fail-on", "error") == (3, f"ERROR: {message}\n", "")


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (
            ["/fv_109", "identify", "--timeout", "2"],
            "no identifier of /fv_109 was found within 2 s",
        ),
        (["/fv_101", "clear", "--timeout", "-1"], "--timeout must be above zero, got -1"),
        (["/fv_101", "save", "--fail-on", "warn"], "--fail-on: save makes no diagnosis"),
        (["/fv_101", "xyz"], "clear"),  # of all services
    ],
)
def test_refused_in_one_line(bench, call, arguments, line):
    code, out, err = call(bench.domain, *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("valve_friction call: ")
    assert line in err
    assert err.count("\n") == 1
    if "fv_109" in line:
        assert "; there are /fv_101, or set its ROS_DOMAIN_ID" in err


@pytest.fixture
def busy(bench):
    """The same domain, where an identification does not end before the test."""
    client, finish = bench.client, bench.folder / FINISH
    assert client.trigger("clear").success
    client.fill(quick_record())
    finish.unlink()
    yield bench
    finish.touch()
    if bench.nodes[0].is_running():
        client.wait_until(lambda: client.trigger("identify").success, "the end of it")


def test_the_timeout_ends_the_command_and_the_node_goes_on(busy):
    assert ended(start(busy.domain, NAMESPACE, "identify", "--timeout", "2")) == (
        2,
        "",
        "valve_friction call: /fv_101/identifier/identify has not answered within 2 s; it is "
        "still running; allow more time with --timeout\n",
    )
    assert busy.client.trigger("identify").message.startswith(
        "an identification is already running"
    )


def waiting(bench):
    """Start the command, which waits for an identification that does not end."""
    begun = bench.folder / BEGUN
    begun.unlink(missing_ok=True)
    process = start(bench.domain, NAMESPACE, "identify")
    bench.client.wait_until(begun.exists, "an identification")
    return process


def test_interrupted_while_it_waits(busy):
    process = waiting(busy)
    process.send_signal(signal.SIGINT)
    assert ended(process) == (
        130,
        "",
        "valve_friction call: interrupted: the identifier continues the task it has started\n",
    )


def test_nobody_is_there(live, call):
    code, out, err = call(live.domain, "/fv_101", "identify", "--timeout", "1")
    assert (code, out) == (2, "")
    assert "there is no identifier at all: start one, or set its ROS_DOMAIN_ID" in err


def test_the_node_is_stopped_meanwhile(busy):
    process = waiting(busy)
    busy.nodes[0].stop()
    assert ended(process) == (
        2,
        "",
        "valve_friction call: /fv_101/identifier: the node was stopped before ~/identify had "
        "finished: call it again once the node is active\n",
    )


def test_the_node_is_killed_meanwhile(live):
    live.start_identifier(script=faulty("slow"))
    live.client.fill(quick_record())
    process = waiting(live)
    live.kill(live.nodes[0])
    assert ended(process) == (
        2,
        "",
        "valve_friction call: /fv_101/identifier ended before it answered\n",
    )
