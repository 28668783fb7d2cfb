# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What ends no node, what ends it, and work in processes of its own, which may die."""

import contextlib
import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from faulty_identifier import (
    BEGINNING,
    BLOCK,
    CLEAN_UP,
    FINISH,
    FREEZE,
    LOOP,
    MENDED,
    MIDDLEWARE,
    RAISE,
    TIMER,
    faulty,
)
from live_nodes import ERROR, NAMESPACE, OK, WARN, buffered, stamps_of, values_of
from processes import PATIENCE, wait_until
from records import quick_record, simulated
from sensor_msgs.msg import FluidPressure, JointState
from std_srvs.srv import Trigger

from valve_friction_ros.health import RefusedRecordError
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.identification import RefusalError, published_estimate
from valve_friction_ros.model import BENCH_VALVE, Recording, SineWave, compiled
from valve_friction_ros.nodes.identifier import workers as workers_module
from valve_friction_ros.nodes.identifier.workers import running_workers
from valve_friction_ros.nodes.plumbing import processes as module
from valve_friction_ros.nodes.plumbing.processes import ElsewhereError, Processes
from valve_friction_ros.nodes.plumbing.worker import Worker, workers_have_ended

DAMAGED = b"\x00\x01\x00\x00xx"


def test_a_damaged_message_costs_only_itself(live):
    process = live.start_identifier()
    client = live.client
    for kind, topic in ((JointState, "stem_state"), (FluidPressure, "actuator_pressure")):
        stranger = client.node.create_publisher(kind, f"{NAMESPACE}/{topic}", 10)
        client.wait_until(lambda one=stranger: one.get_subscription_count() > 0, "the identifier")
        stranger.publish(DAMAGED)
        told = "100 % of its samples are rejected, no usable sample yet: the messages are damaged"
        words = f"{topic}: {told}"
        client.wait_until(lambda words=words: words in process.errors, "the warning")
        client.node.destroy_publisher(stranger)
    client.identified(quick_record())


class TestOneOfSeveral:
    """A valve that fails among three of one process; the others are identified as ever."""

    def start(self, live, tmp_path, faulty, script=None):
        config = tmp_path / "valves.yaml"
        config.write_text(
            "/**:\n  ros__parameters:\n    input_timeout: 600.0\n    method: bench\n"
            "/identifiers:\n  ros__parameters:\n    valves: [fv_101, fv_102, fv_103]\n" + faulty
        )
        arguments = ["--params-file", str(config)]
        process = live.start("identifiers", arguments=arguments, script=script, namespace=None)
        live.client.connect()
        return process

    def statuses(self, client):
        """The next status of each valve."""
        seen = len(client.statuses)

        def met():
            found = {one.name: one for _, one in client.statuses[seen:]}
            return found if len(found) == 3 else None

        return client.wait_until(met, "a status of each valve")

    def require_others(self, client, statuses):
        for name in ("/fv_101/identifier: friction", "/fv_103/identifier: friction"):
            assert statuses[name].level == OK, statuses[name]
        assert client.trigger("clear").success
        client.send_record(quick_record())
        client.next_status(
            lambda one: (
                one.name.startswith(NAMESPACE)
                and values_of(one)["buffered_samples"] == str(2 * len(quick_record()))
            ),
            "all samples of the first valve",
        )
        client.success("identify")

    def test_that_cannot_start(self, live, tmp_path):
        faulty = "/fv_102/identifier:\n  ros__parameters: {travel: -1.0, valve_tag: FV-102}\n"
        process = self.start(live, tmp_path, faulty)
        found = self.statuses(live.client)
        status, told = found["/fv_102/identifier: friction"], "travel must be above zero, got -1"
        assert (status.level, status.hardware_id) == (ERROR, "FV-102")
        assert status.message == f"cannot start, so this valve is not monitored: {told}"
        assert values_of(status)["NE 107"] == "C"
        assert live.client.latched(DiagnosticStatus, "/fv_102/identifier/estimate") == status
        (line,) = (one for one in process.errors.splitlines() if "cannot start" in one)
        assert f"cannot start /fv_102/identifier: {told}: correct it" in line
        self.require_others(live.client, found)
        assert "/fv_102/identifier/identify" not in dict(
            live.client.node.get_service_names_and_types()
        )

    @pytest.mark.slow
    def test_that_fails_while_it_runs(self, live, tmp_path):
        """At its start already, then in its diagnostics; each time the others go on."""
        process = self.start(live, tmp_path, "", faulty("one_raising"))
        process.forgive_tracebacks()
        self.require_others(live.client, self.statuses(live.client))
        for count, where in enumerate((LOOP, TIMER), 1):
            (tmp_path / "draft").write_text(where)
            (tmp_path / "draft").rename(tmp_path / RAISE)
            status = live.client.next_status(lambda one: "a bug" in one.message, "the bug")
            assert status.name == "/fv_102/identifier: friction"
            assert (status.level, values_of(status)["NE 107"]) == (ERROR, "C")
            assert status.message.startswith("internal error: ZeroDivisionError: a bug")
            self.require_others(live.client, self.statuses(live.client))
            assert process.errors.count("Traceback") == count  # not at each turn
        (tmp_path / RAISE).unlink()
        live.client.next_status(
            lambda one: one.name.startswith("/fv_102") and one.level < ERROR, "its end"
        )

    def test_a_bug_at_the_start(self, live, tmp_path):
        (tmp_path / RAISE).write_text(BEGINNING)
        process = self.start(live, tmp_path, "", faulty("one_raising"))
        process.forgive_tracebacks()
        found = self.statuses(live.client)
        status = found["/fv_102/identifier: friction"]
        assert status.level == ERROR
        assert "this valve is not monitored: internal error: ZeroDivisionError" in status.message
        self.require_others(live.client, found)


