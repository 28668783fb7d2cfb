# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The main job over topics: samples in, friction out, to the last bit; also by schedule."""

import math

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from histories import as_kept
from live_nodes import NAMESPACE, NODE, SECOND, START, STREAM, SimulatedClock, stamp_of, values_of
from records import bench_record, quick_record
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from valve_friction_ros.health import Level
from valve_friction_ros.identification import (
    PARAMETER_UNITS,
    UNITS,
    IdentificationSettings,
    identify,
    identify_bench,
)
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, Recording

BIAS = 1.13e-3


@pytest.fixture(scope="module")
def bench(shared):
    """Identify two periods of a square wave; return client, core's assessment, answers."""
    client = shared.client_of_identifier({"method": "bench", "position_bias": BIAS})
    early = client.listen(Float64, f"{NAMESPACE}/identifier/friction/coulomb_friction")
    record = bench_record()
    client.fill(record)
    response = client.trigger("identify")
    assessment = identify_bench(record, BENCH_VALVE, IdentificationSettings(position_bias=BIAS))
    return client, assessment, response, early


def test_bench_record_is_identified(bench):
    client, assessment, response, early = bench
    assert response.success, response.message
    client.wait_until(lambda: early, "the result")
    assert [message.data for message in early] == [assessment.values["coulomb_friction"]]
    truth = {name: getattr(LOW_FRICTION, name) for name in UNITS}
    published = assessment.estimate.values
    assert published.pop("mass") == pytest.approx(truth.pop("mass"), rel=0.1)
    assert published == pytest.approx(truth, rel=1e-3)
    for name in ("coulomb_friction", "viscous_friction", "spring_constant", "spring_preload"):
        found = assessment.parameters[name]
        assert abs(found.value - truth[name]) <= 3 * found.half_width


def as_told(values):
    """Comparable to the last bit, nan included."""
    return {name: repr(float(value)) for name, value in values.items()}


def test_late_subscriber_gets_every_number_to_the_last_bit(bench):
    client, assessment, *_ = bench
    values, published = assessment.values, assessment.estimate
    assert np.isnan(values["static_friction"])  # no slip jump: F_s is F_c in the dead band
    dead_band = 2 * values["coulomb_friction"] / values["spring_constant"]
    expected = {
        **{name: values[name] for name in UNITS},
        "dead_band": dead_band / BENCH_VALVE.travel,
        "fit": assessment.misfit.fit,
        "rms": assessment.misfit.rms,
        "threshold": published.threshold,
        "sigma": published.sigma,
        "r_squared": published.r_squared,
        "sliding_friction": values["sliding_friction"],
        "sliding_speed": assessment.sliding_speed,
        "friction_ratio": np.nan,  # no baseline
    }
    assert as_told(client.friction(*expected)) == as_told(expected)
    assert as_told(client.published(*UNITS)) == as_told(published.values)
    half_widths = {name: one.half_width for name, one in assessment.parameters.items()}
    assert as_told(client.half_widths(*half_widths)) == as_told(half_widths)


def test_sweep_is_labelled_and_holds_the_estimate(bench):
    client, assessment, *_ = bench
    estimate = assessment.estimate
    layout, columns = client.sweep()
    sweep = estimate.sweep
    rows, width = sweep.thresholds.size, len(columns)
    assert [(dim.label, dim.size, dim.stride) for dim in layout.dim] == [
        ("threshold", rows, rows * width),
        (",".join(columns), width, width),
    ]
    expected = {
        "threshold": sweep.thresholds,
        **sweep.estimates,
        "sigma": sweep.sigma,
        "r_squared": sweep.r_squared,
        "samples": sweep.samples,
    }
    assert list(columns) == list(expected)
    for name, values in expected.items():
        np.testing.assert_array_equal(columns[name], values, err_msg=name)

    (row,) = np.flatnonzero(columns["threshold"] == estimate.threshold)
    at_row = {name: values[row] for name, values in columns.items()}
    regressed = {name: value for name, value in estimate.values.items() if name in at_row}
    assert len(regressed) == 5
    assert {name: at_row[name] for name in regressed} == regressed
    assert at_row["samples"] == estimate.samples
    assert at_row["sigma"] == estimate.sigma
    assert at_row["r_squared"] == estimate.r_squared


