"""Friction compared with its baseline: which friction, at which speed, and the ratio's interval."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.health import Baseline, Comparison, SlidingFriction, carried, compared
from valve_friction_ros.identification import Parameter, Verdict

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

    def test_a_given_baseline_adds_nothing(self):
        """Only the 6/200 = 3 % of the friction: 2·e^∓0.03 is 1.94089 to 2.06091."""
        ratio = Comparison((200.0, 6.0), (100.0, 0.0)).ratio
        assert ratio.low == pytest.approx(1.9408910670970163, rel=1e-14)
        assert ratio.high == pytest.approx(2.060909067907034, rel=1e-14)

    def test_two_given_values_leave_no_doubt(self):
        assert Comparison((192.0, 0.0), (128.0, 0.0)).ratio[:3] == (1.5, 1.5, 1.5)

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

    def test_of_the_unit_nothing_is_left(self):
        """Newtons or kilonewtons: the same ratio, to the last bit for a power of two."""
        large = Comparison((256.0, 8.0), (128.0, 4.0)).ratio
        small = Comparison((0.25, 8.0 / 1024), (0.125, 4.0 / 1024)).ratio
        assert large[:3] == small[:3]

    @pytest.mark.parametrize("value", [0.0, -5.0])
    def test_a_friction_that_cannot_be_has_no_interval(self, value):
        ratio = Comparison((value, 1.0), (100.0, 0.0)).ratio
        assert ratio.value == value / 100.0
        assert math.isnan(ratio.low)
        assert math.isnan(ratio.high)
        assert ratio.change == 0.0

    def test_what_it_is_of(self):
        assert Comparison((1.0, 0.0), (1.0, 0.0)).ratio.what == "coulomb friction"
        sliding = Comparison((1.0, 0.0), (1.0, 0.0), "sliding_friction", 9.46e-3).ratio
        assert sliding.what == "sliding friction at 9.5 mm/s"


class TestCarried:
    """F_c + F_v·v at another speed."""

    def carried(self, speed, to, sliding=(200.0, 3.0), viscous=(SLOPE, 0.0)):
        target = SlidingFriction(1.0, 0.0, to)
        return carried(frictions(sliding=sliding, viscous=viscous), speed, target)

    def test_at_its_own_speed_it_stays(self):
        assert self.carried(SPEED, SPEED, viscous=None) == SlidingFriction(200.0, 3.0, SPEED)

    def test_by_the_viscous_friction(self):
        """5000 N·s/m times 4 mm/s are 20 N; ±1000 N·s/m are 4 N, which add in squares to 3 N."""
        faster = self.carried(8e-3, 12e-3, viscous=(SLOPE, 1000.0))
        slower = self.carried(12e-3, 8e-3, viscous=(SLOPE, 1000.0))
        assert (faster.value, faster.half_width) == pytest.approx((220.0, 5.0))
        assert (slower.value, slower.half_width) == pytest.approx((180.0, 5.0))
        assert faster.speed == 12e-3

    def test_an_unknown_viscous_friction_is_none_or_all(self):
        """From 8 to 12 mm/s: 200 N if all is dry, 300 N if all is viscous."""
        found = self.carried(8e-3, 12e-3, (200.0, 0.0), viscous=None)
        assert found.value == pytest.approx(250.0)
        assert found.half_width == pytest.approx(50.0)

    @pytest.mark.parametrize(("to", "is_near"), [(16.0, True), (4.0, True), (16.1, False)])
    def test_up_to_a_factor_of_two(self, to, is_near):
        assert (self.carried(8e-3, to * 1e-3) is not None) is is_near

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
        assert found.ratio.value == pytest.approx(1.0)

    def test_coulomb_friction_where_only_that_is_on_both_sides(self):
        assert self.of(frictions((160.0, 1.0))) == "coulomb_friction"
        assert self.of(frictions((160.0, 1.0), (200.0, 1.0)), Baseline(160.0)) == "coulomb_friction"
        both = frictions((160.0, 1.0), (200.0, 1.0))
        assert self.of(both, speed=3e-3) == "coulomb_friction"

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
