# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Excess and collapsed friction against a baseline, on /diagnostics."""

import math
from dataclasses import replace

import pytest
from live_nodes import NAMESPACE, values_of
from records import quick_record, square_record

from valve_friction_ros.health import Baseline
from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION, LOW_FRICTION

NODE = f"{NAMESPACE}/identifier"
OK, WARN, ERROR = b"\x00", b"\x01", b"\x02"
LIMITS = {"warn_ratio": 1.5, "error_ratio": 2.0, "low_ratio": 0.5}


@pytest.fixture(scope="module")
def healthy(shared):
    """An identifier whose baseline is its own estimate of the healthy valve."""
    shared.start_identifier()
    client = shared.client
    refused = client.trigger("set_baseline")
    client.identified(quick_record())
    accepted = client.trigger("set_baseline")
    return client, refused, accepted


@pytest.fixture
def client(healthy):
    client, *_ = healthy
    assert client.set_together(NODE, LIMITS).successful
    return client


def valve_with(coulomb_friction):
    return replace(
        LOW_FRICTION, coulomb_friction=coulomb_friction, static_friction=coulomb_friction
    )


def test_baseline_needs_an_estimate(healthy):
    _, refused, accepted = healthy
    assert not refused.success
    assert "the valve has no result" in refused.message
    assert accepted.success
    result = identify(quick_record(), BENCH_VALVE)
    taken = "by the identification of 2023-11-14 22:13 UTC"
    assert accepted.message == f"baseline: {Baseline.of(result)}; before: none ({taken})"
    healthy = result.parameters["coulomb_friction"]
    assert healthy.interval[0] < 152.7 < healthy.interval[1]


@pytest.mark.parametrize(
    ("parameters", "ratio", "level", "signal", "words"),
    [
        (HIGH_FRICTION, None, ERROR, "F", "excess friction"),
        (valve_with(0.3 * 152.7), 0.3, ERROR, "S", "friction collapsed"),
        (valve_with(1.7 * 152.7), 1.7, WARN, "M", "friction has grown"),
        (valve_with(1.2 * 152.7), 1.2, OK, "", "friction normal"),
    ],
    ids=["tightened", "worn", "growing", "healthy"],
)
def test_verdict(client, parameters, ratio, level, signal, words):
    """More dry friction alone shows in F_c; ten times the viscous friction in both together."""
    message = client.identified(quick_record(parameters))
    status = client.statuses[-1][1]
    assert status.level == level
    assert words in status.message
    assert status.message == message
    values = values_of(status)
    of = values["friction_ratio of"]
    if ratio is None:
        speed = float(values["baseline_sliding_friction speed [m/s]"])
        told = f"sliding friction at {speed * 1e3:.2g} mm/s"
        assert of == "sliding_friction"
        tight, loose = (float(one.sliding_friction(speed)) for one in (parameters, LOW_FRICTION))
        ratio = tight / loose
    else:
        told = "coulomb friction"
        assert of == "coulomb_friction"
    assert f"{told} is {float(values['friction_ratio']):.2f} (" in status.message
    assert values["NE 107"] == signal
    # With more friction the stem is slower, and between two speeds friction may have fallen.
    near = 2e-3 if of == "coulomb_friction" else 2e-2
    assert float(values["friction_ratio"]) == pytest.approx(ratio, rel=near)
    assert float(values["baseline_coulomb_friction [N]"]) == pytest.approx(152.7, rel=1e-3)
    low, high = (float(values[f"friction_ratio {end}"]) for end in ("low", "high"))
    assert low <= ratio <= high
    published = client.friction("friction_ratio")["friction_ratio"]
    assert published == pytest.approx(float(values["friction_ratio"]), rel=1e-8)


def test_limits_are_parameters_and_judge_at_once(client):
    client.identified(quick_record(HIGH_FRICTION))
    assert client.statuses[-1][1].level == ERROR
    for limits, level in (
        ({"error_ratio": 8.0, "viscous_factor": 100.0}, WARN),
        ({"warn_ratio": 7.5}, OK),
        ({"warn_ratio": 1.1, "error_ratio": 1.2}, ERROR),
    ):
        assert client.set_together(NODE, limits).successful
        client.next_status(lambda status, wanted=level: status.level == wanted, str(level))


