# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The bench of the demo: its nodes as separate processes, and a client for them."""

import contextlib
import os
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import FluidPressure, JointState

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.nodes.plumbing.messages import position_of, stamp_of
from valve_friction_ros.nodes.plumbing.polled_subscription import PolledSubscription
from valve_friction_ros.nodes.plumbing.qos import stream
from valve_friction_ros.nodes.plumbing.rclpy_private import PROFILES
from valve_friction_ros.nodes.service_call import Caller
from valve_friction_ros.streams import RecordBuffer
from valve_friction_ros.wording import Code, said

ANSWER_TIMEOUT = 120.0


class BenchClient(Caller):
    """Collects in `buffer` the samples of the bench in `namespace`, as any other node could."""

    def __init__(
        self, node: Node, executor: Executor, namespace: str, buffer: RecordBuffer
    ) -> None:
        super().__init__(node, executor, lambda: True)
        self._buffer = buffer
        self._identifier = f"/{namespace}/identifier"
        self._first_stamp: int | None = None
        self._last_stamp = 0
        self.status: DiagnosticStatus | None = None
        # Taken in blocks, as in the nodes: a callback per sample would take most of a core.
        self._pressures = PolledSubscription(node, FluidPressure, "actuator_pressure", stream())
        self._stems = PolledSubscription(node, JointState, "stem_state", stream())
        node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)

    def _take(self) -> None:
        """Take all samples that have arrived."""
        has_more = True
        while has_more:
            for taken in self._pressures.take():
                message = taken.message
                self._buffer.add_pressure(stamp_of(message.header.stamp), message.fluid_pressure)
            for taken in self._stems.take():
                self._last_stamp = stamp_of(taken.message.header.stamp)
                self._buffer.add_position(self._last_stamp, position_of(taken.message, ""))
                if self._first_stamp is None:
                    self._first_stamp = self._last_stamp
            has_more = self._pressures.has_more or self._stems.has_more

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == f"{self._identifier}: friction":
                self.status = status

    @property
    def recorded(self) -> float:
        """Length of the stem signal since `begin_record`, s."""
        return 0.0 if self._first_stamp is None else (self._last_stamp - self._first_stamp) / 1e9

    @property
    def diagnostic_values(self) -> dict[str, str]:
        """Key-value pairs of the latest diagnostic."""
        return {} if self.status is None else {v.key: v.value for v in self.status.values}

    def begin_record(self) -> None:
        """Discard all samples and start a new record."""
        self._take()
        self._buffer.clear(said(Code.CLEARED_AS_RECORD_BEGINS))
        self._first_stamp = None

    def recording(self) -> Recording:
        """Return the collected samples on a uniform grid."""
        return self._buffer.snapshot().recording()

    def wait(self, done: Callable[[], bool], timeout: float, what: str) -> None:
        """Spin until `done` is true; raises RefusalError, which names `what`, after `timeout` s."""

        def is_done() -> bool:
            self._take()
            return done()

        if not self._wait(is_done, timeout):
            raise RefusalError(f"no {what} within {timeout:g} s")

    def trigger(self, service: str) -> str:
        """Call a service of the identifier and return its message; raises RefusalError."""
        answer = self.call(self._identifier, service, ANSWER_TIMEOUT)
        if answer is None or not answer.success:
            raise RefusalError(f"{service}: {answer.message if answer else 'no answer'}")
        return answer.message


@contextlib.contextmanager
def bench_client(namespace: str, buffer: RecordBuffer) -> Iterator[BenchClient]:
    """Provide a client of the bench in `namespace`, which is a node of this process."""
    # Python handles Ctrl-C: the handler of rclpy would end the context under the client.
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("demo", namespace=namespace)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        yield BenchClient(node, executor, namespace, buffer)
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown()


_STOP_TIMEOUT = 5.0
_DOMAINS = 100
"""Largest domain: higher numbers may collide with ports that the system assigns."""
_PROFILE = Path(__file__).with_name("fast_discovery.xml")


class NodeProcess(NamedTuple):
    """One node to run: its executable and its parameters."""

    executable: str
    parameters: Mapping[str, object]


def quick_discovery() -> dict[str, str]:
    """Return environment variables for fast discovery between processes of this machine.

    Nothing leaves the machine. Variables set by the user are kept.
    """
    wanted = {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        PROFILES: str(_PROFILE),
    }
    return {name: value for name, value in wanted.items() if name not in os.environ}


@contextlib.contextmanager
def free_domain() -> Iterator[int]:
    """Provide a ROS domain that is not the user's and that no other demo on this machine uses.

    In the domain of another running bench, its topics would appear here under the same names. An
    abstract socket with the number of the domain is held as long as the domain is in use.
    """
    set_already = os.environ.get("ROS_DOMAIN_ID", "0")
    first = os.getpid() % _DOMAINS
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as claim:
        for step in range(_DOMAINS):
            number = 1 + (first + step) % _DOMAINS
            if str(number) != set_already:
                with contextlib.suppress(OSError):  # in use
                    claim.bind(f"\0valve_friction_ros/domain/{number}")
                    break
        else:
            raise RefusalError("no free ROS domain: stop another demo")
        yield number


def _command(node: NodeProcess, namespace: str) -> list[str]:
    command = [sys.executable, "-m", f"valve_friction_ros.nodes.{node.executable}"]
    command += ["--ros-args", "--log-level", "warn", "-r", f"__ns:=/{namespace}"]
    for name, value in node.parameters.items():
        command += ["-p", f"{name}:={value}"]
    return command


def _stop(processes: Sequence[subprocess.Popen[bytes]]) -> None:
    for process in processes:
        process.terminate()  # nothing happens to one that has ended
    for process in processes:
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_STOP_TIMEOUT)
        process.kill()
        process.wait()


@contextlib.contextmanager
def running_nodes(
    nodes: Sequence[NodeProcess], namespace: str
) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Run `nodes` in `namespace` as long as the context lasts, then stop them."""
    processes: list[subprocess.Popen[bytes]] = []
    try:
        # Separate sessions shield the nodes from Ctrl-C in the terminal: they are stopped here.
        processes += [
            subprocess.Popen(_command(node, namespace), start_new_session=True) for node in nodes
        ]
        yield processes
    finally:
        _stop(processes)
