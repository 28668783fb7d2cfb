# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""What streams cost an identifier."""

import os
import statistics
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.client import Client
from rclpy.task import Future
from std_srvs.srv import Trigger

from benchmark.harness.processes import Process, module, parameters
from benchmark.harness.rows import Row, at_most, under
from benchmark.harness.run import Participant
from benchmark.speed.offline import Settings
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.streams import RecordBuffer, rows_arrived

PROFILE = "FASTRTPS_DEFAULT_PROFILES_FILE"
_PATIENCE = 120.0
_MEETING = 0.5
"""Time, s, for a discovered service to discover its client too."""
_SILENCE = 5.0
"""Time without new samples, s, after which no more are expected."""


def identifier(name: str, valve: str, window: float) -> Process:
    """Start the identifier of a valve by its module name."""
    given = parameters(history_file="''", window=f"{window:.1f}")
    return Process(module(name, "--ros-args", "-r", f"__ns:=/{valve}", *given))


def fleet(valves: Sequence[str], window: float) -> Process:
    """Start the identifiers of several valves in one process, which has its own profile."""
    given = parameters(history_file="''", window=f"{window:.1f}", valves=f"[{','.join(valves)}]")
    others = {name: value for name, value in os.environ.items() if name != PROFILE}
    command = module("valve_friction_ros.nodes.identifiers", "--ros-args", *given)
    return Process(command, environment=others)


class Observer(Participant):
    """Listens to the diagnostics of identifiers, and calls their services.

    Without listening, hundreds of valves do not slow it down.
    """

    def __init__(self, listens: bool = True) -> None:
        super().__init__("observer", start_parameter_services=False)
        self.buffered: dict[str, int] = {}
        self.first_seen: dict[str, float] = {}
        self._clients: dict[str, Client] = {}
        if listens:
            kind, topic = DiagnosticArray, "/diagnostics"
            self.node.create_subscription(kind, topic, self._on_diagnostics, 1000)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            valve = status.hardware_id
            self.first_seen.setdefault(valve, time.monotonic())
            values = {entry.key: entry.value for entry in status.values}
            if "buffered_samples" in values:  # only if its process keeps up
                self.buffered[valve] = int(values["buffered_samples"])

    def wait_for(self, valves: Sequence[str], process: Process, buffered: int = 0) -> bool:
        """Listen until all valves hold `buffered` samples or no more arrive; return whether all do.

        The first diagnostics and the first samples may take longer.
        """
        most, end = 0, time.monotonic() + _PATIENCE
        while time.monotonic() < end:
            process.require_running()
            self.spin(0.1)
            if all(self.buffered.get(valve, -1) >= buffered for valve in valves):
                return True
            held = sum(self.buffered.values()) + len(self.buffered)
            if held > most:
                most, end = held, time.monotonic() + _SILENCE
        return False

    def wait_for_answer(self, valve: str) -> float:
        """Call a valve's identifier until it answers; return the time of the answer, s."""
        client = self.node.create_client(Trigger, f"/{valve}/identifier/clear")
        end = time.monotonic() + _PATIENCE
        while time.monotonic() < end:
            # The answer is lost if the node has not discovered its client yet, so call again.
            if client.service_is_ready() and self.answer(client.call_async(Trigger.Request()), 0.3):
                return time.monotonic()
            self.spin(0.02)
        raise TimeoutError(f"/{valve}/identifier does not answer")

    def meet(self, valve: str, service: str) -> Client:
        """Discover a service of a valve, so that a later call includes no discovery time."""
        name = f"/{valve}/identifier/{service}"
        if name not in self._clients:
            self._clients[name] = self.node.create_client(Trigger, name)
            self._clients[name].wait_for_service(_PATIENCE)
            self.spin(_MEETING)
        return self._clients[name]

    def ask(self, valve: str, service: str) -> Future:
        """Call a service of a valve; return the future of its answer."""
        return self.meet(valve, service).call_async(Trigger.Request())

    def told(self, valve: str, service: str) -> Trigger.Response | None:
        """Call a service of a valve and listen until it answers; return None without an answer."""
        return self.answer(self.ask(valve, service), _PATIENCE)

    def cost(self, process: Process, seconds: float) -> float:
        """Listen for a while; return the cores used by a process meanwhile."""
        before = process.usage()
        self.spin(seconds)
        return process.usage().cores_since(before)


