# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Streams that are polled, what is read out of their messages, and the executor of the nodes."""

import contextlib
import itertools
import time
from types import SimpleNamespace

import numpy as np
import processes
import pytest
import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from hypothesis import given, settings
from hypothesis import strategies as st
from live_nodes import SECOND, Client, Domain, time_of
from processes import PATIENCE
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64, Header
from std_srvs.srv import Trigger

from valve_friction_ros.nodes.dashboard import status_of, statuses_in
from valve_friction_ros.nodes.identifier.status import EstimateTopic
from valve_friction_ros.nodes.identifier.valve_inputs import ValveInputs, _Input
from valve_friction_ros.nodes.plumbing import messages, running
from valve_friction_ros.nodes.plumbing.messages import (
    arrivals_of,
    position_of,
    positions_in,
    pressures_in,
    stamp_of,
)
from valve_friction_ros.nodes.plumbing.polled_node import PolledNode, TurnExecutor, create_service
from valve_friction_ros.nodes.plumbing.polled_subscription import PolledSubscription, TakenMessage
from valve_friction_ros.nodes.plumbing.qos import blocks, stream
from valve_friction_ros.streams import Kind, Losses


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


NUMBERS = st.floats(width=64)
TIMES = st.builds(Time, sec=st.integers(-(2**31), 2**31 - 1), nanosec=st.integers(0, 999_999_999))
WORDS = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=12)
NAMES = st.lists(st.one_of(WORDS, st.sampled_from(["stem", "arm"])), max_size=5)


def pressure(stamp, value, frame="actuator", variance=0.0):
    header = Header(stamp=stamp, frame_id=frame)
    return FluidPressure(header=header, fluid_pressure=value, variance=variance)


def serialised(messages):
    return [bytes(serialize_message(message)) for message in messages]


def assert_same(found, expected):
    """Equal to the last bit, nan included."""
    found, expected = np.asarray(found, float), np.asarray(expected, float)
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(np.signbit(found), np.signbit(expected))


def check_pressures(raw):
    read = [deserialize_message(one, FluidPressure) for one in raw]
    stamps, values = pressures_in(raw)
    assert stamps.tolist() == [stamp_of(one.header.stamp) for one in read]
    assert_same(values, [one.fluid_pressure for one in read])


def check_positions(raw, joint):
    read = [deserialize_message(one, JointState) for one in raw]
    expected = [position_of(one, joint) for one in read]
    kinds, stamps, values = positions_in(raw, joint)
    assert stamps.tolist() == [stamp_of(one.header.stamp) for one in read]
    assert (kinds == Kind.POSITION).tolist() == [one is not None for one in expected]
    assert_same(values, [np.nan if one is None else one for one in expected])


@st.composite
def joint_states(draw, count):
    """Messages of one publisher: names and counts are the same, numbers differ."""
    frame, names = draw(WORDS), draw(NAMES)
    sizes = [draw(st.integers(0, 5)) for _ in range(3)]

    def message():
        arrays = [draw(st.lists(NUMBERS, min_size=size, max_size=size)) for size in sizes]
        return JointState(
            header=Header(stamp=draw(TIMES), frame_id=frame),
            name=names,
            **dict(zip(("position", "velocity", "effort"), arrays, strict=True)),
        )

    return [message() for _ in range(count)]


@pytest.mark.parametrize("publishers", ["one", "several"])
@given(frame=WORDS, samples=st.lists(st.tuples(TIMES, NUMBERS, WORDS, NUMBERS), max_size=20))
def test_pressures(publishers, frame, samples):
    check_pressures(
        serialised(
            pressure(at, value, frame if publishers == "one" else own, more)
            for at, value, own, more in samples
        )
    )


@settings(deadline=None)
@given(data=st.data(), joint=st.sampled_from(["stem", "", "arm"]))
def test_positions_of_one_publisher(data, joint):
    check_positions(serialised(data.draw(joint_states(data.draw(st.integers(0, 6))))), joint)


@settings(deadline=None)
@given(data=st.data())
def test_positions_of_several_publishers(data):
    parts = [data.draw(joint_states(2)) for _ in range(3)]
    mixed = [message for several in zip(*parts, strict=True) for message in several]
    check_positions(serialised(mixed), "stem")


