# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Nodes in a user's own process, and identifiers of several valves in one process."""

import contextlib
import gc
import importlib.metadata
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from extension.node_graph import graph_as_markdown, graph_of
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from live_nodes import NAMESPACE, NODE, OK, PROJECT, SECOND, START, WARN, values_of
from local_server import free_port
from rcl_interfaces.srv import GetParameters
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.parameter import Parameter
from records import quick_record
from std_msgs.msg import Empty
from std_srvs.srv import Trigger
from type_description_interfaces.srv import GetTypeDescription

from valve_friction_ros.health import identify_with_numbers
from valve_friction_ros.health.friction_monitor import MOST_SAMPLES
from valve_friction_ros.history import HistoryFile
from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.nodes import Dashboard, PressureSource, Simulator, StrokePlayer
from valve_friction_ros.nodes.identifier import workers
from valve_friction_ros.nodes.identifier.node import Identifier
from valve_friction_ros.nodes.plumbing import polled_node, polled_subscription, rclpy_private
from valve_friction_ros.nodes.plumbing.polled_node import PacedNode, TurnExecutor

EXECUTORS = {
    "single": SingleThreadedExecutor,
    "multi": MultiThreadedExecutor,
    "events": EventsExecutor,
}
STATED = {"clock_tolerance": 0.0, "input_timeout": 600.0, "history_file": "", **vars(BENCH_VALVE)}


def overrides(**changes):
    return [Parameter(name, value=value) for name, value in (STATED | changes).items()]


@contextlib.contextmanager
def spun(node, executor):
    """Turn a node's executor in a thread, as a user's process does."""
    executor.add_node(node)
    ended = threading.Event()

    def turn():
        while not ended.is_set():
            if isinstance(executor, TurnExecutor):
                executor.turn()
                node.poll_guarded()
                ended.wait(0.001)  # a turn takes one message where they come by callbacks
            else:
                executor.spin_once(timeout_sec=0.1)

    thread = threading.Thread(target=turn)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        executor.shutdown()


@pytest.fixture
def compose(live):
    """Return what makes an identifier in this process, in the domain of the client."""
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=live.domain.number)
    made = []

    def make(**changes):
        made.append(
            Identifier(
                namespace=NAMESPACE, context=context, parameter_overrides=overrides(**changes)
            )
        )
        return made[-1]

    make.context = context
    yield make
    for node in made:
        node.destroy_node()
    context.try_shutdown()
    # rclpy prints what tasks of a destroyed node raised when they are collected: here, and not in
    # the midst of another test.
    gc.collect()


def converse(client):
    """Ask a composed identifier for all that a user may ask for."""
    client.connect()
    parameters = client.call(
        GetParameters, f"{NODE}/get_parameters", GetParameters.Request(names=["window"])
    )
    assert parameters.values[0].double_value == 60.0
    client.set_parameters(NODE, {"window": 50.0})
    described = client.call(
        GetTypeDescription,
        f"{NODE}/get_type_description",
        GetTypeDescription.Request(type_name="none"),
    )
    assert not described.successful  # it knows no such type, and says so
    client.fill(quick_record())
    assert "the stem ignores reversals smaller than" in client.success("identify")
    values = values_of(client.next_status())
    assert values["coulomb_friction verdict"] == "identified"


@pytest.mark.parametrize("kind", EXECUTORS)
def test_identifier_works_in_each_executor_of_rclpy(live, compose, kind):
    with spun(compose(), EXECUTORS[kind](context=compose.context)):
        converse(live.client)


@pytest.mark.parametrize("kind", ["single", "turns"])
def test_identifier_works_where_rclpy_offers_no_way_behind_it(live, compose, kind, monkeypatch):
    """As on a version of rclpy whose private calls have gone: messages come by callbacks."""
    for module in (polled_node, polled_subscription):
        monkeypatch.setattr(module, "takes_directly", lambda _: False)
    for name in ("take_messages", "take_request"):
        monkeypatch.delattr(rclpy_private, name)
    made = TurnExecutor if kind == "turns" else SingleThreadedExecutor
    with spun(compose(), made(context=compose.context)):
        converse(live.client)


def test_the_version_of_rclpy_has_been_tried():
    names = ("ros-jazzy-rclpy", "ros-kilted-rclpy", "rclpy")
    for name in names:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            version = importlib.metadata.version(name)
            break
    assert version in rclpy_private.CHECKED, (
        f"run test/nodes with rclpy {version}, and add it to CHECKED of rclpy_private.py"
    )


