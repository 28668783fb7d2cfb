# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Streams that are polled, and the executor that runs what is ready, over real DDS."""

import time
from types import SimpleNamespace

import numpy as np
import processes
import pytest
import rclpy
from live_nodes import SECOND, Client, Domain, time_of
from processes import PATIENCE
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from valve_friction_ros.nodes.identifier.valve_inputs import ValveInputs, _Input
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode, TurnExecutor, create_service
from valve_friction_ros.nodes.plumbing.polled_subscription import PolledSubscription
from valve_friction_ros.nodes.plumbing.qos import blocks, stream
from valve_friction_ros.streams import Losses


@pytest.fixture
def bench():
    """A polled node in this process, the executor of its services, and a client beside it."""
    domain = Domain()
    client = Client(domain)
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=domain.number)
    node = PolledNode("polled", context=context)
    executor = TurnExecutor(context=context)
    executor.add_node(node)
    yield node, executor, client
    executor.shutdown()
    node.destroy_node()
    context.try_shutdown()
    client.close()
    domain.release()


def wait_until(condition, what):
    return processes.wait_until(condition, lambda: what)


def sender(client, polled):
    """Create a publisher that the subscription has met."""
    publisher = client.node.create_publisher(Float64, polled.topic, blocks())
    wait_until(publisher.get_subscription_count, "the subscription")
    return lambda *values: [publisher.publish(Float64(data=float(value))) for value in values]


def taken(polled, count):
    """Poll until `count` messages have come."""
    messages = []
    wait_until(lambda: messages.extend(polled.take()) or len(messages) >= count, "the messages")
    return messages


@pytest.mark.parametrize("raw", [False, True])
def test_messages_are_taken_in_their_order(bench, raw):
    node, _, client = bench
    polled = PolledSubscription(node, Float64, "numbers", blocks(), raw)
    assert polled.take() == []
    begin = time.time_ns()
    sender(client, polled)(*range(500))
    messages = taken(polled, 500)
    read = [deserialize_message(one.message, Float64) if raw else one.message for one in messages]
    assert [one.data for one in read] == list(range(500))
    received = [one.received for one in messages]
    assert received == sorted(received)
    assert begin - SECOND < received[0] <= received[-1] < time.time_ns() + SECOND


@pytest.mark.parametrize(("lost", "share"), [(10017, "100 %"), (20, "0.2 %")])
def test_the_share_of_lost_messages_is_read_as_a_number(lost, share):
    losses = Losses(lost=lost, recently_lost=lost, recently_taken=10045 - lost, silence=0.0)
    told = _Input.loss_problem(SimpleNamespace(losses=losses, topic="numbers"))
    assert told.startswith(f"{share} of the messages on numbers were lost in the last minute")


def send_all(publisher, messages):
    """Publish in bursts that no queue of the transport is overrun by."""
    for begin in range(0, len(messages), 200):
        for message in messages[begin : begin + 200]:
            publisher.publish(message)
        assert publisher.wait_for_all_acked(Duration(seconds=PATIENCE)), "not acknowledged"


def test_where_the_executor_takes_all_messages_nothing_else_takes_them(bench):
    """The EventsExecutor heeds no callback groups: of two takers none would know the order."""
    node, executor, client = bench
    executor.remove_node(node)
    events = EventsExecutor(context=node.context)
    events.add_node(node)
    polled = PolledSubscription(node, Float64, "numbers", blocks())
    publisher = client.node.create_publisher(Float64, "numbers", blocks())
    wait_until(publisher.get_subscription_count, "the subscription")
    send_all(publisher, [Float64(data=float(number)) for number in range(500)])
    messages = polled.take()
    assert messages == []

    def all_came():
        events.spin_once(0.01)
        messages.extend(polled.take())
        return len(messages) >= 500

    wait_until(all_came, "the messages")
    events.shutdown()
    assert [one.message.data for one in messages] == list(range(500))


def test_a_flood_is_taken_by_turns(bench):
    """What others may wait for at most; `is_all` takes what the queue held."""
    node, _, client = bench
    polled = PolledSubscription(node, Float64, "numbers", stream())
    other = PolledSubscription(node, Float64, "numbers", stream())
    publisher = client.node.create_publisher(Float64, "numbers", stream())
    wait_until(lambda: publisher.get_subscription_count() == 2, "the subscriptions")
    send_all(publisher, [Float64(data=float(number)) for number in range(4_000)])
    assert len(other.take(is_all=True)) == 4_000
    sizes = []
    for more in (True, False):
        sizes.append(len(polled.take()))
        assert polled.has_more is more
    assert sizes == [3_000, 1_000]
    assert polled.losses.lost == other.losses.lost == 0


