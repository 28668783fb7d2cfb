# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What an identifier finds of the friction and of the whole valve, against a baseline, over DDS."""

from dataclasses import replace

import numpy as np
import pytest
from live_nodes import ERROR, NODE, OK, SECOND, START, WARN, values_of
from records import quick_record, simulated, stroked_record

from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION, LOW_FRICTION, SensorNoise

LIMITS = {"warn_ratio": 1.5, "error_ratio": 2.0, "low_ratio": 0.5}


@pytest.fixture(scope="module")
def healthy(shared):
    """An identifier whose baseline is its own estimate of the healthy valve."""
    client = shared.client_of_identifier()
    client.set_baseline(quick_record())
    return client


@pytest.fixture
def client(healthy):
    assert healthy.set_together(NODE, LIMITS).successful
    return healthy


def valve_with(coulomb_friction):
    return replace(
        LOW_FRICTION, coulomb_friction=coulomb_friction, static_friction=coulomb_friction
    )


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
    assert status.message == message
    values = values_of(status)
    assert (status.level, values["NE 107"]) == (level, signal)
    of, told, near = "coulomb_friction", "Coulomb friction", 2e-3
    if ratio is None:
        speed = float(values["baseline_sliding_friction speed [m/s]"])
        # With more friction the stem is slower, and between two speeds friction may have fallen.
        of, told, near = "sliding_friction", f"sliding friction at {speed * 1e3:.2g} mm/s", 2e-2
        tight, loose = (float(one.sliding_friction(speed)) for one in (parameters, LOW_FRICTION))
        ratio = tight / loose
    assert values["friction_ratio of"] == of
    assert words in message
    assert f"{told} is {float(values['friction_ratio']):.2f} (" in message
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


HEALTHY = quick_record()
SOFT = replace(LOW_FRICTION, spring_constant=LOW_FRICTION.spring_constant * 2 / 3)
WEAK = quick_record(SOFT)
HARDLY = SensorNoise(3e-5, 300.0, 3).applied_to(
    simulated(5e4 + 5e3 * np.sin(2 * np.pi * np.arange(500) / 250), 0.01, SOFT)
)
"""Small strokes of the valve of the soft spring, which hardly show it."""
CHANGE = "spring_constant change [%]"


def test_a_lost_spring_is_said_and_outlives_a_record_that_hardly_shows_it_and_a_kill(live, history):
    client = live.client_of_identifier()
    client.identified(HEALTHY)
    assert CHANGE not in values_of(client.statuses[-1][1])
    assert client.trigger("set_baseline").success
    status = client.next_status(lambda one: CHANGE in values_of(one), "the change")
    assert status.level == OK
    assert float(values_of(status)[CHANGE]) == 0.0

    assert "the spring constant has changed" in client.identified(WEAK)
    status = client.statuses[-1][1]
    values = values_of(status)
    assert status.level == ERROR
    assert values["NE 107"] == "F"
    assert "the spring constant has changed: 0.667 times" in status.message
    assert float(values[CHANGE]) == pytest.approx(-100 / 3, abs=0.1)
    low, high = (float(values[f"spring_constant change {end} [%]"]) for end in ("low", "high"))
    assert low < -100 / 3 < high
    kept = history.baseline(NODE).baseline
    assert kept.numbers["spring_constant"].value == pytest.approx(
        LOW_FRICTION.spring_constant, 1e-3
    )

    assert "the spring constant has changed" in client.refusal("set_baseline")

    client.identified(HARDLY)
    assert "spring_constant" not in history.last_success(NODE).numbers
    live.restart()
    after = client.next_status(lambda one: CHANGE in values_of(one), "the change after a restart")
    for one in (status, after):
        assert one.level == ERROR
        assert "the spring constant has changed: 0.667 times" in one.message
    assert "not seen in any record since)" in after.message
    assert values_of(after)[CHANGE] == values[CHANGE]


@pytest.mark.parametrize("is_scheduled", [False, True])
def test_lost_travel_is_said_though_its_record_is_refused(live, history, is_scheduled):
    """A sixth of the travel is lost: no model follows the record, but the stem's end is seen."""
    client = live.client_of_identifier()
    client.set_baseline(stroked_record())
    assert client.next_status().level == OK
    if is_scheduled:
        client.set_parameters(NODE, {"period": 0.5})
    assert client.trigger("clear").success
    lost = stroked_record(0.16 * BENCH_VALVE.travel)
    client.send_record(lost, START + 60 * SECOND)
    client.wait_for_buffered(2 * len(lost))
    words = "travel is lost at the lower end: the stem stops +4.57 mm"
    if not is_scheduled:
        answer = client.refusal("identify")
        assert "no friction model reproduces the record" in answer
        assert words in answer
    status = client.next_status(lambda one: words in one.message, "the lost travel")
    assert (status.level, values_of(status)["NE 107"]) == (WARN, "M")
    assert ("was refused" in status.message) == (not is_scheduled)
    assert float(values_of(status)["lower_stop change [m]"]) == pytest.approx(4.572e-3, abs=5e-5)
    client.wait_until(lambda: history.entries()[-1].refusal, "the refusal in the history")
    if not is_scheduled:
        live.restart()
        after = client.next_status(lambda one: words in one.message, "the same after a restart")
        assert after.level == WARN


