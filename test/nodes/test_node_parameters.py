# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Parameters through the parameter services: described, checked, and refused with a reason."""

import math
import re

import numpy as np
import pytest
from live_nodes import NAMESPACE, NODE, SECOND, WARN, SimulatedClock, buffered, stamp_of, values_of
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from records import quick_record, simulated
from std_msgs.msg import Float64MultiArray

from valve_friction_ros.identification import (
    UNITS,
    IdentificationSettings,
    identify,
    identify_signature,
)
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION, TriangleWave

NODES = ("identifier", "simulator", "pressure_source")
OF_ROS = re.compile(r"use_sim_time|start_type_description_service|qos_overrides\..*")
CHECKED_BY_RULE = {  # floating parameters that may be infinite or not given, so have no range
    "travel": -0.01,
    "pressure_minimum": 3e5,
    "pressure_maximum": -1.0,
    "position_bias": math.inf,
    "timing_uncertainty": -1.0,
    "baseline_coulomb_friction": 0.0,
    "survey_watch": -1.0,
    "survey_bad": 0.0,
    "fixed.mass": -1.0,
    "fixed.coulomb_friction": -1.0,
    "fixed.viscous_friction": -1.0,
    "fixed.spring_constant": -1.0,
    "fixed.spring_preload": math.inf,
    "fixed.static_friction": -1.0,
    "fixed.limit_velocity": 0.0,
}
BAD_CHANGES = [  # changes, words of the reason
    *(({name: value}, name.removeprefix("fixed.")) for name, value in CHECKED_BY_RULE.items()),
    ({"travel": math.nan}, "travel must be finite"),
    ({"pressure_minimum": math.nan}, "pressure_minimum (nan) must be below pressure_maximum"),
    ({"diaphragm_area": 0.0}, "diaphragm_area"),
    ({"diaphragm_area": math.nan}, "diaphragm_area"),
    ({"diaphragm_area": 1}, "expected 'Type.DOUBLE' got 'Type.INTEGER'"),
    ({"diaphragm_area": "large"}, "expected 'Type.DOUBLE' got 'Type.STRING'"),
    ({"window": 1}, "Wrong parameter type, expected"),  # the words are rclpy's
    ({"spring_constant": "large"}, "spring_constant: expected 'Type.DOUBLE' got 'Type.STRING'"),
    ({"spring_constant": 2e11}, "spring_constant"),
    ({"input_timeout": 0.0}, "input_timeout"),
    ({"derivative_window": 30}, "window must be odd"),
    ({"polynomial_order": 20, "derivative_window": 21}, "at least order + 2 = 22"),
    ({"warn_ratio": 2.5}, "warn_ratio < error_ratio"),
    ({"assumed_mass": -1.0}, "assumed_mass"),
    ({"drive_scale_uncertainty": 0.5}, "drive_scale_uncertainty must be at least 0 and below 0.5"),
    ({"position_bias": 1e-3, "fixed.spring_preload": 200.0}, "exclude each other"),
    (
        {"method": "guess"},
        "there is no method 'guess': choose from plant, bench, published, signature",
    ),
    ({"joint": "arm"}, "joint"),
    ({"alarm_kind": "unknown"}, "alarm_kind"),
    ({"alarm_hours": math.inf}, "alarm_hours"),
    ({"valve_tag": "FV-102"}, "valve_tag"),
    *(
        ({name: value}, f"read-only parameter: {name}")
        for name, value in {
            "webhook_url": "https://example.com/",
            "alarm_folder": "../../etc",
            "save_folder": "/proc/x",
            "report_folder": "/etc",
            "history_file": "",
            "history_url": "postgresql://example.com/x",
            "history_days": 0.001,
            "save_megabytes": 1e6,
            "alarm_megabytes": 0.001,
            "alarm_recordings": 1,
        }.items()
    ),
]


@pytest.fixture(scope="module")
def client(shared):
    return shared.client_of_identifier()


def range_of(descriptor):
    ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
    return (ranges[0].from_value, ranges[0].to_value) if ranges else None


@pytest.mark.parametrize("name", NODES)
def test_every_parameter_is_described_with_its_unit_and_its_range(live, name):
    live.start(name)
    client, node = live.client, f"{NAMESPACE}/{name}"
    names = [name for name in client.parameter_names(node) if not OF_ROS.fullmatch(name)]
    assert len(names) >= 10
    for descriptor in client.describe(node, names):
        assert re.search(r"\w.*\[[^\]]+\]", descriptor.description), (
            f"{descriptor.name}: no unit in {descriptor.description!r}"
        )
        assert "[SI" not in descriptor.description
        if descriptor.type in (ParameterType.PARAMETER_STRING, ParameterType.PARAMETER_BOOL):
            continue
        limits = range_of(descriptor)
        assert (limits is None) == (descriptor.name in CHECKED_BY_RULE), descriptor.name
        if limits is not None:
            assert limits[0] < limits[1]


