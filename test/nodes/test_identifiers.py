# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Identifiers of several valves in one process, of which one may be flooded with samples."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from live_nodes import NAMESPACE, PROJECT, SECOND, START, WARN, values_of
from records import quick_record
from std_srvs.srv import Trigger

from valve_friction_ros.health.friction_monitor import MOST_SAMPLES
from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE

OTHER = "/fv_102"


@pytest.fixture
def client(live, tmp_path):
    config = tmp_path / "valves.yaml"
    config.write_text(
        "/identifiers:\n  ros__parameters:\n    valves: [fv_101, fv_102]\n"
        "/**:\n  ros__parameters:\n    input_timeout: 600.0\n"
        f"{OTHER}/identifier:\n  ros__parameters:\n    valve_tag: FV-102\n    window: 5.0\n"
    )
    live.start("identifiers", arguments=["--params-file", str(config)], namespace=None)
    live.client.connect()
    return live.client


def test_each_valve_has_its_own(client):
    record = quick_record()
    client.send_record(record, START)
    client.wait_until(
        lambda: {status.hardware_id for _, status in client.statuses} == {"fv_101", "FV-102"},
        "diagnostics of both",
    )
    status = client.next_status(
        lambda one: values_of(one)["buffered_samples"] == "1000", "all samples"
    )
    assert status.name == f"{NAMESPACE}/identifier: friction"
    client.success("identify")
    expected = identify(record, BENCH_VALVE).values["coulomb_friction"]
    assert client.friction("coulomb_friction") == {"coulomb_friction": expected}

    response = client.call(Trigger, f"{OTHER}/identifier/identify", Trigger.Request())
    assert not response.success
    assert "no samples of actuator_pressure" in response.message
    assert client.parameters(f"{OTHER}/identifier", "window", "valve_tag") == [5.0, "FV-102"]
    assert client.parameters(f"{NAMESPACE}/identifier", "window") == [60.0]
    assert client.parameters("/identifiers", "valves") == [["fv_101", "fv_102"]]


def identifying_processes(pid):
    """The processes that Python has spawned for a node."""
    found = [
        int(child)
        for task in Path(f"/proc/{pid}/task").iterdir()
        for child in (task / "children").read_text().split()
    ]
    return [
        one for one in found if b"plumbing.processes" in Path(f"/proc/{one}/cmdline").read_bytes()
    ]


@pytest.mark.slow
def test_processes_identify_and_may_die(live):
    parameters = {"valves": ["fv_101"], "identification_processes": 1, "input_timeout": 600.0}
    process = live.start("identifiers", parameters, namespace=None)
    client, record = live.client, quick_record()
    client.connect()
    client.send_record(record, START)
    client.next_status(lambda one: values_of(one)["buffered_samples"] == "1000", "all samples")
    expected = identify(record, BENCH_VALVE).values["coulomb_friction"]
    assert client.trigger("identify").success
    assert client.friction("coulomb_friction") == {"coulomb_friction": expected}
    (identifying,) = identifying_processes(process.pid)
    os.kill(identifying, signal.SIGKILL)
    assert "ended before it answered" in client.refusal("identify")
    assert client.trigger("identify").success


def endpoints(node, place):
    """The topics that an identifier publishes and hears, and its services, of two endpoints."""
    return [
        {name for name, _ in asked("identifier", place)}
        for asked in (
            node.get_publisher_names_and_types_by_node,
            node.get_subscriber_names_and_types_by_node,
            node.get_service_names_and_types_by_node,
        )
    ]


def test_a_valve_of_a_plant_takes_little_of_the_graph(live):
    """Every participant learns of every endpoint; more than twenty valves have no such services."""
    parameters = {"valves": ["fv_101"], "parameter_services": False, "number_topics": False}
    live.start("identifiers", parameters, namespace=None)
    client = live.client
    client.next_status()
    client.wait_until(lambda: len(endpoints(client.node, NAMESPACE)[2]) == 7, "its services")
    published, heard, services = endpoints(client.node, NAMESPACE)
    assert published == {"/diagnostics", "/rosout"}
    assert heard == {f"{NAMESPACE}/actuator_pressure", f"{NAMESPACE}/stem_state"}
    assert services == {
        f"{NAMESPACE}/identifier/{name}"
        for name in (
            "identify",
            "set_baseline",
            "restore_baseline",
            "save",
            "report",
            "clear",
            "reset_usage",
        )
    }
    assert len(published) + len(heard) + 2 * len(services) <= 20

    told = client.listen(DiagnosticStatus, f"{NAMESPACE}/identifier/estimate")
    client.wait_until(lambda: told, "what is asked for")