@pytest.mark.parametrize(
    ("kind", "wrong", "words"),
    [
        (PressureSource, {"excitation": "noise"}, "excitation 'noise' is unknown"),
        (PressureSource, {"time_jitter": 1.0}, "must be below half of the sampling period"),
        (Simulator, {"static_friction": 1.0}, "must not be below coulomb_friction"),
        (StrokePlayer, {}, "the parameter file is empty: give the file of `plan-test --output`"),
        (Dashboard, {"accounts_file": "/nowhere/accounts"}, "/nowhere/accounts"),
    ],
)
def test_a_refused_node_leaves_the_graph(compose, kind, wrong, words):
    """A user's process may go on without it; nobody must find services that never answer."""
    watcher = rclpy.create_node("watcher", context=compose.context)
    changes = [Parameter(name, value=value) for name, value in wrong.items()]
    with pytest.raises((ValueError, OSError), match=re.escape(words)) as refused:
        kind(context=compose.context, parameter_overrides=changes)
    assert set(watcher.get_node_names()) <= {"watcher", "tester"}, refused
    watcher.destroy_node()


@pytest.mark.parametrize("ends", ["node", "rclpy"])
def test_a_step_that_outlasts_the_end_is_no_bug(compose, monkeypatch, capfd, ends):
    """As of the first sample, while its libraries are loaded on a busy machine, or at Ctrl-C."""
    monkeypatch.setattr(polled_node, "_STEP_PATIENCE", 0.01)
    begun, destroyed = threading.Event(), threading.Event()

    class Slow(PacedNode):
        def step(self):
            begun.set()
            destroyed.wait(60)
            self.alive.publish(Empty())
            return 0.0

    node = Slow("slow", context=compose.context)
    node.alive = node.create_publisher(Empty, "alive", 1)
    node.poll_guarded()
    assert begun.wait(60)
    if ends == "node":
        node.destroy_node()
    else:
        compose.context.shutdown()
    destroyed.set()
    node._thread.join(60)
    assert not node._thread.is_alive()
    assert not node.failures
    assert "internal error" not in capfd.readouterr().err


def change(client, transition, node=NODE):
    request = ChangeState.Request(transition=Transition(id=transition))
    return client.call(ChangeState, f"{node}/change_state", request).success


def state(client):
    return client.call(GetState, f"{NODE}/get_state", GetState.Request()).current_state.id


def test_life_cycle(live, compose):
    """Unconfigured: nothing; inactive: it refuses; active: it works; all of it twice."""
    client = live.client
    with spun(compose(lifecycle=True), TurnExecutor(context=compose.context)):
        for _ in range(2):
            assert state(client) == State.PRIMARY_STATE_UNCONFIGURED
            assert not client.node.get_subscriptions_info_by_topic(f"{NAMESPACE}/stem_state")
            assert change(client, Transition.TRANSITION_CONFIGURE)
            assert state(client) == State.PRIMARY_STATE_INACTIVE
            assert "is inactive: activate it" in client.refusal("identify")

            assert change(client, Transition.TRANSITION_ACTIVATE)
            client.connect()
            client.identified(quick_record())
            assert change(client, Transition.TRANSITION_DEACTIVATE)
            client.drain()
            heard = len(client.statuses)
            client.drain(1.5)
            assert len(client.statuses) == heard  # an inactive node publishes nothing
            assert change(client, Transition.TRANSITION_ACTIVATE)
            values = values_of(client.next_status())
            assert values["coulomb_friction verdict"] == "identified"  # what is known is kept
            assert change(client, Transition.TRANSITION_DEACTIVATE)
            assert change(client, Transition.TRANSITION_CLEANUP)
            client.disconnect()
        assert change(client, Transition.TRANSITION_UNCONFIGURED_SHUTDOWN)
        assert state(client) == State.PRIMARY_STATE_FINALIZED


def test_a_managed_node_that_has_ended_leaves_the_graph(live, compose):
    """Its state machine kept it there, for 20 s after the end of a process."""
    client, node = live.client, compose(lifecycle=True)
    client.wait_until(lambda: "identifier" in client.node.get_node_names(), "the node")
    node.destroy_node()
    client.wait_until(lambda: "identifier" not in client.node.get_node_names(), "its end", 10.0)