@pytest.mark.parametrize(
    ("changes", "words"), BAD_CHANGES, ids=["-".join(map(str, c.items())) for c, _ in BAD_CHANGES]
)
def test_bad_change_is_refused_with_the_rule(client, changes, words):
    before = client.parameters(NODE, *changes)
    result = client.set_together(NODE, changes)
    assert not result.successful
    assert words in result.reason
    after = client.parameters(NODE, *changes)
    assert [str(value) for value in after] == [str(value) for value in before]


def test_good_changes_take_effect_and_unrelated_parameters_stay_settable(client):
    changes = {"fixed.coulomb_friction": 100.0, "derivative_window": 21, "travel": 0.05}
    assert [r.successful for r in client.set_parameters(NODE, changes)] == [True] * 3
    client.identified(quick_record())
    results = client.friction("coulomb_friction", "static_friction", "spring_constant", "dead_band")
    assert results["coulomb_friction"] == 100.0
    static = results["static_friction"]  # F_c where the record shows no slip
    width = (100.0 + (100.0 if math.isnan(static) else static)) / results["spring_constant"]
    assert results["dead_band"] == pytest.approx(width / 0.05, rel=1e-12)
    assert "coulomb_friction" in client.last_values()["fixed"].split(", ")
    back = {"fixed.coulomb_friction": math.nan, "derivative_window": 0, "travel": 0.028575}
    assert client.set_together(NODE, back).successful


def test_new_window_empties_the_buffer_and_says_so(client):
    client.identified(quick_record())
    assert client.set_together(NODE, {"window": 50.0}).successful
    reason = client.identify_all(0).message
    assert "no samples" in reason
    assert "parameters were changed" in reason
    assert client.set_together(NODE, {"window": 60.0}).successful


def signature_record():
    """Five strokes of a quick triangle at 100 Hz."""
    time = np.arange(5000) / 100
    return simulated(TriangleWave(period=20.0).sample(time), 0.01, HIGH_FRICTION)


def test_a_signature_is_identified(client):
    assert client.set_together(NODE, {"method": "signature"}).successful
    message = client.identified(signature_record())
    assert "the stem ignores reversals smaller than 21 % of its travel" in message
    expected = identify_signature(signature_record(), BENCH_VALVE, IdentificationSettings())
    told = client.friction(*UNITS, "fit", "rms", "dead_band", "threshold")
    for name in UNITS:
        assert told[name] == pytest.approx(expected.values[name], rel=1e-9, nan_ok=True)
    assert told["coulomb_friction"] == pytest.approx(606.0, rel=0.02)
    assert told["fit"] == pytest.approx(expected.fit, rel=1e-9)
    assert told["rms"] == pytest.approx(expected.rms, rel=1e-6)
    width = told["coulomb_friction"] + told["static_friction"]
    share = width / told["spring_constant"] / BENCH_VALVE.travel
    assert told["dead_band"] == pytest.approx(share, rel=1e-9)
    assert np.isnan(told["threshold"])
    assert np.isnan([*client.published(*UNITS).values()]).all()
    assert not client.latched(Float64MultiArray, f"{NODE}/sweep").data
    values = values_of(client.next_status())
    assert values["method"] == "signature"
    assert values["estimate_valid"] == "true"
    assert values["coulomb_friction verdict"] == "weak"
    assert float(values["fit [%]"]) == pytest.approx(100 * expected.fit, rel=1e-8)


def test_former_names_are_understood(client):
    for former, used in (("robust", "plant"), ("refined", "bench"), ("best", "plant")):
        assert client.set_together(NODE, {"method": former}).successful
        client.identified(quick_record())
        assert values_of(client.next_status())["method"] == used
        expected = identify(quick_record(), BENCH_VALVE, method=used)
        told = client.friction("coulomb_friction", "threshold")
        assert told["coulomb_friction"] == expected.values["coulomb_friction"]
        assert told["threshold"] == expected.evidence["threshold"]


def test_the_timing_uncertainty_widens_the_intervals(client):
    """Each lag has a prior of that width; on a square wave the record tells little of the lags."""
    told = {}
    for uncertainty in (0.0, 0.2):
        assert client.set_together(NODE, {"timing_uncertainty": uncertainty}).successful
        client.identified(quick_record())
        told[uncertainty] = client.half_widths("viscous_friction")["viscous_friction"]
        expected = identify(
            quick_record(), BENCH_VALVE, IdentificationSettings(timing_uncertainty=uncertainty)
        )
        assert told[uncertainty] == expected.parameters["viscous_friction"].half_width
    assert told[0.0] < told[0.2]
    assert client.set_together(NODE, {"timing_uncertainty": np.nan}).successful
    assert client.set_together(NODE, {"method": "plant"}).successful


