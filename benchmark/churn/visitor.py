# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Participants that come, call, listen and leave, cleanly or not; and an auditor that stays."""

import os
import random
import shutil
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from benchmark.harness.processes import node, parameters
from benchmark.harness.run import Ledger, Participant

RATE = 250
"""Sampling rate of each signal, Hz; low, since listening visitors cost more than the nodes."""

BENCH = Path(__file__).resolve().parents[2] / "config" / "bench_low.yaml"
_VALVE = "/fv_101"
AUDITED = f"{_VALVE}/identifier"
"""The identifier whose buffer nobody clears, so that all of its samples can be checked."""

_OTHERS = ("/fv_201", "/fv_202")
IDENTIFIERS = (AUDITED, *(f"{valve}/identifier" for valve in _OTHERS))
NODES = (*IDENTIFIERS, f"{_VALVE}/simulator", f"{_VALVE}/pressure_source")

STREAMS = (f"{_VALVE}/actuator_pressure", f"{_VALVE}/stem_state")

SERVICES = {"identify": 6, "set_baseline": 6, "clear": 5, "save": 2, "report": 1}
"""Services of an identifier, with the relative frequency of their calls."""


def nodes(
    folder: Path, valve: str = _VALVE, others: Sequence[str] = _OTHERS
) -> dict[str, list[str]]:
    """Return the commands that start the nodes of a plant, which writes into a folder.

    The valve streams like its bench. The others share a process and hear the same streams.
    """
    files = parameters(
        history_file=folder / "history.sqlite",
        save_folder=folder / "saved",
        report_folder=folder / "reports",
    )
    bench = ["--params-file", str(BENCH)]
    place = ["-r", f"__ns:={valve}", *bench]
    heard = [
        word
        for other in others
        for stream in ("actuator_pressure", "stem_state")
        for word in ("-r", f"{other}/{stream}:={valve}/{stream}")
    ]
    many = [*heard, *bench, *parameters(valves=f"[{','.join(others)}]")]
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
_LOOK = 25.0
"""Time between two checks of the buffer by the auditor, s: less than half of its length."""


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
    identifier = chance.choice(IDENTIFIERS)
    (name,) = chance.choices([*SERVICES], [*SERVICES.values()])
    if not (name == "clear" and identifier == AUDITED):
        visitor.call(Trigger, f"{identifier}/{name}", Trigger.Request())


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
    kinds += [(JointState, STREAMS[1]), (Float64, f"{AUDITED}/friction/coulomb_friction")]
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


def visit(ledger: Ledger, number: int, chance: random.Random) -> None:
    """Come, act several times, and leave; one in four leaves without saying goodbye."""
    visitor = Visitor(ledger, f"visitor_{number}")
    for _ in range(chance.randint(1, _MOST_ACTS)):
        (act,) = chance.choices([*_ACTS], [*_ACTS.values()])
        act(visitor, chance)
    if chance.random() < 0.25:
        os._exit(0)
    visitor.close()


def _stamps(bag: Path) -> dict[str, np.ndarray]:
    types = get_typestore(Stores.ROS2_JAZZY)
    found: dict[str, list[int]] = {topic: [] for topic in STREAMS}
    with Reader(bag) as reader:
        for connection, _, raw in reader.messages():
            stamp = types.deserialize_cdr(raw, connection.msgtype).header.stamp
            found[connection.topic].append(stamp.sec * 1_000_000_000 + stamp.nanosec)
    return {topic: np.array(stamps) for topic, stamps in found.items()}


def missing_samples(stamps: np.ndarray) -> int:
    """Return the number of samples missing between the first and last stamp, ns, of a signal."""
    return 0 if stamps.size == 0 else round(np.ptp(stamps) * RATE / 1e9) + 1 - stamps.size


def audit(ledger: Ledger, seconds: float) -> None:
    """Save the buffer of the audited identifier repeatedly, and count missing samples.

    Also log the longest silence on `/diagnostics`.
    """
    published: list[float] = []

    def note(message: DiagnosticArray) -> None:
        if any(status.name.startswith(AUDITED) for status in message.status):
            stamp = message.header.stamp
            published.append(stamp.sec + stamp.nanosec / 1e9)

    until = time.monotonic() + seconds
    with Visitor(ledger, "auditor") as visitor:
        visitor.node.create_subscription(DiagnosticArray, "/diagnostics", note, 1000)
        while time.monotonic() < until:
            visitor.spin(_LOOK)
            published.append(time.time())  # includes a silence that still lasts
            answer = visitor.call(Trigger, f"{AUDITED}/save", Trigger.Request())
            if answer is None or not answer.success:
                ledger.add("unsaved", message=getattr(answer, "message", "no answer"))
                continue
            bag = Path(answer.message)
            for topic, stamps in _stamps(bag).items():
                ledger.add(
                    "samples",
                    topic=topic,
                    first=int(stamps.min(initial=2**62)),
                    last=int(stamps.max(initial=0)),
                    count=stamps.size,
                    missing=missing_samples(stamps),
                )
            shutil.rmtree(bag)
            if len(published) > 1:
                ledger.add("diagnostics", longest=float(np.diff(published).max()))
                del published[:-1]
