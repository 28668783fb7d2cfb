# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A gateway to OPC UA: values, alarms and NE 107 device health of all valves for a control system.

``python examples/opc_ua_health.py --ros-args -p endpoint:=opc.tcp://127.0.0.1:4841/``; Ctrl-C ends
it. It needs asyncua (``pip install asyncua``). Copy it and adapt it to your system.
"""

import asyncio
import contextlib
import math
import re
import sys
import threading
import time
from collections.abc import Iterable
from typing import Any

import rclpy
from asyncua import Node as UaNode
from asyncua import Server, ua
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

DI = "http://opcfoundation.org/UA/DI/"
OWN = "urn:valve_friction_ros:health"
ENUMERATION, ENUM_STRINGS, DEVICE_SET = 6244, 6450, 5001
"""Node numbers of DeviceHealthEnumeration, its strings and DeviceSet in the DI namespace."""
PARAMETERS = {"endpoint": "opc.tcp://127.0.0.1:4841/", "silent_after": 5.0}
SEVERITY = {"OK": 1, "WARN": 500, "ERROR": 900}
NUMBER, ALARM = re.compile(r"(.+?)(?: \[(.+)\])?"), re.compile(r"alarm (\w+)")
"""Keys of values, with units, and of alarm states."""
GOOD, SILENT = ua.StatusCodes.Good, ua.StatusCodes.UncertainNoCommunicationLastUsableValue
HEALTH = ("NORMAL", "FAILURE", "CHECK_FUNCTION", "OFF_SPEC", "MAINTENANCE_REQUIRED")
"""DeviceHealthEnumeration, from 0."""
SIGNALS = ("", "F", "C", "S", "M")
"""The same states as NE 107 status signals."""


class Valve:
    """The object of a valve in the address space; variables appear with their first values."""

    def __init__(self, server: Server, place: UaNode, spaces: tuple[int, int], tag: str) -> None:
        self._server, self._place, self._tag = server, place, tag
        self._di, self._own = spaces
        self._nodes: dict[str, UaNode] = {}
        self._served: dict[str, ua.DataValue] = {}
        self._shown: set[str] = set()
        self._alarm: dict[str, UaNode] = {}
        self._states: dict[str, str] = {}

    async def build(self) -> None:
        """Create the nodes common to all valves."""
        self._root = await self._place.add_object(self._id(""), f"{self._own}:{self._tag}")
        for name in ("AssetId", "ComponentName"):
            await self._root.add_property(self._id(name, self._di), f"{self._di}:{name}", self._tag)
        folder = self._id("DeviceHealthAlarms", self._di), f"{self._di}:DeviceHealthAlarms"
        self._alarms = await self._root.add_folder(*folder)
        kind = ua.ObjectIds.AlarmConditionType
        self._events = await self._server.get_event_generator(kind, self._root)

    def _id(self, name: str, space: int | None = None) -> ua.NodeId:
        return ua.NodeId(f"{self._tag}.{name}".rstrip("."), space or self._own)

    async def _put(self, name: str, place: UaNode, given: ua.DataValue, **more: Any) -> None:
        """Write a variable if it has changed."""
        self._shown.add(name)
        space, data_type = more.get("space", self._own), more.get("data_type")
        if name not in self._nodes:
            bare, value = name.rsplit("/", 1)[-1], given.Value
            node = await place.add_variable(
                self._id(name, space), f"{space}:{bare}", value.Value, value.VariantType, data_type
            )
            if unit := more.get("unit"):
                meant = ua.EUInformation(UnitId=-1, DisplayName=ua.LocalizedText(unit))
                await node.add_property(self._id(f"{name}.unit"), "0:EngineeringUnits", meant)
            self._nodes[name] = node
        if given != self._served.get(name):
            self._served[name] = given
            await self._server.write_attribute_value(self._nodes[name].nodeid, given)

    async def show(self, status: DiagnosticStatus) -> None:
        """Show a status of ``/diagnostics``; a value that it no longer holds is unknown."""
        self._shown.clear()
        values = {entry.key: entry.value for entry in status.values}
        health = _value(SIGNALS.index(values["NE 107"]), ua.VariantType.Int32)
        enumeration = ua.NodeId(ENUMERATION, self._di)
        await self._put("DeviceHealth", self._root, health, space=self._di, data_type=enumeration)
        await self._put("Message", self._root, _value(status.message, ua.VariantType.String))
        for key, text in values.items():
            with contextlib.suppress(ValueError):
                name, unit = NUMBER.fullmatch(key).groups()  # type: ignore[union-attr]
                is_weak = values.get(f"{name} verdict", "identified") != "identified"
                code = ua.StatusCodes.Uncertain if is_weak else GOOD
                code = ua.StatusCodes.BadNoData if math.isnan(float(text)) else code
                given = _value(float(text), ua.VariantType.Double, code)
                await self._put(name, self._root, given, unit=unit)
        for found in filter(None, map(ALARM.fullmatch, values)):
            await self._show_alarm(found[1], values)
        await self._mark(self._nodes.keys() - self._shown, ua.StatusCodes.BadNoData)

    async def _show_alarm(self, kind: str, values: dict[str, str]) -> None:
        if kind not in self._alarm:
            name = f"{self._own}:{kind}"
            self._alarm[kind] = await self._alarms.add_object(self._id(kind), name)
        state = values[f"alarm {kind}"]
        level = values.get(f"alarm {kind} level", "OK")
        message = values.get(f"alarm {kind} message", "")
        for name, given in (
            ("State", _value(state, ua.VariantType.String)),
            ("Active", _value(level != "OK", ua.VariantType.Boolean)),
            ("Message", _value(message, ua.VariantType.String)),
        ):
            await self._put(f"{kind}/{name}", self._alarm[kind], given)
        before, self._states[kind] = self._states.get(kind, "normal"), state
        if state == before:
            return
        event = self._events.event
        is_acknowledged = state not in ("unacknowledged", "returned unacknowledged")
        for name, value in (
            ("ConditionName", kind), ("NodeId", self._alarm[kind].nodeid),
            ("Severity", SEVERITY.get(level, 1)), ("Retain", state != "normal"),
            ("ActiveState", ua.LocalizedText("Active" if level != "OK" else "Inactive")),
            ("ActiveState/Id", level != "OK"), ("AckedState/Id", is_acknowledged),
            ("SuppressedOrShelved", state in ("shelved", "out of service")),
        ):  # fmt: skip
            setattr(event, name, value)
        await self._events.trigger(message=f"{self._tag} {kind}: {state}. {message}".strip())

    async def fall_silent(self) -> None:
        """Mark all values as the last usable values."""
        await self._mark(self._nodes.keys(), SILENT)

    async def _mark(self, names: Iterable[str], code: int) -> None:
        for name in names:
            last = self._served[name].Value
            await self._put(name, self._root, _value(last.Value, last.VariantType, code))


def _value(value: Any, kind: ua.VariantType, code: int = GOOD) -> ua.DataValue:
    return ua.DataValue(ua.Variant(value, kind), ua.StatusCode(code))


class HealthGateway(Node):
    """Subscribes to ``/diagnostics`` and serves its statuses."""

    def __init__(self) -> None:
        super().__init__("opc_ua_health")
        for name, default in PARAMETERS.items():
            self.declare_parameter(name, default)
        self._heard: dict[str, tuple[float, DiagnosticStatus]] = {}
        self.create_subscription(DiagnosticArray, "/diagnostics", self._hear, 1000)

    def _hear(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {entry.key: entry.value for entry in status.values}
            if status.name.endswith(": friction") and values.get("NE 107") in SIGNALS:
                tag = status.hardware_id or status.name.removesuffix("/identifier: friction")
                self._heard[tag] = time.monotonic(), status

    async def serve(self) -> None:
        """Serve until shutdown; each valve is an object in DeviceSet."""
        endpoint, silent_after = (self.get_parameter(name).value for name in PARAMETERS)
        server = Server()
        await server.init()
        server.set_endpoint(endpoint)
        server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
        spaces = await server.register_namespace(DI), await server.register_namespace(OWN)
        kinds = server.get_node(ua.ObjectIds.Enumeration)
        kind = await kinds.add_data_type(
            ua.NodeId(ENUMERATION, spaces[0]), f"{spaces[0]}:DeviceHealthEnumeration"
        )
        names = [ua.LocalizedText(one) for one in HEALTH]
        await kind.add_property(ua.NodeId(ENUM_STRINGS, spaces[0]), "0:EnumStrings", names)
        place = await server.nodes.objects.add_folder(
            ua.NodeId(DEVICE_SET, spaces[0]), f"{spaces[0]}:DeviceSet"
        )
        valves: dict[str, Valve] = {}
        async with server:
            self.get_logger().info(f"ready: serves {endpoint}")
            while rclpy.ok():
                for tag, (heard, status) in list(self._heard.items()):
                    if tag not in valves:
                        valves[tag] = Valve(server, place, spaces, tag)
                        await valves[tag].build()
                    if time.monotonic() - heard > silent_after:
                        await valves[tag].fall_silent()
                    else:
                        await valves[tag].show(status)
                await asyncio.sleep(0.2)


def _listen(node: HealthGateway) -> None:
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    with contextlib.suppress(ExternalShutdownException):
        while rclpy.ok():
            executor.spin_once(timeout_sec=0.2)


if __name__ == "__main__":
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    gateway = HealthGateway()
    listener = threading.Thread(target=_listen, args=(gateway,))
    listener.start()
    try:
        with contextlib.suppress(KeyboardInterrupt):
            asyncio.run(gateway.serve())
    except OSError as error:
        sys.exit(f"cannot serve: {error}")
    finally:
        rclpy.shutdown()
        listener.join()
