# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Friction compared with its baseline: which one, the ratio's interval, and what qualifies it."""

import dataclasses
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from records import quick_record

from valve_friction_ros import compare
from valve_friction_ros.health import (
    Baseline,
    Comparison,
    Diagnosis,
    Finding,
    FrictionMonitor,
    Level,
    Measured,
    MonitorSettings,
    Ratio,
    SlidingFriction,
    StatusSignal,
    Survey,
    SurveyLimits,
    carried,
    compared,
    diagnose,
    diagnose_valve,
    leading_ratio,
    qualified,
    surveyed,
)
from valve_friction_ros.health.diagnosis import survey_of
from valve_friction_ros.health.levels import PACKING_LIMITS
from valve_friction_ros.health.valve_numbers import SHARED
from valve_friction_ros.identification import SPEED_EXPONENT, Parameter, Verdict, identify
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION, LOW_FRICTION, Valve
from valve_friction_ros.settings import PACKINGS
from valve_friction_ros.wording import Code, quoted

FRICTIONS = st.floats(1.0, 1e4)
SHARES = st.floats(0.0, 0.99)
SPEED = 8e-3
SLOPE = 5000.0


def parameter(name, value, half_width=0.0, verdict=Verdict.IDENTIFIED):
    return Parameter(name, value, half_width / 2, half_width, verdict)


def frictions(coulomb=None, sliding=None, viscous=(SLOPE, 0.0), verdict=Verdict.IDENTIFIED):
    """Parameters from values, or pairs of value and half width; None is not identifiable."""
    unknown = (math.nan, math.nan)
    given = {
        "coulomb_friction": coulomb or unknown,
        "sliding_friction": sliding or unknown,
        "viscous_friction": viscous or unknown,
    }
    found = {name: parameter(name, *numbers) for name, numbers in given.items()}
    found["coulomb_friction"] = parameter("coulomb_friction", *(coulomb or unknown), verdict)
    return found


class TestRatio:
    def test_by_hand(self):
        """Shares of 6/200 = 3 % and 4/100 = 4 % add to 5 %: 2·e^∓0.05 is 1.90246 to 2.10254."""
        ratio = Comparison((200.0, 6.0), (100.0, 4.0)).ratio
        assert ratio.value == 2.0
        assert ratio.low == pytest.approx(1.902458849001428, rel=1e-14)
        assert ratio.high == pytest.approx(2.1025421927520482, rel=1e-14)

    @given(FRICTIONS, SHARES, FRICTIONS, SHARES)
    def test_the_inverse_says_the_same(self, healthy, healthy_share, now, now_share):
        """Which of two frictions is called the baseline changes nothing but the sign of the log."""
        one, other = (healthy, healthy_share * healthy), (now, now_share * now)
        ratio, inverse = Comparison(other, one).ratio, Comparison(one, other).ratio
        assert ratio.low * inverse.high == pytest.approx(1.0, rel=1e-12)
        assert ratio.high * inverse.low == pytest.approx(1.0, rel=1e-12)
        assert ratio.low * ratio.high == pytest.approx(ratio.value**2, rel=1e-12)
        assert ratio.low <= ratio.value <= ratio.high
        assert ratio.change == pytest.approx(-inverse.change, abs=1e-9)

    @pytest.mark.parametrize("value", [0.0, -5.0])
    def test_a_friction_that_cannot_be_has_no_interval(self, value):
        ratio = Comparison((value, 1.0), (100.0, 0.0)).ratio
        assert ratio.value == value / 100.0
        assert math.isnan(ratio.low)
        assert math.isnan(ratio.high)
        assert ratio.change == 0.0

    def test_what_it_is_of(self):
        assert Comparison((1.0, 0.0), (1.0, 0.0)).ratio.what == "Coulomb friction"
        sliding = Comparison((1.0, 0.0), (1.0, 0.0), "sliding_friction", 9.46e-3).ratio
        assert sliding.what == "sliding friction at 9.5 mm/s"


def law_of(static, fall, viscous):
    """The friction over the speed of a packing that slips, in its F_c."""
    return lambda v: 1.0 + (static - 1.0) * math.exp(-((v / fall) ** 2)) + viscous * v


