# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Fixtures: domains, node processes and clients, closed and checked at the end."""

import contextlib
from pathlib import Path

import pytest
from live_nodes import NAMESPACE, Client, Domain, NodeProcess

from valve_friction_ros.history import HistoryFile
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.nodes.plumbing.rclpy_private import PROFILES

_HERE = Path(__file__).parent
_PROFILE = _HERE / "fast_discovery.xml"


@pytest.fixture(scope="session", autouse=True)
def ros_environment(tmp_path_factory):
    """Nothing leaves this machine, discovery is quick, logs go where they are cleaned up."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("FASTRTPS_DEFAULT_PROFILES_FILE", raising=False)
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        profile = tmp_path_factory.mktemp("dds") / _PROFILE.name
        text = _PROFILE.read_text(encoding="utf-8")
        if PROFILES.startswith("FASTDDS"):  # the names of tags of Fast DDS 3, of Kilted
            text = text.replace("heartbeatPeriod", "heartbeat_period")
        profile.write_text(text, encoding="utf-8")
        patch.setenv(PROFILES, str(profile))
        patch.setenv("ROS_LOG_DIR", str(tmp_path_factory.mktemp("log")))
        for name in ("ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY", "RCUTILS_LOGGING_USE_STDOUT"):
            patch.delenv(name, raising=False)
        yield


class Live:
    """A domain with a client, and the nodes that a test starts there."""

    def __init__(self, folder):
        self.folder = folder
        self._stack = contextlib.ExitStack()
        self.domain = Domain()
        self._stack.callback(self.domain.release)
        self.client = Client(self.domain)
        self._stack.callback(self.client.close)
        self.nodes = []

    def start(self, name, parameters=None, arguments=(), script=None, namespace=NAMESPACE):
        """Start a node whose end is checked; return its process.

        Identifiers take stamps of any time and publish all of their topics, unless `parameters` say
        otherwise.
        """
        if name in ("identifier", "identifiers"):
            asked = {"estimate_topic": True, "number_topics": True}
            parameters = {"clock_tolerance": 0.0} | asked | (parameters or {})
        process = NodeProcess(
            name, self.domain, self.folder, parameters, arguments, script, namespace
        )
        self.nodes.append(process)
        self.client.watched.append(process)
        return process

    def start_identifier(self, parameters=None, arguments=(), script=None):
        """Start an identifier and connect the client's publishers to it.

        It does not mind silence, unless `parameters` say so: a slow machine would meet some. Its
        valve is that of the bench, but for what `parameters` say, with None for what nobody states.
        """
        stated = {"input_timeout": 600.0} | vars(BENCH_VALVE) | (parameters or {})
        parameters = {name: value for name, value in stated.items() if value is not None}
        process = self.start("identifier", parameters, arguments, script)
        self.client.connect()
        return process

    def client_of_identifier(self, parameters=None, script=None):
        """Start an identifier; return the client beside it."""
        self.start_identifier(parameters, script=script)
        return self.client

    def kill(self, process):
        """End a node by kill -9; what comes now is of the next one."""
        self.client.watched.clear()
        process.kill()
        self.nodes.remove(process)
        self.client.drain()
        self.client.statuses.clear()

    def restart(self, parameters=None):
        """Kill the node that was started last, and start an identifier with these parameters."""
        self.kill(self.nodes[-1])
        return self.start_identifier(parameters)

    def close(self):
        """Stop what still runs; every node must end well."""
        self.client.watched.clear()
        try:
            for process in self.nodes:
                process.stop()
        finally:
            for process in self.nodes:
                process.kill()
            self._stack.close()


@contextlib.contextmanager
def _live(folder):
    bench = Live(folder)
    try:
        yield bench
    finally:
        bench.close()


@pytest.fixture
def live(tmp_path):
    """A domain of the test's own."""
    with _live(tmp_path) as bench:
        yield bench


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """A domain that the tests of a module share."""
    with _live(tmp_path_factory.mktemp("nodes")) as bench:
        yield bench


@pytest.fixture
def history(tmp_path):
    """The file that a node of this test keeps without being told; ROS_HOME is this folder."""
    return HistoryFile(tmp_path / "valve_friction_ros" / "history.sqlite")
