# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Node `simulator`: a valve with Karnopp friction on real topics."""

import sys
import time
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from sensor_msgs.msg import FluidPressure, JointState

from valve_friction_ros.model.checks import require_non_negative
from valve_friction_ros.model.simulation import StemState, advance, balanced_state, compile_kernels
from valve_friction_ros.model.valve import KarnoppParameters, Valve
from valve_friction_ros.nodes.plumbing.messages import stamp_of
from valve_friction_ros.nodes.plumbing.parameters import (
    declare_parameters,
    reject_invalid,
    values_of,
    valve_from,
)
from valve_friction_ros.nodes.plumbing.polled_node import PacedNode
from valve_friction_ros.nodes.plumbing.polled_subscription import PolledSubscription
from valve_friction_ros.nodes.plumbing.qos import qos_overrides, stream
from valve_friction_ros.nodes.plumbing.running import run_nodes
from valve_friction_ros.nodes.plumbing.worker import Readiness, Worker
from valve_friction_ros.settings import KARNOPP, NODES

_TICK = 1e-3
_SELDOM = 0.02
"""Times between two checks for pressures, s: while they arrive, and when none has arrived for
`_WHILE`."""
_WHILE = 1.0
"""Time, s, without a pressure after which the checks become less frequent."""

_LONGEST = 0.5
"""Longest time of one step, s: a reliable subscription that is not emptied blocks its publisher,
and the node must end on request."""

_MOST_WAITING = 20_000
"""Largest number of pressures that wait while the model is compiled; beyond it the oldest are
dropped."""

_HIGHEST_PRESSURE = 1e9
"""Highest accepted pressure, Pa, far beyond any valve: larger numbers may overflow the model."""

_PARAMETERS = NODES["simulator"]
_CHANGEABLE = tuple(one for one in _PARAMETERS if not one.read_only)


def _plant(values: Mapping[str, Any]) -> tuple[Valve, KarnoppParameters, float]:
    """Build the valve, its model and the noise of the position."""
    valve, noise = valve_from(values), values["position_noise"]
    parameters = KarnoppParameters(**{one.name: values[one.name] for one in KARNOPP})
    return valve, parameters, require_non_negative("position_noise", noise)


class Simulator(PacedNode):
    """Advances the model to each stamp of the pressure and publishes the stem at this stamp.

    Add it to any executor of rclpy. Raises ValueError for an impossible valve.

    Parameters
    ----------
    **named
        Arguments of `rclpy.node.Node`, such as `namespace` and `parameter_overrides`.
    """

    def __init__(self, **named: Any) -> None:
        super().__init__("simulator", **named)
        with self.removed_if_refused():
            declare_parameters(self, _PARAMETERS)
            self._plant = _plant(values_of(self, _CHANGEABLE))
        reject_invalid(self, _CHANGEABLE, _plant)
        self.add_post_set_parameters_callback(self._take_parameters)
        self._joint = self.get_parameter("joint").value or "stem"
        self._random = np.random.default_rng(self.get_parameter("noise_seed").value)
        self._stamp: int | None = None
        self._pressure = 0.0
        self._state = StemState(0.0)
        self._readiness = Readiness(self, Worker("compile", compile_kernels), "the stem follows")
        self._publisher = self.create_publisher(
            JointState, "stem_state", stream(), qos_overriding_options=qos_overrides()
        )
        self._waiting: deque[FluidPressure] = deque(maxlen=_MOST_WAITING)
        self._pressures = PolledSubscription(self, FluidPressure, "actuator_pressure", stream())

    def _take_parameters(self, _: object) -> None:
        self._plant = _plant(values_of(self, _CHANGEABLE))

    def step(self) -> float:
        """Simulate the stem for the pressures received; return the time of the next step."""
        begun = time.monotonic()
        # Taken at once: a reliable subscription that is not emptied slows down its publishers.
        self._waiting.extend(taken.message for taken in self._pressures.take())
        if self._readiness.look():
            until = begun + _LONGEST
            while self._waiting and time.monotonic() < until:
                self._follow(self._waiting.popleft())
        return begun + (_TICK if begun - self.last_heard < _WHILE else _SELDOM)

    def _follow(self, message: FluidPressure) -> None:
        stamp, pressure = stamp_of(message.header.stamp), message.fluid_pressure
        valve, parameters, noise = self._plant
        if not abs(pressure) <= _HIGHEST_PRESSURE:
            self.get_logger().warning(
                f"a pressure of {pressure:g} Pa was ignored", throttle_duration_sec=5.0
            )
            return
        if self._stamp is not None and stamp == self._stamp:
            return
        if self._stamp is None or stamp < self._stamp:
            if self._stamp is not None:
                self.get_logger().warning(
                    "time stamps went backwards: the stem starts again from rest",
                    throttle_duration_sec=5.0,
                )
            self._state = balanced_state(valve, parameters, pressure)
        else:
            self._state = advance(
                self._state,
                valve,
                parameters,
                (self._pressure, pressure),
                (stamp - self._stamp) / 1e9,
            )
        self._stamp, self._pressure = stamp, pressure
        state = JointState(
            name=[self._joint],
            position=[self._state.position + noise * self._random.standard_normal()],
            velocity=[self._state.velocity],
        )
        state.header.stamp = message.header.stamp
        state.header.frame_id = message.header.frame_id
        self._publisher.publish(state)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run_nodes(lambda: [Simulator()], arguments)


if __name__ == "__main__":
    sys.exit(main())
