"""A client of the bench: listens to its topics and calls its services."""

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from numpy.typing import NDArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64MultiArray

from valve_friction_ros.model import Recording
from valve_friction_ros.nodes.plumbing.messages import position_of, stamp_of
from valve_friction_ros.nodes.plumbing.polled_subscription import PolledSubscription
from valve_friction_ros.nodes.plumbing.qos import LATCHED, stream
from valve_friction_ros.nodes.service_request import (
    TriggerCall,
    UnansweredError,
    set_parameters_request,
)
from valve_friction_ros.streams import RecordBuffer
from valve_friction_ros.streams.record_buffer import Snapshot

__all__ = ["BenchClient", "BenchError"]

_POLL = 0.05


class BenchError(Exception):
    """The bench did not do what it should; the message says what."""


class BenchClient(Node):
    """Gathers in `buffer` what the bench in `namespace` publishes, as any third node would."""

    def __init__(self, namespace: str, buffer: RecordBuffer) -> None:
        super().__init__("demo", namespace=namespace)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)
        self._buffer = buffer
        self._identifier = f"/{namespace}/identifier"
        self._status: DiagnosticStatus | None = None
        self._sweep: Float64MultiArray | None = None
        self._first_stamp: int | None = None
        self._last_stamp = 0
        # Taken in blocks, as the nodes do: a callback a sample would take most of a processor.
        self._pressures = PolledSubscription(self, FluidPressure, "actuator_pressure", stream())
        self._stems = PolledSubscription(self, JointState, "stem_state", stream())
        self.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        self.create_subscription(
            Float64MultiArray, f"{self._identifier}/sweep", self._on_sweep, LATCHED
        )

    def _take(self) -> None:
        for taken in self._pressures.take():
            self._on_pressure(taken.message)
        for taken in self._stems.take():
            self._on_stem(taken.message)

    def _on_pressure(self, message: FluidPressure) -> None:
        self._buffer.add_pressure(stamp_of(message.header.stamp), message.fluid_pressure)

    def _on_stem(self, message: JointState) -> None:
        stamp = stamp_of(message.header.stamp)
        self._buffer.add_position(stamp, position_of(message, ""))
        self._first_stamp = stamp if self._first_stamp is None else self._first_stamp
        self._last_stamp = stamp

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == f"{self._identifier}: friction":
                self._status = status

    def _on_sweep(self, message: Float64MultiArray) -> None:
        self._sweep = message

    @property
    def recorded(self) -> float:
        """Length of the stem signal since `begin_record`, s."""
        return 0.0 if self._first_stamp is None else (self._last_stamp - self._first_stamp) / 1e9

    @property
    def level(self) -> int | None:
        """Level of the latest diagnostic."""
        return None if self._status is None else self._status.level[0]

    @property
    def diagnostic_message(self) -> str:
        """Text of the latest diagnostic."""
        return "" if self._status is None else self._status.message

    @property
    def diagnostic_values(self) -> dict[str, str]:
        """Key-value pairs of the latest diagnostic."""
        return {} if self._status is None else {v.key: v.value for v in self._status.values}

    @property
    def identifier_hears(self) -> bool:
        """Whether the latest diagnostic counts samples of both signals."""
        shown = self.diagnostic_values
        return all(
            int(shown.get(f"buffered_{signal}", "0")) > 0 for signal in ("pressures", "positions")
        )

    def begin_record(self) -> None:
        """Forget what was gathered and start anew."""
        self._buffer.clear("a new record begins")
        self._first_stamp = None
        self._sweep = None

    def snapshot(self) -> Snapshot:
        """Copy what was gathered."""
        return self._buffer.snapshot()

    def recording(self) -> Recording:
        """Return what was gathered, on a uniform grid."""
        return self.snapshot().recording()

    def wait(self, done: Callable[[], bool], timeout: float, what: str) -> None:
        """Spin until `done` is true; raises BenchError naming `what` after `timeout` seconds."""
        deadline = time.monotonic() + timeout
        while not done():
            if time.monotonic() > deadline:
                raise BenchError(f"no {what} within {timeout:g} s")
            self._executor.spin_once(timeout_sec=_POLL)
            self._take()

    def trigger(self, service: str, timeout: float = 120.0) -> str:
        """Call a Trigger service of the identifier and return its message."""
        call = TriggerCall(self, self._identifier, service, timeout, timeout)
        try:
            self.wait(call.step, 2 * timeout, f"answer of {service}")
        except UnansweredError as error:
            raise BenchError(str(error)) from None
        finally:
            call.close()
        if not call.answer.success:
            raise BenchError(f"{service}: {call.answer.message}")
        return str(call.answer.message)

    def set_parameters(self, node: str, values: Mapping[str, float], timeout: float = 10.0) -> None:
        """Set parameters of a node of the bench, all at once."""
        target = f"{self.get_namespace()}/{node}"
        asked = set_parameters_request(self, target, values)
        try:
            self.wait(asked.step, timeout, f"answer of {target}/set_parameters_atomically")
        finally:
            asked.close()
        if not asked.answer.result.successful:
            raise BenchError(f"{node} refused: {asked.answer.result.reason}")

    def sweep_columns(self, timeout: float = 5.0) -> dict[str, NDArray[np.float64]]:
        """Return the columns of the latest sweep by name."""
        self.wait(lambda: self._sweep is not None, timeout, "sweep")
        sweep: Any = self._sweep
        rows, columns = sweep.layout.dim
        table = np.array(sweep.data).reshape(rows.size, columns.size)
        return dict(zip(columns.label.split(","), table.T, strict=True))

    def close(self) -> None:
        """Stop listening."""
        self._executor.shutdown()
        self.destroy_node()