IDENTIFY = f"{NAMESPACE}/identifier/identify"


def begin_identification(client):
    """Request an identification, and return its future once it is under way."""
    running = client.request(Trigger, IDENTIFY, Trigger.Request())
    assert "already running" in client.refusal("identify")
    assert not running.done()
    return running


def test_long_identification_loses_no_sample(live, tmp_path):
    """What arrives while an identification runs is taken at once, and identified by the next."""
    client = live.client_of_identifier({"method": "bench"}, script=faulty("slow"))
    whole = simulated(SineWave(period=5.0).sample(np.arange(1000) / 100), 0.01)
    begin, rest = slice(500), slice(500, 1000)
    stamps = stamps_of(whole)
    client.send(*((stamps[begin], signal[begin]) for signal in (whole.pressure, whole.position)))
    client.wait_for_buffered(1000)
    running = begin_identification(client)
    client.send(*((stamps[rest], signal[rest]) for signal in (whole.pressure, whole.position)))
    client.next_status(lambda status: buffered(status) == 2000, "all samples")
    assert not running.done()

    (tmp_path / FINISH).touch()
    response = client.wait_until_answered(running)
    assert response.success, response.message
    half = published_estimate(
        Recording(0.01, whole.pressure[begin], whole.position[begin]), BENCH_VALVE
    )
    assert client.friction("sigma") == {"sigma": half.sigma}
    assert client.trigger("identify").success
    sigma = published_estimate(whole, BENCH_VALVE).sigma
    assert sigma != half.sigma
    assert client.friction("sigma") == {"sigma": sigma}


def test_a_bug_is_an_internal_error_and_the_next_record_identifies(live, history, tmp_path):
    process = live.start_identifier(script=faulty("failing"))
    client = live.client
    client.fill(quick_record())
    response = client.refusal("identify")
    words = "internal error: ZeroDivisionError: nobody foresaw it (faulty_identifier.py, line "
    assert response.startswith(words)
    assert response.endswith("): report it, together with the bag that ~/save writes")

    status = client.next_status()
    assert status.level == ERROR
    assert status.message.startswith(words)
    values = values_of(status)
    assert values["NE 107"] == "C"
    assert values["estimate_valid"] == "false"
    assert values["reason"] == response
    assert "[ERROR]" in process.errors
    assert process.errors.count("Traceback (most recent call last)") == 1
    assert 'raise ZeroDivisionError("nobody\\nforesaw it")' in process.errors

    # The same bug again is not logged again.
    assert client.trigger("identify").message == response
    assert process.errors.count("Traceback (most recent call last)") == 1
    assert history.entries() == ()

    (tmp_path / MENDED).touch()
    client.identified_whole(1000)
    assert client.next_status().level == OK
    assert all(not entry.refusal for entry in history.entries())
    process.forgive_tracebacks()


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
        "identifiers", {"valves": "[fv_101, fv_102]"}, script=faulty("stuck"), namespace=None
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


def frozen_end(live, tmp_path, what, silence):
    """Freeze an identifier within C; return its process when it has ended, and the time it took.

    Before, its inputs are silent for so many seconds, in which it asks the middleware.
    """
    process = live.start("identifier", script=faulty("frozen"))
    live.client.next_status()
    if silence:
        live.client.spin(silence)
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
    ("what", "where", "silence"),
    [
        (LOOP, "in _run", 0.0),
        (MIDDLEWARE, "in _end_if_the_middleware_hangs", 4.0),
        (CLEAN_UP, "in _run_until", 0.0),
    ],
)
def test_a_process_that_is_frozen_within_c_ends_by_itself(live, tmp_path, what, where, silence):
    """Silent inputs alone, of which the middleware is asked several times, end nothing."""
    process, lasted = frozen_end(live, tmp_path, what, silence)
    assert where in process.errors
    assert "Timeout (" in process.errors
    if what == CLEAN_UP:
        assert lasted < WITHIN + 1.0


