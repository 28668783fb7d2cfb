# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""Streaming nodes while thousands of clients and DDS participants come and go: `make churn`."""

import argparse
import math
import os
import random
import sys
import time
import traceback
from collections import Counter
from collections.abc import Iterator, Sequence
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from benchmark.harness.processes import Process, node, parameters
from benchmark.harness.rows import Row, none, some
from benchmark.harness.run import BENCH, Events, Ledger, Participant, by_kind, endured, run_parser

RATE = 250
"""Sampling rate of each signal, Hz; low, since listening visitors cost more than the nodes."""

_VALVE = "/fv_101"
_OTHERS = ("/fv_201", "/fv_202")
IDENTIFIERS = tuple(f"{valve}/identifier" for valve in (_VALVE, *_OTHERS))
NODES = (*IDENTIFIERS, f"{_VALVE}/simulator", f"{_VALVE}/pressure_source")

STREAMS = (f"{_VALVE}/actuator_pressure", f"{_VALVE}/stem_state")

SERVICES = {"identify": 6, "set_baseline": 6, "clear": 5, "save": 2, "report": 1}
"""Services of an identifier, with the relative frequency of their calls."""


def nodes(folder: Path) -> dict[str, list[str]]:
    """Return the commands that start the nodes of a plant, which writes into a folder.

    The valve streams like its bench. The others share a process and hear the same streams.
    """
    files = parameters(
        history_file=folder / "history.sqlite",
        save_folder=folder / "saved",
        report_folder=folder / "reports",
    )
    bench = ["--params-file", str(BENCH)]
    place = ["-r", f"__ns:={_VALVE}", *bench]
    heard = [
        word
        for other in _OTHERS
        for stream in ("actuator_pressure", "stem_state")
        for word in ("-r", f"{other}/{stream}:={_VALVE}/{stream}")
    ]
    many = [*heard, *bench, *parameters(valves=f"[{','.join(_OTHERS)}]")]
    return {
        "identifier": node("identifier", *place, *files),
        "identifiers": node("identifiers", *many, *files),
        "simulator": node("simulator", *place, *parameters(position_noise=5e-6)),
        "pressure_source": node("pressure_source", *place, *parameters(sample_rate=float(RATE))),
    }


def process_of(service: str) -> str:
    """Return the name of the process in `nodes` that answers a service."""
    valve, name, _ = service.strip("/").split("/")
    return "identifiers" if f"/{valve}" in _OTHERS else name


ANSWER_LIMIT = 5.0
"""Time limit for the answer to a call, s."""
_HANG = 30.0
"""Time, s, after which a call is considered unanswered."""
_DISCOVERY = 30.0
_LONGEST_LISTENING = 2.0
_MOST_ACTS = 6
_RELIABLE = (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT)


class Visitor(Participant):
    """A participant that logs each of its calls."""

    def __init__(self, ledger: Ledger, name: str) -> None:
        self._ledger = ledger
        super().__init__(name)

    def call(self, kind: type, name: str, request: Any) -> Any:
        """Call a service and log the outcome; return the answer, or None."""
        client = self.node.create_client(kind, name)
        try:
            begin = time.monotonic()
            if not client.wait_for_service(_DISCOVERY):
                self._ledger.add("undiscovered", service=name)
                return None
            found = time.monotonic()
            answer = self.answer(client.call_async(request), _HANG)
            self._ledger.add(
                "call",
                service=name,
                discovery=found - begin,
                seconds=None if answer is None else time.monotonic() - found,
                success=getattr(answer, "success", None),
                message=getattr(answer, "message", ""),
            )
            since = time.time()
            if answer is None and self.answer(client.call_async(request), _HANG) is None:
                self._ledger.add("unanswered twice", service=name, since=since)
            return answer
        finally:
            self.node.destroy_client(client)


def _trigger(visitor: Visitor, chance: random.Random) -> None:
    (name,) = chance.choices([*SERVICES], [*SERVICES.values()])
    visitor.call(Trigger, f"{chance.choice(IDENTIFIERS)}/{name}", Trigger.Request())


def _parameters(visitor: Visitor, chance: random.Random) -> None:
    node = chance.choice(NODES)
    listed = visitor.call(ListParameters, f"{node}/list_parameters", ListParameters.Request())
    if listed is None:
        return
    names = chance.sample(listed.result.names, 3)
    visitor.call(GetParameters, f"{node}/get_parameters", GetParameters.Request(names=names))
    describe = DescribeParameters.Request(names=names)
    visitor.call(DescribeParameters, f"{node}/describe_parameters", describe)
    # Accepted by the identifiers, refused by the others.
    value = ParameterValue(
        type=ParameterType.PARAMETER_DOUBLE, double_value=chance.uniform(1.1, 1.5)
    )
    change = SetParameters.Request(parameters=[Parameter(name="warn_ratio", value=value)])
    visitor.call(SetParameters, f"{node}/set_parameters", change)


