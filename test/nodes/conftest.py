"""Fixtures: domains, node processes and clients, closed and checked at the end."""

import contextlib
from pathlib import Path

import pytest
from live_nodes import NAMESPACE, Client, Domain, NodeProcess

from valve_friction_ros.history import HistoryFile

_HERE = Path(__file__).parent
_PROFILE = _HERE / "fast_discovery.xml"


@pytest.fixture(scope="session", autouse=True)
def ros_environment(tmp_path_factory):
    """Nothing leaves this machine, discovery is quick, logs go where they are cleaned up."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        patch.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", str(_PROFILE))
        patch.setenv("ROS_LOG_DIR", str(tmp_path_factory.mktemp("log")))
        for name in ("ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY", "RCUTILS_LOGGING_USE_STDOUT"):
            patch.delenv(name, raising=False)
        yield


class Live:
    """A domain with a client, and the nodes that a test starts there."""

    def __init__(self, folder):
        self._folder = folder
        self._stack = contextlib.ExitStack()
        self.domain = Domain()
        self._stack.callback(self.domain.release)
        self.client = Client(self.domain)
        self._stack.callback(self.client.close)
        self.nodes = []

    def start(self, name, parameters=None, arguments=(), script=None, namespace=NAMESPACE):
        """Start a node whose end is checked; return its process.

        Identifiers take stamps of any time, unless `parameters` say otherwise.
        """
        if name in ("identifier", "identifiers"):
            parameters = {"clock_tolerance": 0.0} | (parameters or {})
        process = NodeProcess(
            name, self.domain, self._folder, parameters, arguments, script, namespace
        )
        self.nodes.append(process)
        self.client.watched.append(process)
        return process

    def start_identifier(self, parameters=None, arguments=(), script=None):
        """Start an identifier and connect the client's publishers to it.

        It does not mind silence, unless `parameters` say so: a slow machine would meet some.
        """
        parameters = {"input_timeout": 600.0} | (parameters or {})
        process = self.start("identifier", parameters, arguments, script)
        self.client.connect()
        return process

    def kill(self, process):
        """End a node by kill -9; what comes now is of the next one."""
        self.client.watched.clear()
        process.kill()
        self.nodes.remove(process)
        self.client.drain()
        self.client.statuses.clear()

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