def test_one_signal_waits_for_the_other_that_has_more_than_its_share(bench):
    """Otherwise the stem would run ahead of its pressure."""
    node, _, client = bench
    arrived = []
    inputs = ValveInputs(node, "stem", arrived.append, lambda *_: None)
    pressure = client.node.create_publisher(FluidPressure, "actuator_pressure", stream())
    stem = client.node.create_publisher(JointState, "stem_state", stream())
    for publisher in pressure, stem:
        wait_until(publisher.get_subscription_count, "the subscription")
    messages = [FluidPressure(fluid_pressure=1e5) for _ in range(4_000)]
    for number, message in enumerate(messages):
        message.header.stamp = time_of(number)
    send_all(pressure, messages)
    message = JointState(name=["stem"], position=[0.01])
    message.header.stamp = time_of(4_000)
    send_all(stem, [message])

    def kinds():
        inputs.take()
        return np.bincount(arrived[-1].kinds, minlength=2).tolist()

    assert kinds() == [3_000, 0]
    assert kinds() == [1_000, 1]


def test_no_executor_takes_them(bench):
    node, executor, client = bench
    polled = PolledSubscription(node, Float64, "numbers", blocks())
    sender(client, polled)(1, 2, 3)
    time.sleep(0.2)
    executor.turn()
    assert [one.message.data for one in taken(polled, 3)] == [1, 2, 3]

    other = SingleThreadedExecutor(context=node.context)
    other.add_node(node)
    client.node.create_publisher(Float64, "/polled/numbers", blocks())
    sender(client, polled)(4)
    for _ in range(20):
        other.spin_once(timeout_sec=0.01)
    assert [one.message.data for one in taken(polled, 1)] == [4]
    other.shutdown()


def test_no_events_of_the_middleware_are_watched(bench):
    node, *_ = bench
    node.create_publisher(Float64, "out", 1)
    PolledSubscription(node, Float64, "numbers", blocks())
    assert list(node.waitables) == []


class TestTurn:
    def requests(self, client, count, name="/polled/work"):
        caller = client.node.create_client(Trigger, name)
        wait_until(caller.service_is_ready, "the service")
        return [caller.call_async(Trigger.Request()) for _ in range(count)]

    def test_one_answers_all_requests_that_wait(self, bench):
        node, executor, client = bench
        answered = []

        async def work():
            answered.append(1)
            return ""

        create_service(node, "~/work", work)
        for _ in range(10):  # clients, each of which sends up to ten requests at once
            self.requests(client, 5)
        time.sleep(0.5)
        assert executor.turn()
        assert len(answered) == 50
        assert not executor.turn()

    def test_it_runs_timers_and_does_not_wait(self, bench):
        node, executor, _ = bench
        ticks = []
        node.create_timer(0.05, lambda: ticks.append(1))
        begin = time.monotonic()
        executor.turn()
        assert time.monotonic() - begin < 0.04
        time.sleep(0.1)
        assert not executor.turn()
        assert ticks == [1]

    def test_what_a_callback_raises_is_kept_to_its_node(self, bench, capfd):
        node, executor, _ = bench
        faults, calls = [KeyError("a bug")], []

        def work():
            calls.append(1)
            if faults:
                raise faults[0]

        node.create_timer(0.01, work)
        other = PolledNode("other", context=node.context)
        other.create_timer(0.01, lambda: calls.append(2))
        executor.add_node(other)

        def turned(value):
            del calls[:]
            wait_until(lambda: executor.turn() or {1, 2} <= set(calls), "both timers")
            return value()

        (failure,) = turned(lambda: node.failures)
        assert failure.startswith("internal error: KeyError: 'a bug' (test_polling.py, line ")
        turned(lambda: node.failures)
        assert capfd.readouterr().err.count("Traceback (most recent call last)") == 1
        assert other.failures == ()
        faults.clear()
        assert turned(lambda: node.failures) == ()
        other.destroy_node()

    def test_what_a_service_raises_is_kept_to_its_node(self, bench):
        node, executor, client = bench
        node.create_service(Trigger, "~/work", lambda *_: 1 / 0)
        self.requests(client, 1)
        wait_until(lambda: executor.turn() or node.failures, "the bug")
        assert node.failures[0].startswith("internal error: ZeroDivisionError")
