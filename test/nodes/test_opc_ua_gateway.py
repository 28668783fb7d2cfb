# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The gateway of the examples, between a simulated OPC UA server and an identifier."""

import asyncio
import contextlib
import threading
from datetime import datetime, timedelta, timezone

import numpy as np
import pytest
from live_nodes import PROJECT
from local_server import free_port

from valve_friction_ros.records import ReadingOptions, read_recordings, read_valve_file

asyncua = pytest.importorskip("asyncua")
ua = asyncua.ua
GATEWAY = PROJECT / "examples" / "opc_ua_gateway.py"
EXAMPLES = PROJECT / "examples"
START = datetime(2026, 1, 2, tzinfo=timezone.utc)


class SimulatedServer:
    """A server with two variables, in a thread of its own."""

    def __init__(self):
        self.url = f"opc.tcp://127.0.0.1:{free_port()}/"
        self.loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        self._thread.start()

    def do(self, work):
        return asyncio.run_coroutine_threadsafe(work, self.loop).result(60.0)

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
        for count, (time, *values) in enumerate(samples):
            stamp = (START + timedelta(seconds=time)).replace(tzinfo=None)
            for node, value in zip(self.nodes, values, strict=True):
                given = ua.DataValue(ua.Variant(float(value)), SourceTimestamp=stamp)
                await self.server.write_attribute_value(node.nodeid, given)
            if count % 20 == 0:
                await asyncio.sleep(0.1)  # as they would come at 200 Hz

    def close(self):
        with contextlib.suppress(Exception):
            self.do(self.server.stop())
        self.loop.call_soon_threadsafe(self.loop.stop)
        self._thread.join(10.0)


@pytest.fixture
def server():
    served = SimulatedServer()
    served.do(served.start())
    yield served
    served.close()


def heard(server, client, value):
    """Serve a sample of the day before; return whether the next diagnostic tells of both signals.

    Each has a stamp of its own: a server does not tell a sample again.
    """
    day_before = -86_400.0 + len(client.statuses)
    server.do(server.serve([(day_before, *value)]))
    values = client.status_values()
    return int(values["buffered_pressures"]) and int(values["buffered_positions"])


@pytest.mark.slow
def test_a_record_of_a_server_is_identified(server, live):
    described = read_valve_file(EXAMPLES / "fv_101.yaml")
    options = ReadingOptions(described.columns)
    (read,) = read_recordings(EXAMPLES / "five_seconds.csv", described.valve, options)
    record = read.recording()
    times = np.arange(len(record)) * record.sample_period
    travel = described.valve.travel
    live.start_identifier(
        {"diaphragm_area": described.valve.diaphragm_area, "pressure_reference": 0.0,
         "pressure_minimum": -1e4, "pressure_maximum": 4e5, "method": "bench"}
    )  # fmt: skip
    parameters = {"url": server.url, "position_scale": travel / 100, "sampling": 0.0}
    gateway = live.start("opc_ua_gateway", parameters, script=GATEWAY)
    live.client.wait_until(lambda: "ready" in gateway.errors + gateway.output, "the gateway")
    rows = np.column_stack((times, record.pressure / 1e5, 100 * record.position / travel))
    # The first samples may come before the publishers know their subscriber.
    live.client.wait_until(lambda: heard(server, live.client, rows[0, 1:]), "the first sample")
    server.do(server.serve(rows))
    live.client.wait_for_buffered(2 * len(rows))
    assert live.client.trigger("identify").success
    values = live.client.last_values()
    assert float(values["coulomb_friction [N]"]) == pytest.approx(400.0, rel=0.02)
