# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The main job over topics: samples in, friction out, to the last bit what the core computes."""

import numpy as np
import pytest
from live_nodes import (
    NAMESPACE,
    SECOND,
    START,
    STREAM,
    buffered,
    stamp_of,
    time_of,
    values_of,
)
from rclpy.qos import QoSProfile, ReliabilityPolicy
from records import bench_record
from sensor_msgs.msg import FluidPressure
from std_msgs.msg import Float64, Header

from valve_friction_ros.identification import (
    PARAMETER_UNITS,
    UNITS,
    IdentificationSettings,
    identify_bench,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    LOW_FRICTION,
)

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
    friction, spring = (
        assessment.parameters[name] for name in ("coulomb_friction", "spring_constant")
    )
    band = 200.0 * friction.value / spring.value / 0.028575
    assert float(values["dead_band [%]"]) == pytest.approx(band, rel=1e-6)
    # 2·152.7 N over 2.05e5 N/m, over 28.575 mm
    assert band == pytest.approx(5.213, rel=friction.half_width / friction.value)
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

    lossy = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    publisher = client.node.create_publisher(FluidPressure, topic, lossy)
    stamp, seen = START, len(client.statuses)

    def has_arrived():
        nonlocal stamp
        stamp += SECOND // 50
        publisher.publish(FluidPressure(header=Header(stamp=time_of(stamp)), fluid_pressure=1e5))
        return any(buffered(status) > 0 for _, status in client.statuses[seen:])

    client.wait_until(has_arrived, "a sample in the buffer")
