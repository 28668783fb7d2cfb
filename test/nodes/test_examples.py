# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The programs of the examples, each between a simulated other side and live nodes."""

import asyncio
import contextlib
import importlib.util
import math
import socket
import struct
import threading
from datetime import datetime, timedelta, timezone
from functools import reduce

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from live_nodes import NAMESPACE, NODE, PROJECT, STREAM, stamp_of
from local_server import free_port
from records import quick_record
from sensor_msgs.msg import FluidPressure, JointState
from std_srvs.srv import SetBool

from valve_friction_ros.health import Baseline, StatusSignal
from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION
from valve_friction_ros.records import ReadingOptions, read_recordings, read_valve_file

with contextlib.suppress(ImportError):
    import asyncua
    from asyncua import ua

EXAMPLES = PROJECT / "examples"
SENSOR = {"pressure_reference": 0.0, "pressure_minimum": -1e4, "pressure_maximum": 4e5}


def needs(library):
    """Skip a test where a library is not installed."""
    is_there = importlib.util.find_spec(library) is not None
    return pytest.mark.skipif(not is_there, reason="run `make venv-test`")


def recorded():
    """The record of the examples, its valve, and its times, s."""
    described = read_valve_file(EXAMPLES / "fv_101.yaml")
    options = ReadingOptions(described.columns)
    (read,) = read_recordings(EXAMPLES / "five_seconds.csv", described.valve, options)
    record = read.recording()
    return record, described.valve, np.arange(len(record)) * record.sample_period


class LoopThread:
    """A loop of asyncio that is driven step by step."""

    def __init__(self):
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()

    def do(self, work):
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(60.0)

    def end(self):
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(10.0)


class Heard:
    """Stamps (ns) and values of both signals of a valve, as they come."""

    def __init__(self, client):
        self.pressures, self.places = [], []
        for kind, topic, take in (
            (FluidPressure, "actuator_pressure", self._pressure),
            (JointState, "stem_state", self._place),
        ):
            client.node.create_subscription(kind, f"{NAMESPACE}/{topic}", take, STREAM)

    def _pressure(self, message):
        self.pressures.append((stamp_of(message.header.stamp), round(message.fluid_pressure, 9)))

    def _place(self, message):
        self.places.append((stamp_of(message.header.stamp), round(message.position[0], 9)))


FIRST, POSITION = 100, 104
"""Registers of the pressure and of the position, with others between them."""


def as_registers(value, word_order="big"):
    words = list(struct.unpack(">2H", struct.pack(">f", value)))
    return words if word_order == "big" else words[::-1]


class ModbusDevice(LoopThread):
    """A device whose registers say, at each request, what `values` returns."""

    def __init__(self, port, values, word_order="big"):
        self.requests = []
        self._port, self._values, self._word_order = port, values, word_order
        super().__init__()
        self.do(self._start())

    async def _answer(self, function, start, address, count, registers, _):
        self.requests.append((function, address, count))
        pressure, position = self._values()
        for place, value in ((FIRST, pressure), (POSITION, position)):
            registers[place - start : place - start + 2] = as_registers(value, self._word_order)

    async def _start(self):
        from pymodbus.server import ModbusTcpServer
        from pymodbus.simulator import DataType, SimData, SimDevice

        block = SimData(FIRST, values=[0] * 6, datatype=DataType.REGISTERS)
        device = SimDevice(id=7, simdata=[block], action=self._answer)
        self._server = ModbusTcpServer(device, address=("127.0.0.1", self._port))
        await self._server.serve_forever(background=True)

    def close(self):
        self.do(self._server.shutdown())
        self.end()


def modbus_parameters(port, **others):
    places = {"device": 7, "pressure_register": FIRST, "position_register": POSITION}
    return {"host": "127.0.0.1", "port": port, "longest": 10.0} | places | others