ELSEWHERE = {
    "pressure_minimum": 3e5,
    "pressure_maximum": 4e5,
    "warn_ratio": 3.0,
    "error_ratio": 4.0,
}
"""Values of another valve that contradict those in force until all are set."""


@pytest.mark.parametrize("beside", [{}, {"valve_tag": "FV-102", "windw": 5.0, "travel": "long"}])
@pytest.mark.parametrize("order", [1, -1])
def test_the_order_of_a_loaded_file_has_no_effect(client, beside, order):
    """As ros2 param load sends it; what can never be set is refused alone, with the remedy."""
    before = dict(zip(ELSEWHERE, client.parameters(NODE, *ELSEWHERE), strict=True))
    for values in (ELSEWHERE, before):
        asked = dict([*values.items(), *beside.items()][::order])
        results = dict(zip(asked, client.set_parameters(NODE, asked), strict=True))
        assert {name for name, one in results.items() if not one.successful} == set(beside)
        assert client.parameters(NODE, *ELSEWHERE) == [*values.values()]
    if beside:
        assert results["windw"].reason == (
            "identifier has no parameter 'windw': did you mean 'window'?"
        )


def test_the_dump_of_a_node_in_another_namespace_can_be_loaded(client):
    """It names the topics there, one parameter for each quality; each was refused."""
    dumped = {
        "window": 50.0,
        "qos_overrides./fv_102/stem_state.subscription.depth": 10,
        "qos_overrides./fv_102/stem_state.subscription.reliability": "reliable",
    }
    results = client.set_parameters(NODE, dumped)
    ignored = "ignored, as the node does not have this topic"
    assert [(one.successful, one.reason) for one in results] == [
        (True, ""),
        (True, ignored),
        (True, ignored),
    ]
    assert client.set_together(NODE, dumped).successful
    assert client.parameters(NODE, "window") == [50.0]


@pytest.mark.parametrize("kind", [SetParameters, SetParametersAtomically])
def test_a_value_of_unknown_type_is_refused(client, kind):
    """Such as of a client in another language; it was an internal error, and never answered."""
    change = ParameterMessage(name="window", value=ParameterValue(type=77, double_value=5.0))
    service = "set_parameters" + ("_atomically" if kind is SetParametersAtomically else "")
    answer = client.call(kind, f"{NODE}/{service}", kind.Request(parameters=[change]))
    result = answer.results[0] if kind is SetParameters else answer.result
    assert not result.successful
    assert result.reason.startswith("window: there is no type 77: choose from ")
    assert client.parameters(NODE, "window") == [60.0]


@pytest.mark.parametrize("text", [".nan", "nan"])
def test_numbers_may_be_texts(client, text):
    """ros2 param load sends .nan and 1e-06 so."""
    assert client.set_together(NODE, {"assumed_mass": "1e-06", "fixed.mass": text}).successful
    mass, fixed = client.parameters(NODE, "assumed_mass", "fixed.mass")
    assert mass == 1e-6
    assert math.isnan(fixed)


def test_a_deleted_number_is_unset_and_can_be_set_again(client):
    """As ros2 param delete does: rclpy no longer has the parameter."""
    for value in (2.0, None, 3.0, "null"):
        assert client.set_together(NODE, {"fixed.mass": value}).successful
        assert client.parameters(NODE, "fixed.mass") == [None if value == "null" else value]
    assert client.set_together(NODE, {"warn_ratio": 1.25}).successful
    client.identified(quick_record())
    assert not client.last_values()["fixed"]


def test_simulated_time(live):
    """Without a clock it is missed; a clock that is set back empties the buffer."""
    client = live.client_of_identifier()
    assert client.set_together(NODE, {"use_sim_time": True}).successful
    status = client.next_status(lambda one: "no time on /clock" in one.message, "a warning")
    assert status.level == WARN
    for service in ("identify", "set_baseline", "reset_usage", "shelve", "report"):
        assert client.refusal(service).startswith("no time on /clock")  # it was dated 1970
    assert client.trigger("clear").success
    clock = SimulatedClock(client)

    def run_until_stamped(begin, end):
        clock.now, seen = begin, len(client.statuses)
        clock.run_until(
            lambda: any(begin <= stamp_of(at) < end for at, _ in client.statuses[seen:]),
            f"a diagnostic from {begin} to {end}",
        )

    run_until_stamped(5000 * SECOND, 6000 * SECOND)
    assert "/clock" not in client.next_status().message
    client.send_record(quick_record())
    seen = len(client.statuses)
    clock.run_until(
        lambda: any(buffered(status) == 1000 for _, status in client.statuses[seen:]), "all samples"
    )
    run_until_stamped(1000 * SECOND, 2000 * SECOND)
    response = client.refusal("identify")
    assert "no samples" in response
    assert re.search(
        r"the buffer was cleared: the time on /clock jumped back by [678]\d(\.\d)? min; if a bag "
        r"is played in a loop, identify shortly before it begins again",
        response,
    )
