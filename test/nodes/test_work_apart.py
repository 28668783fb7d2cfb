# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Work in processes of its own: what it returns and raises, and that a process may die."""

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from processes import PATIENCE, wait_until

from valve_friction_ros.health import (
    RefusedRecordError,
)
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import compiled
from valve_friction_ros.nodes.identifier import workers as workers_module
from valve_friction_ros.nodes.identifier.workers import running_workers
from valve_friction_ros.nodes.plumbing import processes as module
from valve_friction_ros.nodes.plumbing.processes import ElsewhereError, Processes
from valve_friction_ros.nodes.plumbing.worker import Worker, workers_have_ended

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