def test_baseline_is_a_parameter(live):
    live.start_identifier({"baseline_coulomb_friction": 200.0, "valve_tag": "FV-101/A"})
    live.client.identified(quick_record(HIGH_FRICTION))
    status = live.client.statuses[-1][1]
    assert status.level == ERROR
    assert status.hardware_id == "FV-101/A"
    values = values_of(status)
    assert float(values["friction_ratio"]) == pytest.approx(3.03, rel=1e-3)
    assert values["method"] == "plant"

    assert live.client.set_together(NODE, {"baseline_coulomb_friction": 600.0}).successful
    values = live.client.status_values(lambda status: status.level == OK, "OK")
    assert float(values["friction_ratio"]) == pytest.approx(1.01, rel=1e-3)


def test_published_values_stand_beside(live):
    live.start_identifier({"method": "bench"})
    live.client.identified(quick_record(HIGH_FRICTION))
    assert float(live.client.last_values()["mass published [kg]"]) == 1.0


def test_parameter_shows_the_baseline_of_the_service_and_replaces_it(live):
    live.start_identifier()
    client = live.client
    client.identified(quick_record())
    assert client.trigger("set_baseline").success
    (shown,) = client.parameters(NODE, "baseline_coulomb_friction")
    told = float(client.last_values()["baseline_coulomb_friction [N]"])
    assert shown == pytest.approx(told, rel=1e-8)
    assert float(client.last_values()["baseline half width [N]"]) > 0

    assert client.set_together(NODE, {"baseline_coulomb_friction": 100.0}).successful
    values = client.status_values(
        lambda status: values_of(status)["baseline_coulomb_friction [N]"] == "100", "100 N"
    )
    assert values["baseline half width [N]"] == "0"
    assert client.set_together(NODE, {"baseline_coulomb_friction": math.nan}).successful
    client.next_status(
        lambda status: "baseline_coulomb_friction [N]" not in values_of(status), "no baseline"
    )


def test_refusal_keeps_the_verdict_and_says_so(live):
    live.start_identifier({"baseline_coulomb_friction": 200.0})
    client = live.client
    client.identified(quick_record(HIGH_FRICTION))
    assert client.trigger("clear").success
    assert not client.trigger("identify").success
    status = client.next_status(lambda s: values_of(s)["estimate_valid"] == "false", "a refusal")
    assert status.level == ERROR
    assert "the latest identification was refused: " in status.message
    assert "before: excess friction" in status.message


SQUARE = square_record()


def test_an_alarm_by_the_sliding_friction_where_the_coulomb_friction_is_vague(live):
    """A square wave behind a lag: F_c is weak, and the sliding friction serves instead."""
    live.start_identifier({"timing_uncertainty": 0.02})
    client = live.client
    client.identified(SQUARE)
    values = client.last_values()
    assert values["coulomb_friction verdict"] == "weak"
    assert client.trigger("set_baseline").success
    known = float(client.last_values()["baseline_sliding_friction [N]"])
    grown = replace(
        HIGH_FRICTION,
        coulomb_friction=1.6 * HIGH_FRICTION.coulomb_friction,
        static_friction=1.6 * HIGH_FRICTION.static_friction,
        viscous_friction=1.6 * HIGH_FRICTION.viscous_friction,
    )
    client.identified(square_record(grown))
    status = client.statuses[-1][1]
    assert status.level == WARN
    values = values_of(status)
    assert values["friction_ratio of"] == "sliding_friction"
    assert "friction has grown: sliding friction at " in status.message
    low, high = (float(values[f"friction_ratio {end}"]) for end in ("low", "high"))
    assert 1.25 < low < 1.6 < high
    assert float(client.friction("friction_ratio")["friction_ratio"]) == pytest.approx(
        float(values["friction_ratio"])
    )
    assert known == pytest.approx(float(values["baseline_sliding_friction [N]"]))


def test_a_baseline_of_no_use_is_refused(live):
    live.start_identifier({"timing_uncertainty": 0.3})
    live.client.identified(square_record(LOW_FRICTION))
    answer = live.client.trigger("set_baseline")
    assert not answer.success
    assert answer.message.startswith("this result cannot be the baseline: coulomb friction is ")
    assert "state a timing_uncertainty" in answer.message