class TestCarried:
    """F_c + F_v·v at another speed."""

    def carried(self, speed, to, sliding=(200.0, 3.0), viscous=(SLOPE, 0.0)):
        target = SlidingFriction(1.0, 0.0, to)
        return carried(frictions(sliding=sliding, viscous=viscous), speed, target)

    def test_at_its_own_speed_it_stays(self):
        assert self.carried(SPEED, SPEED, viscous=None) == SlidingFriction(200.0, 3.0, SPEED)

    @staticmethod
    def expected(apart, low, high):
        """Join two Gaussians, of what is known and of what is usual; ± is 1.96 deviations.

        To s times the speed, a share of 0.16·(1 − 1/s) is lost, give or take 0.12·(1 − 1/s).
        """
        lost = 1.0 - math.exp(-abs(apart))
        found = (low + high) / 2 - math.copysign(0.16 * lost, apart)
        known = ((high - low) / 2 / 1.959964) ** 2 + (0.12 * lost) ** 2
        usual = (0.4 * apart) ** 2
        mean = (found / known + 0.3 * apart / usual) / (1 / known + 1 / usual)
        return mean, 1.959964 / math.sqrt(1 / known + 1 / usual)

    @pytest.mark.parametrize("to", [3e-3, 7e-3, 12e-3, 40e-3])
    def test_by_the_viscous_friction(self, to):
        """5000 ± 1000 N·s/m at 8 mm/s are 16 to 24 % of 200 N, and grow with the speed."""
        found = self.carried(8e-3, to, viscous=(SLOPE, 1000.0))
        ends = sorted(math.log(1 + share * (to / 8e-3 - 1)) for share in (0.16, 0.24))
        step, doubt = self.expected(math.log(to / 8e-3), *ends)
        assert found.value == pytest.approx(200.0 * math.exp(step), rel=1e-6)
        share = math.hypot(3.0 / 200.0, doubt)
        assert found.half_width == pytest.approx(share * found.value, rel=1e-6)
        assert found.speed == to

    @pytest.mark.parametrize("to", [4e-3, 12e-3])
    def test_an_unknown_viscous_friction_is_none_or_all(self, to):
        """Where all is dry, friction stays; where all is viscous, it grows as the speed."""
        apart = math.log(to / 8e-3)
        step, doubt = self.expected(apart, *sorted((0.0, apart)))
        for unknown in (None, (9e9, 1e9), (-1.0, 9e9)):
            found = self.carried(8e-3, to, (200.0, 0.0), viscous=unknown)
            expected = (step, doubt)
            if unknown == (9e9, 1e9):  # more than all is all
                expected = self.expected(apart, apart, apart)
            assert math.log(found.value / 200.0) == pytest.approx(expected[0], rel=1e-6)
            assert found.half_width == pytest.approx(expected[1] * found.value, rel=1e-6)

    def test_a_withheld_viscous_friction_counts(self):
        """An interval that is wider than its value says that there is little of it."""
        known = frictions(sliding=(200.0, 3.0), viscous=None)
        little = dataclasses.replace(known["viscous_friction"], withheld=(500.0, 900.0))
        found = carried(known | {"viscous_friction": little}, 8e-3, SlidingFriction(1.0, 0.0, 4e-3))
        assert found == self.carried(8e-3, 4e-3, viscous=(500.0, 900.0))
        assert found.half_width < 0.6 * self.carried(8e-3, 4e-3, viscous=None).half_width

    @pytest.mark.parametrize(("share", "counts"), [(0.09, True), (0.14, False)])
    def test_the_viscous_friction_of_a_vague_spring_does_not_count(self, share, counts):
        """A fit that does not separate spring from friction does not tell F_v, however narrow."""
        known = frictions(sliding=(200.0, 3.0), viscous=(SLOPE, 1000.0), verdict=Verdict.WEAK)
        spring = parameter("spring_constant", 1e5, share * 1e5, Verdict.WEAK)
        to = SlidingFriction(1.0, 0.0, 6e-3)
        found = carried(known | {"spring_constant": spring}, 8e-3, to)
        assert found == self.carried(8e-3, 6e-3, viscous=(SLOPE, 1000.0) if counts else None)
        fixed = replace(spring, verdict=Verdict.FIXED)
        assert carried(known | {"spring_constant": fixed}, 8e-3, to).half_width < 20.0

    @pytest.mark.parametrize("width", [0.0, 0.1, 0.3, None])
    @pytest.mark.parametrize("farthest", [1.5, 2.5, 8.0])
    def test_95_percent_of_drawn_packings_are_inside(self, width, farthest):
        """Friction by its law at two speeds; F_v·v/F known to ± `width`, or not at all."""
        random = np.random.default_rng(5)
        inside = []
        for _ in range(2000):
            static = random.choice([1.0, 1.15 * (2.0 / 1.15) ** random.random()])
            fall = 0.3e-3 * (5.0 / 0.3) ** random.random()
            large = 10 ** random.uniform(-3.0, -1.7)
            viscous = 0.1 * 30 ** random.random() / large
            law = law_of(static, fall, viscous)
            speed = large * 10 ** random.uniform(-1.3, 0.1)
            to = speed * farthest ** random.uniform(-1.0, 1.0)
            unit = law(speed) / speed
            error = random.normal(0.0, (width or 0.0) / 1.96)
            known = None if width is None else (viscous + error * unit, width * unit)
            found = self.carried(speed, to, (law(speed), 0.0), known)
            if found is None:  # too far apart
                assert max(speed, to) > 2.0 * min(speed, to)
                continue
            apart = abs(math.log(found.value / law(to)))  # as a ratio has it
            inside.append(apart <= found.half_width / found.value)
        assert 0.88 < np.mean(inside) < 0.985

    @pytest.mark.parametrize(("to", "is_near"), [(4e-3, True), (2.9e-3, False), (24e-3, False)])
    def test_not_where_too_little_is_known_between_the_speeds(self, to, is_near):
        """Of an unknown F_v, 8 and 2.9 mm/s are 44 % apart by 95 %; of a known one, 17 %."""
        assert (self.carried(8e-3, to, viscous=None) is not None) is is_near
        assert self.carried(8e-3, to) is not None

    @pytest.mark.parametrize("is_weak", [True, False])
    def test_no_packing_has_surely_changed_however_far_the_speeds(self, is_weak):
        """An unchanged packing at two speeds, 30 and more apart; F_v unknown, or from its creep."""
        random = np.random.default_rng(11)
        for _ in range(1000):
            static, fall = random.uniform(1.0, 1.45), 0.3e-3 * (5.0 / 0.3) ** random.random()
            fast = 10 ** random.uniform(-3.0, -1.7)
            law = law_of(static, fall, random.uniform(0.05, 3.0) / fast)
            slow = fast / random.uniform(30.0, 100.0)
            speeds = [slow, fast] if is_weak else random.permutation([slow, fast])
            creep = 0.07 * law(slow) / slow, 0.04 * law(slow) / slow
            now = frictions(sliding=(law(speeds[0]), 0.0), viscous=creep if is_weak else None)
            weak = replace(now["viscous_friction"], verdict=Verdict.WEAK)
            baseline = Baseline(sliding=SlidingFriction(law(speeds[1]), 0.0, speeds[1]))
            found = compared(now | {"viscous_friction": weak}, speeds[0], baseline)
            assert found is None or found.ratio.change == 0.0

    def test_not_without_a_friction_or_a_speed(self):
        assert self.carried(SPEED, SPEED, sliding=None) is None
        assert self.carried(math.nan, SPEED) is None
        assert self.carried(SPEED, SPEED, sliding=(-1.0, 0.1)) is None


