# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""An observer of identifiers: their diagnostics, response times and resource use."""

import os
import time
from collections.abc import Sequence

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.client import Client
from rclpy.task import Future
from std_srvs.srv import Trigger

from benchmark.harness.processes import Process, module, parameters
from benchmark.harness.run import Participant

PROFILE = "FASTRTPS_DEFAULT_PROFILES_FILE"
_PATIENCE = 120.0
_SETTLING = 0.5
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
            self.spin(_SETTLING)
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
