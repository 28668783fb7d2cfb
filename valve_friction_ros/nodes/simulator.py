"""Node `simulator`: a valve with Karnopp friction on real topics."""

import sys
import time
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from sensor_msgs.msg import FluidPressure, JointState

from valve_friction_ros.model import (
    KarnoppParameters,
    StemState,
    Valve,
    advance,
    balanced_state,
    compile_kernels,
)
from valve_friction_ros.model.checks import require_non_negative
from valve_friction_ros.nodes.plumbing.messages import stamp_of
from valve_friction_ros.nodes.plumbing.parameters import (
    ParameterSpec,
    declare_parameters,
    reject_invalid,
    values_of,
)
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode
from valve_friction_ros.nodes.plumbing.polled_subscription import PolledSubscription
from valve_friction_ros.nodes.plumbing.qos import qos_overrides, stream
from valve_friction_ros.nodes.plumbing.readiness import Readiness
from valve_friction_ros.nodes.plumbing.running import run_node
from valve_friction_ros.nodes.plumbing.valve_parameters import (
    JOINT,
    KARNOPP_PARAMETERS,
    VALVE_PARAMETERS,
    karnopp_parameters_from,
    valve_from,
)
from valve_friction_ros.nodes.plumbing.worker import Worker

__all__ = ["PARAMETERS", "Simulator", "main"]

_PAUSE = 0.02
"""Time between two looks for pressures, s: as often as `pressure_source` sends some."""

_LONGEST = 0.5
"""Time, s, for which the stem follows pressures in one turn: a reliable subscription that is not
emptied holds its publisher up, and the node must end when it is asked."""

_MOST_WAITING = 20_000
"""Pressures that wait until the model is compiled; then the oldest are given up."""

_HIGHEST_PRESSURE = 1e9
"""Pressure, Pa, beyond any valve: a larger number may overflow the model."""

_NOISE_PARAMETERS = (
    ParameterSpec(
        "position_noise", 0.0, "Standard deviation of the stem sensor's noise [m]", (0.0, 1.0)
    ),
    ParameterSpec("noise_seed", 0, "Seed of the noise [-]", (0, 2**31 - 1), read_only=True),
)
_CHANGEABLE = (*VALVE_PARAMETERS, *KARNOPP_PARAMETERS, *_NOISE_PARAMETERS)
PARAMETERS = (*_CHANGEABLE, JOINT)


class _Plant(NamedTuple):
    valve: Valve
    parameters: KarnoppParameters
    position_noise: float


def _plant(values: Mapping[str, Any]) -> _Plant:
    return _Plant(
        valve_from(values),
        karnopp_parameters_from(values),
        require_non_negative("position_noise", values["position_noise"]),
    )


class Simulator(PolledNode):
    """Steps the model by the stamps of the pressure and publishes the stem at the same stamps."""

    def __init__(self) -> None:
        super().__init__("simulator")
        declare_parameters(self, PARAMETERS)
        self._plant = _plant(values_of(self, _CHANGEABLE))
        reject_invalid(self, _CHANGEABLE, _plant)
        self.add_post_set_parameters_callback(self._take_parameters)
        self._joint = self.get_parameter(JOINT.name).value or "stem"
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

    def poll(self) -> None:
        """Let the stem follow the pressures that have arrived."""
        # Taken at once: a reliable subscription that is not emptied slows its publishers down.
        self._waiting.extend(taken.message for taken in self._pressures.take())
        if not self._readiness.look():
            return
        until = time.monotonic() + _LONGEST
        while self._waiting and time.monotonic() < until:
            self._follow(self._waiting.popleft())

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
                    "stamps went back: the stem starts anew, at rest", throttle_duration_sec=5.0
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
    return run_node(Simulator, arguments, _PAUSE)


if __name__ == "__main__":
    sys.exit(main())
