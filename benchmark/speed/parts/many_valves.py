# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Hundreds of valves in one process: start, memory, cost and answers.

The peer of 500 valves is five times the cost of 100 valves, so a ratio below one means
disproportionate growth.
"""

import time
from collections.abc import Iterable
from typing import NamedTuple

from benchmark.harness.rows import Row, at_most, under
from benchmark.speed.measuring import Settings
from benchmark.speed.observer import Observer, fleet
from benchmark.speed.parts.streams import Outcome, fed

_FEW, _MANY = 100, 500
_RATE = 1000
_IDENTIFIED = 5


class _Found(NamedTuple):
    outcome: Outcome
    answer: float


def _found(count: int, settings: Settings) -> _Found:
    """Stream to the valves for longer than a window; call one valve while others identify."""
    settings.say(f"{count} valves, 1 kHz in blocks of 100")
    valves = [f"fv_{number}" for number in range(count)]
    answers = [0.0]

    def ask(_: Observer) -> None:
        with Observer(listens=False) as client:
            for valve in valves[:_IDENTIFIED]:
                client.meet(valve, "identify")
            client.told(valves[-1], "restore_baseline")
            working = [client.ask(valve, "identify") for valve in valves[:_IDENTIFIED]]
            while not all(one.done() for one in working):
                begin = time.monotonic()
                client.told(valves[-1], "restore_baseline")  # refused immediately
                answers.append(time.monotonic() - begin)
                client.spin(0.1)

    seconds, blocks = settings.seconds + 50, ["--blocks"]
    outcome = fed(lambda _: fleet(valves, 60.0), valves, _RATE, seconds, blocks, ask)
    return _Found(outcome, max(answers))


def _rows(few: _Found, many: _Found) -> Iterable[Row]:
    times, peer = _MANY // _FEW, f"{_MANY // _FEW} × {_FEW} valves"
    (one, _), (all_of, answer) = few, many
    cpu = all_of.cpu_to_start
    yield at_most("start to the last diagnostic", all_of.seconds_to_start, "s", 8)
    yield Row("processor time until then", cpu, "CPU s", times * one.cpu_to_start, peer)
    memory, few_of = all_of.megabytes, times * one.megabytes
    yield under("memory, windows of 60 s", memory, "MB", 1500, few_of, peer)
    busy, goal = all_of.busy, "under one core"
    yield Row("1 kHz in blocks of 100", busy, "cores", times * one.busy, peer, goal, busy < 1)
    yield Row("no stream", all_of.idle, "cores", times * one.idle, peer)
    item = "longest answer while others identify"
    yield under(item, answer, "s", 1, few.answer, f"{_FEW} valves")


def measure(settings: Settings) -> Iterable[Row]:
    """Measure a process of 100 valves and a process of 500."""
    few, many = (_found(count, settings) for count in (_FEW, _MANY))
    return _rows(few, many)