@needs("pymodbus")
def test_each_answer_of_modbus_is_one_sample_and_a_lost_device_is_found_again(live):
    """Scales, word order and registers; a value that is not there is left out."""
    said = [(1.5, 20.0), (math.nan, 30.0), (1.25, 40.0)]
    turn = iter(range(10**9))

    def values():
        return said[next(turn) % 3]

    heard = Heard(live.client)
    port = free_port()
    given = modbus_parameters(
        port, kind="holding", word_order="little", position_scale=-2e-4, position_at_zero=0.02
    )
    gateway = live.start("modbus_gateway", given, script=EXAMPLES / "modbus_gateway.py")
    live.client.wait_until(lambda: "is lost, tried again" in gateway.errors, "the first complaint")
    device = ModbusDevice(port, values, "little")
    live.client.wait_until(lambda: len(heard.places) > 10, "samples")
    device.close()
    lost = gateway.errors.count("is lost")
    live.client.wait_until(lambda: gateway.errors.count("is lost") > lost, "the next complaint")
    count = len(heard.places)
    device = ModbusDevice(port, values, "little")
    live.client.wait_until(lambda: len(heard.places) > count + 10, "samples again")
    live.client.wait_until(lambda: len(heard.places) == len(heard.pressures), "both signals")
    device.close()
    assert {function for function, _, _ in device.requests} == {3}
    assert {value for _, value in heard.pressures} == {1.5e5, 1.25e5}
    assert {value for _, value in heard.places} == {0.016, 0.012}
    stamps = [stamp for stamp, _ in heard.places]
    assert stamps == sorted(set(stamps))
    assert set(stamps) & {stamp for stamp, _ in heard.pressures} >= set(stamps[5:-5])


ADDRESS, MAKER, KIND, NUMBER = 3, 0x26, 0x0F, bytes((0x12, 0x34, 0x56))
LONG = bytes((0x80 | MAKER & 0x3F, KIND)) + NUMBER
"""Long address of a device, after its answer to command 0, as a primary master sends it."""
PERCENT, BAR, UNUSED = 57, 7, 250


def nothing():
    return struct.pack(">I", 0x7FA00000)  # the NaN of HART: no value


class HartDevice:
    """A device of HART-IP 1, byte by byte after TP10300 and the universal commands.

    `values()` returns position, pressure and the device status at each command 3.
    """

    def __init__(self, values, protocol, port=0):
        self._values = values
        self.asked = []
        kind = socket.SOCK_DGRAM if protocol == "udp" else socket.SOCK_STREAM
        self._socket = self._line = socket.socket(socket.AF_INET, kind)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._socket.bind(("127.0.0.1", port))
        self.port = self._socket.getsockname()[1]
        if protocol == "tcp":
            self._socket.listen()
        serve = self._serve_datagrams if protocol == "udp" else self._serve_connections
        self._thread = threading.Thread(target=serve, daemon=True)
        self._thread.start()

    def _serve_datagrams(self):
        with contextlib.suppress(OSError):  # closed
            while (one := self._socket.recvfrom(1024))[0]:
                self._socket.sendto(self._reply(one[0]), one[1])

    def _serve_connections(self):
        with contextlib.suppress(OSError):  # closed
            while True:
                self._line = self._socket.accept()[0]
                with self._line as line:
                    while head := line.recv(8, socket.MSG_WAITALL):
                        length = struct.unpack(">H", head[6:])[0] - 8
                        body = line.recv(length, socket.MSG_WAITALL) if length else b""
                        line.sendall(self._reply(head + body))

    def _reply(self, request):
        version, _, what, _, sequence, length = struct.unpack(">BBBBHH", request[:8])
        assert length == len(request)
        body = request[8:]
        if what == 3:
            body = self._answer(body)
        return struct.pack(">BBBBHH", version, 1, what, 0, sequence, 8 + len(body)) + body

    def _answer(self, frame):
        """Answer a frame of a token-passing HART link: delimiter, address, command, data."""
        size = 5 if frame[0] & 0x80 else 1
        address, command = frame[1 : 1 + size], frame[1 + size]
        assert reduce(int.__xor__, frame) == 0, "checksum"
        self.asked.append((command, address))
        status = 0
        if command == 0:
            data = bytes((254, MAKER, KIND, 5, 7, 1, 2, 0x18, 0)) + NUMBER
        else:
            position, pressure, status = self._values()
            data = struct.pack(">fBf", 12.0, PERCENT, position) + bytes((BAR,))
            data += nothing() if math.isnan(pressure) else struct.pack(">f", pressure)
            data += bytes((UNUSED,)) + nothing()
        answer = bytes((frame[0] & 0x80 | 0x06,)) + address
        answer += bytes((command, 2 + len(data), 0, status)) + data
        return answer + bytes((reduce(int.__xor__, answer),))

    def close(self):
        for one in (self._line, self._socket):
            with contextlib.suppress(OSError):  # of datagrams: the thread ends all the same
                one.shutdown(socket.SHUT_RDWR)
        self._thread.join(10.0)
        self._socket.close()


