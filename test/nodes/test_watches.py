# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a node watches and keeps, each watch without a graph; and the queue of its history."""

import asyncio
import math
import sqlite3
import threading
import time
import tracemalloc
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from histories import VALVE
from processes import PATIENCE, wait_until
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from service import SECOND, START, made_moves
from service import VALVE as BUILT

from valve_friction_ros.evidence import Move
from valve_friction_ros.health import FrictionMonitor, MonitorSettings
from valve_friction_ros.history import HistoryError, HistoryFile, KeptValve, read_moves
from valve_friction_ros.identification import IdentificationSettings, RefusalError
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.nodes import dashboard
from valve_friction_ros.nodes.dashboard import WatchedSignals
from valve_friction_ros.nodes.identifier import evidence_watch, response_watch, workers
from valve_friction_ros.nodes.identifier.evidence_watch import MoveLedger
from valve_friction_ros.nodes.identifier.history_writer import WaitingChanges
from valve_friction_ros.nodes.identifier.node import Identifier
from valve_friction_ros.nodes.identifier.usage_watch import UsageWatch
from valve_friction_ros.nodes.identifier.workers import HistoryThread, Workers
from valve_friction_ros.nodes.plumbing import polled_subscription
from valve_friction_ros.nodes.plumbing.worker import Worker
from valve_friction_ros.records.bags.topics import StreamNames
from valve_friction_ros.streams import Arrivals, Kind


def node_of(values, now=lambda: START, log=None, is_played=False):
    """A node without a graph: its parameters, its clock and its log."""
    clock = SimpleNamespace(
        now=lambda: SimpleNamespace(nanoseconds=now()), ros_time_is_active=is_played
    )
    say = ([] if log is None else log).append
    return SimpleNamespace(
        get_clock=lambda: clock,
        get_logger=lambda: SimpleNamespace(info=say, warning=say, error=say),
        get_parameter=lambda name: SimpleNamespace(value=values[name]),
    )


@pytest.mark.parametrize(
    ("silence", "has_arrived", "cause"),
    [
        (
            5.0,
            False,
            "its publisher is silent, or it is still waiting for a node that was killed: wait up",
        ),
        (25.0, False, "its publisher is silent"),
        (5.0, True, "its publisher is silent"),
    ],
)
def test_a_publisher_that_may_wait_for_a_dead_node(monkeypatch, silence, has_arrived, cause):
    now = [100.0]
    monkeypatch.setattr(polled_subscription.time, "monotonic", lambda: now[0])
    publisher = SimpleNamespace(topic_type="sensor_msgs/msg/FluidPressure")
    node = SimpleNamespace(get_publishers_info_by_topic=lambda _: [publisher])
    watch = polled_subscription.InputWatch(node, "/fv_101/actuator_pressure", publisher.topic_type)
    if has_arrived:
        watch.arrived()
    now[0] += silence
    said = watch.problem(3.0)
    assert said.startswith(f"no data on /fv_101/actuator_pressure for {silence} s: {cause}")
    assert ("killed" in said) == ("killed" in cause)


class Node:
    """Counts its subscriptions."""

    def __init__(self):
        self.open = []


class Subscription:
    """Refuses what rclpy refuses."""

    def __init__(self, node, _kind, topic, _quality, **_):
        if " " in topic:
            raise ValueError("Invalid topic name: has a space:\n  a second line")
        self._node, self._topic = node, topic
        node.open.append(topic)

    def end(self):
        self._node.open.remove(self._topic)

    def take(self):
        return []


@pytest.fixture
def subscriptions(monkeypatch):
    monkeypatch.setattr(dashboard, "PolledSubscription", Subscription)


@pytest.mark.usefixtures("subscriptions")
@pytest.mark.parametrize("topics", [("no topic", "/stem"), ("/pressure", "no topic")])
def test_a_name_that_is_none_is_told_and_leaves_nothing_open(topics):
    node, heard = Node(), {"/v/identifier": StreamNames(*topics, "stem")}
    signals = WatchedSignals(heard.__getitem__)
    strip = signals.watch("/v/identifier")
    for _ in range(3):
        signals.step(node)
    assert node.open == []
    assert strip.note() == "'no topic' cannot be subscribed to: Invalid topic name: has a space:"
    heard["/v/identifier"] = StreamNames("/pressure", "/stem", "stem")
    signals.step(node)
    assert node.open == ["/pressure", "/stem"]
    assert strip.trouble == ""
    strip.add(0, np.array([1]), np.array([1.0]))
    signals.unwatch("/v/identifier")
    signals.step(node)
    assert node.open == []


