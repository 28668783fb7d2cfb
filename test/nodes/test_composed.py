# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Nodes in a user's own process: in each executor of rclpy, by their life cycle, and documented."""

import contextlib
import gc
import importlib.metadata
import re
import socket
import threading
import time
import urllib.error
import urllib.request

import pytest
import rclpy
from extension.node_graph import graph_as_markdown, graph_of
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from live_nodes import NAMESPACE, NODE, OK, PROJECT, values_of
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
STATED = {
    "clock_tolerance": 0.0,
    "input_timeout": 600.0,
    "history_file": "",
    **vars(BENCH_VALVE),
}


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
                ended.wait(0.01)
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


def test_a_step_that_outlasts_the_end_is_no_bug(compose, monkeypatch, capfd):
    """As of the first sample, while its libraries are loaded on a busy machine."""
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
    node.destroy_node()
    destroyed.set()
    node._thread.join(60)
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


@pytest.mark.parametrize("kind", [TurnExecutor, SingleThreadedExecutor])
def test_a_clean_up_ends_an_identification(live, compose, monkeypatch, kind):
    """What followed met topics and a service that were gone, and ended the executor of a user."""
    begun, cleaned = threading.Event(), threading.Event()

    def slow(*arguments):
        begun.set()
        cleaned.wait(60)
        return identify_with_numbers(*arguments)

    monkeypatch.setattr(workers, "identify_with_numbers", slow)
    client, node = live.client, compose(lifecycle=True)
    with spun(node, kind(context=compose.context)):
        assert change(client, Transition.TRANSITION_CONFIGURE)
        assert change(client, Transition.TRANSITION_ACTIVATE)
        client.connect()
        client.fill(quick_record())
        client.request(Trigger, f"{NODE}/identify", Trigger.Request())
        client.wait_until(begun.is_set, "an identification")
        assert change(client, Transition.TRANSITION_DEACTIVATE)
        assert change(client, Transition.TRANSITION_CLEANUP)
        cleaned.set()
        for _ in range(2):
            client.drain()
            assert state(client) == State.PRIMARY_STATE_UNCONFIGURED
        assert change(client, Transition.TRANSITION_CONFIGURE)
        assert change(client, Transition.TRANSITION_ACTIVATE)
        assert client.next_status().level == OK
    assert not node.failures


def test_a_configuration_that_waits_for_a_server_lets_the_executor_continue(
    live, compose, tmp_path
):
    """The server accepts a connection and never says anything."""
    pytest.importorskip("psycopg", reason="run `make venv-database`")
    client, turns = live.client, []
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"postgresql://me@127.0.0.1:{silent.getsockname()[1]}/valves?connect_timeout=4"
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
            assert time.monotonic() - begun > 3.5
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