@needs("hartip")
@pytest.mark.slow
@pytest.mark.parametrize("protocol", ["udp", "tcp"])
def test_each_answer_of_hart_is_one_sample_and_a_lost_device_is_found_again(live, protocol):
    """Of four answers one has no pressure, and one is of a device that says it is defective."""
    said = [(20.0, 1.5, 0), (30.0, math.nan, 0), (40.0, 1.25, 0), (50.0, 2.0, 0x80)]
    turn = iter(range(10**9))
    heard = Heard(live.client)
    device = HartDevice(lambda: said[next(turn) % 4], protocol)
    given = {"host": "127.0.0.1", "port": device.port, "protocol": protocol, "address": ADDRESS,
             "rate": 50.0, "longest": 0.5,
             "position_scale": -2e-4, "position_at_zero": 0.02}  # fmt: skip
    gateway = live.start("hart_ip_gateway", given, script=EXAMPLES / "hart_ip_gateway.py")
    live.client.wait_until(lambda: len(heard.places) > 10, "samples")
    device.close()
    live.client.wait_until(lambda: "is lost, tried again" in gateway.errors, "the complaint")
    count = len(heard.places)
    device = HartDevice(lambda: said[next(turn) % 4], protocol, device.port)
    live.client.wait_until(lambda: len(heard.places) > count + 10, "samples again")
    live.client.wait_until(lambda: len(heard.places) == len(heard.pressures), "both signals")
    assert device.asked[0] == (0, bytes((0x80 | ADDRESS,)))
    assert {one for one in device.asked if one[0] == 3} == {(3, LONG)}
    gateway.stop()
    device.close()
    assert {value for _, value in heard.pressures} == {1.5e5, 1.25e5}
    assert {value for _, value in heard.places} == {0.016, 0.012}
    stamps = [stamp for stamp, _ in heard.places]
    assert stamps == sorted(set(stamps))
    assert stamps == [stamp for stamp, _ in heard.pressures]


DAY_OF_RECORD = datetime(2026, 1, 2, tzinfo=timezone.utc)


class SimulatedServer(LoopThread):
    """A server with two variables, in a thread of its own."""

    def __init__(self):
        super().__init__()
        self.url = f"opc.tcp://127.0.0.1:{free_port()}/"

    async def start(self):
        self.server = asyncua.Server()
        await self.server.init()
        self.server.set_endpoint(self.url)
        self.server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
        space = await self.server.register_namespace("urn:test")
        self.nodes = [
            await self.server.nodes.objects.add_variable(
                ua.NodeId(f"FV-101.{name}", space), name, 0.0, datatype=ua.NodeId(11)
            )
            for name in ("pressure", "position")
        ]
        for node in self.nodes:  # bad: there is no sample yet
            nothing = ua.DataValue(ua.Variant(0.0), ua.StatusCode(ua.StatusCodes.Bad))
            await self.server.write_attribute_value(node.nodeid, nothing)
        await self.server.start()

    async def serve(self, samples):
        """Write rows of time, s, pressure and position; the stamps are those of the source."""
        for count, (moment, *values) in enumerate(samples):
            stamp = (DAY_OF_RECORD + timedelta(seconds=moment)).replace(tzinfo=None)
            for node, value in zip(self.nodes, values, strict=True):
                given = ua.DataValue(ua.Variant(float(value)), SourceTimestamp=stamp)
                await self.server.write_attribute_value(node.nodeid, given)
            if count % 20 == 0:
                await asyncio.sleep(0.1)  # as they would come at 200 Hz

    def close(self):
        with contextlib.suppress(Exception):
            self.do(self.server.stop())
        self.end()


@pytest.fixture
def server():
    served = SimulatedServer()
    served.do(served.start())
    yield served
    served.close()


def both_heard(server, client, value):
    """Serve a sample of the day before; return whether the next diagnostic tells of both signals.

    Each has a stamp of its own: a server does not tell a sample again.
    """
    day_before = -86_400.0 + len(client.statuses)
    server.do(server.serve([(day_before, *value)]))
    values = client.status_values()
    return int(values["buffered_pressures"]) and int(values["buffered_positions"])


