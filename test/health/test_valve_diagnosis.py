# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What has changed on a valve besides its friction: bounds, causes, and whole identifications."""

import math
from dataclasses import fields, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from records import quick_record

from valve_friction_ros.health import (
    Baseline,
    Level,
    Measured,
    StatusSignal,
    ValveLimits,
    diagnose_numbers,
    diagnose_valve,
    valve_changes,
    valve_numbers,
)
from valve_friction_ros.identification import (
    IMPERFECTIONS_FOUND,
    Parameter,
    Verdict,
    identify,
)
from valve_friction_ros.identification.trust.verdict import not_identifiable
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, Recording, SensorNoise, Valve

TRAVEL, SPRING = 0.03, 2e5
VALVE = Valve(diaphragm_area=0.04, pressure_reference=1e5, travel=TRAVEL)
FORCE = SPRING * TRAVEL
HEALTHY = {
    "spring_constant": Measured(SPRING, 1e3),
    "spring_preload": Measured(500.0, 20.0),
    "coulomb_friction": Measured(150.0, 3.0),
    "static_friction": Measured(170.0, 3.0),
    "viscous_friction": Measured(5e3, 100.0),
    "viscous_asymmetry": Measured(0.0, 0.05),
    "slip_force": Measured(20.0, 5.0),
    "lag": Measured(0.0, 0.003),
    "lower_stop": Measured(0.0, 1e-5),
    "upper_stop": Measured(TRAVEL, 1e-5),
    "lowest_position": Measured(0.0, 1e-5),
    "highest_position": Measured(TRAVEL, 1e-5),
    "drive_noise": Measured(100.0, 2.0),
    "stem_noise": Measured(1e-5, 2e-7),
}
BASELINE = Baseline(150.0, 3.0, numbers=HEALTHY)
WARN, ERROR = Level.WARN, Level.ERROR
MAINTENANCE, FUNCTION = StatusSignal.MAINTENANCE_REQUIRED, StatusSignal.CHECK_FUNCTION


def found(baseline=BASELINE, valve=VALVE, limits=None, **changes):
    """Findings where the numbers of the healthy valve are changed to these; None: not known."""
    numbers = HEALTHY | {
        name: Measured(*one) if isinstance(one, tuple) else one for name, one in changes.items()
    }
    known = {name: one for name, one in numbers.items() if one is not None}
    return diagnose_numbers(known, baseline, valve, limits)


def only(findings):
    assert len(findings) == 1, findings
    return findings[0]


def test_a_baseline_of_a_friction_alone_says_nothing():
    assert found(Baseline(150.0), spring_constant=(1e5, 10.0)) == ()


@pytest.mark.parametrize(
    ("changes", "level", "signal", "words"),
    [
        ({"spring_constant": (0.75 * SPRING, 1e3)}, WARN, MAINTENANCE, "check the spring"),
        ({"spring_constant": (0.6 * SPRING, 1e3)}, ERROR, StatusSignal.FAILURE, "check the spring"),
        ({"spring_constant": (1.25 * SPRING, 1e3)}, WARN, MAINTENANCE, "1.25 times"),
        ({"spring_preload": (800.0, 20.0)}, WARN, MAINTENANCE, "check the bench set"),
        ({"slip_force": (120.0, 20.0)}, WARN, MAINTENANCE, "jumps by 2 % of its travel"),
        ({"viscous_friction": (2e4, 4e2)}, WARN, MAINTENANCE, "viscous friction has grown to 4"),
        ({"viscous_friction": (1e3, 50.0)}, WARN, MAINTENANCE, "viscous friction has fallen"),
        ({"viscous_asymmetry": (-0.5, 0.05)}, WARN, MAINTENANCE, "grown downward"),
        ({"lower_stop": (2e-3, 1e-5)}, WARN, MAINTENANCE, "lost at the lower end: the stem stops"),
        ({"lower_stop": (-2e-3, 1e-5)}, WARN, MAINTENANCE, "lower end has moved outward by -2.00"),
        ({"upper_stop": (TRAVEL - 2e-3, 1e-5)}, WARN, MAINTENANCE, "lost at the upper end"),
        ({"stem_noise": (3e-5, 6e-7)}, WARN, FUNCTION, "noise of the stem position has grown to 3"),
        ({"drive_noise": (300.0, 6.0)}, WARN, FUNCTION, "noise of the pressure has grown to 3"),
        ({"lag": (0.05, 0.003)}, WARN, FUNCTION, "behind the pressure has grown, +50 ms"),
        ({"lag": (-0.05, 0.003)}, WARN, FUNCTION, "behind the pressure has shrunk, -50 ms"),
    ],
)
def test_each_change_is_a_finding_of_its_own(changes, level, signal, words):
    finding = only(found(**changes))
    assert (finding.level, finding.status_signal) == (level, signal)
    assert words in finding.message