@given(garbage=st.lists(st.binary(max_size=12), min_size=2, max_size=8))
def test_bytes_after_the_message_and_in_its_padding_are_nothing(garbage):
    """rclpy leaves either of them as it finds it."""
    raw = serialised(pressure(Time(sec=k), 1e5 + k, "abcdef") for k in range(len(garbage)))
    assert raw[0][12:23] == b"\x07\0\0\0abcdef\0"  # then five bytes of padding
    spoilt = [
        one[:23] + (extra + b"\xff").ljust(5, b"\xaa")[:5] + one[28:] + extra
        for one, extra in zip(raw, garbage, strict=True)
    ]
    check_pressures(spoilt)
    assert messages._alike(spoilt, messages._pressure_layout) is not None


def test_a_stream_is_decoded_as_a_table(monkeypatch):
    """What a publisher usually sends never comes to be deserialised one by one."""

    def refuse(*_):
        raise AssertionError("one by one")

    pressures = serialised(pressure(Time(sec=-k, nanosec=k), 1e5 + k) for k in range(300))
    stems = serialised(
        JointState(header=Header(stamp=Time(sec=k)), name=["arm", "stem"], position=[0.0, 1e-3 * k])
        for k in range(300)
    )
    monkeypatch.setattr(messages, "deserialize_message", refuse)
    assert pressures_in(pressures).values.tolist() == [1e5 + k for k in range(300)]
    assert positions_in(stems, "stem").values.tolist() == [1e-3 * k for k in range(300)]


def big_endian(message):
    """Serialise a pressure without frame the other way round."""
    fields = [
        np.array([message.header.stamp.sec, message.header.stamp.nanosec, 1], ">i4").tobytes(),
        b"\0\0\0\0",  # the frame's end, and padding
        np.array([message.fluid_pressure, message.variance], ">f8").tobytes(),
    ]
    return b"\x00\x00\x00\x00" + b"".join(fields)


def test_the_other_byte_order():
    check_pressures([big_endian(pressure(Time(sec=k, nanosec=7), 1e5 + k, "")) for k in range(3)])


@pytest.mark.parametrize("cut", [0, 3, 11, 20, 30])
def test_what_is_no_message_is_refused_by_the_library(cut):
    (whole,) = serialised([pressure(Time(sec=1), 1e5)])
    with pytest.raises(RuntimeError, match="deserialize"):
        pressures_in([whole[:cut]])


def as_taken(messages, received):
    return [TakenMessage(*pair) for pair in zip(serialised(messages), received, strict=True)]


def test_arrivals_are_in_the_order_of_their_receipt():
    of_stem = [1, 2, 5]
    pressures = as_taken(
        (pressure(Time(nanosec=k), 1.0 * k) for k in (0, 3, 4, 6)), received=(10, 13, 14, 16)
    )
    stems = as_taken(
        (
            JointState(
                header=Header(stamp=Time(nanosec=k)),
                name=["stem" if k != 5 else "arm"],
                position=[0.5 * k],
            )
            for k in of_stem
        ),
        received=(11, 12, 15),
    )
    kinds, stamps, values = arrivals_of(pressures, stems, "stem")
    assert kinds.tolist() == [0, 1, 1, 0, 0, Kind.NO_POSITION, 0]
    assert stamps.tolist() == list(range(7))
    assert_same(values, [0.0, 0.5, 1.0, 3.0, 4.0, np.nan, 6.0])
    assert arrivals_of([], [], "stem").stamps.size == 0


def test_a_topic_keeps_its_order_when_the_clock_of_receipt_is_set_back():
    pressures = as_taken(
        (pressure(Time(nanosec=k), 1.0) for k in range(4)), received=(10, 20, 5, 6)
    )
    stems = as_taken([JointState(header=Header(stamp=Time(nanosec=9)), position=[0.0])], [15])
    assert arrivals_of(pressures, stems, "").stamps.tolist() == [0, 9, 1, 2, 3]


# CDR ends a text with a zero byte, so none is inside; ROS sends UTF-8.
TEXT = st.text(st.characters(exclude_characters="\0", exclude_categories=("Cs",)), max_size=20)
STATUSES = st.builds(
    DiagnosticStatus,
    level=st.binary(min_size=1, max_size=1),
    name=TEXT,
    message=TEXT,
    hardware_id=TEXT,
    values=st.lists(st.builds(KeyValue, key=TEXT, value=TEXT), max_size=5),
)


