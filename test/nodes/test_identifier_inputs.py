# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Inputs of an identifier: missing and mismatched ones are warned of; samples by the block."""

import contextlib
import itertools

import numpy as np
import pytest
from live_nodes import NAMESPACE, OK, START, STREAM, WARN, stamps_of, values_of
from processes import PATIENCE
from rclpy.duration import Duration
from rclpy.qos import QoSProfile, ReliabilityPolicy
from records import quick_record
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout, String

from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE

PRESSURE, STEM = f"{NAMESPACE}/actuator_pressure", f"{NAMESPACE}/stem_state"


@pytest.fixture(scope="module")
def client(shared):
    shared.start("identifier", {"input_timeout": 2.0})  # it reports silence soon
    return shared.client


@contextlib.contextmanager
def publisher(client, kind, topic, qos=STREAM):
    made = client.node.create_publisher(kind, topic, qos)
    try:
        yield made
    finally:
        client.node.destroy_publisher(made)


def warned_of(client, topic, cause):
    """Wait for a warning of one cause for one topic."""
    return client.next_status(
        lambda status: any(
            f"no data on {topic} for" in part and cause in part
            for part in status.message.split("; ")
        ),
        f"a warning that {topic}: {cause}",
    )


def test_nobody_publishes(client):
    for topic in (PRESSURE, STEM):
        status = warned_of(client, topic, "it has no publisher")
        assert status.level == WARN
    values = values_of(status)
    assert values["NE 107"] == "C"
    assert values["estimate_valid"] == "false"
    assert "nothing has been identified yet" in status.message


def test_wrong_type(client):
    with publisher(client, String, STEM) as wrong:
        status = warned_of(client, STEM, "it is published as std_msgs/msg/String")
        wrong.publish(String(data="0.01"))
        assert "not sensor_msgs/msg/JointState" in status.message
        assert status.level == WARN
        warned_of(client, PRESSURE, "it has no publisher")


def test_silent_publisher(client):
    with publisher(client, FluidPressure, PRESSURE):
        status = warned_of(client, PRESSURE, "its publisher is silent")
        assert status.level == WARN
        warned_of(client, STEM, "it has no publisher")


def sends_until_taken(client, made):
    """Publish stem positions until some have got into the buffer."""
    stamp = START

    def is_taken():
        nonlocal stamp
        stamp += 20_000_000
        message = JointState(name=["stem"], position=[0.0])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
        made.publish(message)
        return STEM not in client.statuses[-1][1].message

    client.wait_until(is_taken, "samples of the stem")


def test_two_publishers_at_once(client):
    """Their samples are mixed, and if their stamps rise nothing else shows it."""
    node = client.node.get_fully_qualified_name()
    told = f"2 publishers send {STEM} at the same time, from {node}: stop"
    with publisher(client, JointState, STEM) as one, publisher(client, JointState, STEM) as other:
        turns = itertools.cycle((one, other))

        def is_told():
            next(turns).publish(JointState())
            return told in client.statuses[-1][1].message

        client.wait_until(is_told, told)
        assert client.statuses[-1][1].level == WARN

        def is_over():
            one.publish(JointState())
            return told not in client.statuses[-1][1].message

        client.wait_until(is_over, "its end")


@pytest.mark.slow
def test_best_effort_and_reliable_publishers_alike(client):
    best_effort = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    for quality in (best_effort, STREAM, best_effort):
        warned_of(client, STEM, "it has no publisher")
        with publisher(client, JointState, STEM, quality) as made:
            sends_until_taken(client, made)
    warned_of(client, STEM, "it has no publisher")
    with (
        publisher(client, JointState, STEM),
        publisher(client, JointState, STEM, best_effort) as made,
    ):
        sends_until_taken(client, made)


TOPIC = f"{NAMESPACE}/identifier/samples"
COLUMNS = "time,pressure,position"
RECORD = quick_record()
ROWS = np.column_stack([stamps_of(RECORD) / 1e9, RECORD.pressure, RECORD.position])