LIMITS = ValveLimits()
BOUNDS = {
    "spring_constant": SPRING * (1 - LIMITS.spring_change),
    "spring_preload": 500.0 + LIMITS.preload_change * FORCE,
    "slip_force": 20.0 + LIMITS.slip_change * FORCE,
    "viscous_asymmetry": LIMITS.asymmetry_change,
    "lag": LIMITS.lag_change,
    "upper_stop": TRAVEL * (1 - LIMITS.stop_change),
}


@pytest.mark.parametrize("name", BOUNDS)
@given(width=st.floats(1e-4, 0.5), past=st.sampled_from([-0.01, 0.01]))
def test_a_bound_is_passed_only_by_the_whole_interval(name, width, past):
    """Of the interval of the change, both half widths in squares; in the logarithm for a ratio."""
    healthy, bound = HEALTHY[name], BOUNDS[name]
    away = math.copysign(1.0, bound - healthy.value)
    if name == "spring_constant":
        whole = (1 + past) * math.hypot(width, healthy.share)
        value = bound * math.exp(away * whole)
        half = width * value
    else:
        half = width * abs(bound - healthy.value)
        value = bound + away * (1 + past) * math.hypot(half, healthy.half_width)
    assert bool(found(**{name: (value, half)})) == (past > 0)


@given(st.dictionaries(st.sampled_from([*HEALTHY]), st.floats(-1, 1)))
def test_numbers_within_their_intervals_raise_nothing(moved):
    changes = {
        name: (HEALTHY[name].value + share * HEALTHY[name].half_width, HEALTHY[name].half_width)
        for name, share in moved.items()
    }
    assert found(**changes) == ()


def scaled(factor, *names):
    return {name: HEALTHY[name].times(factor) for name in names}


FORCES = ("spring_constant", "coulomb_friction", "static_friction", "viscous_friction")


