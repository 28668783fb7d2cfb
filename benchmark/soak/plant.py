# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The processes of the plant, what was sent to each, and what they have told."""

import signal
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout
from std_srvs.srv import Trigger

from benchmark.churn.ledger import Ledger
from benchmark.churn.places import Node
from benchmark.churn.processes import NodeProcess
from benchmark.soak.feed import Piece
from benchmark.soak.nonsense import Nonsense, said
from valve_friction_ros.nodes.plumbing.messages import time_message
from valve_friction_ros.nodes.plumbing.qos import blocks, stream

__all__ = ["Life", "Plant", "Process"]

_CALL_LIMIT = 120.0
"""Time, s, after which a call will not be answered any more."""


@dataclass
class Life:
    """A process from its start to its end.

    Attributes
    ----------
    process : NodeProcess
        The process.
    begin : float
        When it was started, s since 1970.
    sent : Counter
        Samples sent to each of its valves; bad ones among them.
    told : dict
        Values of the latest diagnostic of each valve.
    calls : dict
        Calls under way: valve, service and begin by their future.
    unsaved : int
        Identifications answered since a valve last told that its history is written.
    """

    process: NodeProcess
    begin: float
    sent: Counter[str] = field(default_factory=Counter)
    told: dict[str, Mapping[str, str]] = field(default_factory=dict)
    messages: dict[str, str] = field(default_factory=dict)
    calls: dict[Future, tuple[str, str, float]] = field(default_factory=dict)
    unsaved: int = 0

    def accounted(self, valve: str) -> int:
        """Return the samples of a valve that were taken, or rejected with a cause."""
        values = self.told.get(valve, {})
        return sum(int(values.get(f"samples_{one}", "0")) for one in ("taken", "rejected"))

    @property
    def is_settled(self) -> bool:
        """Whether each sample that was sent is accounted for."""
        return all(self.accounted(valve) == count for valve, count in self.sent.items())


class Process:
    """One process of the plant with its valves, over all its lives.

    Parameters
    ----------
    name : str
        Name of the process.
    node : Node
        What is run.
    valves : sequence of str
        Namespaces of its valves.
    log : Path
        Of all its lives.
    """

    def __init__(self, name: str, node: Node, valves: tuple[str, ...], log: Path) -> None:
        self.name, self.valves = name, valves
        self._node, self._log = node, log
        self.is_held = False
        """Whether nothing is to be sent to it now."""
        self.life = self._begun()

    def _begun(self) -> Life:
        return Life(NodeProcess(self._node, self._log), time.time())

    def begin_again(self) -> None:
        """Start it anew."""
        self.life = self._begun()


