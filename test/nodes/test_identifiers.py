"""Identifiers of several valves in one process."""

import os
import signal
from pathlib import Path

import pytest
from live_nodes import NAMESPACE, START, values_of
from records import quick_record
from std_srvs.srv import Trigger

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
    response = client.trigger("identify")
    assert response.success, response.message
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
    return [one for one in found if b"spawn_main" in Path(f"/proc/{one}/cmdline").read_bytes()]


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
    response = client.trigger("identify")
    assert not response.success
    assert "has ended before its answer" in response.message
    assert client.trigger("identify").success