def array(statuses, frame=""):
    message = DiagnosticArray(status=statuses)
    message.header.frame_id = frame
    return bytes(serialize_message(message))


@given(st.lists(STATUSES, max_size=4), TEXT)
def test_they_are_what_rclpy_reads(statuses, frame):
    found = [(one.name, one.read()) for one in statuses_in(array(statuses, frame))]
    assert found == [(one.name, status_of(one)) for one in statuses]


@given(st.data())
def test_other_bytes_are_refused(data):
    """A message that ends early, or any bytes: a status, or ValueError, and nothing else."""
    whole = array(data.draw(st.lists(STATUSES, min_size=1, max_size=2)))
    cut = whole[: data.draw(st.integers(0, len(whole)))]
    for message in (cut, data.draw(st.binary(max_size=60)), b"\0\1" + data.draw(st.binary())):
        with contextlib.suppress(ValueError):
            for one in statuses_in(message):
                one.read()
        with contextlib.suppress(ValueError):
            for one in statuses_in(message):
                one.mark()


def test_what_ends_within_its_name_is_refused():
    with pytest.raises(ValueError, match="no diagnostics"):
        list(statuses_in(array([DiagnosticStatus(name="a" * 40)])[:30]))


def marks(*statuses):
    return [one.mark() for one in statuses_in(array(statuses))]


def said(message="friction normal", age="1.0", ratio="1.02", count="5"):
    pairs = {"friction_ratio": ratio, "estimate_age [s]": age, "buffered_samples": count}
    values = [KeyValue(key=key, value=value) for key, value in pairs.items()]
    return DiagnosticStatus(name="/v/identifier: friction", message=message, values=values)


@pytest.mark.parametrize(
    ("given", "waits"),
    [
        ({}, True),
        ({"ROS_DISCOVERY_SERVER": "10.0.0.1:11811"}, False),
        ({"ROS_DISCOVERY_SERVER": "10.0.0.1:11811", "ROS_SUPER_CLIENT": "TRUE"}, True),
    ],
)
def test_a_discovery_server_tells_nobody_of_topics_not_yet_used(bench, monkeypatch, given, waits):
    """A node that waited for the other side never met it, so its blocks were never received."""
    for name, value in given.items():
        monkeypatch.setenv(name, value)
    node, _, _ = bench
    PolledSubscription(node, Float64, "numbers", blocks(), is_optional=True)
    EstimateTopic(node, is_wanted=True).publish(DiagnosticStatus())
    assert bool(node.awaited) is bool(node.offered) is waits


@pytest.mark.parametrize(("nodes", "polls"), [(1, 100), (50, 20), (500, 10)])
def test_hundreds_of_nodes_are_polled_once_a_second(monkeypatch, nodes, polls):
    """A poll costs as much for one sample as for a hundred; a hundred turns take ten seconds."""
    clock = itertools.count()
    monkeypatch.setattr(running.time, "monotonic", lambda: next(clock) / 10)
    turns = running._polls([object()] * nodes)
    assert sum(bool(polled) for polled in itertools.islice(turns, 100)) == polls


def test_a_mark_is_that_of_its_status_and_its_essential_keys():
    """Ages and counters leave it, and so does a key within another one."""
    assert marks(said()) == marks(said(age="2.0", count="7"))
    assert marks(said()) != marks(said(ratio="1.03"))
    assert marks(said()) != marks(said(message="friction has grown"))
    alike = DiagnosticStatus(values=[KeyValue(key="my friction_ratio", value="9")])
    assert marks(alike, said()) == [*marks(DiagnosticStatus()), *marks(said())]


def test_bytes_between_the_texts_leave_the_mark():
    """The serialiser leaves them as they were in its memory."""
    whole = bytearray(array([said(message="ab")]))  # three bytes and a zero: none is needed
    (before,) = (one.mark() for one in statuses_in(bytes(whole)))
    place = whole.index(b"friction_ratio\0") + len(b"friction_ratio\0")
    assert -place % 4
    whole[place : place + -place % 4] = b"\xee" * (-place % 4)
    (after,) = (one.mark() for one in statuses_in(bytes(whole)))
    assert after == before
