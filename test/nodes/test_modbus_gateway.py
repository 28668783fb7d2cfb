# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The gateway of the examples, between a simulated Modbus device and an identifier."""

import asyncio
import math
import struct
import threading
import time

import numpy as np
import pytest
from live_nodes import NAMESPACE, PROJECT, STREAM
from local_server import free_port
from sensor_msgs.msg import FluidPressure, JointState

from valve_friction_ros.records import ReadingOptions, read_recordings, read_valve_file

pytest.importorskip("pymodbus", reason="run `make venv-test`")
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

GATEWAY = PROJECT / "examples" / "modbus_gateway.py"
EXAMPLES = PROJECT / "examples"
FIRST, POSITION = 100, 104
"""Registers of the pressure and of the position, with others between them."""


def as_registers(value, word_order="big"):
    words = list(struct.unpack(">2H", struct.pack(">f", value)))
    return words if word_order == "big" else words[::-1]


class Device:
    """A device whose registers say, at each request, what `values` returns."""

    def __init__(self, port, values, word_order="big"):
        self.requests = []
        self._port, self._values, self._word_order = port, values, word_order
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self._do(self._start())

    def _do(self, work):
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(60.0)

    async def _answer(self, function, start, address, count, registers, _):
        self.requests.append((function, address, count))
        pressure, position = self._values()
        for place, value in ((FIRST, pressure), (POSITION, position)):
            registers[place - start : place - start + 2] = as_registers(value, self._word_order)

    async def _start(self):
        block = SimData(FIRST, values=[0] * 6, datatype=DataType.REGISTERS)
        device = SimDevice(id=7, simdata=[block], action=self._answer)
        self._server = ModbusTcpServer(device, address=("127.0.0.1", self._port))
        await self._server.serve_forever(background=True)

    def close(self):
        self._do(self._server.shutdown())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(10.0)


def parameters(port, **others):
    places = {"device": 7, "pressure_register": FIRST, "position_register": POSITION}
    return {"host": "127.0.0.1", "port": port, "longest": 10.0} | places | others


@pytest.mark.slow
def test_a_valve_behind_a_device_is_identified(live):
    """The device says what the recorded valve does at the time of each request."""
    described = read_valve_file(EXAMPLES / "fv_101.yaml")
    options = ReadingOptions(described.columns)
    (read,) = read_recordings(EXAMPLES / "five_seconds.csv", described.valve, options)
    record = read.recording()
    travel = described.valve.travel
    times = np.arange(len(record)) * record.sample_period
    begun = []

    def now():
        elapsed = time.monotonic() - begun[0] if begun else 0.0
        return (
            np.interp(elapsed, times, record.pressure / 1e5),
            np.interp(elapsed, times, 100 * record.position / travel),
        )

    port = free_port()
    device = Device(port, now)
    live.start_identifier(
        {"diaphragm_area": described.valve.diaphragm_area, "pressure_reference": 0.0,
         "pressure_minimum": -1e4, "pressure_maximum": 4e5}
    )  # fmt: skip
    given = parameters(port, position_scale=travel / 100, rate=100.0)
    live.start("modbus_gateway", given, script=GATEWAY)
    live.client.wait_until(
        lambda: int(live.client.status_values()["buffered_samples"]) > 20, "the first samples"
    )
    begun.append(time.monotonic())
    live.client.wait_until(lambda: time.monotonic() > begun[0] + times[-1], "the end of the record")
    assert live.client.trigger("identify").success
    values = live.client.last_values()
    value, half = (float(values[f"coulomb_friction{what} [N]"]) for what in ("", " half width"))
    assert value == pytest.approx(400.0, abs=1.5 * half)
    assert half < 100.0
    assert set(device.requests) == {(4, FIRST, POSITION + 2 - FIRST)}
    device.close()


def test_each_answer_is_one_sample_and_a_lost_device_is_found_again(live):
    """Scales, word order and registers; a value that is not there is left out."""
    said = [(1.5, 20.0), (math.nan, 30.0), (1.25, 40.0)]
    turn = iter(range(10**9))

    def values():
        return said[next(turn) % 3]

    heard = {"pressure": [], "place": []}
    for kind, topic, take in (
        (FluidPressure, "actuator_pressure", lambda m: ("pressure", m.fluid_pressure)),
        (JointState, "stem_state", lambda m: ("place", m.position[0])),
    ):

        def note(message, take=take):
            name, value = take(message)
            stamp = message.header.stamp
            heard[name].append((stamp.sec * 10**9 + stamp.nanosec, value))

        live.client.node.create_subscription(kind, f"{NAMESPACE}/{topic}", note, STREAM)
    port = free_port()
    given = parameters(
        port, kind="holding", word_order="little", position_scale=-2e-4, position_at_zero=0.02
    )
    gateway = live.start("modbus_gateway", given, script=GATEWAY)
    live.client.wait_until(lambda: "is lost, tried again" in gateway.errors, "the first complaint")
    device = Device(port, values, "little")
    live.client.wait_until(lambda: len(heard["place"]) > 10, "samples")
    device.close()
    lost = gateway.errors.count("is lost")
    live.client.wait_until(lambda: gateway.errors.count("is lost") > lost, "the next complaint")
    count = len(heard["place"])
    device = Device(port, values, "little")
    live.client.wait_until(lambda: len(heard["place"]) > count + 10, "samples again")
    live.client.wait_until(lambda: len(heard["place"]) == len(heard["pressure"]), "both signals")
    device.close()
    assert {function for function, _, _ in device.requests} == {3}
    assert {value for _, value in heard["pressure"]} == {1.5e5, 1.25e5}
    assert {round(value, 9) for _, value in heard["place"]} == {0.016, 0.012}
    stamps = [stamp for stamp, _ in heard["place"]]
    assert stamps == sorted(set(stamps))
    assert set(stamps) & {stamp for stamp, _ in heard["pressure"]} >= set(stamps[5:-5])