BASELINE = Baseline(160.0, 1.6, SlidingFriction(200.0, 2.0, SPEED))


class TestWhichFriction:
    def of(self, parameters, baseline=BASELINE, speed=SPEED):
        found = compared(parameters, speed, baseline)
        return found and found.of

    def test_the_sliding_friction(self):
        found = compared(frictions((240.0, 60.0), (300.0, 3.0)), SPEED, BASELINE)
        assert (found.of, found.speed) == ("sliding_friction", SPEED)
        assert found.ratio.value == 1.5
        share = math.hypot(0.01, 0.01)
        assert found.ratio.low == pytest.approx(1.5 * math.exp(-share))
        assert found.excess == (100.0, pytest.approx(math.hypot(3.0, 2.0)))

    def test_at_the_speed_of_the_baseline(self):
        """The same packing at 12 mm/s: 20 N more, and none of it is growth."""
        found = compared(frictions((160.0, 60.0), (220.0, 2.0)), 12e-3, BASELINE)
        assert found.of == "sliding_friction"
        assert found.ratio.low < 1.0 < found.ratio.high < 1.2

    def test_coulomb_friction_where_only_that_is_on_both_sides(self):
        assert self.of(frictions((160.0, 1.0))) == "coulomb_friction"
        assert self.of(frictions((160.0, 1.0), (200.0, 1.0)), Baseline(160.0)) == "coulomb_friction"
        both = frictions((160.0, 1.0), (200.0, 1.0))
        assert self.of(both, speed=math.nan) == "coulomb_friction"

    def test_nothing_where_neither_is(self):
        assert self.of(frictions((160.0, 1.0)), Baseline(sliding=BASELINE.sliding)) is None
        assert self.of(frictions(sliding=(200.0, 1.0)), Baseline(160.0)) is None

    def test_a_weak_coulomb_friction_does_not_count_however_narrow(self):
        weak = frictions((320.0, 1.0), (360.0, 60.0), verdict=Verdict.WEAK)
        assert self.of(weak) == "sliding_friction"

    def test_what_the_split_moves_from_viscous_to_coulomb_friction_is_no_growth(self):
        """F_c 1.5 times as large and F_v 0: the sliding friction is what it was."""
        moved = frictions((240.0, 2.0), (200.0, 4.0), (0.0, 300.0))
        assert self.of(moved) == "sliding_friction"
        assert compared(moved, SPEED, BASELINE).ratio.change == 0.0
        fallen = frictions((80.0, 1.0), (200.0, 4.0), (15e3, 300.0))
        assert self.of(fallen) == "sliding_friction"

    def test_growth_of_the_dry_friction_alone_shows_in_the_coulomb_friction(self):
        """80 N more of each: 1.5 times F_c, 1.4 times the sliding friction."""
        assert self.of(frictions((240.0, 2.0), (280.0, 3.0))) == "coulomb_friction"

    def test_coulomb_friction_where_a_lag_makes_the_sliding_friction_uncertain(self):
        assert self.of(frictions((240.0, 2.0), (280.0, 90.0))) == "coulomb_friction"

    def test_of_two_without_a_change_the_one_known_better(self):
        assert self.of(frictions((160.0, 1.0), (200.0, 9.0))) == "coulomb_friction"
        assert self.of(frictions((160.0, 7.0), (200.0, 1.0))) == "sliding_friction"

    def test_a_common_scale_of_all_forces_cancels(self):
        """Twice the diaphragm area on both sides: the same ratio."""
        double = Baseline(320.0, 3.2, SlidingFriction(400.0, 4.0, SPEED))
        one = compared(frictions((240.0, 9.0), (310.0, 6.0)), 10e-3, BASELINE)
        scaled = frictions((480.0, 18.0), (620.0, 12.0), (2 * SLOPE, 0.0))
        other = compared(scaled, 10e-3, double)
        assert one.ratio == other.ratio