_OURS = "valve_friction_ros.nodes.identifier"
_PEER = "benchmark.speed.typed_identifier"
_PEER_NAME = "typed, default executor"
_VALVE = "fv_1"
_VALVES = [f"fv_{number}" for number in range(100)]
_SETTLING = 3.0
_CHILD_ENDS = 12.0
"""Time, s, after which the child process of an identification has ended."""
_LONGEST_REPEAT = 20.0
_UNIT = "cores"


class Outcome(NamedTuple):
    """Effect of a stream on the receiving process."""

    idle: float
    busy: float
    sent: int
    arrived: int
    seconds_to_start: float
    cpu_to_start: float
    megabytes: float


def _ours(window: float) -> Process:
    return identifier(_OURS, _VALVE, window)


def _peer(window: float) -> Process:
    return identifier(_PEER, _VALVE, window)


def _source(valves: Sequence[str], rate: int, seconds: float, *options: str) -> Process:
    """Start the source of the streams for several valves."""
    stream = ("--rate", str(rate), "--seconds", str(seconds), *options)
    return Process(module("benchmark.speed.stream_source", *valves, *stream))


def fed(
    start: Callable[[float], Process],
    valves: Sequence[str],
    rate: int,
    seconds: float,
    options: Sequence[str] = (),
    meanwhile: Callable[[Observer], object] = lambda _: None,
) -> Outcome:
    """Start identifiers, stream for `seconds`, and count the samples that arrive."""
    with Observer() as listener, start(2 * seconds + 60) as process:
        if not listener.wait_for(valves, process):
            raise RuntimeError("the identifiers do not publish their diagnostics")
        started = max(listener.first_seen.values()) - process.begin
        spent = process.usage().processor
        listener.spin(_SETTLING)
        idle = listener.cost(process, 5.0)
        with _source(valves, rate, seconds, *options) as source:
            listener.wait_for(valves, process, 1)
            busy = listener.cost(process, seconds - 2 * _SETTLING)
            meanwhile(listener)
            sent = 2 * int(source.output.readline())
            listener.wait_for(valves, process, sent)
        arrived = min(listener.buffered.values())
        return Outcome(idle, busy, sent, arrived, started, spent, process.usage().memory)


def _one_valve(settings: Settings) -> Iterator[Row]:
    seconds = min(settings.seconds, _LONGEST_REPEAT)
    found: dict[Callable[[float], Process], list[Outcome]] = {_ours: [], _peer: []}
    for repeat in range(settings.repeats):
        for start, outcomes in found.items():
            name = start.__name__.strip("_")
            settings.say(f"1 kHz × 2 topics, {name}, {repeat + 1} of {settings.repeats}")
            outcomes.append(fed(start, [_VALVE], 1000, seconds))
    busy, idle = (
        [statistics.median(getattr(one, name) for one in some) for some in found.values()]
        for name in ("busy", "idle")
    )
    goal = "at most a fifth"
    yield Row("1 kHz × 2 topics", busy[0], _UNIT, busy[1], _PEER_NAME, goal, busy[0] <= busy[1] / 5)
    yield Row("no stream", idle[0], _UNIT, idle[1], _PEER_NAME)


def _start(settings: Settings) -> Iterator[Row]:
    walls, costs = [], []
    for repeat in range(settings.repeats):
        settings.say(f"start, {repeat + 1} of {settings.repeats}")
        with Observer() as listener, _ours(60.0) as process:
            walls.append(listener.wait_for_answer(_VALVE) - process.begin)
            costs.append(process.usage().processor)
    yield at_most("start to first answer of a service", statistics.median(walls), "s", 1.5)
    yield Row("processor time until then", statistics.median(costs), "CPU s")


def _memory_of_a_node(settings: Settings) -> Iterator[Row]:
    """Fill a window of 60 s at 1 kHz, identify it, and write reports."""
    settings.say("memory with a full window")
    reports = 20
    with Observer() as listener, _ours(60.0) as process:
        listener.wait_for([_VALVE], process)
        with _source([_VALVE], 1000, 65.0) as source:
            source.output.readline()
        listener.wait_for([_VALVE], process, 120_000)
        for when, service, times in (
            ("with a full window of 60 s at 1 kHz", "identify", 0),
            ("after an identification", "identify", 1),
            (f"after {reports} reports", "report", reports),
        ):
            for _ in range(times):
                answer = listener.told(_VALVE, service)
                if answer is None or not answer.success:
                    raise RuntimeError(f"{service}: {answer}")
            listener.spin(_CHILD_ENDS)
            size, share = process.usage().memory, process.proportional()
            yield at_most(f"memory {when}", size, "MB", 150, share, "PSS")