class TestCausesThatLookTheSame:
    """A cause is named unless another number excludes it."""

    @pytest.mark.parametrize(
        ("factor", "level"), [(0.75, WARN), (1.25, WARN), (0.6, ERROR), (1.4, ERROR)]
    )
    def test_a_factor_beyond_the_failure_of_a_spring_is_an_error(self, factor, level):
        finding = only(found(**scaled(factor, *FORCES)))
        assert (finding.level, finding.status_signal) == (level, FUNCTION)
        assert "a common factor points to the scale of the pressure sensor" in finding.message
        assert "and the diaphragm area rather than to spring and packing" in finding.message

    @pytest.mark.parametrize("factor", [0.6, 1.4])
    def test_a_slip_jump_that_a_factor_does_not_explain_is_told(self, factor):
        common, slip = found(**scaled(factor, *FORCES), slip_force=(120.0, 5.0))
        assert "a common factor" in common.message
        assert slip.message.startswith("the slip jump has grown")

    def test_a_slip_jump_that_a_factor_explains_is_not(self):
        forces = scaled(4.0, *FORCES)
        assert "a common factor" in only(found(**forces, slip_force=(80.0, 5.0))).message
        assert len(found(**forces, slip_force=(180.0, 5.0))) == 2

    def test_a_vague_viscous_friction_that_a_factor_does_not_explain_is_told(self):
        forces = scaled(1.4, *FORCES[:-1])
        common, viscous = found(**forces, viscous_friction=(2e4, 4e3))
        assert "a common factor" in common.message
        assert viscous.message.startswith("viscous friction has grown to 4")
        forces = scaled(2.5, *FORCES[:-1])
        assert len(found(**forces, viscous_friction=(1.3e4, 1.9e3))) == 1

    def test_the_noise_of_a_new_scale_is_no_finding_of_its_own(self):
        assert "a common factor" in only(found(**scaled(2.3, *FORCES, "drive_noise"))).message
        both = found(**scaled(2.3, *FORCES), **scaled(6.0, "drive_noise"))
        assert len(both) == 2
        assert "noise of the pressure has grown to 6" in both[1].message

    @pytest.mark.parametrize(("pascals", "is_air"), [(101e3, True), (-98e3, True), (60e3, False)])
    def test_a_shift_by_one_atmosphere_questions_gauge_or_absolute_first(self, pascals, is_air):
        shifted = 500.0 + VALVE.diaphragm_area * pascals
        message = found(spring_preload=(shifted, 1.0))[0].message
        assert ("check the reference of the pressure sensor, gauge or abs" in message) == is_air
        assert ("check the bench set" in message) != is_air

    def test_stops_that_stay_exclude_the_scale_of_the_position(self):
        message = only(found(**scaled(0.75, "spring_constant"))).message
        assert message.endswith("check the spring")
        longer = found(**scaled(0.75, "spring_constant"), **scaled(1 / 0.75, "upper_stop"))
        assert "the scale of the position sensor" in longer[0].message

    def test_a_spring_whose_friction_stays_is_no_scale_of_the_pressure(self):
        message = only(found(**scaled(0.75, "spring_constant"), upper_stop=None)).message
        assert "the scale of the position sensor" in message
        assert "pressure" not in message
        unknown = found(
            **scaled(0.75, "spring_constant"), coulomb_friction=None, static_friction=None
        )
        assert "the scale of the pressure sensor and the diaphragm area" in only(unknown).message

    @pytest.mark.parametrize("friction", [(112.0, 25.0), (90.0, 60.0), (140.0, 200.0)])
    def test_a_vague_friction_makes_no_sensor_of_a_broken_spring(self, friction):
        vague = {"coulomb_friction": friction, "static_friction": None, "viscous_friction": None}
        finding = only(found(**scaled(0.6, "spring_constant"), **vague))
        assert finding.level is ERROR
        assert "check the spring" in finding.message
        assert "the scale of the pressure sensor and the diaphragm area" in finding.message

    def test_a_weak_spring_takes_its_preload_with_it(self):
        finding = only(found(**scaled(0.5, "spring_constant", "spring_preload")))
        assert "the spring constant has changed together with its preload" in finding.message

    def test_a_shifted_balance_has_four_causes(self):
        message = only(
            found(spring_preload=(620.0, 1.0), lower_stop=None, upper_stop=None, limits=LOW)
        ).message
        assert "+120 N" in message
        assert "the zero of the pressure sensor (+3 kPa)" in message
        assert "the zero of the position sensor (-0.6 mm)" in message
        assert "packing with more friction upward" in message

    def test_stops_that_stay_exclude_the_position_sensor(self):
        """And a shift beyond the friction excludes an uneven packing."""
        message = only(found(spring_preload=(620.0, 1.0), limits=LOW)).message
        assert "the bench set" in message
        assert "position sensor" not in message
        assert "packing" not in only(found(spring_preload=(800.0, 1.0))).message

    def test_stops_that_move_with_the_balance_convict_the_position_sensor(self):
        shift = -2e-3
        balance, stops = found(
            spring_preload=(500.0 - SPRING * shift, 20.0),
            lower_stop=(shift, 1e-5),
            upper_stop=(TRAVEL + shift, 1e-5),
        )
        assert (
            "check the zero of the position sensor (-2 mm), consistent with the shift of both "
            "travel stops" in balance.message
        )
        assert "both travel stops have shifted by -2.00 mm" in stops.message

    @pytest.mark.parametrize("other", [None, HEALTHY["upper_stop"]])
    def test_one_stop_that_moves_with_the_balance_convicts_nothing(self, other):
        """With the other stop unseen all causes remain; one that stays excludes the sensor's zero.

        A seat that has worn, and a bench set that has moved, look the same as the zero.
        """
        shift = -2e-3
        changes = {
            "spring_preload": (500.0 - SPRING * shift, 20.0),
            "lower_stop": (shift, 1e-5),
            "upper_stop": other,
        }
        balance, stop = found(**changes)
        assert "the bench set or the zero of the pressure sensor (+10 kPa" in balance.message
        agrees = (
            "or the zero of the position sensor (-2 mm), consistent with the shift of the one "
            "travel stop reached"
        )
        assert (agrees in balance.message) == (other is None)
        assert ("position sensor" in balance.message) == (other is None)
        assert "alike" not in balance.message
        sensor = "the zero or span of the position sensor" if other is None else "the span of"
        assert sensor in stop.message