def block(rows, labels=("sample", COLUMNS), sizes=None):
    rows = np.asarray(rows, float)
    dimensions = [
        MultiArrayDimension(label=label, size=size, stride=0)
        for label, size in zip(labels, sizes or rows.shape, strict=True)
    ]
    layout = MultiArrayLayout(dim=dimensions)
    return Float64MultiArray(layout=layout, data=rows.ravel().tolist())


@pytest.fixture(scope="module")
def fed(client):
    """The client, and the publisher of its blocks."""
    blocks = client.node.create_publisher(Float64MultiArray, TOPIC, STREAM)
    client.wait_until(blocks.get_subscription_count, "the subscription")
    return client, blocks


def send(publisher, rows, size=50):
    for begin in range(0, len(rows), size):
        publisher.publish(block(rows[begin : begin + size]))
    assert publisher.wait_for_all_acked(Duration(seconds=PATIENCE)), "not acknowledged"


def is_warned(status):
    return status.level == WARN


def test_the_numbers_are_those_of_the_record(fed):
    client, publisher = fed
    client.empty_the_buffer()
    send(publisher, ROWS)
    client.identified_whole(2 * len(RECORD))
    expected = identify(RECORD, BENCH_VALVE)
    assert client.friction("coulomb_friction", "rms") == {
        "coulomb_friction": expected.values["coulomb_friction"],
        "rms": expected.misfit.rms,
    }


def test_a_valve_fed_by_blocks_needs_no_topics(fed):
    client, publisher = fed
    client.empty_the_buffer()
    sent = 0

    def status_after(message):
        nonlocal sent
        publisher.publish(block(ROWS[sent : sent + 1]))
        sent += 1
        return client.next_status(lambda status: "no data" not in status.message, message)

    for _ in range(4):  # each a second: longer than the topics may be silent
        assert status_after("no warning").level == OK
    status = client.next_status(is_warned, "a warning of silence")
    assert f"no data on {TOPIC}" in status.message
    assert "its publisher is silent" in status.message
    assert f"no data on {NAMESPACE}/actuator_pressure" not in status.message
    assert values_of(status)["NE 107"] == "C"
    assert status_after("no warning").level == OK


NO_BLOCKS = {
    "columns": (
        block(ROWS[:4], ("sample", "time,position,pressure")),
        f"the columns are 'time,position,pressure', not '{COLUMNS}'",
    ),
    "length": (
        block(ROWS[:4], sizes=(5, 3)),
        "there are 12 numbers from offset 0, not 5 × 3 from 0",
    ),
}


@pytest.mark.parametrize("name", NO_BLOCKS)
def test_what_is_no_block_is_told_until_one_comes(fed, name):
    client, publisher = fed
    client.empty_the_buffer()
    message, reason = NO_BLOCKS[name]
    publisher.publish(message)
    status = client.next_status(lambda one: reason in one.message, "the reason")
    assert status.level == WARN
    assert f"a block on {TOPIC}: {reason}" in status.message
    assert values_of(status)["buffered_samples"] == "0"
    publisher.publish(block(ROWS[:4]))
    status = client.next_status(lambda one: reason not in one.message, "the end of the warning")
    assert values_of(status)["buffered_samples"] == "8"


def test_the_stamps_are_those_of_the_topics(fed):
    """Microseconds of seconds since 1970: what a float still tells apart."""
    client, publisher = fed
    client.empty_the_buffer()
    client.connect()
    send(publisher, ROWS[:100])
    client.wait_for_buffered(200)
    client.send_pressure(stamps_of(RECORD)[99], RECORD.pressure[99])
    client.send_stem(stamps_of(RECORD)[100], RECORD.position[100])
    assert "actuator_pressure repeats a time stamp (1 samples)" in client.identify_all(201).message