RATE, WINDOW = 10_000, 20.0
OWN, OTHERS = 10.0, 2.0
"""Most processor time, s, for the answer of the flooded valve, and before that of another: beside
what taking the samples in costs."""


@pytest.fixture
def storm(live):
    """Flood the second of two valves; the first is the client's. Its client and its process."""
    process = live.start(
        "identifiers",
        {"valves": "[fv_101, fv_102]", "window": WINDOW, "input_timeout": 600.0},
        namespace=None,
    )
    live.client.connect()
    path = os.pathsep.join(
        [str(PROJECT), str(PROJECT / "test" / "support"), os.environ.get("PYTHONPATH", "")]
    )
    storm = subprocess.Popen(
        [sys.executable, "-m", "storm", "/fv_102", "--rate", str(RATE), "--seconds", "600"],
        env=os.environ | {"ROS_DOMAIN_ID": str(live.domain.number), "PYTHONPATH": path},
    )
    yield live.client, process
    storm.kill()
    storm.wait()


def status_of(client, valve, condition):
    return client.next_status(
        lambda one: one.name.startswith(valve) and condition(values_of(one)), f"status of {valve}"
    )


def times(pid):
    """Processor time that all threads of a process have used, s, and the time, s."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    used = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return np.array([used, time.monotonic()])


@pytest.mark.slow
def test_a_storm_on_one_valve_is_bounded_work_and_leaves_the_other_its_turn(storm):
    """The times are those of the process: what others do on this machine is none of its work.

    A slow machine takes samples in for longer, until an answer is there: that share is no delay.
    """
    client, process = storm
    client.send_record(quick_record())
    status_of(client, NAMESPACE, lambda one: one["buffered_samples"] == "1000")
    flooded_since = times(process.pid)
    status_of(client, "/fv_102", lambda one: int(one["buffered_positions"]) > 1.1 * MOST_SAMPLES)
    begun = times(process.pid)
    used, lasted = begun - flooded_since

    def beside_samples():
        since, waited = times(process.pid) - begun
        return since - waited * used / lasted

    flooded = client.request(Trigger, "/fv_102/identifier/identify", Trigger.Request())
    other = client.request(Trigger, f"{NAMESPACE}/identifier/identify", Trigger.Request())
    answer = client.wait_until_answered(other)
    delay = beside_samples()
    assert answer.success, answer.message
    answer = client.wait_until_answered(flooded)
    own = beside_samples()
    assert answer.success, answer.message
    assert own <= OWN
    assert delay <= OTHERS
    values = values_of(status_of(client, "/fv_102", lambda one: "averaged_samples" in one))
    assert int(values["averaged_samples"]) >= 2


@pytest.mark.slow
def test_lost_messages_are_a_warning_with_their_share_until_it_is_over(live):
    """A queue of ten takes a burst of a thousand."""
    depth = "qos_overrides./fv_101/actuator_pressure.subscription.depth"
    client = live.client_of_identifier({depth: 10})
    client.send_pressure(START, 1e5)
    client.next_status(lambda one: values_of(one)["buffered_pressures"] == "1", "the first")
    for number in range(1, 1001):
        client.send_pressure(START + number * SECOND // 1000, 1e5)
    status = client.next_status(lambda one: "were lost" in one.message, "the loss")
    values = values_of(status)
    lost, taken = int(values["pressures lost [messages]"]), int(values["buffered_pressures"])
    assert lost + taken == 1001
    assert float(values["pressures lost [%]"]) == pytest.approx(100 * lost / 1001, rel=1e-2)
    assert status.level == WARN
    assert values["NE 107"] == "C"
    assert (
        f"messages on {NAMESPACE}/actuator_pressure were lost in the last minute" in status.message
    )
    assert f"({lost} of 1001)" in status.message
    status = client.next_status(lambda one: "were lost" not in one.message, "its end")
    assert status.level < WARN
    assert values_of(status)["pressures lost [messages]"] == str(lost)