class HeldHistory:
    """A history whose file another program holds: a diagnosis comes while a change waits."""

    path = None
    reservation = ""
    valve = KeptValve("/fv_101/identifier", "FV-101")

    def look_up(self, *_):
        return None

    def keep_soon(self, change):
        pass

    async def keep_change(self, change):
        self.waiting = change
        self.seen = self.watch.limits(), self.watch.findings()


def test_a_diagnosis_meanwhile_sees_the_new_packing():
    history = HeldHistory()
    limits = {"travel_limit": 1e-3, "reversal_limit": 0.0}
    node = node_of({"counting_dead_band": 1e-4, "air_to": "open", **limits})
    watch = UsageWatch(node, FrictionMonitor(MonitorSettings(BENCH_VALVE)), history)
    history.watch = watch
    position = np.linspace(0.0, BENCH_VALVE.travel, 64)
    stamps = START + 10 * SECOND * np.arange(position.size)
    watch.take(Arrivals(np.full(64, Kind.POSITION, np.uint8), stamps, position))
    answer = asyncio.run(watch.reset())
    assert "0.02" in answer
    ((state,), findings) = history.seen
    assert (state.used, findings) == (0.0, [])
    assert watch.findings() == []


def change(name):
    return partial(print, name)


def drained(waiting):
    names = []
    while (one := waiting.first()) is not None:
        names.append(one.args[0])
        waiting.remove(one)
    return names


def test_identifications_go_first_and_the_order_stays():
    waiting = WaitingChanges(most=4)
    waiting.add(change("baseline"))
    for k in range(5):
        waiting.add(change(f"identified {k}"), identification=True)
    waiting.add(change("renewal"))
    assert waiting.given_up == "3 identifications"
    assert drained(waiting) == ["baseline", "identified 3", "identified 4", "renewal"]


def test_without_identifications_the_oldest_goes():
    """A change waits once, and may go while it is made."""
    waiting, made = WaitingChanges(most=2), change("made")
    for one in (made, made, change(1), change(2)):
        waiting.add(one)
    assert waiting.given_up == "1 other change"
    waiting.remove(made)
    waiting.add(change("identified"), identification=True)
    assert waiting.given_up == "1 identification and 1 other change"
    waiting.forget_given_up()
    assert waiting.given_up == ""
    assert drained(waiting) == [1, 2]


class TestHistoryThread:
    """One for all valves of a process."""

    PLACE = Path("history.sqlite")

    def fail(self, thread, asked, place=PLACE, lasts=0.0):
        """Return whether a writing that fails was tried."""
        tried = []

        def locked():
            tried.append(time.sleep(lasts))
            raise HistoryError("locked")

        with pytest.raises(HistoryError, match="locked"), thread.writing(place, asked):
            locked()
        return bool(tried)

    def test_a_locked_file_is_waited_for_once(self, monkeypatch):
        monkeypatch.setattr(workers, "_LONG", 0.01)
        thread, asked = HistoryThread(), time.monotonic()
        assert self.fail(thread, asked, lasts=0.02)
        assert not self.fail(thread, asked)
        assert self.fail(thread, asked, place=Path("another.sqlite"))
        with thread.writing(self.PLACE, time.monotonic()):
            pass  # what is asked for later is tried
        assert self.fail(thread, time.monotonic())

    def test_what_fails_at_once_holds_up_nothing(self):
        thread, asked = HistoryThread(), time.monotonic()
        assert self.fail(thread, asked)
        with thread.writing(self.PLACE, asked):
            pass


MOST = 2_000_000
"""Bytes; 450 polls that are kept for ever take four times as many."""


class CommandBench:
    """A watch without a graph; `unit` and `travel` are its parameters."""

    def __init__(self, monkeypatch, unit="m", travel=0.02):
        values = {"command_unit": unit, "input_timeout": 3.0}
        values |= {"deviation_limit": 0.0, "dead_time_limit": 0.0, "t86_limit": 0.0}
        self.queue, self.now = [], 0.0
        polled = SimpleNamespace(
            take=self._taken,
            follow_publishers=lambda: None,
            topic="stem_command",
            silence=lambda: 0.0,
        )
        monkeypatch.setattr(response_watch, "PolledSubscription", lambda *_, **__: polled)
        monkeypatch.setattr(response_watch, "monotonic", lambda: self.now, raising=False)
        settings = SimpleNamespace(valve=SimpleNamespace(travel=travel))
        friction = SimpleNamespace(estimate=None, settings=settings)
        history = SimpleNamespace(look_up=lambda *_: None, valve=None, keep_soon=lambda *_: None)
        self.watch = response_watch.ResponseWatch(node_of(values), friction, history)

    def _taken(self):
        taken, self.queue = self.queue, []
        return taken

    def command(self, value, stamp):
        message = JointState(name=["stem"], position=[value])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
        self.queue.append(SimpleNamespace(message=serialize_message(message)))

    def poll(self, stamps, place=0.01):
        count = len(stamps)
        kinds = np.tile(np.array([Kind.PRESSURE, Kind.POSITION], np.uint8), count)
        values = np.tile(np.array([1e5, place]), count)
        self.watch.take(Arrivals(kinds, np.repeat(np.asarray(stamps, np.int64), 2), values))

    def serve(self, seconds, value=0.01, ahead=0):
        """Command and stem at 10 Hz."""
        for tenth in range(round(10 * seconds)):
            stamp = START + round(1e9 * self.now)
            self.command(value, stamp + ahead)
            self.poll([stamp])
            self.now += 0.1
            if tenth % 10 == 0:
                self.watch.findings()

    @property
    def problem(self):
        return self.watch.values().get("stem_command problem", "")


