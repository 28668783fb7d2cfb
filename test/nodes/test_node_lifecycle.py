# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Starting with impossible parameters, and stopping by Ctrl-C."""

import failing_identifier
import numpy as np
import pytest
from live_nodes import NAMESPACE, PROJECT, Domain, NodeProcess, buffered, stamps_of, values_of
from records import quick_record, simulated
from slow_identifier import FINISH, SCRIPT
from std_srvs.srv import Trigger

from valve_friction_ros.history import HistoryFile
from valve_friction_ros.identification import published_estimate
from valve_friction_ros.model import BENCH_VALVE, Recording, SineWave

IDENTIFY = f"{NAMESPACE}/identifier/identify"
OK, ERROR = b"\x00", b"\x02"
NODES = ("identifier", "simulator", "pressure_source")
PLAYED = str(PROJECT / "test/nodes/played_pressure.csv")
BAD_STARTS = {  # node, parameters, words of the only line
    "even window": ("identifier", {"derivative_window": 30}, "window must be odd"),
    "limits": ("identifier", {"warn_ratio": 3.0}, "warn_ratio < error_ratio"),
    "range": ("identifier", {"diaphragm_area": -1.0}, "diaphragm_area"),
    "integer": ("identifier", {"diaphragm_area": 1}, "diaphragm_area"),
    "friction": ("simulator", {"coulomb_friction": 600.0}, "static_friction"),
    "quality": (
        "simulator",
        {f"qos_overrides.{NAMESPACE}/stem_state.publisher.reliability": "perhaps"},
        "reliability",
    ),
    "excitation": ("pressure_source", {"excitation": "noise"}, "'noise' is unknown"),
    "levels": ("pressure_source", {"low": 2e5}, "low (200000) must be below high"),
    "no valves": ("identifiers", {}, "no valve is named"),
    "valve twice": ("identifiers", {"valves": "[fv_1, fv_1]"}, "valve /fv_1 is named twice"),
    "one namespace": ("identifiers", {"valves": "[fv_1, fv_2]"}, "/fv_1 is remapped to /fv_101"),
    "no namespace": ("identifiers", {"valves": "[fv-1]"}, "fv-1"),
    "no file": ("pressure_source", {"excitation": "file", "file": "no.csv"}, "no.csv"),
    "file pressure": (
        "pressure_source",
        {"excitation": "file", "file": PLAYED, "file_maximum": 1e5},
        "150000 Pa breaks file_maximum (100000 Pa)",
    ),
    "file rate": (
        "pressure_source",
        {"excitation": "file", "file": PLAYED, "file_rate": 2e4},
        "25000 Pa/s breaks file_rate (20000 Pa/s)",
    ),
    "no file name": ("pressure_source", {"excitation": "file"}, "file"),
}


@pytest.mark.parametrize("name", BAD_STARTS)
def test_impossible_parameter_ends_the_start_with_one_line(tmp_path, name):
    node, parameters, words = BAD_STARTS[name]
    domain = Domain()
    process = NodeProcess(node, domain, tmp_path, parameters)
    try:
        code = process.exit_code()
    finally:
        process.kill()
        domain.release()
    assert code == 2, process.errors
    (line,) = process.errors.splitlines()
    assert words in line
    assert process.output == ""


@pytest.mark.parametrize("arguments", [["-p", "window"], ["--params-file", "missing.yaml"]])
def test_malformed_arguments_end_the_start_without_a_traceback(tmp_path, arguments):
    domain = Domain()
    process = NodeProcess("simulator", domain, tmp_path, arguments=arguments)
    try:
        code = process.exit_code()
    finally:
        process.kill()
        domain.release()
    assert code == 2, process.errors
    assert "Traceback" not in process.errors
    assert arguments[-1] in process.errors


