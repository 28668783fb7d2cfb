# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What an identifier publishes and logs of its estimates, and identifications by its schedule."""

import math

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from histories import as_kept
from live_nodes import NAMESPACE, NODE, SECOND, START, SimulatedClock, stamp_of, values_of
from records import quick_record
from sensor_msgs.msg import JointState

from valve_friction_ros.health import Level
from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE, Recording

TOPIC = f"{NODE}/estimate"
BUFFERED = {"buffered_samples", "buffered_pressures", "buffered_positions"}
OF_THE_INPUTS = {"estimate_age [s]", *BUFFERED}


def test_one_message_at_each_change(live):
    client = live.client_of_identifier({"valve_tag": "FV-101/A"})
    heard = client.listen(DiagnosticStatus, TOPIC)
    client.wait_until(lambda: heard, "the message of the start")
    assert values_of(heard[-1])["estimate_valid"] == "false"

    client.identified(quick_record())
    client.wait_until(lambda: values_of(heard[-1])["estimate_valid"] == "true", "an estimate")
    shown, estimate = client.last_values(), values_of(heard[-1])
    assert client.latched(DiagnosticStatus, TOPIC) == heard[-1]  # as a late listener gets it
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


def test_the_numbers_in_one_stamped_message(live):
    """All of an identification, by name; what nobody asks for is no topic of the graph."""
    asked = dict.fromkeys(("estimate_topic", "number_topics"), False) | {"result_topic": True}
    client = live.client_of_identifier(asked)
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


def lines(process, words):
    return [line for line in process.errors.splitlines() if words in line]


def test_each_event_is_logged_once(live):
    process = live.start_identifier({"input_timeout": 1.0})
    client, node = live.client, f"{NAMESPACE}/identifier"
    client.wait_until(lambda: lines(process, "ready"), "the ready line")
    client.wait_until(lambda: lines(process, "level OK → WARN"), "a change of level")
    refusal = client.trigger("identify").message
    assert f"no data on {NAMESPACE}/actuator_pressure for" in refusal
    assert "its publisher is silent" in refusal
    assert "no samples of actuator_pressure" in refusal
    # A patient node is content with old samples, so that no slow machine adds changes of level.
    assert client.set_together(node, {"input_timeout": 600.0}).successful
    answer = client.identified(quick_record())
    client.wait_until(lambda: lines(process, "level WARN → OK"), "a content node")
    baseline = client.trigger("set_baseline").message
    assert client.set_together(node, {"input_timeout": 1.0}).successful
    client.wait_until(lambda: len(lines(process, "level OK → WARN")) == 2, "silence again")
    (ready,) = lines(process, "ready")
    assert f"{NAMESPACE}/actuator_pressure and {NAMESPACE}/stem_state" in ready
    identified = lines(process, "identified: ")
    assert answer.split("; ")[-1] in identified[-1]
    assert len(lines(process, baseline)) == 1
    assert len(lines(process, "level WARN → OK")) == 1


RECORD = quick_record()
EXPECTED = as_kept(identify(RECORD, BENCH_VALVE).parameters["coulomb_friction"])


def skipped(words):
    return lambda status: words in values_of(status).get("scheduled_skip", "")


def test_it_identifies_without_being_asked(live, history):
    node = live.start_identifier({"period": 0.2})
    client = live.client
    status = client.next_status(skipped("no samples of actuator_pressure"), "a skip")
    assert status.message == "no estimate: nothing has been identified yet"
    values = values_of(status)
    assert values["reason"] == ""
    assert 0 <= float(values["scheduled_skip_age [s]"]) < 30
    client.send_record(RECORD, START)

    def is_whole():
        entries = history.entries()
        return entries and entries[-1].friction == EXPECTED

    client.wait_until(is_whole, "an identification of the whole record")
    assert client.friction("coulomb_friction") == {"coulomb_friction": EXPECTED.value}
    status = client.next_status(skipped("no new samples since the last identification"), "a skip")
    assert values_of(status)["estimate_valid"] == "true"
    assert not any(entry.refusal for entry in history.entries())
    count = len(history.entries())

    # A record that tells nothing leaves verdict and history as they are, and the log too.
    assert client.trigger("clear").success
    still = Recording(0.01, RECORD.pressure, 0 * RECORD.position)
    client.send_record(still, START + 60 * SECOND)
    client.wait_for_buffered(2 * len(still))
    status = client.next_status(skipped("the stem"), "a skip")
    assert "refused" not in status.message
    assert values_of(status)["estimate_valid"] == "true"
    assert values_of(status)["reason"] == ""
    assert len(history.entries()) == count
    assert "refused" not in node.errors

    # Asked for, the same is a refusal.
    assert not client.trigger("identify").success
    assert "the latest identification was refused" in client.next_status().message
    assert history.entries()[-1].refusal


def test_the_period_is_changed_while_it_runs(live):
    client = live.client_of_identifier()
    assert "scheduled_skip" not in client.status_values()
    assert client.set_together(NODE, {"period": 0.1}).successful
    client.next_status(skipped("no samples"), "a skip")
    assert client.set_together(NODE, {"period": 0.0}).successful
    client.next_status(lambda status: "scheduled_skip" not in values_of(status), "the end of it")
    assert not client.set_together(NODE, {"period": -1.0}).successful


def test_by_simulated_time(live):
    """The clock of a simulation or of a bag, not the wall's."""
    client = live.client_of_identifier({"period": 100.0, "use_sim_time": True})
    clock = SimulatedClock(client)
    clock.now = 1_000 * SECOND

    def tick_until(condition, step):
        before = len(client.statuses)
        clock.run_until(
            lambda: any(condition(*one) for one in client.statuses[before:]),
            "a status",
            step * SECOND,
        )

    def skipped_at(stamp, status):
        age = float(values_of(status).get("scheduled_skip_age [s]", "nan"))
        return stamp_of(stamp) / SECOND - age if skipped("no samples")(status) else math.nan

    tick_until(lambda _, status: "/clock" not in status.message, 0)
    reached = clock.now / SECOND
    # The first clock comes long after zero, so the schedule is due at once, and 100 s later.
    tick_until(lambda *one: skipped_at(*one) >= reached, 1)
    tick_until(lambda *one: skipped_at(*one) >= reached + 100, 1)
    times = {round(skipped_at(*one)) for one in client.statuses if skipped_at(*one) > 0}
    first, second = sorted(times)[0], sorted(times)[-1]
    assert reached <= first < reached + 100 <= second < reached + 300
    assert sum(time < reached + 100 for time in times) == 1
