# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A gateway from OPC UA: two variables of a server become the inputs of a valve's identifier.

``python examples/opc_ua_gateway.py --ros-args -r __ns:=/fv_101 -p url:=opc.tcp://plc:4840/ ...``;
Ctrl-C ends it. It needs asyncua (``pip install asyncua``). Copy it and adapt it to your server.
"""

import asyncio
import contextlib
from datetime import datetime, timezone
from typing import Any

import rclpy
from asyncua import Client, ua
from builtin_interfaces.msg import Time
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import FluidPressure, JointState

LOST = (OSError, asyncio.TimeoutError, ua.UaError)
"""Errors of a server that is absent or shuts down."""
PARAMETERS = {
    "url": "opc.tcp://localhost:4840/",
    "pressure_node": "ns=2;s=FV-101.pressure",
    "position_node": "ns=2;s=FV-101.position",
    "pressure_scale": 1e5,  # Pa per unit of the server; here bar
    "position_scale": 0.0,  # m per unit of the server; for percent, travel / 100
    "position_at_zero": 0.0,  # m at server value 0; for an air-to-close valve whose server gives
    # the opening, the travel, with a negative scale
    "sampling": 20.0,  # requested sampling interval, ms
}


class OpcUaGateway(Node):
    """Publishes each sample of the two variables with its source timestamp."""

    def __init__(self) -> None:
        super().__init__("opc_ua_gateway")
        for name, default in PARAMETERS.items():
            self.declare_parameter(name, default)
        if not self.value("position_scale"):
            raise SystemExit("opc_ua_gateway: set position_scale, m in a unit of the server")
        self._pressures = self.create_publisher(FluidPressure, "actuator_pressure", 1000)
        self._stems = self.create_publisher(JointState, "stem_state", 1000)

    def value(self, name: str) -> Any:
        """Return a parameter."""
        return self.get_parameter(name).value

    def datachange_notification(self, node: Any, value: float, data: Any) -> None:
        """Publish a sample, called by asyncua; skip a bad sample or one without a timestamp."""
        given = data.monitored_item.Value
        stamp = _time(given.SourceTimestamp)
        if stamp is None or not given.StatusCode.is_good():
            return
        if node.nodeid.to_string() == self.value("pressure_node"):
            pressure = FluidPressure(fluid_pressure=value * self.value("pressure_scale"))
            pressure.header.stamp = stamp
            self._pressures.publish(pressure)
        else:
            place = self.value("position_at_zero") + value * self.value("position_scale")
            stem = JointState(name=["stem"], position=[place])
            stem.header.stamp = stamp
            self._stems.publish(stem)

    def _request(self, node: Any, handle: int) -> ua.MonitoredItemCreateRequest:
        """Request every sample: by default a server reports only changes of the value."""
        always = ua.DataChangeFilter(Trigger=ua.DataChangeTrigger.StatusValueTimestamp)
        return ua.MonitoredItemCreateRequest(
            ItemToMonitor=ua.ReadValueId(NodeId=node.nodeid, AttributeId=ua.AttributeIds.Value),
            MonitoringMode=ua.MonitoringMode.Reporting,
            RequestedParameters=ua.MonitoringParameters(
                ClientHandle=handle,
                SamplingInterval=self.value("sampling"),
                Filter=always,
                QueueSize=1000,
                DiscardOldest=True,
            ),
        )

    async def follow(self) -> None:
        """Follow the server, and reconnect whenever it is lost."""
        log = self.get_logger()
        while rclpy.ok():
            try:
                async with Client(self.value("url"), timeout=20.0) as client:
                    names = ("pressure_node", "position_node")
                    nodes = [client.get_node(self.value(name)) for name in names]
                    subscription = await client.create_subscription(100.0, self)
                    await subscription.create_monitored_items(
                        [self._request(node, handle) for handle, node in enumerate(nodes, 1)]
                    )
                    log.info(f"ready: follows {self.value('url')}")
                    while rclpy.ok():
                        await asyncio.sleep(0.5)
                        await client.check_connection()
            except LOST as error:  # noqa: PERF203 - it is the loop that tries again
                log.warning(f"{self.value('url')} is lost, tried again: {error!r}")
                await asyncio.sleep(1.0)


def _time(given: datetime | None) -> Time | None:
    """Convert an OPC UA time, which is in UTC."""
    if given is None:
        return None
    since = given.replace(tzinfo=timezone.utc) - datetime(1970, 1, 1, tzinfo=timezone.utc)
    nanoseconds = (since.days * 86_400 + since.seconds) * 10**9 + since.microseconds * 1000
    return Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


if __name__ == "__main__":
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(OpcUaGateway().follow())
