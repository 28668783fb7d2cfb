# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The gateway of the examples, between a simulated HART-IP device and a subscriber."""

import math
import socket
import struct
import threading
from functools import reduce

import pytest
from live_nodes import NAMESPACE, PROJECT, STREAM
from sensor_msgs.msg import FluidPressure, JointState

pytest.importorskip("hartip", reason="run `make venv-test`")
GATEWAY = PROJECT / "examples" / "hart_ip_gateway.py"
ADDRESS, MAKER, KIND, NUMBER = 3, 0x26, 0x0F, bytes((0x12, 0x34, 0x56))
LONG = bytes((0x80 | MAKER & 0x3F, KIND)) + NUMBER
"""Long address of a device, after its answer to command 0, as a primary master sends it."""
PERCENT, BAR, UNUSED = 57, 7, 250


def nothing():
    return struct.pack(">I", 0x7FA00000)  # the NaN of HART: no value


class Device:
    """A device of HART-IP 1 by UDP, byte by byte after TP10300 and the universal commands.

    `values()` returns position, pressure and the device status at each command 3.
    """

    def __init__(self, values, port=0):
        self._values = values
        self.asked = []
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", port))
        self.port = self._socket.getsockname()[1]
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self):
        while True:
            request, sender = self._socket.recvfrom(1024)
            if not request:
                return
            version, _, what, _, sequence, length = struct.unpack(">BBBBHH", request[:8])
            assert length == len(request)
            body = request[8:]
            if what == 3:
                body = self._answer(body)
            header = struct.pack(">BBBBHH", version, 1, what, 0, sequence, 8 + len(body))
            self._socket.sendto(header + body, sender)

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
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
            end.sendto(b"", ("127.0.0.1", self.port))
        self._thread.join(10.0)
        self._socket.close()


@pytest.mark.slow
def test_each_answer_is_one_sample_and_a_lost_device_is_found_again(live):
    """Of four answers one has no pressure, and one is of a device that says it is defective."""
    said = [(20.0, 1.5, 0), (30.0, math.nan, 0), (40.0, 1.25, 0), (50.0, 2.0, 0x80)]
    turn = iter(range(10**9))
    heard = {"pressure": [], "place": []}
    for kind, topic, name in (
        (FluidPressure, "actuator_pressure", "pressure"),
        (JointState, "stem_state", "place"),
    ):

        def note(message, name=name):
            value = message.position[0] if name == "place" else message.fluid_pressure
            stamp = message.header.stamp
            heard[name].append((stamp.sec * 10**9 + stamp.nanosec, round(value, 9)))

        live.client.node.create_subscription(kind, f"{NAMESPACE}/{topic}", note, STREAM)
    device = Device(lambda: said[next(turn) % 4])
    given = {"host": "127.0.0.1", "port": device.port, "address": ADDRESS, "rate": 50.0,
             "longest": 0.5, "position_scale": -2e-4, "position_at_zero": 0.02}  # fmt: skip
    gateway = live.start("hart_ip_gateway", given, script=GATEWAY)
    live.client.wait_until(lambda: len(heard["place"]) > 10, "samples")
    device.close()
    live.client.wait_until(lambda: "is lost, tried again" in gateway.errors, "the complaint")
    count = len(heard["place"])
    device = Device(lambda: said[next(turn) % 4], device.port)
    live.client.wait_until(lambda: len(heard["place"]) > count + 10, "samples again")
    live.client.wait_until(lambda: len(heard["place"]) == len(heard["pressure"]), "both signals")
    assert device.asked[0] == (0, bytes((0x80 | ADDRESS,)))
    assert {one for one in device.asked if one[0] == 3} == {(3, LONG)}
    gateway.stop()
    device.close()
    assert {value for _, value in heard["pressure"]} == {1.5e5, 1.25e5}
    assert {value for _, value in heard["place"]} == {0.016, 0.012}
    stamps = [stamp for stamp, _ in heard["place"]]
    assert stamps == sorted(set(stamps))
    assert stamps == [stamp for stamp, _ in heard["pressure"]]
