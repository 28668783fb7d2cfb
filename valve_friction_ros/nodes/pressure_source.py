"""Node `pressure_source`: a bench's pressure signal on a topic."""

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from sensor_msgs.msg import FluidPressure

from valve_friction_ros.model import (
    DEFAULT_LAG,
    Excitation,
    IsaSteps,
    SampledPressure,
    SineWave,
    SquareWave,
    TriangleWave,
    converter_response,
)
from valve_friction_ros.nodes.plumbing.messages import time_message
from valve_friction_ros.nodes.plumbing.parameters import (
    ParameterSpec,
    declare_parameters,
    values_of,
)
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode
from valve_friction_ros.nodes.plumbing.qos import qos_overrides, stream
from valve_friction_ros.nodes.plumbing.running import run_node
from valve_friction_ros.records.tables.table import read_columns

__all__ = ["PARAMETERS", "PressureSource", "main"]

_PAUSE = 0.02
"""Time between two blocks of samples, s."""

_BLOCK = 50
_LONGEST = 0.5
"""Samples published together, and time, s, after which the rest waits for the next turn: a reliable
subscription that is not emptied holds its publisher up, and the node must end when it is asked."""

_SQUARE = SquareWave()

PARAMETERS = (
    ParameterSpec(
        "excitation",
        "square",
        "Signal: square, triangle, sine, isa_steps or file [-]",
        read_only=True,
    ),
    ParameterSpec("low", _SQUARE.low, "Lowest pressure of the signal [Pa]", (-1e9, 1e9), True),
    ParameterSpec("high", _SQUARE.high, "Highest pressure of the signal [Pa]", (-1e9, 1e9), True),
    ParameterSpec(
        "period",
        _SQUARE.period,
        "Period of square, triangle and sine; hold time of each isa_steps level [s]",
        (1e-3, 1e6),
        True,
    ),
    ParameterSpec(
        "file",
        "",
        "CSV file with the columns time_s and pressure_pa, for the excitation file [-]",
        read_only=True,
    ),
    ParameterSpec("file_minimum", -1e9, "Lowest pressure in the file [Pa]", (-1e9, 1e9), True),
    ParameterSpec("file_maximum", 1e9, "Highest pressure in the file [Pa]", (-1e9, 1e9), True),
    ParameterSpec(
        "file_rate", 1e12, "Largest rate of the pressure in the file [Pa/s]", (0.0, 1e12), True
    ),
    ParameterSpec("sample_rate", 1000.0, "Samples per second of signal [Hz]", (0.1, 1e5), True),
    ParameterSpec(
        "speed", 1.0, "Seconds of signal published in a second of real time [-]", (1e-3, 1e3), True
    ),
    ParameterSpec(
        "converter_lag", DEFAULT_LAG, "Time constant of the V/P converter [s]", (0.0, 1e3), True
    ),
    ParameterSpec(
        "pressure_noise",
        0.0,
        "Standard deviation of white noise on the pressure, which the stem feels too [Pa]",
        (0.0, 1e9),
        True,
    ),
    ParameterSpec(
        "time_jitter",
        0.0,
        "Largest deviation of a sample's time, either way; below half of a period [s]",
        (0.0, 1.0),
        True,
    ),
    ParameterSpec("noise_seed", 0, "Seed of the noise and the jitter [-]", (0, 2**31 - 1), True),
)


def _from_file(values: Mapping[str, Any]) -> SampledPressure:
    """Read a pressure, linear between its rows; raises ValueError where it breaks a limit."""
    path = values["file"]
    if not path:
        raise ValueError("excitation is 'file' but the parameter file is empty")
    columns = read_columns(Path(path), ("time_s", "pressure_pa"))
    signal = SampledPressure(columns["time_s"], columns["pressure_pa"])
    lowest, highest = float(signal.pressures.min()), float(signal.pressures.max())
    for name, breaks, found, unit in (
        ("file_minimum", lowest < values["file_minimum"], lowest, "Pa"),
        ("file_maximum", highest > values["file_maximum"], highest, "Pa"),
        ("file_rate", (rate := _largest_rate(signal)) > values["file_rate"], rate, "Pa/s"),
    ):
        if breaks:
            raise ValueError(
                f"{path}: {found:.6g} {unit} breaks {name} ({values[name]:.6g} {unit}): nothing is "
                "played; plan it again, or change the limit"
            )
    return signal


def _largest_rate(signal: SampledPressure) -> float:
    rates = np.abs(np.diff(signal.pressures) / np.diff(signal.times))
    return float(np.max(rates, initial=0.0))


def _excitation(values: Mapping[str, Any]) -> Excitation:
    """Build the signal; raises ValueError for an unknown kind or impossible numbers."""
    kind, low, high, period = (values[name] for name in ("excitation", "low", "high", "period"))
    if kind == "file":
        return _from_file(values)
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


class PressureSource(PolledNode):
    """Publishes the signal in blocks, each sample with its own stamp."""

    def __init__(self) -> None:
        super().__init__("pressure_source")
        declare_parameters(self, PARAMETERS)
        values = values_of(self, PARAMETERS)
        self._excitation = _excitation(values)
        self._period = 1.0 / values["sample_rate"]
        self._speed = values["speed"]
        self._lag = values["converter_lag"]
        self._noise = values["pressure_noise"]
        self._jitter = values["time_jitter"]
        if not self._jitter < self._period / 2:
            raise ValueError(
                f"time_jitter ({self._jitter:g} s) must be below half of the sampling period "
                f"({self._period:g} s): stamps would not rise"
            )
        self._random = np.random.default_rng(values["noise_seed"])
        self._sent = 0
        self._before: tuple[float, float] | None = None
        self._start: int | None = None
        self._publisher = self.create_publisher(
            FluidPressure, "actuator_pressure", stream(), qos_overriding_options=qos_overrides()
        )
        self.get_logger().info(f"ready: publishes {self._publisher.topic_name}")

    def poll(self) -> None:
        """Publish all samples whose time has come since the last block."""
        now = self.get_clock().now().nanoseconds
        if not now:  # use_sim_time, and the clock has not come yet
            return
        if self._start is None or now < self._start:
            self._start = now
            self._sent = 0
        elapsed = (now - self._start) / 1e9 * self._speed
        due = int(elapsed / self._period) + 1
        until = time.monotonic() + _LONGEST
        while self._sent < due and time.monotonic() < until:
            self._publish(min(due - self._sent, _BLOCK), self._start)

    def _publish(self, count: int, start: int) -> None:
        """Publish the next `count` samples of a signal that began at `start`, ns."""
        sample = self._sent + np.arange(count)
        pressure = self._response(self._excitation.sample(sample * self._period))
        if self._noise > 0:
            pressure = pressure + self._noise * self._random.standard_normal(count)
        times = sample * self._period
        if self._jitter > 0:
            times = times + self._random.uniform(-self._jitter, self._jitter, count)
        message = FluidPressure(variance=self._noise**2)
        message.header.frame_id = "actuator"
        for seconds, value in zip(times, pressure, strict=True):
            message.header.stamp = time_message(start + round(seconds * 1e9))
            message.fluid_pressure = float(value)
            self._publisher.publish(message)
        self._sent += count

    def _response(self, command: np.ndarray) -> np.ndarray:
        """Pass a block through the converter, continuing from the block before."""
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
    return run_node(PressureSource, arguments, _PAUSE)


if __name__ == "__main__":
    sys.exit(main())