@needs("asyncua")
@pytest.mark.slow
def test_a_record_of_a_server_is_identified(server, live):
    record, valve, times = recorded()
    given = {**SENSOR, "diaphragm_area": valve.diaphragm_area, "method": "bench"}
    live.start_identifier(given)
    parameters = {"url": server.url, "position_scale": valve.travel / 100, "sampling": 0.0}
    gateway = live.start("opc_ua_gateway", parameters, script=EXAMPLES / "opc_ua_gateway.py")
    live.client.wait_until(lambda: "ready" in gateway.errors + gateway.output, "the gateway")
    rows = np.column_stack((times, record.pressure / 1e5, 100 * record.position / valve.travel))
    # The first samples may come before the publishers know their subscriber.
    live.client.wait_until(lambda: both_heard(server, live.client, rows[0, 1:]), "the first sample")
    server.do(server.serve(rows))
    live.client.wait_for_buffered(2 * len(rows))
    assert live.client.trigger("identify").success
    values = live.client.last_values()
    assert float(values["coulomb_friction [N]"]) == pytest.approx(400.0, rel=0.02)


DI, OWN = "http://opcfoundation.org/UA/DI/", "urn:valve_friction_ros:health"


class ControlSystem(LoopThread):
    """A client of OPC UA, driven step by step; it notes the events of a valve."""

    def __init__(self, url):
        super().__init__()
        self._client = asyncua.Client(url, timeout=20.0)
        self.events = []
        self.do(self._client.connect())
        self.di, self.own = (self.do(self._client.get_namespace_index(one)) for one in (DI, OWN))

    def node(self, tag, *names):
        """Browse from the devices to a node, as a client does that knows the names only."""
        path = [f"{self.di}:DeviceSet", f"{self.own}:{tag}", *names]
        return self.do(self._client.nodes.objects.get_child(path))

    def read(self, tag, *names):
        """Return value and quality of a variable; None where it is not there yet."""
        try:
            given = self.do(self.node(tag, *names).read_data_value(raise_on_bad_status=False))
        except ua.UaStatusCodeError:
            return None
        return given.Value.Value, given.StatusCode.name

    def health(self, tag):
        return self.read(tag, f"{self.di}:DeviceHealth")

    def alarm(self, tag, kind, what="State"):
        place = f"{self.di}:DeviceHealthAlarms", f"{self.own}:{kind}", f"{self.own}:{what}"
        found = self.read(tag, *place)
        return found and found[0]

    def event_notification(self, event):
        self.events.append(event)

    def follow(self, tag):
        subscription = self.do(self._client.create_subscription(50.0, self))
        kind = ua.ObjectIds.AlarmConditionType
        self.do(subscription.subscribe_events(self.node(tag), kind))

    def close(self):
        self.do(self._client.disconnect())
        self.end()


@pytest.fixture
def served(live):
    """The gateway, and who connects clients to it."""
    url = f"opc.tcp://127.0.0.1:{free_port()}/"
    given, script = {"endpoint": url, "silent_after": 3.0}, EXAMPLES / "opc_ua_health.py"
    gateway = live.start("opc_ua_health", given, script=script, namespace=None)
    live.client.wait_until(lambda: "ready" in gateway.errors + gateway.output, "the gateway")
    system = ControlSystem(url)
    yield system
    system.close()


