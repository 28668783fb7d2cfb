# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What can be a baseline, and what is refused."""

import dataclasses
import math

import pytest

from valve_friction_ros.health import Baseline, BaselineLack, Lack, SlidingFriction
from valve_friction_ros.health.baseline import GOOD_SHARE, LARGEST_SHARE
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
        "coulomb friction 152.7 ± 2.0 N, sliding friction 205.5 ± 3.2 N at 9.5 mm/s"
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

    def test_known_worse_one_serves_the_sliding_friction_first(self, known):
        """At a half width of 33 % one serves where none is known to 13 %, beyond it none."""
        sliding = SlidingFriction(200.0, 66.0, 8e-3)
        assert Baseline.of(known(13.1, 66.0)) == Baseline(sliding=sliding)
        assert Baseline.of(known(33.0, 66.1)) == Baseline(100.0, 33.0)
        assert Baseline.of(known(13.0, 66.0)) == Baseline(100.0, 13.0)

    def test_without_any_of_use_it_is_refused(self, known):
        with pytest.raises(RefusalError) as refusal:
            Baseline.of(known(35.0, 80.0))
        assert str(refusal.value) == (
            "this result cannot be the baseline: coulomb friction is known to ±35 %, and a "
            "baseline needs ±33 %; sliding friction is known to ±40 %, and a baseline needs "
            "±33 %: record "
            "more strokes, some fast and some slow, and state a timing_uncertainty if the clocks "
            "and lags of both signals are known"
        )

        assert (
            refusal.value.lacks
            == Baseline.lacks(known(35.0, 80.0))
            == (
                BaselineLack("coulomb_friction", Lack.PRECISION, 0.35, LARGEST_SHARE),
                BaselineLack("sliding_friction", Lack.PRECISION, 0.4, LARGEST_SHARE),
            )
        )

    def test_with_one_of_use_nothing_is_missing(self, known):
        assert Baseline.lacks(known(35.0, 66.0)) == Baseline.lacks(known(33.0, 80.0)) == ()

    def test_what_a_wide_one_cannot_show_is_said(self):
        assert Baseline(100.0, 13.0).remark == Baseline(100.0).remark == ""
        assert Baseline(100.0, 13.0, SlidingFriction(200.0, 66.0, 8e-3)).remark == ""
        words = "it is known to ±33 %: only friction that has grown to 2 times is certain to be"
        assert Baseline(sliding=SlidingFriction(200.0, 66.0, 8e-3)).remark.startswith(words)
        assert Baseline(100.0, 33.0).remark.startswith(words)

    def test_growth_is_declared_with_the_widest_baseline(self):
        """1.5·exp(−√2·0.13) is 1.248: the limit of the first alarm, but for the rounding."""
        for growth, share in ((1.5, GOOD_SHARE), (2.0, LARGEST_SHARE)):
            found = growth * math.exp(-math.sqrt(2) * share)
            assert found == pytest.approx(1.25, rel=5e-3)
