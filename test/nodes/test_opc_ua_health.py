# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The gateway to OPC UA: what a client of a control system reads of a live valve."""

import asyncio
import threading

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from live_nodes import NAMESPACE, PROJECT
from local_server import free_port
from records import quick_record
from std_srvs.srv import SetBool

from valve_friction_ros.health import Baseline, StatusSignal
from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION

asyncua = pytest.importorskip("asyncua")
ua = asyncua.ua
GATEWAY = PROJECT / "examples" / "opc_ua_health.py"
NODE = f"{NAMESPACE}/identifier"
DI, OWN = "http://opcfoundation.org/UA/DI/", "urn:valve_friction_ros:health"


class ControlSystem:
    """A client of OPC UA, driven step by step; it notes the events of a valve."""

    def __init__(self, url):
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self._client = asyncua.Client(url, timeout=20.0)
        self.events = []
        self.do(self._client.connect())
        self.di, self.own = (self.do(self._client.get_namespace_index(one)) for one in (DI, OWN))

    def do(self, work):
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(60.0)

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
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(10.0)


@pytest.fixture
def served(live):
    """The gateway, and who connects clients to it."""
    url = f"opc.tcp://127.0.0.1:{free_port()}/"
    gateway = live.start(
        "opc_ua_health", {"endpoint": url, "silent_after": 3.0}, script=GATEWAY, namespace=None
    )
    live.client.wait_until(lambda: "ready" in gateway.errors + gateway.output, "the gateway")
    system = ControlSystem(url)
    yield system
    system.close()


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
        others = [DiagnosticStatus(name="another node: friction less", hardware_id="X")]
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
