# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Commands that cannot be used: bounded memory, and the reason."""

import math
import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from valve_friction_ros.nodes.identifier import response_watch
from valve_friction_ros.streams import Arrivals, Kind

SECOND = 10**9
START = 1_700_000_000 * SECOND
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
    assert "stand still: fill header.stamp" in bench.problem
    bench.serve(2.0)
    assert bench.problem == ""


@pytest.mark.parametrize(
    ("parameters", "value", "ahead", "said"),
    [
        ({}, 0.01, 3600, "s ahead of those of stem_state: synchronise the clocks"),
        ({}, 0.01, -3600, "s behind those of stem_state: synchronise the clocks"),
        ({}, 50.0, 0, "50 m is no place of the stem: check command_unit"),
        ({}, math.nan, 0, "a command holds no number"),
        ({"travel": math.inf}, 0.01, 0, "the travel of the valve is not known: set travel"),
        ({"travel": math.inf, "unit": "%"}, 50.0, 0, "the travel of the valve is not known"),
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
    assert finding.message.startswith("no command of stem_command can be used: ")
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
    assert "50 m is no place" in bench.problem