def _listen(visitor: Visitor, chance: random.Random) -> None:
    kinds = [(DiagnosticArray, "/diagnostics"), (FluidPressure, STREAMS[0])]
    kinds += [(JointState, STREAMS[1]), (Float64, f"{IDENTIFIERS[0]}/friction/coulomb_friction")]
    subscriptions = [
        visitor.node.create_subscription(
            kind,
            topic,
            lambda _: None,
            QoSProfile(depth=chance.choice((1, 100, 5000)), reliability=chance.choice(_RELIABLE)),
            raw=chance.random() < 0.5,
        )
        for kind, topic in chance.sample(kinds, chance.randint(1, len(kinds)))
    ]
    visitor.spin(chance.uniform(0.05, _LONGEST_LISTENING))
    for subscription in subscriptions:
        visitor.node.destroy_subscription(subscription)


def _look_around(visitor: Visitor, chance: random.Random) -> None:
    visitor.spin(chance.uniform(0.0, 0.5))
    for name, _ in visitor.node.get_topic_names_and_types():
        visitor.node.get_publishers_info_by_topic(name)
    visitor.node.get_service_names_and_types()
    visitor.node.get_node_names_and_namespaces()


def _publish_elsewhere(visitor: Visitor, chance: random.Random) -> None:
    publishers = [
        visitor.node.create_publisher(FluidPressure, f"/fv_{chance.randint(900, 910)}/pressure", 10)
        for _ in range(chance.randint(1, 5))
    ]
    for publisher in publishers:
        publisher.publish(FluidPressure(fluid_pressure=1e5))
    visitor.spin(chance.uniform(0.0, 0.5))
    for publisher in publishers:
        visitor.node.destroy_publisher(publisher)


_ACTS = {_trigger: 4, _parameters: 1, _listen: 2, _look_around: 1, _publish_elsewhere: 1}


def visit(ledger: Ledger, number: int, seed: int) -> None:
    """Come, act several times, and leave; one in four leaves without saying goodbye.

    An exception that ends the visit is noted.
    """
    chance = random.Random(seed)
    try:
        visitor = Visitor(ledger, f"visitor_{number}")
        for _ in range(chance.randint(1, _MOST_ACTS)):
            (act,) = chance.choices([*_ACTS], [*_ACTS.values()])
            act(visitor, chance)
        if chance.random() < 0.25:
            os._exit(0)
        visitor.close()
    except BaseException:
        ledger.add("broken", number=number, trace=traceback.format_exc())
        raise


def hung_services(events: Events, until: float = math.inf) -> list[str]:
    """Return unanswered services whose process has answered no other client meanwhile.

    Only services reported before `until`, s since 1970, are included. A single client may lose its
    answers; a hung node answers none.
    """
    answered: dict[str, float] = {}
    for one in events:
        if one["kind"] == "call" and one["seconds"] is not None:
            answered[process_of(one["service"])] = one["time"]
    return [
        one["service"]
        for one in events
        if one["kind"] == "unanswered twice"
        and one["time"] < until
        and answered.get(process_of(one["service"]), 0.0) < one["since"]
    ]


def _call_rows(calls: Events) -> Iterator[Row]:
    yield some("calls of services and parameters", len(calls))
    by_name: dict[str, list[float]] = {}
    for one in calls:
        name = one["service"].rpartition("/")[2]
        by_name.setdefault(name, []).append(one["seconds"] or np.inf)
    for name, times in sorted(by_name.items()):
        yield Row(f"  {name} ({len(times)}): longest answer", max(times), "s")
    answered = [one["seconds"] for one in calls if one["seconds"] is not None]
    if answered:
        yield Row("median answer", float(np.median(answered)), "s")
        yield Row("answer of 99 in 100", float(np.quantile(answered, 0.99)), "s")
    late = sum(time > ANSWER_LIMIT for time in answered)
    yield none(f"answered after more than {ANSWER_LIMIT:g} s", late)
    yield none("never answered", len(calls) - len(answered))


def rows(events: Events) -> Iterator[Row]:
    """Count the events, and compare them with the goals."""
    of = by_kind(events)
    ends = Counter(one["end"] for one in of["visit"])
    visits = sum(ends.values())
    yield some("participants that came and went", visits)
    yield Row("of them killed", ends["killed"])
    yield none("of these failed", visits - ends["gone"] - ends["killed"])
    yield from _call_rows(of["call"])
    yield Row("clients that were never answered, twice", len(of["unanswered twice"]))
    yield none("services not found in 30 s", len(of["undiscovered"]))
    yield none("nodes that ended themselves, frozen", len(of["ended itself"]))
    yield none("nodes that died or hung", len(of["died"]))