def _share(outcome: Outcome) -> float:
    return 100 * outcome.arrived / outcome.sent


def _ten_kilohertz(settings: Settings) -> Iterator[Row]:
    settings.say(f"10 kHz × 2 topics for {settings.seconds:g} s")
    ours = fed(_ours, [_VALVE], 10_000, settings.seconds)
    settings.say("10 kHz × 2 topics, typed")
    seconds = min(settings.seconds, _LONGEST_REPEAT)
    peer = fed(_peer, [_VALVE], 10_000, seconds)
    item = f"10 kHz × 2 topics for {settings.seconds:g} s"
    yield Row(item, ours.busy, _UNIT, peer.busy, f"{_PEER_NAME}, {seconds:g} s")
    goal, met = "nothing lost", ours.arrived == ours.sent
    yield Row("of that arrived", _share(ours), "%", _share(peer), _PEER_NAME, goal, met)


def _while_identifying(settings: Settings) -> Iterator[Row]:
    settings.say("identifications during a stream")
    seconds = min(settings.seconds, _LONGEST_REPEAT)
    answers: list[bool] = []

    def identify(listener: Observer) -> None:
        while len(answers) < 3:
            answer = listener.told(_VALVE, "identify")
            answers.append(answer is not None and answer.success)

    ours = fed(_ours, [_VALVE], 1000, 2 * seconds, meanwhile=identify)
    goal, met = "nothing lost", ours.arrived == ours.sent and all(answers)
    yield Row("arrived during three identifications", _share(ours), "%", None, "", goal, met)


def _many_valves(settings: Settings) -> Iterator[Row]:
    settings.say("10 valves in one process, 1 kHz × 2 topics each")
    seconds = min(settings.seconds, _LONGEST_REPEAT)
    ten = _VALVES[:10]
    topics = fed(partial(fleet, ten), ten, 1000, seconds)
    yield Row("10 valves in one process, 1 kHz × 2 topics", topics.busy, _UNIT)
    yield Row("of that arrived at the valve with the least", _share(topics), "%")
    settings.say("100 valves, blocks of 100 samples")
    blocks = fed(partial(fleet, _VALVES), _VALVES, 1000, settings.seconds, ["--blocks"])
    goal, met = "at most 0.25, none lost", blocks.busy <= 0.25 and blocks.arrived == blocks.sent
    yield Row("100 valves, blocks of 100 at 10 Hz", blocks.busy, _UNIT, None, "", goal, met)
    yield Row("of that arrived at the valve with the least", _share(blocks), "%")
    yield at_most("memory of their process", blocks.megabytes, "MB", 400)
    yield Row("its start to the last first diagnostic", blocks.seconds_to_start, "s")


def _memory(_: Settings) -> Iterator[Row]:
    """Fill a window of ten minutes at 1 kHz twice."""
    buffer, sizes = RecordBuffer(BENCH_VALVE, 600.0), []
    for begin in range(0, 1_300_000, 100):
        seconds = (begin + np.arange(100)) / 1000
        buffer.add_arrivals(rows_arrived(np.column_stack([seconds, seconds + 1e5, seconds])))
        sizes.append(buffer.nbytes)
    full = sizes[6010:]
    plain = 2 * 600_001 * 16 / 1e6
    goal, met = "under 20 MB, constant", max(full) < 20e6 and max(full) - min(full) < 1e5
    yield Row("window of 10 min at 1 kHz", max(full) / 1e6, "MB", plain, "16 B a sample", goal, met)
    yield Row("by which that varies", (max(full) - min(full)) / 1e6, "MB")


def streams(settings: Settings) -> Iterator[Row]:
    """Stream to an identifier as a process, fed over DDS.

    Costs are processor seconds of all threads of the process per second of streaming, given as
    cores. A stream has lost nothing if the identifier's buffer holds every published sample.
    """
    parts = (
        _memory,
        _memory_of_a_node,
        _start,
        _one_valve,
        _ten_kilohertz,
        _while_identifying,
        _many_valves,
    )
    for part in parts:
        yield from part(settings)


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


def many_valves(settings: Settings) -> Iterator[Row]:
    """Start hundreds of valves in one process: start, memory, cost and answers.

    The peer of 500 valves is five times the cost of 100 valves, so a ratio below one means
    disproportionate growth.
    """
    few, many = (_found(count, settings) for count in (_FEW, _MANY))
    return _rows(few, many)
