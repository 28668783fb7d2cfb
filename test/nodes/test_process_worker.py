"""Work in processes of its own: what it returns and raises, and that a process may die."""

import os
import signal
import threading
import time

import pytest
from live_nodes import PATIENCE
from records import quick_record

from valve_friction_ros.health import (
    FrictionMonitor,
    MonitorSettings,
    RefusedRecordError,
    identify_snapshot,
)
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.nodes.plumbing.process_worker import ProcessWorker
from valve_friction_ros.nodes.plumbing.worker import Worker
from valve_friction_ros.streams import rows_arrived

NUMBERS = {"position_noise": Measured(1e-6, 1e-7)}


def refuse():
    raise RefusedRecordError("the stem did not move", NUMBERS)


def fail():
    raise KeyError("a bug")


def die():
    os.kill(os.getpid(), signal.SIGKILL)


def wait_for(path):
    while not path.exists():
        time.sleep(0.01)
    return os.getpid()


@pytest.fixture(scope="module")
def worker():
    made = ProcessWorker("test", 2, os.getpid)
    yield made
    made.shutdown(wait=False)


def done(future):
    return future.result(PATIENCE)


def test_it_prepares_and_is_busy_until_all_is_done(tmp_path):
    worker = ProcessWorker("test", 1, os.getpid)
    assert worker.is_preparing
    work = worker.submit(wait_for, tmp_path / "end")
    assert worker.is_busy
    (tmp_path / "end").touch()
    assert done(work) != os.getpid()
    assert not worker.is_preparing
    deadline = time.monotonic() + PATIENCE
    while worker.is_busy:
        assert time.monotonic() < deadline
    assert worker.busy_for() == 0.0
    worker.shutdown(wait=False)


def test_a_result_is_that_of_a_thread(worker):
    record = quick_record()
    monitor = FrictionMonitor(MonitorSettings(BENCH_VALVE))
    columns = zip(record.time, record.pressure, record.position, strict=True)
    monitor.buffer.add_arrivals(rows_arrived([*columns]))
    result = done(worker.submit(identify_snapshot, *monitor.input()))
    assert result.to_dict() == identify_snapshot(*monitor.input()).to_dict()


def test_what_work_raises_comes_whole(worker):
    with pytest.raises(RefusedRecordError, match="the stem did not move") as raised:
        done(worker.submit(refuse))
    assert raised.value.numbers == NUMBERS
    with pytest.raises(KeyError, match="a bug"):
        done(worker.submit(fail))


def test_a_process_that_dies_costs_its_own_work_only(worker, tmp_path):
    other = worker.submit(wait_for, tmp_path / "end")
    with pytest.raises(RefusalError, match="has ended before its answer"):
        done(worker.submit(die))
    again = worker.submit(os.getpid)
    assert done(again) != os.getpid()
    (tmp_path / "end").touch()
    assert done(other) != done(again)


def test_threads_share_what_waits(tmp_path):
    worker = Worker("test", threads=2)
    blocked = worker.submit(wait_for, tmp_path / "end")
    assert done(worker.submit(os.getpid)) == os.getpid()
    assert worker.busy_for() > 0.0
    (tmp_path / "end").touch()
    done(blocked)
    worker.shutdown()
    assert not worker.is_busy


def test_valves_take_turns():
    """Each has one identification in the queue: one that asks again is behind the others."""
    begin, order, done = threading.Event(), [], threading.Event()
    worker = Worker("identify")

    def identify(valve):
        begin.wait(PATIENCE)
        order.append(valve)

    def ask_again(future):
        future.result()
        if len(order) < 6:
            worker.submit(identify, "storm").add_done_callback(ask_again)
        else:
            done.set()

    worker.submit(identify, "storm").add_done_callback(ask_again)
    for valve in ("b", "c"):
        worker.submit(identify, valve)
    begin.set()
    assert done.wait(PATIENCE)
    worker.shutdown()
    assert order == ["storm", "b", "c", "storm", "storm", "storm"]