LOW = replace(LIMITS, preload_change=0.01)


@pytest.mark.parametrize(
    ("end", "stop", "far", "way"),
    [
        ("lower", "lower_stop", "lowest_position", 1.0),
        ("upper", "upper_stop", "highest_position", -1.0),
    ],
)
def test_a_stop_met_once_is_compared_with_the_reach_of_the_other(end, stop, far, way):
    """Travel is lost where the baseline went on; beyond its stop, the stop has moved outward."""
    healthy = HEALTHY[stop].value
    reached = {name: one for name, one in HEALTHY.items() if "stop" not in name}
    baseline = replace(BASELINE, numbers=reached)
    inside, outside = ((healthy + 2e-3 * side, 1e-5) for side in (way, -way))
    assert f"lost at the {end} end" in only(found(baseline, **{stop: inside})).message
    assert found(baseline, **{stop: outside}) == ()
    beyond = found(**{stop: None, far: outside})
    assert f"{end} end has moved outward by {-2.0 * way:+.2f} mm" in only(beyond).message
    assert found(**{stop: None, far: inside}) == ()


def test_a_stop_that_stays_leaves_the_span_of_the_position_sensor():
    assert (
        "the span of the position sensor" in only(found(upper_stop=(0.95 * TRAVEL, 1e-5))).message
    )
    alone = only(found(upper_stop=(0.95 * TRAVEL, 1e-5), lower_stop=None)).message
    assert "the zero or span of the position sensor" in alone


def test_without_travel_shares_of_it_are_not_compared():
    changed = {"spring_preload": (900.0, 1.0), "slip_force": (400.0, 1.0), "lower_stop": (1.0, 0.0)}
    assert found(valve=replace(VALVE, travel=math.inf), **changed) == ()


@pytest.mark.parametrize("name", [one.name for one in fields(ValveLimits)])
def test_impossible_limits_are_refused(name):
    with pytest.raises(ValueError, match=f"{name} must be above"):
        ValveLimits(**{name: 0.0})


def test_limits_of_the_spring_are_in_order():
    with pytest.raises(ValueError, match="spring_change < spring_failure"):
        ValveLimits(spring_change=0.4)


def noisy_record(packing, seed):
    return SensorNoise(5e-6, 50.0, seed).applied_to(quick_record(packing))


@pytest.fixture(scope="module")
def healthy_result():
    return identify(noisy_record(LOW_FRICTION, 1), BENCH_VALVE)


class TestWholeIdentifications:
    """Records of simulated valves, from the samples to the sentence."""

    def test_an_unchanged_valve_with_another_noise(self, healthy_result):
        again = identify(noisy_record(LOW_FRICTION, 2), BENCH_VALVE)
        assert diagnose_valve(again, Baseline.of(healthy_result)).findings == ()

    def test_a_spring_that_has_lost_a_third_of_its_stiffness(self, healthy_result):
        weak = replace(LOW_FRICTION, spring_constant=LOW_FRICTION.spring_constant * 2 / 3)
        result = identify(noisy_record(weak, 3), BENCH_VALVE)
        finding = only(diagnose_valve(result, Baseline.of(healthy_result)).findings)
        assert finding.level is ERROR
        assert finding.message.startswith("the spring constant has changed")
        numbers = valve_numbers(result)
        assert numbers["spring_constant"].value == pytest.approx(weak.spring_constant, rel=0.01)

    @pytest.mark.parametrize(
        ("error", "words"),
        [
            ((6e3, 0.0), "pressure sensor (+5.9"),
            ((0.0, 2e-3), "position sensor (+2 mm"),
            ((0.0, -2e-3), "position sensor (-2 mm"),
        ],
    )
    def test_a_zero_is_named_as_the_error_of_the_reading(self, healthy_result, error, words):
        true = noisy_record(LOW_FRICTION, 5)
        read = Recording(true.sample_period, true.drive + error[0], true.position + error[1])
        result = identify(read, BENCH_VALVE)
        found = diagnose_numbers(
            valve_numbers(result), Baseline.of(healthy_result), BENCH_VALVE, LOW
        )
        (balance,) = [one.message for one in found if "balance" in one.message]
        assert words in balance