NUMBERS = {"position_noise": Measured(1e-6, 1e-7)}


def refuse():
    raise RefusedRecordError("the stem did not move", NUMBERS)


def fail():
    raise KeyError("a bug")


def die():
    os.kill(os.getpid(), signal.SIGKILL)


def no_cache():
    return False


def wait_for(path):
    while not path.exists():
        time.sleep(0.01)
    return os.getpid()


@pytest.fixture(scope="module")
def processes():
    made = Processes()
    yield made
    made.end()


@pytest.fixture
def worker():
    with Worker("test", threads=2) as made:
        yield made


def done(future):
    return future.result(PATIENCE)


def test_all_threads_wait_for_what_is_prepared():
    finish, order = threading.Event(), []

    def prepare():
        finish.wait(PATIENCE)
        order.append("prepared")

    with Worker("test", prepare, threads=2) as worker:
        works = [worker.submit(order.append, "worked") for _ in range(3)]
        assert worker.is_preparing
        finish.set()
        for one in works:
            done(one)
    assert order == ["prepared", *["worked"] * 3]
    assert not worker.is_preparing


def test_the_process_that_worked_last_works_again(processes):
    assert processes.done(os.getpid) == processes.done(os.getpid) != os.getpid()


def test_a_process_ends_when_nobody_needs_it(monkeypatch):
    monkeypatch.setattr(module, "_KEPT", 0.05)
    processes = Processes()
    first = processes.done(os.getpid)
    # not even as a zombie
    wait_until(lambda: not Path(f"/proc/{first}").exists())
    assert processes.done(os.getpid) != first
    processes.end()


def test_it_ends_with_its_parent_though_it_works():
    """Killed, the parent can ask nothing of it."""
    code = (
        "import os, threading, time\n"
        "from valve_friction_ros.nodes.plumbing.processes import Processes\n"
        "made = Processes()\n"
        "print(made.done(os.getpid), flush=True)\n"
        "threading.Thread(target=made.done, args=(time.sleep, 3600)).start()\n"
        "while made._free: time.sleep(0.01)\n"
        "os.kill(os.getpid(), 9)\n"
    )
    parent = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=PATIENCE
    )
    assert parent.returncode == -signal.SIGKILL
    wait_until(lambda: not is_running(int(parent.stdout)))


def is_running(process):
    """Whether it is there, and no zombie that nobody has read."""
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def test_what_work_raises_comes_whole(processes):
    with pytest.raises(RefusedRecordError, match="the stem did not move") as raised:
        processes.done(refuse)
    assert raised.value.numbers == NUMBERS
    with pytest.raises(KeyError, match="a bug") as raised:
        processes.done(fail)
    assert isinstance(raised.value.__cause__, ElsewhereError)
    assert raised.value.__cause__.file == __file__
    assert 'raise KeyError("a bug")' in str(raised.value.__cause__)


def test_what_cannot_be_sent_is_a_bug_and_ends_no_process(processes):
    before = processes.done(os.getpid)
    with pytest.raises((TypeError, pickle.PicklingError)):
        processes.done(threading.Lock)
    assert processes.done(os.getpid) == before


def test_a_process_that_dies_costs_its_own_work_only(processes, worker, tmp_path):
    other = worker.submit(processes.done, wait_for, tmp_path / "end")
    with pytest.raises(RefusalError, match="ended before it answered"):
        done(worker.submit(processes.done, die))
    again = worker.submit(processes.done, os.getpid)
    assert done(again) != os.getpid()
    (tmp_path / "end").touch()
    assert done(other) != done(again)


def test_what_is_compiled_without_a_place_is_known_here(monkeypatch):
    """The process that identifies finds out; this one tells it."""
    monkeypatch.setattr(compiled, "_without_cache", set())
    monkeypatch.setattr(workers_module, "find_cache", no_cache)
    monkeypatch.setattr(workers_module, "compile_methods", os.getpid)
    with running_workers(processes=1) as workers:
        wait_until(lambda: not workers.identify.is_preparing)
        assert not compiled.kernels_are_cached()


def test_threads_share_what_waits_and_tell_how_long_they_are_busy(worker, tmp_path):
    assert (worker.busy_for(), worker.is_busy) == (0.0, False)
    blocked = worker.submit(wait_for, tmp_path / "end")
    assert done(worker.submit(os.getpid)) == os.getpid()
    wait_until(lambda: worker.busy_for() > 0.05)
    assert worker.is_busy
    (tmp_path / "end").touch()
    done(blocked)
    wait_until(lambda: not worker.is_busy)
    assert worker.busy_for() == 0.0


@pytest.mark.parametrize("finishes", [True, False])
def test_the_end_waits_for_what_finishes(finishes):
    with Worker("test", finishes=finishes) as worker:
        worker.submit(time.sleep, 0.3)
        assert workers_have_ended(PATIENCE) == finishes
    assert workers_have_ended(0.0)