class TestSharedLag:
    """What a lag does to both frictions alike is no doubt about their ratio."""

    HEALTHY = Measured(30.0, 0.0)

    def of(self, shared, width=40.0, healthy=40.0, speed=SPEED):
        sliding = SlidingFriction(200.0, healthy, SPEED)
        baseline = Baseline(sliding=sliding, numbers={SHARED: self.HEALTHY})
        numbers = {} if shared is None else {SHARED: Measured(shared, 0.0)}
        now = frictions(sliding=(400.0, width), viscous=(SLOPE, 100.0))
        return compared(now, speed, baseline, numbers)

    def test_by_hand(self):
        """Shares of 0.1 and 0.2, of which 60/400 and 30/200 are wrong alike by nine tenths."""
        expected = math.sqrt(0.1**2 + 0.2**2 - 2 * 0.9 * 0.1 * 0.15)
        assert self.of(60.0).share == pytest.approx(expected, rel=1e-12)

    def test_the_friction_that_is_added_knows_it_too(self):
        """Half widths of 40 N, of which 40 and 30 N are wrong alike: 1600 + 1600 - 1.8 · 1200."""
        assert self.of(60.0).excess == (200.0, pytest.approx(math.sqrt(1040.0)))

    def test_it_is_never_more_than_the_half_width_and_unknown_it_is_none(self):
        assert self.of(60.0, width=1.0) == self.of(1.0, width=1.0)
        assert self.of(None).share == math.hypot(0.1, 0.2)

    def test_twice_as_fast_it_was_twice_the_force(self):
        assert self.of(60.0, speed=2 * SPEED).shared[0] == 30.0


KNOWN = Measured(0.5, 0.02)