@pytest.mark.parametrize("zero", [-5e3, -6e3])
def test_a_preload_near_zero_is_judged_by_its_newtons(healthy_result, zero):
    """A sensor that reads 5 kPa too low takes the preload of 232 N to 9 N."""
    true = noisy_record(LOW_FRICTION, 6)
    result = identify(replace(true, drive=true.drive + zero), BENCH_VALVE)
    assert result.parameters["spring_preload"].verdict is not Verdict.NOT_IDENTIFIABLE
    shift = valve_changes(valve_numbers(result), valve_numbers(healthy_result))["spring_preload"]
    assert shift.holds(BENCH_VALVE.diaphragm_area * zero)
    finding = only(diagnose_valve(result, Baseline.of(healthy_result)).findings)
    assert f"the zero of the pressure sensor ({1e-3 * zero:.2g}" in finding.message
    back = diagnose_valve(healthy_result, Baseline.of(result)).findings
    assert "the force balance has shifted" in only(back).message


def test_a_doubted_model_leaves_what_the_signals_and_the_force_balance_say_and_the_slip_jump(
    healthy_result,
):
    doubted = replace(healthy_result.misfit, systematic=1e-3, tolerated=1e-4)
    assert not doubted.describes
    numbers = valve_numbers(replace(healthy_result, misfit=doubted))
    signals = {"drive_noise", "stem_noise", "lowest_position", "highest_position"}
    balance = {"spring_constant", "spring_preload"}
    of_sliding = {"sliding_friction_shared", "speed_exponent"}
    assert numbers.keys() == signals | balance | of_sliding | {"slip_force"}


@pytest.mark.parametrize(("coulomb", "width"), [(300.0, 80.0), (50.0, 50.0), (None, 80.0)])
def test_a_slip_jump_is_known_to_half_of_itself_where_friction_is_not(
    healthy_result, coulomb, width
):
    """160 N of a slip jump, each with 30 N of its own: it has grown, whatever F_c is."""
    found = {"slip_force": {"value": 160.0, "half_width": 30.0}}
    friction = replace(healthy_result.parameters["coulomb_friction"], half_width=coulomb or 0.0)
    if coulomb is None:
        friction = not_identifiable("coulomb_friction", "why")
    parameters = {**healthy_result.parameters, "coulomb_friction": friction}
    evidence = {**healthy_result.evidence, IMPERFECTIONS_FOUND: found}
    numbers = valve_numbers(replace(healthy_result, parameters=parameters, evidence=evidence))
    assert numbers["slip_force"] == Measured(160.0, math.hypot(30.0, width))


def numbers_with(result, **parameters):
    return valve_numbers(replace(result, parameters={**result.parameters, **parameters}))


def test_a_spring_that_is_hardly_known_leaves_no_other_number(healthy_result):
    spring = replace(healthy_result.parameters["spring_constant"], half_width=0.11 * 2.05e5)
    numbers = numbers_with(healthy_result, spring_constant=spring)
    assert "spring_preload" not in numbers
    assert "stem_noise" in numbers


@pytest.mark.parametrize("verdict", Verdict)
def test_a_viscous_friction_counts_where_it_is_told_apart_from_a_lag(healthy_result, verdict):
    """And so does the share by which it is larger upward."""
    viscous = Parameter("viscous_friction", 4.9e3, 100.0, 200.0, verdict)
    found = {"viscous_asymmetry": {"value": 0.5, "half_width": 0.1}}
    evidence = {**healthy_result.evidence, IMPERFECTIONS_FOUND: found}
    numbers = numbers_with(replace(healthy_result, evidence=evidence), viscous_friction=viscous)
    known = {"viscous_friction", "viscous_asymmetry"} & numbers.keys()
    assert len(known) == (2 if verdict is Verdict.IDENTIFIED else 0)
