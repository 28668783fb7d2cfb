# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The evidence of an identifier: combined in a thread, watched, and shown."""

import os
import sqlite3
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import pytest
from service import START, made_moves
from service import VALVE as BUILT
from test_move_ledger import HOUR, Bench

from valve_friction_ros.health import FrictionMonitor, MonitorSettings
from valve_friction_ros.identification import IdentificationSettings, RefusalError
from valve_friction_ros.nodes.identifier import evidence_watch
from valve_friction_ros.nodes.identifier.node import Identifier
from valve_friction_ros.nodes.identifier.workers import Workers
from valve_friction_ros.nodes.plumbing.worker import Worker

PATIENCE = 60.0
EXACT = IdentificationSettings(timing_uncertainty=0.005)


def finished(coroutine):
    """Run a coroutine that awaits a thread, and return its result."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        try:
            coroutine.send(None)
        except StopIteration as end:
            return end.value
        time.sleep(0.01)
    raise TimeoutError


class WatchBench(Bench):
    """A watch of evidence without a graph."""

    def __init__(self, path, worker):
        self.worker = worker
        self.monitor = FrictionMonitor(MonitorSettings(valve=BUILT, identification=EXACT))
        super().__init__(path)

    def start(self):
        self.watch = evidence_watch.EvidenceWatch(
            self.node, self.monitor, self.history, self.worker
        )
        self.ledger = self.watch._ledger

    def add(self, moves):
        self.true = moves[-1].end
        self.ledger.add(moves)


@pytest.fixture
def bench(tmp_path):
    worker = Worker("evidence")
    yield WatchBench(tmp_path / "history.sqlite", worker)
    worker.shutdown()


def test_a_baseline_is_combined_in_the_thread(bench, monkeypatch):
    combine, threads = evidence_watch.evidence_of, []

    def watched(*arguments):
        threads.append(threading.current_thread().name)
        return combine(*arguments)

    monkeypatch.setattr(evidence_watch, "evidence_of", watched)
    bench.add(made_moves(2.0, lambda _: 300.0))
    assert finished(bench.watch.outdates(START))
    baseline = finished(bench.watch.as_baseline())
    assert baseline.sliding.value == pytest.approx(300.0, rel=0.02)
    assert bench.watch.evidence.moves == len(bench.ledger.moves)
    assert len(threads) == 2
    assert all(name.startswith("evidence") for name in threads)


def test_a_packing_that_is_renewed_meanwhile_has_no_baseline(bench):
    bench.add(made_moves(2.0, lambda _: 300.0))
    begun = bench.watch.as_baseline()
    begun.send(None)
    bench.watch.renew()
    with pytest.raises(RefusalError, match="0 moves up and 0 down"):
        finished(begun)
    assert bench.watch.evidence.moves == 0


def settled(bench):
    """Show the values once the thread has nothing to do."""
    deadline = time.monotonic() + PATIENCE
    while bench.worker.is_busy and time.monotonic() < deadline:
        time.sleep(0.01)
    return bench.watch.values()


def test_a_bug_in_the_thread_is_a_problem_until_it_is_gone(bench, monkeypatch):
    def bug(*_):
        raise ZeroDivisionError("a bug")

    bench.add(made_moves(2.0, lambda _: 300.0))
    with monkeypatch.context() as patched:
        patched.setattr(evidence_watch, "evidence_of", bug)
        bench.watch._combine()
        assert settled(bench)["evidence moves"] == "0"
    (failure,) = bench.watch.failures
    assert failure.startswith("internal error: ZeroDivisionError: a bug")
    assert any("Traceback" in one for one in bench.log)
    bench.watch._combine()
    assert settled(bench)["evidence moves"] == "600"
    assert bench.watch.failures == []


def test_a_thread_that_never_ends_is_overdue():
    """As its watchdog sees it."""
    idle = SimpleNamespace(busy_for=lambda: 0.0, is_preparing=False)
    stuck = SimpleNamespace(busy_for=lambda: 200.0)
    node = SimpleNamespace(
        is_configured=True,
        _workers=Workers(
            None, identify=idle, files=idle, history=idle, evidence=stuck, alerts=None, digest=None
        ),
        get_parameter=lambda _: SimpleNamespace(value=100.0),
    )
    problem = Identifier.overdue(node)
    assert problem.startswith("the thread of moves in service has not ended its work for 200 s")


def test_a_change_stays_when_the_moves_before_it_have_gone(bench):
    """Over a restart, too, and until the packing is renewed."""
    bench.add(made_moves(4.0, lambda hour: 450.0 if hour >= 2 else 300.0))
    finished(bench.watch.as_baseline())
    shown = {key: one for key, one in bench.watch.values().items() if "change" in key}
    assert float(shown["evidence change_ratio"]) == pytest.approx(1.5, rel=0.05)
    assert len(shown) == 5
    bench.ledger.close()
    connection = sqlite3.connect(bench.file.path)
    with connection:
        connection.execute("DELETE FROM move WHERE end_ns < ?", (START + 3 * HOUR,))
    connection.close()
    bench.start()
    assert bench.watch.evidence.change is None
    assert 290 < bench.watch.evidence.moves < 310
    assert shown.items() <= bench.watch.values().items()
    bench.watch.renew()
    assert not any("change" in key for key in bench.watch.values())


@pytest.mark.parametrize(("given", "used"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "3"}, "3")])
def test_matrices_are_computed_in_one_thread(given, used):
    code = (
        "import os, sys, valve_friction_ros.nodes.start; "
        "print(os.environ['OPENBLAS_NUM_THREADS'], 'numpy' in sys.modules)"
    )
    bare = {key: value for key, value in os.environ.items() if key != "OPENBLAS_NUM_THREADS"}
    answer = subprocess.run(
        [sys.executable, "-c", code], env=bare | given, capture_output=True, text=True, check=True
    )
    assert answer.stdout.split() == [used, "False"]
