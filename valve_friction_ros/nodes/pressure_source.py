# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Node `pressure_source`: a bench's pressure signal on a topic."""

import math
import sys
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from sensor_msgs.msg import FluidPressure

from valve_friction_ros.model.excitations import (
    Excitation,
    IsaSteps,
    SampledPressure,
    SineWave,
    SquareWave,
    TriangleWave,
)
from valve_friction_ros.model.recording import converter_response
from valve_friction_ros.nodes.plumbing.messages import time_message
from valve_friction_ros.nodes.plumbing.parameters import declare_parameters, values_of
from valve_friction_ros.nodes.plumbing.polled_node import PacedNode
from valve_friction_ros.nodes.plumbing.qos import qos_overrides, stream
from valve_friction_ros.nodes.plumbing.running import run_nodes
from valve_friction_ros.records.table import read_columns
from valve_friction_ros.settings import NODES

_TICK = 1e-3
"""Shortest time between two publications, s: at higher rates they hold several samples."""
_CATCHING_UP = 2
"""Rate at which late samples are sent, over the usual rate: a burst would overrun the queues of
subscribers."""
_WAITING = 0.02
"""Time between two checks of a clock that has not yet started, s."""
_BLOCK = 50
"""Number of samples computed together."""

_PARAMETERS = NODES["pressure_source"]


def pressure_from_file(path: Path, values: Mapping[str, Any]) -> SampledPressure:
    """Read a pressure signal from a file, linear between its rows.

    Raises ValueError if it exceeds a limit: ``file_minimum``, ``file_maximum`` or ``file_rate``.
    """
    columns = read_columns(path, ("time_s", "pressure_pa"))
    signal = SampledPressure(columns["time_s"], columns["pressure_pa"])
    lowest, highest = float(signal.pressures.min()), float(signal.pressures.max())
    rates = np.abs(np.diff(signal.pressures) / np.diff(signal.times))
    rate = float(np.max(rates, initial=0.0))
    for name, breaks, found, unit in (
        ("file_minimum", lowest < values["file_minimum"], lowest, "Pa"),
        ("file_maximum", highest > values["file_maximum"], highest, "Pa"),
        ("file_rate", rate > values["file_rate"], rate, "Pa/s"),
    ):
        if breaks:
            raise ValueError(
                f"{path}: {found:.6g} {unit} violates {name} ({values[name]:.6g} {unit}): nothing "
                "is played; plan the test again, or change the limit"
            )
    return signal


def _excitation(values: Mapping[str, Any]) -> Excitation:
    """Build the signal; raises ValueError for an unknown signal or impossible numbers."""
    kind, low, high, period = (values[name] for name in ("excitation", "low", "high", "period"))
    if kind == "file":
        if not values["file"]:
            raise ValueError("excitation is 'file' but the parameter file is empty")
        return pressure_from_file(Path(values["file"]), values)
    if kind == "isa_steps":
        return IsaSteps((low + high) / 2, high - low, hold=period)
    waves: dict[str, Callable[[float, float, float], Excitation]] = {
        "square": SquareWave,
        "triangle": TriangleWave,
        "sine": SineWave,
    }
    if kind not in waves:
        known = ", ".join([*waves, "isa_steps", "file"])
        raise ValueError(f"excitation {kind!r} is unknown: choose from {known}")
    return waves[kind](low, high, period)


def _period(values: Mapping[str, Any]) -> float:
    """Return the sampling period, s; raises ValueError if the jitter exceeds its half."""
    period, jitter = 1.0 / values["sample_rate"], values["time_jitter"]
    if not jitter < period / 2:
        raise ValueError(
            f"time_jitter ({jitter:g} s) must be below half of the sampling period "
            f"({period:g} s): time stamps would not increase"
        )
    return period


class PressureSource(PacedNode):
    """Publishes the signal, each sample at its time and with its own stamp.

    Add it to any executor of rclpy. Raises ValueError for an unknown signal or impossible numbers.

    Parameters
    ----------
    **named
        Arguments of `rclpy.node.Node`, such as `namespace` and `parameter_overrides`.
    """

    def __init__(self, **named: Any) -> None:
        super().__init__("pressure_source", **named)
        with self.removed_if_refused():
            declare_parameters(self, _PARAMETERS)
            values = values_of(self, _PARAMETERS)
            self._excitation = _excitation(values)
            self._period = _period(values)
        self._speed = values["speed"]
        self._lag = values["converter_lag"]
        self._noise = values["pressure_noise"]
        self._jitter = values["time_jitter"]
        self._tick = max(self._period / self._speed, _TICK)
        self._most = _CATCHING_UP * math.ceil(self._tick * self._speed / self._period)
        self._random = np.random.default_rng(values["noise_seed"])
        self._ready: deque[tuple[int, float]] = deque()
        self._computed = self._sent = 0
        self._before: tuple[float, float] | None = None
        self._start: int | None = None
        self._message = FluidPressure(variance=self._noise**2)
        self._message.header.frame_id = "actuator"
        self._publisher = self.create_publisher(
            FluidPressure, "actuator_pressure", stream(), qos_overriding_options=qos_overrides()
        )
        self.get_logger().info(f"ready: publishing {self._publisher.topic_name}")

    def step(self) -> float:
        """Publish the samples that are due; return the time of the next step."""
        begun, now = time.monotonic(), self.get_clock().now().nanoseconds
        if not now:  # use_sim_time, and no clock received yet
            return begun + _WAITING
        if self._start is None or now < self._start:
            self._start = now
            self._computed = self._sent = 0
            self._ready.clear()
        elapsed = (now - self._start) / 1e9
        due = int(elapsed * self._speed / self._period) + 1
        for _ in range(min(due - self._sent, self._most)):
            self._publish()
        if self._sent < due:
            return begun + self._tick
        following = self._sent * self._period / self._speed - elapsed
        return begun + min(max(following, _TICK), _WAITING)

    def _publish(self) -> None:
        if not self._ready:
            self._compute()
        nanoseconds, self._message.fluid_pressure = self._ready.popleft()
        self._message.header.stamp = time_message((self._start or 0) + nanoseconds)
        self._publisher.publish(self._message)
        self._sent += 1

    def _compute(self) -> None:
        """Compute the next block: times since the start, ns, and pressures."""
        sample = self._computed + np.arange(_BLOCK)
        pressure = self._response(self._excitation.sample(sample * self._period))
        if self._noise > 0:
            pressure = pressure + self._noise * self._random.standard_normal(_BLOCK)
        times = sample * self._period
        if self._jitter > 0:
            times = times + self._random.uniform(-self._jitter, self._jitter, _BLOCK)
        nanoseconds = np.rint(times * 1e9).astype(np.int64)
        self._ready.extend(zip(nanoseconds.tolist(), pressure.tolist(), strict=True))
        self._computed += _BLOCK

    def _response(self, command: np.ndarray) -> np.ndarray:
        """Pass a block through the converter, continuing from the previous block."""
        if self._before is None:
            pressure = converter_response(command, self._period, self._lag)
        else:
            last_command, last_pressure = self._before
            pressure = converter_response(
                np.concatenate(([last_command], command)), self._period, self._lag, last_pressure
            )[1:]
        self._before = float(command[-1]), float(pressure[-1])
        return pressure


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run_nodes(lambda: [PressureSource()], arguments)


if __name__ == "__main__":
    sys.exit(main())
