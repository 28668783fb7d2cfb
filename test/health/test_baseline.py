"""What can be a baseline, and what is refused."""

import dataclasses
import math

import pytest

from valve_friction_ros.health import Baseline, SlidingFriction
from valve_friction_ros.health.baseline import LARGEST_SHARE
from valve_friction_ros.identification import RefusalError


class TestBounds:
    @pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
    def test_impossible_friction(self, value):
        with pytest.raises(ValueError, match=r"^baseline_coulomb_friction must be"):
            Baseline(value)

    @pytest.mark.parametrize("half_width", [-1.0, math.nan, math.inf])
    def test_impossible_half_width(self, half_width):
        with pytest.raises(ValueError, match=r"^half_width must"):
            Baseline(100.0, half_width)

    @pytest.mark.parametrize(
        ("numbers", "name"),
        [
            ((0.0, 1.0, 1e-3), "sliding_friction"),
            ((1.0, -1.0, 1e-3), "half_width"),
            ((1.0, 1.0, 0.0), "sliding_speed"),
        ],
    )
    def test_impossible_sliding_friction(self, numbers, name):
        with pytest.raises(ValueError, match=f"^{name} must"):
            SlidingFriction(*numbers)

    def test_there_is_one_friction_at_least(self):
        with pytest.raises(ValueError, match="needs a coulomb friction or a sliding friction"):
            Baseline()

    def test_a_given_value_has_no_width(self):
        assert Baseline(100.0).half_width == 0.0


def test_it_is_told_on_one_line():
    sliding = SlidingFriction(205.5, 3.25, 9.5e-3)
    assert str(Baseline(152.7)) == "coulomb friction 152.7 N"
    assert str(Baseline(152.7, 2.0, sliding)) == (
        "coulomb friction 152.7 ± 2 N, sliding friction 205.5 ± 3.2 N at 9.5 mm/s"
    )
    assert str(Baseline(sliding=sliding)) == "sliding friction 205.5 ± 3.2 N at 9.5 mm/s"


class TestOfAResult:
    @pytest.fixture
    def known(self, with_values, friction):
        """Function of half widths, N: a result with F_c 100 N and 200 N of sliding friction."""

        def build(coulomb, sliding, speed=8e-3):
            found = with_values(
                coulomb_friction=friction(100.0, coulomb),
                sliding_friction=friction(200.0, sliding, "sliding_friction"),
            )
            return dataclasses.replace(found, sliding_speed=speed)

        return build

    def test_it_has_both(self, known):
        expected = Baseline(100.0, 3.0, SlidingFriction(200.0, 4.0, 8e-3))
        assert Baseline.of(known(3.0, 4.0)) == expected

    def test_what_is_known_too_badly_is_left_out(self, known):
        """At a half width of 13 % a friction serves, beyond it does not."""
        sliding = SlidingFriction(200.0, 26.0, 8e-3)
        assert Baseline.of(known(13.1, 26.0)) == Baseline(sliding=sliding)
        assert Baseline.of(known(13.0, 26.1)) == Baseline(100.0, 13.0)
        assert Baseline.of(known(13.0, 26.0, speed=math.nan)) == Baseline(100.0, 13.0)

    def test_without_any_of_use_it_is_refused(self, known):
        with pytest.raises(RefusalError) as refusal:
            Baseline.of(known(30.0, 50.0))
        assert str(refusal.value) == (
            "this result cannot be the baseline: coulomb friction is known to ±30 %, and a "
            "baseline needs ±13 %; sliding friction is known to ±25 %, and a baseline needs "
            "±13 %: record "
            "more strokes, some fast and some slow, and state a timing_uncertainty if the clocks "
            "and lags of both signals are known"
        )

    def test_growth_by_half_is_declared_with_the_widest_baseline(self):
        """1.5·exp(−√2·0.13) is 1.248: the limit of the first alarm, but for the rounding."""
        assert 1.5 * math.exp(-math.sqrt(2) * LARGEST_SHARE) == pytest.approx(1.25, rel=2e-3)
