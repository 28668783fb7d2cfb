# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The moves in service as a node keeps them: a wrong clock, and what combines them in a thread."""

import sqlite3
import threading
import time
from types import SimpleNamespace

import pytest
from histories import VALVE
from service import SECOND, START, made_moves
from service import VALVE as BUILT
from waiting import PATIENCE, wait_until

from valve_friction_ros.evidence import Move
from valve_friction_ros.health import FrictionMonitor, MonitorSettings
from valve_friction_ros.history import HistoryFile, read_change, read_moves, read_reference
from valve_friction_ros.identification import IdentificationSettings, RefusalError
from valve_friction_ros.nodes.identifier import evidence_watch
from valve_friction_ros.nodes.identifier.evidence_watch import MoveLedger
from valve_friction_ros.nodes.identifier.node import Identifier
from valve_friction_ros.nodes.identifier.workers import Workers
from valve_friction_ros.nodes.plumbing.worker import Worker

HOUR, YEAR = 3600 * SECOND, 365 * 86_400 * SECOND
PERIOD = 12 * SECOND


def move(begin):
    return Move(begin, begin + SECOND, 1e-3, 2e-3, 500.0, 10.0, 1e-3)


class Bench:
    """A ledger without a graph; each move comes a second after its end, by the true time."""

    def __init__(self, path, is_played=False):
        self.file, self.true, self.error, self.log = HistoryFile(path), START, 0, []
        clock = SimpleNamespace(
            now=lambda: SimpleNamespace(nanoseconds=self.true + self.error),
            ros_time_is_active=is_played,
        )
        self.node = SimpleNamespace(
            get_clock=lambda: clock,
            get_logger=lambda: SimpleNamespace(warning=self.log.append, error=self.log.append),
            get_parameter=lambda _: SimpleNamespace(value=0.0),
        )
        self.history = SimpleNamespace(
            valve=VALVE,
            moves=lambda: read_moves(self.file, VALVE.name, BUILT),
            reference=lambda: read_reference(self.file, VALVE.name, BUILT),
            change=lambda: read_change(self.file, VALVE.name, BUILT),
            keep_soon=lambda change: change(self.file),
        )
        self.file.prepare()
        self.start()

    def start(self):
        self.ledger = MoveLedger(self.node, self.history, BUILT)

    def serve(self, count):
        for _ in range(count):
            self.true += PERIOD
            begin = self.true + self.error - 2 * SECOND
            self.ledger.add([move(begin)])

    def kept(self):
        self.ledger.close()
        return read_moves(self.file, VALVE.name, BUILT)


@pytest.mark.parametrize("ahead", [HOUR, 3 * YEAR])
@pytest.mark.parametrize("restarts", [False, True])
def test_a_clock_that_is_set_back_costs_no_later_move(tmp_path, ahead, restarts):
    bench = Bench(tmp_path / "history.sqlite")
    bench.serve(10)
    before = bench.kept()
    bench.error = ahead
    bench.serve(20)
    if restarts:
        assert len(bench.kept()) == 30
        bench.start()
    bench.error = 0
    bench.serve(7)
    assert len(bench.ledger.moves) == 30
    assert "earlier than those stored" in bench.ledger.problem
    bench.serve(33)
    assert bench.ledger.problem == ""
    assert bench.ledger.left_out == 0
    found = bench.ledger.moves
    assert found[:10] == before
    assert [one.begin for one in found] == sorted(one.begin for one in found)
    assert len(found) == 50
    assert found[-1].end < bench.true
    assert bench.kept() == found
    assert any("the clock was ahead" in one and "20 stored moves" in one for one in bench.log)


def test_a_clock_that_is_not_set_yet_costs_no_kept_move(tmp_path):
    """A machine that begins hours behind, until it asks for the time."""
    bench = Bench(tmp_path / "history.sqlite")
    bench.serve(20)
    bench.error = -HOUR
    bench.serve(5)
    bench.error = 0
    bench.serve(10)
    assert len(bench.ledger.moves) == 30
    assert bench.ledger.left_out == 5


def test_a_stray_stamp_is_no_problem_and_an_hour_of_them_is(tmp_path):
    """Sensors that are an hour behind, and a node whose clock is right."""
    bench = Bench(tmp_path / "history.sqlite")
    bench.serve(20)
    bench.ledger.add([move(START - HOUR)])
    assert bench.ledger.problem == ""
    assert bench.ledger.left_out == 1
    for number in range(30):
        bench.ledger.add([move(START - HOUR + number * PERIOD)])
    assert "the latest 31 moves in service are left out" in bench.ledger.problem
    assert "check the clocks" in bench.ledger.problem
    assert len(bench.ledger.moves) == 20
    bench.serve(1)
    assert bench.ledger.problem == ""


def test_a_recording_that_is_played_costs_no_kept_move(tmp_path):
    bench = Bench(tmp_path / "history.sqlite", is_played=True)
    bench.serve(20)
    bench.error = -HOUR
    bench.serve(20)
    assert len(bench.ledger.moves) == 20
    assert "when playing a recording" in bench.ledger.problem


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
    wait_until(lambda: not bench.worker.is_busy)
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
    assert problem.startswith("the thread of moves in service has been busy for 200 s")


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