_PAUSE = 1.2
"""Mean time between arrivals of visitors, s."""
_KILLED = 0.3
"""Share of visitors that are killed at a random instant."""
_LONGEST_LIFE = 5.0
"""Longest time until they are killed, s."""
_VISIT_LIMIT = 120.0
"""Time, s, after which a visitor is considered hung."""


class Crowd:
    """The visitors that come and go.

    Its process must not start ROS itself, because it is forked repeatedly.
    """

    def __init__(self, ledger: Ledger, seed: int, at_once: int) -> None:
        self._ledger, self._at_once = ledger, at_once
        self._chance = random.Random(seed)
        self._visitors: dict[BaseProcess, tuple[float, bool]] = {}
        """Present visitors: end of the visit, and whether they are killed then."""
        self._count, self._next = 0, 0.0

    def turn(self) -> None:
        """Kill visitors that are due, note those that have left, and start others."""
        now = time.monotonic()
        for child, (until, is_killed) in list(self._visitors.items()):
            if child.exitcode is not None:
                end = "gone" if child.exitcode == 0 else f"status {child.exitcode}"
                self._ledger.add("visit", end=end)
            elif now > until:
                self._kill(child, "killed" if is_killed else "hung")
            else:
                continue
            del self._visitors[child]
        if len(self._visitors) < self._at_once and now > self._next:
            self._next = now + self._chance.expovariate(1 / _PAUSE)
            self._let_one_come(now)

    def _kill(self, child: BaseProcess, end: str) -> None:
        child.kill()
        child.join()
        self._ledger.add("visit", end=end)

    def _let_one_come(self, now: float) -> None:
        self._count += 1
        is_killed = self._chance.random() < _KILLED
        life = self._chance.uniform(0.0, _LONGEST_LIFE) if is_killed else _VISIT_LIMIT
        told = self._ledger, self._count, self._chance.randrange(2**63)
        child = get_context("fork").Process(target=visit, args=told)
        child.start()
        self._visitors[child] = now + life, is_killed

    def end(self, patience: float = _VISIT_LIMIT) -> None:
        """Wait until all processes are done; kill those that remain."""
        until = time.monotonic() + patience
        for child in self._visitors:
            child.join(max(0.0, until - time.monotonic()))
            if child.exitcode is None:
                self._kill(child, "hung")
        self._visitors = {}


_TURN = 0.05
_LOOK_EVERY = 10.0
_FROZEN = 1
"""Exit code of a node that has ended itself because it was frozen."""


class _Plant:
    def __init__(self, folder: Path, ledger: Ledger) -> None:
        self._folder, self._ledger = folder, ledger
        self.processes: dict[str, Process] = {}

    def start(self, name: str) -> None:
        self.processes[name] = Process(nodes(self._folder)[name], self._folder / f"{name}.log")

    def watch(self, seconds: float, crowd: Crowd) -> None:
        """Let the crowd come and go until the time is up or a node has died."""
        end = time.monotonic() + seconds
        next_look = 0.0
        while time.monotonic() < end:
            crowd.turn()
            if time.monotonic() > next_look:
                next_look = time.monotonic() + _LOOK_EVERY
                if self._have_died():
                    break
            time.sleep(_TURN)

    def _have_died(self) -> bool:
        """Note dead and hung nodes; hung nodes write their stacks to their logs.

        A node that has ended itself because it or its middleware was frozen is restarted, as launch
        and systemd do.
        """
        for service in hung_services(self._ledger.events(), time.time() - _HANG):
            hung = self.processes[process_of(service)]
            if hung.exit_code() is None:
                hung.write_stacks()
        codes = {name: process.exit_code() for name, process in self.processes.items()}
        for name, code in codes.items():
            if code == _FROZEN:
                self._ledger.add("ended itself", name=name)
                self.start(name)
            elif code is not None:
                self._ledger.add("died", name=name, code=code)
        return any(code not in (None, _FROZEN) for code in codes.values())

    def end(self) -> None:
        """End the nodes that still run."""
        for process in self.processes.values():
            if process.exit_code() is None:
                process.end()


def _live(options: argparse.Namespace, seconds: float, ledger: Ledger) -> Iterator[Row]:
    """Run the plant and the crowd, then end the plant."""
    crowd = Crowd(ledger, options.seed, options.at_once)
    plant = _Plant(options.folder, ledger)
    try:
        for name in nodes(options.folder):
            plant.start(name)
        plant.watch(seconds, crowd)
        crowd.end()
    finally:
        crowd.end(0.0)
        plant.end()
    return rows(ledger.events())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the churn; return 1 if a goal is missed."""
    parser = run_parser("churn", __doc__)
    parser.add_argument("--at-once", type=int, default=4, help="visitors at a time (%(default)s)")
    return endured("{} of churn", parser, arguments, _live)


if __name__ == "__main__":
    sys.exit(main())