class Plant:
    """All processes, and a node that feeds, asks and hears them.

    Parameters
    ----------
    ledger : Ledger
        What happens is noted there.
    processes : sequence of Process
        The processes.
    """

    def __init__(self, ledger: Ledger, processes: tuple[Process, ...]) -> None:
        self.ledger, self.processes = ledger, processes
        self._context = rclpy.Context()
        rclpy.init(args=[], context=self._context)
        self._node = rclpy.create_node("soak", context=self._context, enable_rosout=False)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._by_valve = {valve: one for one in processes for valve in one.valves}
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._hear, 1000)
        create = self._node.create_publisher
        self._pressures = {
            valve: create(FluidPressure, f"{valve}/actuator_pressure", stream())
            for valve in self.valves
        }
        self._stems = {
            valve: create(JointState, f"{valve}/stem_state", stream()) for valve in self.valves
        }
        self._blocks = {
            valve: create(Float64MultiArray, f"{valve}/identifier/samples", blocks())
            for valve in self.valves
        }
        self._clients = {
            (valve, service): self._node.create_client(Trigger, f"{valve}/identifier/{service}")
            for valve in self.valves
            for service in ("identify", "set_baseline", "save", "report")
        }

    @property
    def valves(self) -> tuple[str, ...]:
        """Namespaces of all valves."""
        return tuple(self._by_valve)

    def process_of(self, valve: str) -> Process:
        """Return the process that watches a valve."""
        return self._by_valve[valve]

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def turn(self, seconds: float) -> None:
        """Hear what comes within some time, and note calls that have ended."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)
        for process in self.processes:
            for call, (valve, service, begin) in list(process.life.calls.items()):
                if call.done():
                    answer: Any = call.result()
                    self._note(process, valve, service, begin, answer.success, answer.message)
                elif time.monotonic() - begin > _CALL_LIMIT:
                    self._note(process, valve, service, begin, None, "")
                else:
                    continue
                del process.life.calls[call]

    def _note(
        self,
        process: Process,
        valve: str,
        service: str,
        begin: float,
        success: bool | None,
        message: str,
    ) -> None:
        seconds = time.monotonic() - begin
        if service == "identify" and success is not None:
            process.life.unsaved += 1
        self.ledger.add(
            "call",
            valve=valve,
            service=service,
            seconds=None if success is None else seconds,
            success=success,
            message=message,
        )

    def give_up_calls(self, process: Process, why: str) -> None:
        """Note that the calls under way will not be answered, as the process has ended."""
        for valve, service, _ in process.life.calls.values():
            self.ledger.add("call", valve=valve, service=service, seconds=None, ended=why)
        process.life.calls.clear()

    def _hear(self, message: DiagnosticArray) -> None:
        stamp = message.header.stamp
        for status in message.status:
            valve = status.name.rpartition("/identifier")[0]
            process = self._by_valve.get(valve)
            if process is None or stamp.sec + stamp.nanosec / 1e9 < process.life.begin:
                continue
            life = process.life
            life.told[valve] = {one.key: one.value for one in status.values}
            life.messages[valve] = status.message
            if "the history is not written" not in status.message:
                life.unsaved = 0

    def is_ready(self, valve: str) -> bool:
        """Whether a valve is heard, and hears."""
        process = self._by_valve[valve]
        if process.is_held or valve not in process.life.told:
            return False
        if len(process.valves) > 1:
            return bool(self._blocks[valve].get_subscription_count())
        publishers = self._pressures[valve], self._stems[valve]
        return all(one.get_subscription_count() for one in publishers)

    def send(self, valve: str, piece: Piece) -> None:
        """Send rows as single samples, or as a block to a process of many valves."""
        process = self._by_valve[valve]
        rows = len(piece.stamps)
        if len(process.valves) > 1:
            columns = (piece.stamps / 1e9, piece.pressure, piece.position)
            data = [float(number) for row in zip(*columns, strict=True) for number in row]
            layout = MultiArrayLayout(
                dim=[
                    MultiArrayDimension(label="sample", size=rows, stride=3 * rows),
                    MultiArrayDimension(label="time,pressure,position", size=3, stride=3),
                ]
            )
            self._blocks[valve].publish(Float64MultiArray(layout=layout, data=data))
            process.life.sent[valve] += 2 * rows
            return
        for stamp, pressure, position in zip(*(part.tolist() for part in piece), strict=True):
            sample = FluidPressure(fluid_pressure=pressure)
            sample.header.stamp = time_message(stamp)
            self._pressures[valve].publish(sample)
            stem = JointState(name=["stem"], position=[position])
            stem.header.stamp = sample.header.stamp
            self._stems[valve].publish(stem)
        process.life.sent[valve] += 2 * rows

    def say(self, valve: str, kind: Nonsense | None) -> None:
        """Send what both sensors of a valve say now: nonsense of a kind, or the truth."""
        messages = said(kind, time.time_ns())
        for publishers, message in zip((self._pressures, self._stems), messages, strict=True):
            publishers[valve].publish(message)
        self._by_valve[valve].life.sent[valve] += len(messages)

    def ask(self, valve: str, service: str) -> None:
        """Call a service of a valve, if it is there."""
        client, process = self._clients[valve, service], self._by_valve[valve]
        if client.service_is_ready() and not process.is_held:
            call = client.call_async(Trigger.Request())
            process.life.calls[call] = valve, service, time.monotonic()

    def wait(self, met: Callable[[], bool], limit: float) -> bool:
        """Hear until something is so; return whether it came so within a limit, s."""
        end = time.monotonic() + limit
        while not met():
            if time.monotonic() > end:
                return False
            self.turn(0.05)
        return True

    def end_life(self, process: Process, how: signal.Signals) -> None:
        """Note what a life has taken, at its end."""
        life = process.life
        if how is signal.SIGKILL:
            life.process.kill()
        else:
            took = life.process.end(how)
            code = life.process.exit_code()
            self.ledger.add("ending", name=process.name, seconds=took, code=code)
        self.give_up_calls(process, how.name)
        self.note_life(process, how.name)

    def note_life(self, process: Process, how: str) -> None:
        """Write down what was sent to a life, and what it has told of it."""
        life = process.life
        for valve in process.valves:
            values = life.told.get(valve, {})
            self.ledger.add(
                "life",
                valve=valve,
                end=how,
                sent=life.sent[valve],
                taken=int(values.get("samples_taken", "0")),
                rejected=int(values.get("samples_rejected", "0")),
                causes=values.get("samples_rejected causes", ""),
                unsaved=life.unsaved,
            )
