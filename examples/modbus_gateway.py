# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A gateway from Modbus TCP: two values of a device become the inputs of a valve's identifier.

``python examples/modbus_gateway.py --ros-args -r __ns:=/fv_101 -p host:=plc ...``; Ctrl-C ends it.
It needs pymodbus (``pip install 'pymodbus>=3.16,<4'``). Copy it and adapt it to your device.
"""

import contextlib
import logging
import math
import time
from typing import Any

import rclpy
from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.time import Time
from sensor_msgs.msg import FluidPressure, JointState

LOST = (OSError, ModbusException)
"""Errors of a device that is absent or refuses a request."""
PARAMETERS = {
    "host": "localhost",
    "port": 502,
    "device": 1,  # unit number at this address
    "kind": "input",  # input registers (function 4, from 30001) or holding (3, from 40001)
    "pressure_register": 0,  # first register of the value, counted from 0: 30001 is 0
    "position_register": 2,  # within 120 of the other: one request reads both
    "format": "float32",  # of both values: int16, uint16, int32, uint32, float32 or float64
    "word_order": "big",  # little if the low word of a value comes first
    "pressure_scale": 1e5,  # Pa per unit of the device; here bar
    "position_scale": 0.0,  # m per unit of the device; for percent, travel / 100
    "position_at_zero": 0.0,  # m at device value 0; for an air-to-close valve whose device gives
    # the opening, the travel, with a negative scale
    "rate": 50.0,  # requests per second
    "longest": 0.1,  # longest time to an answer, s; a later one is dropped, as its time is unknown
}


class ModbusGateway(Node):
    """Publishes the two values of each answer, with one stamp."""

    def __init__(self) -> None:
        super().__init__("modbus_gateway")
        for name, default in PARAMETERS.items():
            self.declare_parameter(name, default)
        if not self.value("position_scale"):
            raise SystemExit("modbus_gateway: set position_scale, m in a unit of the device")
        self._format = ModbusTcpClient.DATATYPE[self.value("format").upper()]
        self._client = ModbusTcpClient(
            self.value("host"), port=self.value("port"), timeout=1.0, retries=0
        )
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
            asked = self.get_clock().now()
            pressure, position = self._read()
            answered = self.get_clock().now()
        except LOST as error:
            self._is_lost = True
            self._client.close()
            self.get_logger().warning(f"{where} is lost, tried again: {error}")
            time.sleep(1.0)
            return
        if self._is_lost:
            self._is_lost = False
            self.get_logger().info(f"ready: follows {where}")
        took = (answered - asked).nanoseconds
        has_values = math.isfinite(pressure) and math.isfinite(position)
        if has_values and took <= 1e9 * self.value("longest"):
            between = Time(nanoseconds=asked.nanoseconds + took // 2)
            self._publish(between, pressure, position)

    def _read(self) -> tuple[float, float]:
        """Read both values in one request: two requests would cause a lag between the signals."""
        client, width = self._client, self._format.value[1]
        if not client.connected and not client.connect():
            raise ConnectionError("no connection")
        places = [self.value("pressure_register"), self.value("position_register")]
        first = min(places)
        ask = client.read_input_registers
        if self.value("kind") == "holding":
            ask = client.read_holding_registers
        answer = ask(first, count=max(places) + width - first, device_id=self.value("device"))
        if answer.isError():
            raise ModbusException(str(answer))
        pressure, position = (
            client.convert_from_registers(
                answer.registers[place - first :][:width], self._format, self.value("word_order")
            )
            for place in places
        )
        return pressure, position

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
    logging.disable()  # pymodbus repeats the messages of this node
    rclpy.init()
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(ModbusGateway())