def test_limits_of_the_spring_and_a_restored_baseline_brings_all_its_numbers_back(live):
    client = live.client_of_identifier({"baseline_in_alarm": True})
    client.set_baseline(HEALTHY)
    client.identified(WEAK)
    assert client.statuses[-1][1].level == ERROR
    assert client.set_parameters(NODE, {"spring_failure": 0.6})[0].successful
    client.next_status(lambda one: one.level == WARN, "another limit")
    assert client.set_parameters(NODE, {"spring_change": 0.5})[0].successful
    client.next_status(lambda one: one.level == OK, "both limits")
    (refused,) = client.set_parameters(NODE, {"spring_change": 0.7})
    assert "spring_change < spring_failure" in refused.reason
    assert client.trigger("set_baseline").success
    assert client.next_status(lambda one: one.level == OK, "a new baseline")
    live.restart({"baseline_in_alarm": True})
    assert client.next_status(lambda one: CHANGE in values_of(one), "the kept one").level == OK
    assert client.trigger("restore_baseline").success
    status = client.next_status(lambda one: one.level == ERROR, "the first baseline")
    assert "the spring constant has changed" in status.message
    client.set_parameters(NODE, {"baseline_coulomb_friction": 150.0})
    status = client.next_status(lambda one: one.level == OK, "a friction alone")
    assert CHANGE not in values_of(status)


def still(place, pressures, begin):
    """Stamps, pressures and positions: one of each in a second."""
    stamps = START + begin * SECOND + SECOND * np.arange(len(pressures), dtype=np.int64)
    return (stamps, np.array(pressures, dtype=float)), (stamps, np.full(len(pressures), place))


def test_a_seized_stem_is_an_alarm_until_it_moves(live):
    record = quick_record()
    client = live.client_of_identifier({"window": 3600.0})
    client.set_baseline(record)
    assert client.next_status().level == OK
    middle = 0.5 * float(record.position.min() + record.position.max())
    resting, supply = float(np.median(record.pressure)), float(record.pressure.max())
    client.send(*still(middle, [*40 * [resting], *40 * [supply]], 60))
    status = client.next_status(lambda one: one.level == ERROR, "a seized stem")
    assert status.message.startswith(f"the stem has not moved from {1e3 * middle:.1f} mm since ")
    values = values_of(status)
    assert values["NE 107"] == "F"
    assert values["standstill since [time]"].startswith("2023-11-14T22:14")
    assert float(values["standstill static_friction at least [N]"]) > 2 * float(
        values["coulomb_friction [N]"]
    )
    client.send(*still(1.2 * middle, 30 * [supply], 140))
    status = client.next_status(lambda one: one.level == OK, "a stem that moves again")
    assert "has not moved from" not in status.message


UNSTATED = dict.fromkeys(
    ("diaphragm_area", "pressure_reference", "travel", "pressure_minimum", "pressure_maximum")
)


def test_what_nobody_has_stated_is_said_until_somebody_does(live):
    client = live.client_of_identifier(UNSTATED)
    assert client.parameters(NODE, *UNSTATED) == [None] * len(UNSTATED)
    client.identified(quick_record())
    values = client.last_values()
    assert values["assumed"] == ", ".join(UNSTATED)
    assert "values in newtons depend on an assumed area" in values["warnings"]
    assert values["coulomb_friction verdict"] == "weak"
    assert values["coulomb_friction reason"] == "it depends on an assumed area"
    assert client.trigger("set_baseline").success

    stated = {"diaphragm_area": 0.0445, "pressure_reference": 41740.0, "travel": 0.028575}
    assert client.set_together(NODE, stated).successful
    client.identified(quick_record())
    values = client.last_values()
    assert values["assumed"] == "pressure_minimum, pressure_maximum"
    assert values["coulomb_friction verdict"] == "identified"
    assert float(values["friction_ratio"]) == 1.0

    # What is stated is compared with the record, as what the valve file of a command states.
    spring = LOW_FRICTION.spring_constant
    told = "N/m from the record but stated as 102500 N/m: check diaphragm_area"
    for stated, words, verdict in ((spring / 2, [told], "weak"), (spring, [], "identified")):
        assert client.set_together(NODE, {"spring_constant": stated, "mass": 1.542}).successful
        client.identified(quick_record())
        values = client.last_values()
        assert [one for one in (told, "but stated as") if one in values["warnings"]][:1] == words
        assert values["coulomb_friction verdict"] == verdict
