"""Friction compared with its baseline: the ratio and its interval."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.health import Baseline
from valve_friction_ros.identification import Parameter, Verdict

FRICTIONS = st.floats(1.0, 1e4)
SHARES = st.floats(0.0, 0.99)


def friction_of(value, half_width):
    return Parameter("coulomb_friction", value, half_width / 2, half_width, Verdict.WEAK)


class TestComparison:
    def test_by_hand(self, friction):
        """Shares of 6/200 = 3 % and 4/100 = 4 % add to 5 %: 2·e^∓0.05 is 1.90246 to 2.10254."""
        ratio = Baseline(100.0, 4.0).compared_with(friction(200.0, 6.0))
        assert ratio.value == 2.0
        assert ratio.low == pytest.approx(1.902458849001428, rel=1e-14)
        assert ratio.high == pytest.approx(2.1025421927520482, rel=1e-14)

    def test_a_given_baseline_adds_nothing(self, friction):
        """Only the 6/200 = 3 % of the friction: 2·e^∓0.03 is 1.94089 to 2.06091."""
        ratio = Baseline(100.0).compared_with(friction(200.0, 6.0))
        assert ratio.low == pytest.approx(1.9408910670970163, rel=1e-14)
        assert ratio.high == pytest.approx(2.060909067907034, rel=1e-14)

    def test_two_given_values_leave_no_doubt(self, friction):
        assert Baseline(128.0).compared_with(friction(192.0)) == (1.5, 1.5, 1.5)

    @given(FRICTIONS, SHARES, FRICTIONS, SHARES)
    def test_the_inverse_says_the_same(self, healthy, healthy_share, now, now_share):
        """Which of two frictions is called the baseline changes nothing but the sign of the log."""
        one = Baseline(healthy, healthy_share * healthy)
        other = Baseline(now, now_share * now)
        ratio = one.compared_with(friction_of(now, now_share * now))
        inverse = other.compared_with(friction_of(healthy, healthy_share * healthy))
        assert ratio.low * inverse.high == pytest.approx(1.0, rel=1e-12)
        assert ratio.high * inverse.low == pytest.approx(1.0, rel=1e-12)
        assert ratio.low * ratio.high == pytest.approx(ratio.value**2, rel=1e-12)
        assert ratio.low <= ratio.value <= ratio.high

    def test_of_the_unit_nothing_is_left(self, friction):
        """Newtons or kilonewtons: the same ratio, to the last bit for a power of two."""
        large = Baseline(128.0, 4.0).compared_with(friction(256.0, 8.0))
        assert Baseline(0.125, 4.0 / 1024).compared_with(friction(0.25, 8.0 / 1024)) == large

    def test_a_friction_that_is_not_identifiable_has_no_ratio(self, unknown):
        assert all(math.isnan(one) for one in Baseline(100.0, 4.0).compared_with(unknown()))

    @pytest.mark.parametrize("value", [0.0, -5.0])
    def test_a_friction_that_cannot_be_has_no_interval(self, friction, value):
        ratio = Baseline(100.0).compared_with(friction(value, 1.0))
        assert ratio.value == value / 100.0
        assert math.isnan(ratio.low)
        assert math.isnan(ratio.high)


class TestBounds:
    @pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
    def test_impossible_friction(self, value):
        with pytest.raises(ValueError, match=r"^baseline_coulomb_friction must be"):
            Baseline(value)

    @pytest.mark.parametrize("half_width", [-1.0, math.nan, math.inf])
    def test_impossible_half_width(self, half_width):
        with pytest.raises(ValueError, match=r"^half_width must"):
            Baseline(100.0, half_width)

    def test_a_given_value_has_no_width(self):
        assert Baseline(100.0).half_width == 0.0
