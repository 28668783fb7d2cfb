# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A gateway from HART-IP: two dynamic variables of a positioner become the inputs of an identifier.

``python examples/hart_ip_gateway.py --ros-args -r __ns:=/fv_101 -p host:=192.0.2.7 ...``; Ctrl-C
ends it. It needs hartip-py (``pip install hartip-py``), which is under the GPL: a program that
combines both and is distributed falls under the GPL too. Copy it and adapt it to your device.
"""

import contextlib
import math
import time
from typing import Any

import rclpy
from hartip import HARTIPClient, parse_cmd3
from hartip.exceptions import HARTError
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.time import Time
from sensor_msgs.msg import FluidPressure, JointState

LOST = (OSError, HARTError)
"""Errors of a device that is absent or refuses a request."""
MALFUNCTION = 0x80
"""Bit of the device status: its measurements may be wrong."""
PARAMETERS = {
    "host": "localhost",
    "port": 5094,
    "protocol": "udp",  # or tcp
    "address": 0,  # polling address behind the gateway or multiplexer
    "pressure_variable": "SV",  # dynamic variable: PV, SV, TV or QV
    "position_variable": "PV",
    "pressure_scale": 1e5,  # Pa per unit of the device; here bar
    "position_scale": 0.0,  # m per unit of the device; for percent, travel / 100
    "position_at_zero": 0.0,  # m at device value 0; for an air-to-close valve whose device gives
    # the opening, the travel, with a negative scale
    "rate": 2.0,  # requests per second; a HART loop answers two or three
    "longest": 1.0,  # longest time to an answer, s; a later one is dropped, as its time is unknown
}


class HartIpGateway(Node):
    """Publishes the two values of each answer to command 3, with one stamp."""

    def __init__(self) -> None:
        super().__init__("hart_ip_gateway")
        for name, default in PARAMETERS.items():
            self.declare_parameter(name, default)
        if not self.value("position_scale"):
            raise SystemExit("hart_ip_gateway: set position_scale, m in a unit of the device")
        where = self.value("host"), self.value("port"), self.value("protocol")
        self._client = HARTIPClient(*where, timeout=2 * self.value("longest"), dr_retries=3)
        self._client.default_address = self.value("address")
        self._is_lost = True
        self._pressures = self.create_publisher(FluidPressure, "actuator_pressure", 1000)
        self._stems = self.create_publisher(JointState, "stem_state", 1000)
        self.create_timer(1 / self.value("rate"), self._follow)

    def value(self, name: str) -> Any:
        """Return a parameter."""
        return self.get_parameter(name).value

    def _follow(self) -> None:
        """Send one request and publish the answer; reconnect to a lost device."""
        where = f"{self.value('host')}:{self.value('port')}"
        try:
            if self._is_lost:
                self._client.connect()
                self._client.default_unique_addr = None  # the device may have been replaced
                self._client.read_unique_id().raise_for_error()
            asked = self.get_clock().now()
            answer = self._client.read_dynamic_variables()
            answered = self.get_clock().now()
            answer.raise_for_error()
        except LOST as error:
            self._is_lost = True
            with contextlib.suppress(*LOST):
                self._client.close()
            self.get_logger().warning(f"{where} is lost, tried again: {error}")
            time.sleep(1.0)
            return
        if self._is_lost:
            self._is_lost = False
            self.get_logger().info(f"ready: follows {where}")
        found = {one.label: one.value for one in parse_cmd3(answer.payload).get("variables", ())}
        names = self.value("pressure_variable"), self.value("position_variable")
        pressure, position = (found.get(name, math.nan) for name in names)
        took = (answered - asked).nanoseconds
        has_values = math.isfinite(pressure) and math.isfinite(position)
        if answer.device_status & MALFUNCTION:
            self.get_logger().warning(
                f"{where} says that it is defective", throttle_duration_sec=60
            )
        elif has_values and took <= 1e9 * self.value("longest"):
            between = Time(nanoseconds=asked.nanoseconds + took // 2)
            self._publish(between, pressure, position)

    def _publish(self, when: Time, pressure: float, position: float) -> None:
        """Publish a sample in Pa and m."""
        message = FluidPressure(fluid_pressure=pressure * self.value("pressure_scale"))
        message.header.stamp = when.to_msg()
        self._pressures.publish(message)
        place = self.value("position_at_zero") + position * self.value("position_scale")
        stem = JointState(name=["stem"], position=[place])
        stem.header.stamp = message.header.stamp
        self._stems.publish(stem)


if __name__ == "__main__":
    rclpy.init()
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(HartIpGateway())
