# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is said of an input that does not arrive."""

from types import SimpleNamespace

import pytest

from valve_friction_ros.nodes.plumbing import polled_subscription


@pytest.mark.parametrize(
    ("silence", "has_arrived", "cause"),
    [
        (5.0, False, "its publisher is silent, or still waits for a node that was killed, for up"),
        (25.0, False, "its publisher is silent"),
        (5.0, True, "its publisher is silent"),
    ],
)
def test_a_publisher_that_may_wait_for_a_dead_node(monkeypatch, silence, has_arrived, cause):
    now = [100.0]
    monkeypatch.setattr(polled_subscription.time, "monotonic", lambda: now[0])
    publisher = SimpleNamespace(topic_type="sensor_msgs/msg/FluidPressure")
    node = SimpleNamespace(get_publishers_info_by_topic=lambda _: [publisher])
    watch = polled_subscription.InputWatch(node, "/fv_101/actuator_pressure", publisher.topic_type)
    if has_arrived:
        watch.arrived()
    now[0] += silence
    said = watch.problem(3.0)
    assert said.startswith(f"no data on /fv_101/actuator_pressure for {silence} s: {cause}")
    assert ("killed" in said) == ("killed" in cause)