def test_diagnostics(bench):
    client, assessment, response, _ = bench
    begun = len(client.statuses)
    client.wait_until(lambda: len(client.statuses) >= begun + 4, "four diagnostics")
    stamps = [stamp_of(stamp) for stamp, _ in client.statuses[begun:]]
    assert np.median(np.diff(stamps)) == pytest.approx(SECOND, rel=0.25)

    status = client.next_status()
    assert status.name == f"{NAMESPACE}/identifier: friction"
    assert status.hardware_id == "fv_101"
    values = values_of(status)
    published = assessment.estimate
    for name, one in assessment.parameters.items():
        key = f"{name} [{PARAMETER_UNITS[name]}]"
        assert float(values[key]) == pytest.approx(one.value, rel=1e-8, nan_ok=True)
        half_width = float(values[f"{name} half width [{PARAMETER_UNITS[name]}]"])
        assert half_width == pytest.approx(one.half_width, rel=1e-8, nan_ok=True)
        assert values[f"{name} verdict"] == one.verdict.value
        assert values.get(f"{name} reason", "") == one.reason
        if name not in published.values:
            continue
        told = float(values[f"{name} published [{UNITS[name]}]"])
        assert told == pytest.approx(published.values[name], rel=1e-8)
    assert float(values["fit [%]"]) == pytest.approx(100 * assessment.misfit.fit, rel=1e-8)
    assert float(values["threshold [m/s]"]) == pytest.approx(published.threshold, rel=1e-8)
    assert float(values["sigma [N]"]) == pytest.approx(published.sigma, rel=1e-8)
    assert float(values["r_squared"]) == pytest.approx(published.r_squared, rel=1e-8)
    friction, spring = (assessment.values[name] for name in ("coulomb_friction", "spring_constant"))
    band = 200.0 * friction / spring / BENCH_VALVE.travel
    assert float(values["dead_band [%]"]) == pytest.approx(band, rel=1e-6)
    assert int(values["samples"]) == published.samples
    assert float(values["estimate_age [s]"]) > 0
    assert values["estimate_valid"] == "true"
    assert values["reason"] == ""
    assert values["NE 107"] == ""
    assert response.message in status.message


def test_stream_is_received_by_the_quality_of_service_of_the_parameters(live):
    topic = f"{NAMESPACE}/actuator_pressure"
    prefix = f"qos_overrides.{topic}.subscription"
    live.start("identifier", {f"{prefix}.reliability": "best_effort", f"{prefix}.depth": 777})
    client = live.client
    node = f"{NAMESPACE}/identifier"
    (pressure,) = client.wait_until(
        lambda: client.node.get_subscriptions_info_by_topic(topic), "subscription"
    )
    (stem,) = client.wait_until(
        lambda: client.node.get_subscriptions_info_by_topic(f"{NAMESPACE}/stem_state"), "the other"
    )
    assert pressure.qos_profile.reliability.name == "BEST_EFFORT"
    assert stem.qos_profile.reliability == STREAM.reliability
    other = f"qos_overrides.{NAMESPACE}/stem_state.subscription.depth"
    assert client.parameters(node, f"{prefix}.depth", other) == [777, 20_000]


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
    width = float(shown["dead_band half width [%]"]) / 100
    assert found["dead_band"][1] == pytest.approx(width, rel=1e-2)
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
    assert client.set_together(NODE, {"period": 0.0}).successful
    client.next_status(lambda status: "scheduled_skip" not in values_of(status), "the end of it")


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
