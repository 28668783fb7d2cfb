# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The plant, the dashboard and one real valve, as processes of their own in a domain of theirs."""

import os
import time
from collections.abc import Callable
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.executors import SingleThreadedExecutor
from rclpy.serialization import serialize_message
from rclpy.signals import SignalHandlerOptions

from benchmark.load.kept_plant import write_history
from benchmark.load.processes import Process, node_arguments
from valve_friction_ros.nodes.service_call import caller

__all__ = ["LIVE", "Stage"]

LIVE = "/live_1/identifier"
"""The identifier of the real valve."""
_RECORD = 14.0
"""Length of its record, s: more than a period of its pressure."""
_ANSWER = 600.0


class Stage:
    """Starts the processes, and knows them.

    Parameters
    ----------
    folder : Path
        Of the history and the logs.
    valves : int
        Number of the simulated valves.
    port : int
        Where the dashboard listens.
    """

    def __init__(self, folder: Path, valves: int, port: int) -> None:
        self.folder, self.valves, self.port = folder, valves, port
        self.address = f"http://127.0.0.1:{port}"
        self.processes: list[Process] = []
        self.dashboards: list[Process] = []
        self._count = 0
        self._history = folder / "history.sqlite"
        self._template = folder / "status.cdr"

    def start(self, module: str, arguments: list[str]) -> Process:
        """Start a module of Python."""
        self._count += 1
        log = self.folder / f"{module.rpartition('.')[2]}_{self._count}.log"
        made = Process(module, arguments, log)
        self.processes.append(made)
        return made

    def _node(self, name: str, namespace: str, parameters: dict[str, object]) -> Process:
        return self.start(f"valve_friction_ros.nodes.{name}", node_arguments(namespace, parameters))

    def identifier(self, tag: str) -> Process:
        """Start the identifier of the real valve, under a tag."""
        self.live = self._node(
            "identifier",
            "/live_1",
            {"valve_tag": tag, "history_file": self._history, "window": 60.0},
        )
        return self.live

    def dashboard(self) -> Process:
        """Start the dashboard, and wait until it can be opened."""
        made = self._node("dashboard", "", {"port": self.port, "history_file": self._history})
        made.wait_for("ready: open")
        self.dashboards.append(made)
        return made

    def plant(self, rate: float, *more: str) -> Process:
        """Start the simulated valves, and wait until they publish."""
        arguments = [str(self._template), "--valves", str(self.valves), "--rate", str(rate), *more]
        made = self.start("benchmark.load.plant", arguments)
        made.wait_for("publishing")
        return made

    def prepare(self, say: Callable[[str], None]) -> None:
        """Write the history, and let a real valve say what the simulated ones will say."""
        say(f"writing the history of {self.valves} valves")
        write_history(self._history, self.valves)
        say("identifying a simulated valve by real nodes")
        self.identifier("LIVE-1")
        self._node("simulator", "/live_1", {"position_noise": 1e-5, "noise_seed": 1})
        self._node(
            "pressure_source",
            "/live_1",
            {"excitation": "sine", "sample_rate": 100.0, "pressure_noise": 20.0, "noise_seed": 2},
        )
        with caller(lambda: True) as client:
            identifier = client.find(LIVE, _ANSWER)
            time.sleep(_RECORD)
            for service in ("identify", "set_baseline"):
                answer = client.call(identifier, service, _ANSWER)
                if answer is None or not answer.success:
                    raise RuntimeError(f"{service}: {answer}")
        self._template.write_bytes(_heard())


def _heard() -> bytes:
    """Return the next status of the real valve that has a ratio, serialised."""
    found: list[DiagnosticStatus] = []

    def note(message: DiagnosticArray) -> None:
        found.extend(
            status
            for status in message.status
            if any(value.key == "friction_ratio" for value in status.values)
        )

    context = rclpy.Context()
    rclpy.init(args=[], context=context, signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("listener", context=context, enable_rosout=False)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    node.create_subscription(DiagnosticArray, "/diagnostics", note, 100)
    deadline = time.monotonic() + _ANSWER
    while not found and time.monotonic() < deadline:
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    node.destroy_node()
    context.try_shutdown()
    if not found:
        raise RuntimeError(f"{LIVE} says no ratio of its friction (pid {os.getpid()})")
    raw: bytes = serialize_message(found[-1])
    return raw
