# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Samples by the block on `~/samples`: the same numbers, the same rules, and what is no block."""

import numpy as np
import pytest
from live_nodes import NAMESPACE, OK, STREAM, WARN, stamps_of, values_of
from records import quick_record
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout

from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE

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
def fed(shared):
    """Client of an identifier that reports silence soon, and the publisher of its blocks."""
    shared.start("identifier", {"input_timeout": 2.0})
    client = shared.client
    publisher = client.node.create_publisher(Float64MultiArray, TOPIC, STREAM)
    client.wait_until(publisher.get_subscription_count, "the subscription")
    return client, publisher


def send(publisher, rows, size=50):
    for begin in range(0, len(rows), size):
        publisher.publish(block(rows[begin : begin + size]))


def is_warned(status):
    return status.level == WARN


def test_the_numbers_are_those_of_the_record(fed):
    client, publisher = fed
    client.empty_the_buffer()
    send(publisher, ROWS)
    response = client.identify_all(2 * len(RECORD))
    assert response.success, response.message
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