def test_ctrl_c_stops_every_node(live):
    processes = [live.start(name) for name in NODES]
    live.client.wait_until(lambda: nodes_of(live.client).issuperset(NODES), "the nodes")
    live.client.wait_until(lambda: live.client.statuses, "a diagnostic")
    for process in processes:
        live.client.watched.remove(process)
        process.stop()


def nodes_of(client):
    """Names of the nodes in the valve's namespace."""
    found = client.node.get_node_names_and_namespaces()
    return {name for name, namespace in found if namespace == NAMESPACE}


def begin_identification(client):
    """Request an identification, and return its future once it is under way."""
    running = client.request(Trigger, IDENTIFY, Trigger.Request())
    second = client.call(Trigger, IDENTIFY, Trigger.Request())
    assert not second.success
    assert "already running" in second.message
    assert not running.done()
    return running


def test_ctrl_c_during_an_identification(live, tmp_path):
    process = live.start_identifier(script=SCRIPT)
    client = live.client
    client.send_record(quick_record())
    client.wait_for_buffered(1000)
    begin_identification(client)
    client.watched.remove(process)
    process.interrupt()
    client.wait_until(lambda: "identifier" not in nodes_of(client), "the end of the node")
    (tmp_path / FINISH).touch()
    process.require_good_end()


def test_long_identification_loses_no_sample(live, tmp_path):
    """What arrives while an identification runs is taken at once, and identified by the next."""
    live.start_identifier({"method": "bench"}, script=SCRIPT)
    client = live.client
    whole = simulated(SineWave(period=5.0).sample(np.arange(1000) / 100), 0.01)
    begin, rest = slice(500), slice(500, 1000)
    stamps = stamps_of(whole)
    client.send(*((stamps[begin], signal[begin]) for signal in (whole.pressure, whole.position)))
    client.wait_for_buffered(1000)
    running = begin_identification(client)
    client.send(*((stamps[rest], signal[rest]) for signal in (whole.pressure, whole.position)))
    client.next_status(lambda status: buffered(status) == 2000, "all samples")
    assert not running.done()

    (tmp_path / FINISH).touch()
    response = client.wait_until_answered(running)
    assert response.success, response.message
    half = published_estimate(
        Recording(0.01, whole.pressure[begin], whole.position[begin]), BENCH_VALVE
    )
    assert client.friction("sigma") == {"sigma": half.sigma}
    assert client.trigger("identify").success
    sigma = published_estimate(whole, BENCH_VALVE).sigma
    assert sigma != half.sigma
    assert client.friction("sigma") == {"sigma": sigma}


def test_a_bug_is_an_internal_error_and_the_next_record_identifies(live, tmp_path):
    history = HistoryFile(tmp_path / "valve_friction_ros" / "history.sqlite")
    process = live.start_identifier(script=failing_identifier.SCRIPT)
    client = live.client
    client.send_record(quick_record())
    client.wait_for_buffered(1000)
    response = client.trigger("identify")
    assert not response.success
    words = "internal error: ZeroDivisionError: nobody foresaw it (failing_identifier.py, line "
    assert response.message.startswith(words)
    assert response.message.endswith("): report it, with what ~/save writes")

    status = client.next_status()
    assert status.level == ERROR
    assert status.message.startswith(words)
    values = values_of(status)
    assert values["NE 107"] == "C"
    assert values["estimate_valid"] == "false"
    assert values["reason"] == response.message
    assert "[ERROR]" in process.errors
    assert process.errors.count("Traceback (most recent call last)") == 1
    assert 'raise ZeroDivisionError("nobody\\nforesaw it")' in process.errors

    # The same bug again is not logged again.
    assert client.trigger("identify").message == response.message
    assert process.errors.count("Traceback (most recent call last)") == 1
    assert history.entries() == ()

    (tmp_path / failing_identifier.MENDED).touch()
    client.identified_whole(1000)
    assert client.next_status().level == OK
    assert all(not entry.refusal for entry in history.entries())
    process.forgive_tracebacks()
