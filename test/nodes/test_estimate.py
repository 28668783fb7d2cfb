# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The topic `~/estimate`: one message a valve, at each change; topics of numbers by a parameter."""

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from live_nodes import NAMESPACE, SECOND, START, stamp_of, values_of
from records import quick_record
from sensor_msgs.msg import JointState

from valve_friction_ros.health import Level

TOPIC = f"{NAMESPACE}/identifier/estimate"
BUFFERED = {"buffered_samples", "buffered_pressures", "buffered_positions"}
OF_THE_INPUTS = {"estimate_age [s]", *BUFFERED}


def test_one_message_at_each_change(live):
    live.start_identifier({"valve_tag": "FV-101/A"})
    client = live.client
    heard = client.listen(DiagnosticStatus, TOPIC)
    client.wait_until(lambda: heard, "the message of the start")
    assert values_of(heard[-1])["estimate_valid"] == "false"

    client.identified(quick_record())
    client.wait_until(lambda: values_of(heard[-1])["estimate_valid"] == "true", "an estimate")
    shown, estimate = client.last_values(), values_of(heard[-1])
    assert heard[-1].hardware_id == "FV-101/A"
    assert heard[-1].message == client.statuses[-1][1].message
    for key in ("coulomb_friction [N]", "coulomb_friction half width [N]", "dead_band [%]",
                "dead_band half width [%]"):  # fmt: skip
        assert estimate[key] == shown[key]
    assert estimate["estimate_time"].endswith("Z")
    assert not OF_THE_INPUTS & set(estimate)

    # Diagnostics go on, once a second; what is known stays, and nothing is said.
    known = len(heard)
    for _ in range(3):
        client.next_status()
    assert len(heard) == known

    assert client.trigger("set_baseline").success
    client.wait_until(lambda: "baseline_coulomb_friction [N]" in values_of(heard[-1]), "a baseline")
    assert client.trigger("clear").success
    assert not client.trigger("identify").success
    client.wait_until(lambda: values_of(heard[-1])["estimate_valid"] == "false", "a refusal")
    assert "no samples" in values_of(heard[-1])["reason"]
    assert heard[-1].level == bytes([Level.OK])


def test_a_late_listener_gets_the_last_message(live):
    live.start_identifier()
    live.client.identified(quick_record())
    late = live.client.latched(DiagnosticStatus, TOPIC)
    assert values_of(late)["coulomb_friction verdict"] == "identified"


@pytest.mark.parametrize("asked", [True, False])
def test_topics_of_numbers_are_a_parameter(live, asked):
    live.start_identifier({"number_topics": asked})
    client = live.client
    client.latched(DiagnosticStatus, TOPIC)
    client.send_record(quick_record(), START + SECOND)
    topics = dict(client.node.get_topic_names_and_types())
    numbers = [name for name in topics if name.startswith(f"{NAMESPACE}/identifier/friction/")]
    assert bool(numbers) is asked
    assert (f"{NAMESPACE}/identifier/sweep" in topics) is asked


def test_the_numbers_in_one_stamped_message(live):
    """All of an identification, by name; what nobody asks for is no topic of the graph."""
    asked = dict.fromkeys(("estimate_topic", "number_topics"), False) | {"result_topic": True}
    live.start_identifier(asked)
    client = live.client
    client.identified(quick_record())
    result = client.latched(JointState, f"{NAMESPACE}/identifier/result")
    shown = client.last_values()
    found = dict(zip(result.name, zip(result.position, result.effort, strict=True), strict=True))
    for name in ("coulomb_friction", "viscous_friction"):
        unit = {"coulomb_friction": "N", "viscous_friction": "N·s/m"}[name]
        value, half_width = found[name]
        assert value == pytest.approx(float(shown[f"{name} [{unit}]"]), rel=1e-3)
        assert half_width == pytest.approx(float(shown[f"{name} half width [{unit}]"]), rel=1e-2)
    end = START + 10_000_000 * (len(quick_record()) - 1)
    assert abs(stamp_of(result.header.stamp) - end) < 250  # ns: a double of seconds since 1970
    own = f"{NAMESPACE}/identifier/"
    topics = {name for name, _ in client.node.get_topic_names_and_types() if name.startswith(own)}
    assert topics == {f"{own}result"}