@pytest.mark.parametrize("stem_comes", [True, False])
def test_memory_is_bounded_where_time_stands_still(monkeypatch, stem_comes):
    bench = CommandBench(monkeypatch)
    stamps = np.zeros(500 if stem_comes else 0)
    bench.command(0.01, 0)
    command = bench.queue[:]
    bench.poll(stamps)
    tracemalloc.start()
    for _ in range(450):
        bench.queue = command * (1 if stem_comes else 50)
        bench.poll(stamps)
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert held < MOST
    assert "do not advance: fill in header.stamp" in bench.problem
    bench.serve(2.0)
    assert bench.problem == ""


@pytest.mark.parametrize(
    ("parameters", "value", "ahead", "said"),
    [
        ({}, 0.01, 3600, "s ahead of those of stem_state: synchronise the clocks"),
        ({}, 0.01, -3600, "s behind those of stem_state: synchronise the clocks"),
        ({}, 50.0, 0, "50 m is not a valid stem position: check command_unit"),
        ({}, math.nan, 0, "a command is not a number"),
        ({"travel": math.inf}, 0.01, 0, "the travel of the valve is unknown: set travel"),
        ({"travel": math.inf, "unit": "%"}, 50.0, 0, "the travel of the valve is unknown"),
    ],
)
def test_commands_that_cannot_be_used(monkeypatch, parameters, value, ahead, said):
    bench = CommandBench(monkeypatch, **parameters)
    bench.serve(30.0, value, ahead * SECOND)
    assert said in bench.problem
    assert bench.watch.findings() == []
    bench.serve(35.0, value, ahead * SECOND)
    (finding,) = bench.watch.findings()
    assert (finding.level, finding.status_signal.value) == (1, "C")
    assert finding.message.startswith("no command on stem_command can be used: ")
    assert said in finding.message
    if not parameters:
        bench.serve(3.0)
        assert bench.problem == ""
        assert bench.watch.findings() == []


def test_commands_of_which_some_can_be_used(monkeypatch):
    bench = CommandBench(monkeypatch)
    for _ in range(70):
        bench.serve(0.5)
        bench.serve(0.5, 50.0)
    assert bench.watch.findings() == []
    assert "50 m is not a valid stem position" in bench.problem


HOUR, YEAR = 3600 * SECOND, 365 * 86_400 * SECOND
PERIOD = 12 * SECOND


def move(begin):
    return Move(begin, begin + SECOND, 1e-3, 2e-3, 500.0, 10.0, 1e-3)


class LedgerBench:
    """A ledger without a graph; each move comes a second after its end, by the true time."""

    def __init__(self, path, is_played=False):
        self.file, self.true, self.error, self.log = HistoryFile(path), START, 0, []
        now = lambda: self.true + self.error  # noqa: E731
        self.node = node_of({"history_days": 0.0}, now, self.log, is_played)
        self.history = SimpleNamespace(
            valve=VALVE,
            look_up=lambda read, *which: read(self.file, VALVE.name, *which),
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
    bench = LedgerBench(tmp_path / "history.sqlite")
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
    bench = LedgerBench(tmp_path / "history.sqlite")
    bench.serve(20)
    bench.error = -HOUR
    bench.serve(5)
    bench.error = 0
    bench.serve(10)
    assert len(bench.ledger.moves) == 30
    assert bench.ledger.left_out == 5


def test_a_stray_stamp_is_no_problem_and_an_hour_of_them_is(tmp_path):
    """Sensors that are an hour behind, and a node whose clock is right."""
    bench = LedgerBench(tmp_path / "history.sqlite")
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
    bench = LedgerBench(tmp_path / "history.sqlite", is_played=True)
    bench.serve(20)
    bench.error = -HOUR
    bench.serve(20)
    assert len(bench.ledger.moves) == 20
    assert "to play a recording" in bench.ledger.problem


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


class WatchBench(LedgerBench):
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