class TestExponent:
    """A friction curve that is known near the speed of the record."""

    def carried(self, to, exponent=KNOWN):
        now = frictions(sliding=(200.0, 0.0), viscous=None)
        numbers = {} if exponent is None else {SPEED_EXPONENT: exponent}
        return carried(now, SPEED, SlidingFriction(1.0, 0.0, to), numbers)

    @pytest.mark.parametrize("to", [0.8 * SPEED, 1.25 * SPEED])
    def test_near_it_friction_is_a_power_of_the_speed(self, to):
        found = self.carried(to)
        assert found.value == pytest.approx(200.0 * (to / SPEED) ** 0.5, rel=0.01)
        assert found.half_width < 0.5 * self.carried(to, None).half_width

    def test_an_exponent_that_is_not_known_is_not_taken(self):
        assert self.carried(2 * SPEED, Measured(0.5, 5.0)) == self.carried(2 * SPEED, None)

    def test_of_packings_that_slip_nearly_all_lie_inside(self):
        """Drawn F_c, F_s, v_s, F_v; carried from the exact slope at one speed to another one."""
        generator = np.random.default_rng(7)
        inside = []
        for _ in range(400):
            ends = np.log([[1.0, 0.3e-3, 10.0, 0.5e-3, 0.5], [2.0, 5e-3, 300.0, 2e-2, 2.0]])
            static, fall, viscous, speed, apart = np.exp(generator.uniform(*ends))
            law = law_of(static, fall, viscous)
            step = 1e-6 * speed
            slope = (law(speed + step) - law(speed - step)) / (2 * step) * speed / law(speed)
            now = frictions(sliding=(law(speed), 0.0), viscous=None)
            to = SlidingFriction(1.0, 0.0, apart * speed)
            found = carried(now, speed, to, {SPEED_EXPONENT: Measured(slope, 0.0)})
            inside.append(abs(found.value - law(apart * speed)) <= found.half_width)
        assert 0.9 < np.mean(inside) < 1.0


FACTOR = Measured.between(2.2, 2.15, 2.25)
VALVE = Valve(diaphragm_area=0.04, pressure_reference=1e5, travel=0.03)
GROWN = Diagnosis(
    Level.ERROR,
    StatusSignal.FAILURE,
    quoted("excess friction: so much"),
    Ratio.between(2.2, 2.1, 2.3),
)
WORDS = (
    "friction and spring constant have changed by the same factor, which points to the scale of "
    "the pressure sensor and the diaphragm area: check both before working on the packing; "
)


def test_the_level_stays_and_the_signal_is_to_check():
    told = qualified(GROWN, FACTOR, VALVE)
    assert (told.level, told.status_signal) == (Level.ERROR, StatusSignal.CHECK_FUNCTION)
    assert told.message == WORDS + "excess friction: so much"
    assert qualified(told, FACTOR, VALVE) == told


def test_a_force_has_no_diaphragm():
    told = qualified(GROWN, FACTOR, Valve(None, travel=0.03))
    assert "points to the scale of the drive force sensor: check both" in told.message


@pytest.mark.parametrize(
    ("diagnosis", "factor"),
    [
        (GROWN, None),
        (GROWN, Measured.between(1.5, 1.45, 1.55)),
        (replace(GROWN, level=Level.OK), FACTOR),
        (replace(GROWN, ratio=None), FACTOR),
    ],
)
def test_what_the_factor_does_not_explain_stays(diagnosis, factor):
    """No factor; a friction that has grown by more; nothing found; nothing compared."""
    assert qualified(diagnosis, factor, VALVE) == diagnosis


@pytest.fixture(scope="module")
def healthy():
    return identify(quick_record(), BENCH_VALVE)


class TestWholeRecords:
    def test_a_pressure_sensor_that_reads_twice_too_much(self, healthy):
        """Half the area stands for it, by a result and by the monitor."""
        twice = replace(BENCH_VALVE, diaphragm_area=2 * BENCH_VALVE.diaphragm_area)
        scaled = identify(quick_record(), twice)
        found = diagnose_valve(scaled, Baseline.of(healthy))
        assert found.friction.message.startswith(WORDS)
        assert "a common factor" in found.findings[0].message
        assert compare(scaled, healthy) == found.friction
        monitor = FrictionMonitor(MonitorSettings(scaled.valve))
        monitor.baseline = Baseline.of(healthy)
        monitor.accept(scaled, 1)
        assert monitor.diagnosis().message.startswith(WORDS)
        assert monitor.diagnosis().level > Level.OK

    def test_friction_that_has_grown_by_itself(self, healthy):
        tight = 2.5 * LOW_FRICTION.coulomb_friction
        packing = replace(LOW_FRICTION, coulomb_friction=tight, static_friction=tight)
        found = diagnose_valve(identify(quick_record(packing), BENCH_VALVE), Baseline.of(healthy))
        assert found.friction.status_signal is StatusSignal.FAILURE
        assert found.friction.message.startswith("excess friction")