@pytest.mark.parametrize("kind", [TurnExecutor, SingleThreadedExecutor])
def test_a_transition_that_the_state_does_not_have_is_refused(live, compose, kind):
    """It was never answered, and ended the executor of a user."""
    client, node = live.client, compose(lifecycle=True)
    with spun(node, kind(context=compose.context)):
        for illegal in (Transition.TRANSITION_CLEANUP, Transition.TRANSITION_ACTIVATE, 200):
            assert not change(client, illegal)
        assert change(client, Transition.TRANSITION_CONFIGURE)
        assert not change(client, Transition.TRANSITION_CONFIGURE)
        assert state(client) == State.PRIMARY_STATE_INACTIVE
    assert not node.failures


@pytest.fixture
def held(monkeypatch):
    """Identifications of this process begin, and wait until the second event."""
    begun, released = threading.Event(), threading.Event()

    def slow(*arguments):
        begun.set()
        released.wait(60)
        return identify_with_numbers(*arguments)

    monkeypatch.setattr(workers, "identify_with_numbers", slow)
    yield begun, released
    released.set()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"diaphragm_area": 0.09}, "the parameters of the valve were changed during"),
        ({"use_sim_time": True}, "no time on /clock although use_sim_time is set"),
    ],
)
def test_a_result_of_another_valve_or_without_a_date_is_refused(
    live, compose, held, tmp_path, change, reason
):
    """It raised and ended alarms, and went into the history, as of this valve or of 1970."""
    file = tmp_path / "history.sqlite"
    client, node = live.client, compose(history_file=str(file))
    with spun(node, TurnExecutor(context=compose.context)):
        client.connect()
        client.fill(quick_record())
        asked = client.request(Trigger, f"{NODE}/identify", Trigger.Request())
        client.wait_until(held[0].is_set, "an identification")
        client.set_parameters(NODE, change)
        held[1].set()
        answer = client.wait_until_answered(asked)
        assert not answer.success
        assert reason in answer.message
        assert client.status_values()["estimate_valid"] == "false"
    assert all(one.time > 1e18 for one in HistoryFile(file).entries())


AWAITING = [TurnExecutor, SingleThreadedExecutor, MultiThreadedExecutor]


@pytest.mark.parametrize("kind", AWAITING)
def test_a_clean_up_ends_an_identification(live, compose, held, kind):
    """What followed met topics and a service that were gone, and ended the executor of a user.

    The caller waited for an answer without end.
    """
    client, node = live.client, compose(lifecycle=True)
    with spun(node, kind(context=compose.context)):
        assert change(client, Transition.TRANSITION_CONFIGURE)
        assert change(client, Transition.TRANSITION_ACTIVATE)
        client.connect()
        client.fill(quick_record())
        asked = client.request(Trigger, f"{NODE}/identify", Trigger.Request())
        client.wait_until(held[0].is_set, "an identification")
        assert change(client, Transition.TRANSITION_DEACTIVATE)
        assert change(client, Transition.TRANSITION_CLEANUP)
        answer = client.wait_until_answered(asked)
        assert not answer.success
        assert (
            "the node was cleaned up or shut down before ~/identify had finished" in answer.message
        )
        held[1].set()
        for _ in range(2):
            client.drain()
            assert state(client) == State.PRIMARY_STATE_UNCONFIGURED
        assert change(client, Transition.TRANSITION_CONFIGURE)
        assert change(client, Transition.TRANSITION_ACTIVATE)
        assert client.next_status().level == OK
    assert not node.failures


@pytest.mark.parametrize("kind", AWAITING)
def test_the_end_of_a_node_answers_what_it_was_asked(live, compose, held, kind):
    """The caller waited for an answer without end; other nodes of the executor go on."""
    client, node = live.client, compose()
    executor = kind(context=compose.context)
    turns = []
    other = rclpy.create_node("other", context=compose.context)
    other.create_timer(0.02, lambda: turns.append(time.monotonic()))
    executor.add_node(other)
    with spun(node, executor):
        client.connect()
        client.fill(quick_record())
        asked = client.request(Trigger, f"{NODE}/identify", Trigger.Request())
        client.wait_until(held[0].is_set, "an identification")
        executor.remove_node(node)
        node.destroy_node()
        answer = client.wait_until_answered(asked)
        assert not answer.success
        assert "the node was stopped before ~/identify had finished" in answer.message
        held[1].set()
        before = len(turns)
        client.wait_until(lambda: len(turns) > before + 5, "turns of the other node")
    other.destroy_node()


