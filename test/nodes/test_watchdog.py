# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A node that is stuck says so, systemd is told nothing good of it, and it can be ended."""

import contextlib
import signal
import socket
import time

import pytest
from faulty_identifier import BLOCK, CLEAN_UP, FINISH, FREEZE, LOOP, MIDDLEWARE, faulty
from live_nodes import ERROR, NAMESPACE, WARN, values_of
from records import quick_record
from std_srvs.srv import Trigger

WITHIN = 3.0
"""Time, s, in which a node ends after a signal, as promised; a loaded machine adds to it."""


class Systemd:
    """The socket that systemd gives to a service, and what has come to it."""

    def __init__(self, path):
        self.path = str(path)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(self.path)
        self._socket.setblocking(False)

    def heard(self):
        """Return what has come since the last call."""
        states = []
        with contextlib.suppress(BlockingIOError):
            while True:
                states.append(self._socket.recv(100).decode())
        return states

    def close(self):
        self._socket.close()


@pytest.fixture
def systemd(tmp_path, monkeypatch):
    listener = Systemd(tmp_path / "notify")
    monkeypatch.setenv("NOTIFY_SOCKET", listener.path)
    monkeypatch.setenv("WATCHDOG_USEC", "2000000")
    yield listener
    listener.close()


def wait_to_hear(client, systemd, state):
    client.wait_until(lambda: state in systemd.heard(), f"{state} at systemd")


def hears_no_watchdog(client, systemd):
    """Whether no WATCHDOG=1 comes in a time in which several would."""
    end = time.monotonic() + 2.0
    systemd.heard()
    client.wait_until(lambda: time.monotonic() > end, "two seconds")
    return "WATCHDOG=1" not in systemd.heard()


@pytest.fixture
def stuck(live, tmp_path, systemd):
    """Identifiers of two valves whose loop a file stops."""
    process = live.start(
        "identifiers",
        {"valves": "[fv_101, fv_102]"},
        script=faulty("stuck"),
        namespace=None,
    )
    wait_to_hear(live.client, systemd, "READY=1")
    return process, tmp_path / BLOCK


def test_a_loop_that_stands_still(live, systemd, stuck):
    process, block = stuck
    client = live.client
    client.next_status()
    wait_to_hear(client, systemd, "WATCHDOG=1")
    block.touch()
    for valve in ("fv_101", "fv_102"):
        status = client.next_status(
            lambda one, valve=valve: one.hardware_id == valve and one.level == ERROR,
            f"the end of {valve}'s monitoring",
        )
        assert status.name == f"/{valve}/identifier: friction"
        assert status.message.startswith("stuck: the main loop of this process has not run for ")
        assert values_of(status) == {"estimate_valid": "false", "NE 107": "C"}
    assert hears_no_watchdog(client, systemd)
    client.wait_until(lambda: "in poll_when_free" in process.errors, "the stack traces")
    assert process.errors.count("most recent call first") >= 2  # all threads

    block.unlink()
    client.next_status(lambda one: one.level != ERROR, "a status of the loop")
    wait_to_hear(client, systemd, "WATCHDOG=1")
    process.stop()
    assert "STOPPING=1" in systemd.heard()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stuck_node_ends_all_the_same(live, stuck, number):
    process, block = stuck
    block.touch()
    time.sleep(0.5)
    live.client.watched.clear()
    live.nodes.remove(process)
    begin = time.monotonic()
    process._process.send_signal(number)
    assert process.exit_code() == 1
    assert time.monotonic() - begin < WITHIN + 1.0
    assert "is abandoned" in process.errors
    assert "in poll_when_free" in process.errors


def test_an_identification_that_does_not_return(live, tmp_path, systemd):
    process = live.start_identifier({"identification_limit": 1.0}, script=faulty("slow"))
    client = live.client
    client.fill(quick_record())
    running = client.request(Trigger, f"{NAMESPACE}/identifier/identify", Trigger.Request())
    status = client.next_status(
        lambda one: "beyond identification_limit (1 s)" in one.message, "a warning"
    )
    assert status.level == WARN
    assert values_of(status)["NE 107"] == "C"
    assert hears_no_watchdog(client, systemd)
    (tmp_path / FINISH).touch()
    assert client.wait_until_answered(running).success
    client.next_status(lambda one: "identification_limit" not in one.message, "its end")
    wait_to_hear(client, systemd, "WATCHDOG=1")
    process.stop()


def test_ctrl_c_leaves_an_identification_that_does_not_return(live):
    process = live.start_identifier(script=faulty("slow"))
    client = live.client
    client.fill(quick_record())
    client.request(Trigger, f"{NAMESPACE}/identifier/identify", Trigger.Request())
    assert "already running" in client.trigger("identify").message
    begin = time.monotonic()
    process.stop()
    assert time.monotonic() - begin < WITHIN + 1.0


def frozen_end(live, tmp_path, what):
    """Freeze an identifier within C; return its process when it has ended, and the time it took."""
    process = live.start("identifier", script=faulty("frozen"))
    live.client.next_status()
    live.client.watched.clear()
    live.nodes.remove(process)
    (tmp_path / "draft").write_text(what)
    (tmp_path / "draft").rename(tmp_path / FREEZE)
    begin = time.monotonic()
    if what == CLEAN_UP:
        process.interrupt()
    try:
        assert process.exit_code() == 1, process.errors
        return process, time.monotonic() - begin
    finally:
        process.kill()


@pytest.mark.parametrize(
    ("what", "where"),
    [
        (LOOP, "in _run"),
        (MIDDLEWARE, "in _end_if_the_middleware_hangs"),
        (CLEAN_UP, "in _run_until"),
    ],
)
def test_a_process_that_is_frozen_within_c_ends_by_itself(live, tmp_path, what, where):
    process, lasted = frozen_end(live, tmp_path, what)
    assert where in process.errors
    assert "Timeout (" in process.errors
    if what == CLEAN_UP:
        assert lasted < WITHIN + 1.0


def test_silent_inputs_alone_end_nothing(live):
    """The middleware is asked several times, and answers."""
    process = live.start("identifier", script=faulty("frozen"))
    live.client.next_status()
    begin = time.monotonic()
    live.client.wait_until(lambda: time.monotonic() > begin + 4.0, "four seconds")
    process.require_running()
    live.client.next_status()
