# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Plays a planned stroke test on a valve, watches the limits, and goes back at once.

It never begins by itself: somebody calls `~/start`. It plays the file of ``plan-test --output``.
"""

import math
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rclpy.duration import Duration
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import String

from valve_friction_ros.nodes.plumbing.messages import position_of
from valve_friction_ros.nodes.plumbing.parameters import declare_parameters, values_of
from valve_friction_ros.nodes.plumbing.polled_node import PacedNode, create_service
from valve_friction_ros.nodes.plumbing.polled_subscription import PolledSubscription
from valve_friction_ros.nodes.plumbing.qos import LATCHED, stream
from valve_friction_ros.nodes.plumbing.running import run_nodes
from valve_friction_ros.nodes.pressure_source import pressure_from_file
from valve_friction_ros.planning.played_test import PlayedTest, PlayLimits, PlayPhase
from valve_friction_ros.settings import NODES
from valve_friction_ros.wording import Code, said

_PARAMETERS = NODES["stroke_player"]
_ACKNOWLEDGED = Duration(seconds=1.0)
"""Time allowed for the delivery of the last set point before the node ends."""


def _played(values: Mapping[str, Any]) -> PlayedTest:
    """Read the test and its limits; raises ValueError if a limit is missing or violated."""
    if not values["file"]:
        raise ValueError("the parameter file is empty: give the file of `plan-test --output`")
    signal = pressure_from_file(Path(values["file"]).expanduser(), values)
    margin = values["pressure_margin"]
    limits = PlayLimits(
        (values["position_minimum"], values["position_maximum"]),
        (values["file_minimum"] - margin, values["file_maximum"] + margin),
        values["silence"],
        values["longest_test"],
    )
    return PlayedTest(signal, limits)


class StrokePlayer(PacedNode):
    """Publishes set points while a test is played, and nothing before.

    Add it to any executor of rclpy. Raises ValueError for a test that violates its limits.

    Parameters
    ----------
    **named
        Arguments of `rclpy.node.Node`, such as `namespace` and `parameter_overrides`.
    """

    def __init__(self, **named: Any) -> None:
        super().__init__("stroke_player", **named)
        with self.removed_if_refused():
            declare_parameters(self, _PARAMETERS)
            values = values_of(self, _PARAMETERS)
            self._test = _played(values)
        self._period, self._joint = 1.0 / values["sample_rate"], values["joint"]
        self._told: tuple[PlayPhase, str] | None = None
        self._lock = threading.Lock()  # services and steps run in different threads
        self._publisher = self.create_publisher(FluidPressure, "pressure_set_point", stream())
        self._state = self.create_publisher(String, "~/state", LATCHED)
        self._pressures = PolledSubscription(self, FluidPressure, "actuator_pressure", stream())
        self._stems = PolledSubscription(self, JointState, "stem_state", stream())
        create_service(self, "~/start", self._start, "not started")
        create_service(self, "~/stop", self._stop)

    def close(self) -> None:
        """Return to the start of a running test, and wait for the delivery of this set point."""
        super().close()
        with self._lock:
            if self._test.phase is PlayPhase.PLAYING:
                self._test.abort(said(Code.PLAYER_SHUT_DOWN))
                self._set(self._test.home)
                self._publisher.wait_for_all_acked(_ACKNOWLEDGED)
                self._tell()

    async def _start(self) -> str:
        with self._lock:
            self._listen()
            self._test.start(time.monotonic())
            self._tell()
            return str(self._test)

    async def _stop(self) -> str:
        with self._lock:
            self._test.abort(said(Code.PLAYER_STOPPED))
        self.step()
        return str(self._test)

    def _listen(self) -> None:
        now = time.monotonic()
        for taken in self._pressures.take():
            self._test.heard_pressure(taken.message.fluid_pressure, now)
        for taken in self._stems.take():
            place = position_of(taken.message, self._joint)
            self._test.heard_stem(math.nan if place is None else place, now)

    def step(self) -> float:
        """Publish the set point that is due; return the time of the next step."""
        begun = time.monotonic()
        with self._lock:
            self._listen()
            pressure = self._test.step(begun)
            if pressure is not None:
                self._set(pressure)
            self._tell()
        return begun + self._period

    def _set(self, pressure: float) -> None:
        message = FluidPressure(fluid_pressure=pressure)
        message.header.stamp = self.get_clock().now().to_msg()
        self._publisher.publish(message)

    def _tell(self) -> None:
        """Log and publish the state of the test if it has changed."""
        now = self._test.phase, str(self._test)
        if now == self._told:
            return
        self._told = now
        self._state.publish(String(data=now[1]))
        if now[0] is PlayPhase.BACK:
            self.get_logger().error(now[1])
        else:
            self.get_logger().info(now[1])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run_nodes(lambda: [StrokePlayer()], arguments)


if __name__ == "__main__":
    sys.exit(main())