@needs("asyncua")
@pytest.mark.slow
def test_a_control_system_sees_a_valve_fail_and_be_answered(live, served):
    healthy = Baseline.of(identify(quick_record(), BENCH_VALVE)).coulomb_friction
    node = live.start_identifier({"baseline_coulomb_friction": healthy, "input_timeout": 600.0})
    client, tag = live.client, live.client.next_status().hardware_id

    def waits_for(condition, what):
        client.wait_until(condition, what)

    waits_for(lambda: served.alarm(tag, "friction_high") == "normal", "the valve")
    served.follow(tag)
    assert client.identified(quick_record(HIGH_FRICTION))
    waits_for(lambda: served.alarm(tag, "friction_high") == "unacknowledged", "the alarm")
    assert served.health(tag) == (1, "Good")
    assert served.alarm(tag, "friction_high", "Active") is True
    assert served.alarm(tag, "friction_high", "Message").startswith("excess friction")
    friction, quality = served.read(tag, f"{served.own}:coulomb_friction")
    assert friction == float(client.last_values()["coulomb_friction [N]"])
    assert quality == "Good"
    unit = served.node(tag, f"{served.own}:coulomb_friction", "0:EngineeringUnits")
    assert served.do(unit.read_value()).DisplayName.Text == "N"
    assert served.read(tag, f"{served.di}:ComponentName") == (tag, "Good")

    client.set_parameters(NODE, {"alarm_who": "A. Operator"})
    assert client.trigger("acknowledge").success
    waits_for(lambda: served.alarm(tag, "friction_high") == "acknowledged", "the acknowledgement")
    client.set_parameters(NODE, {"alarm_who": "A. Operator", "alarm_hours": 8.0})
    assert client.call(SetBool, f"{NODE}/out_of_service", SetBool.Request(data=True)).success
    waits_for(lambda: served.alarm(tag, "positioner") == "out of service", "the maintenance")

    def told():
        return [one for one in served.events if one.ConditionName == "friction_high"]

    waits_for(lambda: len(told()) == 3, "three events")
    states = [
        (getattr(one, "ActiveState/Id"), getattr(one, "AckedState/Id"), one.SuppressedOrShelved)
        for one in told()
    ]
    assert states == [(True, False, False), (True, True, False), (True, True, True)]
    assert [one.Severity for one in told()] == [900] * 3

    live.kill(node)
    silent = "UncertainNoCommunicationLastUsableValue"
    waits_for(lambda: served.health(tag) == (1, silent), "that nothing is heard")
    assert served.read(tag, f"{served.own}:coulomb_friction") == (friction, silent)


@needs("asyncua")
@pytest.mark.slow
def test_each_signal_of_ne_107_and_each_verdict(live, served):
    """What is heard is made here, so that each occurs."""
    expected = {"": 0, "F": 1, "C": 2, "S": 3, "M": 4}
    assert set(expected) == {one.value for one in StatusSignal}
    publisher = live.client.node.create_publisher(DiagnosticArray, "/diagnostics", 10)
    numbers = {"identified": ("1.5", "Good"), "weak": ("2.5", "Uncertain"),
               "not identifiable": ("nan", "BadNoData")}  # fmt: skip

    def status(signal):
        values = {"NE 107": signal}
        for verdict, (text, _) in numbers.items():
            values |= {f"{verdict}_one [kg]": text, f"{verdict}_one verdict": verdict}
        pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
        name = f"/v{signal}/identifier: friction"
        return DiagnosticStatus(name=name, hardware_id=f"V-{signal}", values=pairs)

    def heard():
        door = [KeyValue(key="NE 107", value="worn"), KeyValue(key="torque", value="5")]
        others = [
            DiagnosticStatus(name="another node: friction less", hardware_id="X"),
            DiagnosticStatus(name="hinge: friction", hardware_id="X", values=door),
            DiagnosticStatus(name="hinge: friction", hardware_id="X", level=b"\x02"),
        ]
        publisher.publish(DiagnosticArray(status=[*map(status, expected), *others]))
        return served.read("V-M", f"{served.di}:DeviceHealth")

    live.client.wait_until(heard, "the last valve")
    for signal, value in expected.items():
        assert served.health(f"V-{signal}") == (value, "Good")
    for verdict, (_, quality) in numbers.items():
        assert served.read("V-F", f"{served.own}:{verdict}_one")[1] == quality
    assert served.health("X") is None
    kind = served.do(served.node("V-F", f"{served.di}:DeviceHealth").read_data_type())
    assert (kind.NamespaceIndex, kind.Identifier) == (served.di, 6244)

    del numbers["identified"]  # such as a ratio without a baseline
    live.client.wait_until(
        lambda: heard() and served.read("V-F", f"{served.own}:identified_one")[1] == "BadNoData",
        "that it is not known any more",
    )


def test_the_small_dashboard_shows_a_valve_and_what_becomes_of_it(live):
    live.start_identifier({"valve_tag": "FV-101"})
    shown = live.start("worst_valves", script=EXAMPLES / "worst_valves.py", namespace=None)
    client = live.client
    client.wait_until(lambda: "OK    FV-101" in shown.output, "the valve")
    client.set_baseline(quick_record())
    client.identified(quick_record(HIGH_FRICTION))
    client.wait_until(lambda: "ERROR FV-101" in shown.output, "the alarm")
    assert shown.output.splitlines()[-1].split()[2:5] == ["NE", "107", "F"]
