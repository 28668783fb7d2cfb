# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Nodes as processes, what they cost, and what they say."""

import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.client import Client
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future
from std_srvs.srv import Trigger

from benchmark.process_usage import (
    processor_seconds,
    proportional_megabytes,
    resident_megabytes,
)

__all__ = ["DOMAIN", "Observer", "Process"]

DOMAIN = 77
_PATIENCE = 120.0
_SETTLING = 0.5
"""Time, s, after which a service that was found has met its client, too."""
_SILENCE = 5.0
"""Time without new samples after which no more are expected, s."""
_DEMO = Path(__file__).resolve().parents[2] / "valve_friction_ros" / "commands" / "demo"
_PROFILE = _DEMO / "fast_discovery.xml"


class Process:
    """A Python module running in the benchmark's domain.

    Parameters
    ----------
    module : str
        Its name.
    arguments : sequence of str
        Its arguments.
    own_profile : bool
        Whether it brings a profile of Fast DDS itself, in place of that for a quick discovery.
    """

    def __init__(
        self, module: str, arguments: Sequence[str] = (), own_profile: bool = False
    ) -> None:
        profile = {} if own_profile else {"FASTRTPS_DEFAULT_PROFILES_FILE": str(_PROFILE)}
        inherited = dict(os.environ)
        inherited.pop("FASTRTPS_DEFAULT_PROFILES_FILE", None)
        self.begin = time.time()
        self._process = subprocess.Popen(
            [sys.executable, "-m", module, *arguments],
            env=inherited
            | profile
            | {"ROS_DOMAIN_ID": str(DOMAIN), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def __enter__(self) -> "Process":
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the process; one that does not end is killed."""
        self._process.terminate()
        try:
            self._process.communicate(timeout=20)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.communicate()

    @property
    def output(self) -> IO[str]:
        """What it prints."""
        assert self._process.stdout is not None  # noqa: S101 - it was asked for
        return self._process.stdout

    def require_running(self) -> None:
        """Raise RuntimeError if the process has ended."""
        if self._process.poll() is not None:
            raise RuntimeError(f"{self._process.args} ended with {self._process.returncode}")

    def cpu(self) -> float:
        """Processor time that all its threads have used, s."""
        return processor_seconds(self._process.pid)

    def resident(self) -> float:
        """Memory in use, MB."""
        return resident_megabytes(self._process.pid)

    def proportional(self) -> float:
        """Memory in use, MB, what it shares with other processes divided among them."""
        return proportional_megabytes(self._process.pid)


class Observer:
    """Listens to the diagnostics of the identifiers, and calls them.

    Parameters
    ----------
    listens : bool
        Whether it listens; one that does not is no slower where there are hundreds of valves.
    """

    def __init__(self, listens: bool = True) -> None:
        self._context = rclpy.Context()
        rclpy.init(args=[], context=self._context, domain_id=DOMAIN)
        self._node = rclpy.create_node(
            "observer", context=self._context, enable_rosout=False, start_parameter_services=False
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self.buffered: dict[str, int] = {}
        self.first_seen: dict[str, float] = {}
        self._clients: dict[str, Client] = {}
        if listens:
            kind, topic = DiagnosticArray, "/diagnostics"
            self._node.create_subscription(kind, topic, self._on_diagnostics, 1000)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            valve = status.hardware_id
            self.first_seen.setdefault(valve, time.time())
            values = {entry.key: entry.value for entry in status.values}
            if "buffered_samples" in values:  # of a valve whose process keeps up
                self.buffered[valve] = int(values["buffered_samples"])

    def spin(self, seconds: float) -> None:
        """Listen for a while."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)

    def wait_for(self, valves: Sequence[str], process: Process, buffered: int = 0) -> bool:
        """Listen until all valves hold `buffered` samples, or no more come; return whether all do.

        They are patiently waited for until the first diagnostics and the first samples.
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
        """Ask a valve's identifier until it answers; return the time of its answer, s."""
        client = self._node.create_client(Trigger, f"/{valve}/identifier/clear")
        end = time.monotonic() + _PATIENCE
        while time.monotonic() < end:
            # A node that has not met its client yet answers it in vain, so it is asked again.
            if client.service_is_ready():
                future = client.call_async(Trigger.Request())
                self._executor.spin_until_future_complete(future, 0.3)
                if future.done():
                    return time.time()
            self.spin(0.02)
        raise TimeoutError(f"/{valve}/identifier does not answer")

    def meet(self, valve: str, service: str) -> Client:
        """Find a service of a valve, so that a call of it takes no longer than its answer."""
        name = f"/{valve}/identifier/{service}"
        if name not in self._clients:
            self._clients[name] = self._node.create_client(Trigger, name)
            self._clients[name].wait_for_service(_PATIENCE)
            self.spin(_SETTLING)
        return self._clients[name]

    def ask(self, valve: str, service: str) -> Future:
        """Call a service of a valve; return what becomes its answer."""
        return self.meet(valve, service).call_async(Trigger.Request())

    def wait(self, future: Future) -> None:
        """Listen until an answer has come."""
        self._executor.spin_until_future_complete(future, _PATIENCE)

    def identify(self, valve: str) -> tuple[bool, str]:
        """Call the identification of a valve; return whether it succeeded, and its message."""
        future = self.ask(valve, "identify")
        self.wait(future)
        response = future.result()
        return (False, "no answer") if response is None else (response.success, response.message)

    def close(self) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()


@contextlib.contextmanager
def observer(listens: bool = True) -> Iterator[Observer]:
    """Provide an observer that has just come and knows nothing."""
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(_PROFILE)
    made = Observer(listens)
    try:
        yield made
    finally:
        made.close()