def test_a_server_that_does_not_answer_never_stops_the_executor(live, compose, tmp_path):
    """The server accepts a connection and never says anything."""
    pytest.importorskip("psycopg", reason="run `make venv-database`")
    client, turns = live.client, []
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"postgresql://me@127.0.0.1:{silent.getsockname()[1]}/valves?connect_timeout=2"
        node = compose(
            lifecycle=True, history_url=url, history_file=str(tmp_path / "history.sqlite")
        )
        other = rclpy.create_node("other", context=compose.context)
        other.create_timer(0.02, lambda: turns.append(time.monotonic()))
        executor = SingleThreadedExecutor(context=compose.context)
        executor.add_node(other)
        with spun(node, executor):
            begun = time.monotonic()
            assert change(client, Transition.TRANSITION_CONFIGURE)
            assert time.monotonic() - begun > 1.5
            cleaned = time.monotonic()
            assert change(client, Transition.TRANSITION_CLEANUP)
            assert time.monotonic() - cleaned < 1.0
            request = ChangeState.Request(transition=Transition(label="configure"))
            asked = client.request(ChangeState, f"{NODE}/change_state", request)
            client.wait_until(lambda: "await" in str(threading.enumerate()), "a wait")
            node.destroy_node()
            assert not client.wait_until_answered(asked).success
        assert sum(one > begun for one in turns) > 20
        other.destroy_node()


def test_a_wrong_parameter_leaves_the_node_unconfigured(live, compose):
    client = live.client
    with spun(compose(lifecycle=True, warn_ratio=3.0), TurnExecutor(context=compose.context)):
        assert not change(client, Transition.TRANSITION_CONFIGURE)
        assert state(client) == State.PRIMARY_STATE_UNCONFIGURED
        client.set_parameters(NODE, {"warn_ratio": 1.5})
        assert change(client, Transition.TRANSITION_CONFIGURE)


def test_pages_rest_with_the_node(live):
    port = free_port()
    live.start("dashboard", {"port": port, "lifecycle": True}, namespace=None)
    client = live.client

    def page():
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=5) as answer:
                return answer.status
        except urllib.error.HTTPError as error:
            return error.code
        except OSError:
            return None

    client.wait_until(lambda: page() == 503, "a page of a dashboard at rest")
    for _ in range(2):
        for transition, code in (
            (Transition.TRANSITION_CONFIGURE, 503),
            (Transition.TRANSITION_ACTIVATE, 200),
            (Transition.TRANSITION_DEACTIVATE, 503),
            (Transition.TRANSITION_CLEANUP, 503),
        ):
            assert change(client, transition, "/dashboard")
            assert page() == code


PAGE = PROJECT / "doc" / "reference" / "nodes.md"


@pytest.mark.parametrize(
    ("node", "some"),
    [
        ("identifier", {"stem_command", "~/friction/mass", "~/identify"}),
        ("simulator", {"actuator_pressure", "stem_state"}),
        ("pressure_source", {"actuator_pressure"}),
        ("stroke_player", {"stem_state", "pressure_set_point", "~/start", "~/stop"}),
        ("dashboard", {"/diagnostics"}),
    ],
)
def test_each_topic_and_service_has_a_meaning(node, some):
    found = graph_of(node)
    assert some <= {name for names in found.values() for name in names}
    page = PAGE.read_text(encoding="utf-8")
    for kind, names in found.items():
        if names:
            assert f"```{{node-graph}} {node} {kind}\n" in page
            text = graph_as_markdown(node, kind)
            assert all(name.rpartition("/")[2] in text for name in names)


def test_a_valve_without_a_namespace_is_called_as_its_node(compose):
    named = {"context": compose.context, "parameter_overrides": overrides()}
    node = Identifier(cli_args=["--ros-args", "-r", "__node:=kitchen_valve"], **named)
    status = node.stuck_status("")
    node.destroy_node()
    assert (status.name, status.hardware_id) == ("/kitchen_valve: friction", "kitchen_valve")


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

    refusal = client.refusal("identify", f"{OTHER}/identifier")
    assert "no samples of actuator_pressure" in refusal
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
    own = ("identify", "set_baseline", "restore_baseline", "save", "report", "clear", "reset_usage")
    assert services == {f"{NAMESPACE}/identifier/{name}" for name in own}
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