MOVES, IDENTIFIED = 2.4, 1.1


def by_moves(level, leads):
    return Finding(
        level, StatusSignal.FAILURE, quoted("by moves"), leads=leads, friction_ratio=MOVES
    )


SPRING = Finding(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, quoted("the spring"))


@pytest.mark.parametrize(
    ("diagnosed", "findings", "level", "ratio"),
    [
        (Level.OK, [by_moves(Level.ERROR, True)], Level.ERROR, MOVES),
        (Level.ERROR, [by_moves(Level.ERROR, True)], Level.ERROR, MOVES),
        (Level.ERROR, [by_moves(Level.ERROR, False)], Level.ERROR, IDENTIFIED),
        (Level.OK, [by_moves(Level.ERROR, False)], Level.ERROR, MOVES),
        (Level.WARN, [SPRING], Level.WARN, IDENTIFIED),
        (Level.OK, [SPRING], Level.WARN, math.nan),
        (Level.OK, [], Level.OK, IDENTIFIED),
        (Level.OK, [by_moves(Level.WARN, True)], Level.ERROR, math.nan),
    ],
)
def test_the_ratio_of_a_level(diagnosed, findings, level, ratio):
    compared = Ratio.between(IDENTIFIED, 1.0, 1.2)
    diagnosis = Diagnosis(diagnosed, StatusSignal.GOOD, quoted(""), compared)
    assert leading_ratio(diagnosis, findings, level) == pytest.approx(ratio, nan_ok=True)
    if MOVES not in [one.friction_ratio for one in findings]:
        assert math.isnan(leading_ratio(replace(diagnosis, ratio=None), findings, level))


@pytest.mark.parametrize(
    ("band", "half_width", "expected"),
    [
        (0.05, 0.01, Survey.GOOD),
        (0.05, 0.06, Survey.WATCH),
        (0.15, 0.01, Survey.WATCH),
        (0.21, 0.005, Survey.BAD),
        (0.21, 0.05, Survey.WATCH),
        (0.15, 0.10, Survey.UNKNOWN),
        (math.nan, math.nan, Survey.UNKNOWN),
    ],
)
def test_the_interval_decides(band, half_width, expected):
    assert surveyed(band, half_width) is expected


def test_a_packing_has_limits_which_may_be_stated():
    assert tuple(PACKING_LIMITS) == PACKINGS
    assert SurveyLimits.of_packing() == SurveyLimits() == SurveyLimits(0.10, 0.20)
    assert SurveyLimits.of_packing("graphite") == SurveyLimits(0.15, 0.30)
    assert SurveyLimits.of_packing("graphite", bad=0.5) == SurveyLimits(0.15, 0.5)
    with pytest.raises(ValueError, match="packing must be ptfe or graphite, got 'felt'"):
        SurveyLimits.of_packing("felt")
    with pytest.raises(ValueError, match=r"survey_bad, got survey_watch 0\.25, survey_bad 0\.2"):
        SurveyLimits.of_packing(watch=0.25)


@pytest.mark.parametrize(
    ("packing", "expected", "words"),
    [((), Survey.GOOD, ": good by"), ((HIGH_FRICTION,), Survey.BAD, ": bad by")],
)
def test_the_packings_of_the_paper(packing, expected, words):
    """(F_c + F_s)/(k·travel): 2·152.7/5858 = 5.2 % of the one, 2·606/5858 = 20.7 % of the other."""
    result = identify(quick_record(*packing), BENCH_VALVE)
    assert survey_of(result, BENCH_VALVE) is expected
    found = diagnose(result, BENCH_VALVE)
    assert (found.survey, found.statement.code) == (expected, Code.NO_BASELINE)
    assert words in found.message
    assert found.to_dict()["survey"] == expected.value
