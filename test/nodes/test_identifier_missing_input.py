# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A missing or mismatched input is a warning that names the topic and the cause."""

import contextlib

import pytest
from live_nodes import NAMESPACE, START, STREAM, WARN, values_of
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import String

PRESSURE, STEM = f"{NAMESPACE}/actuator_pressure", f"{NAMESPACE}/stem_state"


@pytest.fixture(scope="module")
def client(shared):
    shared.start("identifier", {"input_timeout": 0.5})
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
