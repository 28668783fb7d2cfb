"""What is said of an input that does not arrive."""

from types import SimpleNamespace

import pytest
from sensor_msgs.msg import FluidPressure

from valve_friction_ros.nodes.plumbing import input_watch


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
    monkeypatch.setattr(input_watch.time, "monotonic", lambda: now[0])
    publisher = SimpleNamespace(topic_type="sensor_msgs/msg/FluidPressure")
    node = SimpleNamespace(get_publishers_info_by_topic=lambda _: [publisher])
    watch = input_watch.InputWatch(
        node, SimpleNamespace(topic_name="/fv_101/actuator_pressure", msg_type=FluidPressure)
    )
    if has_arrived:
        watch.arrived()
    now[0] += silence
    said = watch.problem(3.0)
    assert said.startswith(f"no data on /fv_101/actuator_pressure for {silence} s: {cause}")
    assert ("killed" in said) == ("killed" in cause)
