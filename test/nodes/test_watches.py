# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a node watches besides its samples, each watch without a graph."""

import asyncio
import math
import time
import tracemalloc
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from valve_friction_ros.dashboard.live_state import Sources
from valve_friction_ros.health import FrictionMonitor, MonitorSettings
from valve_friction_ros.history import HistoryError, KeptValve
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.nodes import dashboard
from valve_friction_ros.nodes.dashboard import WatchedSignals
from valve_friction_ros.nodes.identifier import response_watch, workers
from valve_friction_ros.nodes.identifier.history_writer import WaitingChanges
from valve_friction_ros.nodes.identifier.usage_watch import UsageWatch
from valve_friction_ros.nodes.identifier.workers import HistoryThread
from valve_friction_ros.nodes.plumbing import polled_subscription
from valve_friction_ros.streams import Arrivals, Kind


@pytest.mark.parametrize(
    ("silence", "has_arrived", "cause"),
    [
        (
            5.0,
            False,
            "its publisher is silent, or it is still waiting for a node that was killed (up",
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
    node, heard = Node(), {"/v/identifier": Sources(*topics, "stem")}
    signals = WatchedSignals(heard.__getitem__)
    strip = signals.watch("/v/identifier")
    for _ in range(3):
        signals.step(node)
    assert node.open == []
    assert strip.note() == "'no topic' cannot be subscribed to: Invalid topic name: has a space:"
    heard["/v/identifier"] = Sources("/pressure", "/stem", "stem")
    signals.step(node)
    assert node.open == ["/pressure", "/stem"]
    assert strip.trouble == ""
    strip.add(0, np.array([1]), np.array([1.0]))
    signals.unwatch("/v/identifier")
    signals.step(node)
    assert node.open == []


SECOND = 1_000_000_000
START = 1_790_000_000 * SECOND
PARAMETERS = {
    "counting_dead_band": 1e-4,
    "air_to": "open",
    "travel_limit": 1e-3,
    "reversal_limit": 0.0,
}


class HeldHistory:
    """A history whose file another program holds: a diagnosis comes while a change waits."""

    path = None
    reservation = ""
    valve = KeptValve("/fv_101/identifier", "FV-101")

    def usage(self):
        return None

    def keep_soon(self, change):
        pass

    async def keep_change(self, change):
        self.waiting = change
        self.seen = self.watch.limits(), self.watch.findings()


def watch_of(history):
    """A watch without a graph."""
    node = SimpleNamespace(
        get_parameter=lambda name: SimpleNamespace(value=PARAMETERS[name]),
        get_clock=lambda: SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=START)),
        get_logger=lambda: SimpleNamespace(info=str),
    )
    history.watch = UsageWatch(node, FrictionMonitor(MonitorSettings(BENCH_VALVE)), history)
    return history.watch


def test_a_diagnosis_meanwhile_sees_the_new_packing():
    history = HeldHistory()
    watch = watch_of(history)
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
    waiting = WaitingChanges(most=2)
    for k in range(3):
        waiting.add(change(k))
    assert waiting.given_up == "1 other change"
    waiting.add(change("identified"), identification=True)
    assert waiting.given_up == "1 identification and 1 other change"
    waiting.forget_given_up()
    assert waiting.given_up == ""
    assert drained(waiting) == [1, 2]


def test_a_change_waits_once_and_may_go_while_it_is_made():
    waiting, one = WaitingChanges(most=1), change("made")
    waiting.add(one)
    waiting.add(one)
    assert waiting.given_up == ""
    waiting.add(change("next"))
    waiting.remove(one)
    assert drained(waiting) == ["next"]


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


class Bench:
    """A watch without a graph; `unit` and `travel` are its parameters."""

    def __init__(self, monkeypatch, unit="m", travel=0.02):
        values = {"command_unit": unit, "input_timeout": 3.0}
        values |= {"deviation_limit": 0.0, "dead_time_limit": 0.0, "t86_limit": 0.0}
        self.queue, self.now = [], 0.0
        polled = SimpleNamespace(
            subscription=None,
            take=self._taken,
            follow_publishers=lambda: None,
            topic="stem_command",
            watch=SimpleNamespace(silence=lambda: 0.0),
        )
        monkeypatch.setattr(response_watch, "PolledSubscription", lambda *_, **__: polled)
        monkeypatch.setattr(response_watch, "monotonic", lambda: self.now, raising=False)
        node = SimpleNamespace(get_parameter=lambda name: SimpleNamespace(value=values[name]))
        settings = SimpleNamespace(valve=SimpleNamespace(travel=travel))
        friction = SimpleNamespace(estimate=None, settings=settings)
        history = SimpleNamespace(answers=lambda: (), valve=None, keep_soon=lambda *_: None)
        self.watch = response_watch.ResponseWatch(node, friction, history)

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
    bench = Bench(monkeypatch)
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
    bench = Bench(monkeypatch, **parameters)
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
    bench = Bench(monkeypatch)
    for _ in range(70):
        bench.serve(0.5)
        bench.serve(0.5, 50.0)
    assert bench.watch.findings() == []
    assert "50 m is not a valid stem position" in bench.problem
