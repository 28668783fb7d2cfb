# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The lag of the stem: its prior, its likelihood by fits, and what it leaves of a number."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from valve_friction_ros.identification.engine.lags import (
    LAGS,
    LagPrior,
    LagProfile,
    mixture_half_width,
    share_of_timing,
    spread_of,
)
from valve_friction_ros.identification.engine.posterior_fit import PosteriorFit, Stage
from valve_friction_ros.identification.engine.search import _lowest

SIGMA = 0.01
SHARPNESS = 1.5  # the logarithm of the likelihood is divided by it


class TestLagPrior:
    LAGS = np.linspace(-2.0, 2.0, 400_001)

    def test_unstated(self):
        """Cauchy's: half within 4 ms, 95 % within 51 ms, 2·arctan(x/4 ms)/π; never impossible."""
        density = np.exp(LagPrior().log_density(self.LAGS))
        share = [np.sum(density[np.abs(self.LAGS) < reach]) for reach in (4e-3, 50.82e-3)]
        inside = 2.0 / math.pi * math.atan(self.LAGS[-1] / 4e-3)
        expected = np.array([0.5, 0.95]) / inside
        assert np.array(share) / np.sum(density) == pytest.approx(expected, abs=1e-3)
        assert not LagPrior().is_known

    def test_stated(self):
        """A Gaussian."""
        density = LagPrior(0.02).log_density(np.array([0.0, 0.02, 0.06]))
        np.testing.assert_allclose(density - density[0], [0.0, -0.5, -4.5])
        assert LagPrior(0.02).precision(0.3) == pytest.approx(0.02**-2)

    def test_its_precision_falls_where_it_is_flat(self):
        assert LagPrior().precision(0.0) > LagPrior().precision(0.05) > 0.0

    def test_known(self):
        assert LagPrior(0.0).is_known


class TestMixture:
    def test_of_one_normal_distribution(self):
        ones = np.ones(1)
        assert mixture_half_width(ones, 3.0 * ones, 2.0 * ones) == pytest.approx(
            2.0 * 1.959964, rel=1e-5
        )

    def test_of_sharp_ones_apart(self):
        """Two of three share the mean's side; the third is held too: 95 % do not go without it."""
        values = np.array([0.0, 0.0, 3.0])
        assert mixture_half_width(np.ones(3) / 3, values, np.full(3, 1e-6)) == pytest.approx(
            2.0, abs=1e-5
        )

    def test_what_is_rarer_than_one_in_twenty_is_left_out(self):
        weights, values = np.array([0.97, 0.03]), np.array([0.0, 100.0])
        assert mixture_half_width(weights, values, np.ones(2)) < 10.0

    def test_its_timing_is_what_the_record_leaves(self):
        """In squares, and never more than was found."""
        assert share_of_timing(5.0 * 1.959964, 3.0, 9.0) == pytest.approx(4.0, rel=1e-6)
        assert share_of_timing(5.0 * 1.959964, 3.0, 2.0) == 2.0
        assert share_of_timing(1.0, 3.0, 2.0) == 0.0

    def test_spread(self):
        assert spread_of(np.exp(-0.5 * (LAGS / SIGMA) ** 2)) == pytest.approx(SIGMA, rel=1e-3)


def fit(lag, cost, is_apart=False, residual=0.0):
    at = {"delay": lag, "stem_lag": 0.0, "force_lag": 0.0}
    stage = Stage(at, np.array([[SIGMA**2]]), cost, 0.0)
    nothing = np.zeros(1)
    return PosteriorFit(
        SimpleNamespace(weights=1.0),
        ("delay",),
        (stage,),
        1.0,
        nothing,
        nothing,
        np.array([residual]),
        is_apart=is_apart,
    )


def parabola(lifted=0.0):
    """Fits at five lags; the one at a deviation above the best ends that much too high."""
    return [fit(n * SIGMA, n**2 + (lifted if n == 1 else 0.0)) for n in (-2, -1, 0, 1, 2)]


class TestProfile:
    def test_of_a_parabola(self):
        expected = -0.5 * (LAGS / SIGMA) ** 2 / SHARPNESS
        found = LagProfile.of(parabola()).by_fits
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)

    @pytest.mark.parametrize("lifted", [0.5, 3.0, 10.0])
    def test_a_fit_that_ends_too_high_excludes_no_lag(self, lifted):
        usual = LagProfile.of(parabola()).by_fits
        assert np.all(LagProfile.of(parabola(lifted)).by_fits >= usual - 0.5)
        assert LagProfile.of(parabola(lifted)).by_fits[150] == 0.0

    def test_one_far_apart_is_as_likely_as_it_fits_and_no_more_than_the_best(self):
        far = 0.1
        there = int(np.argmin(np.abs(LAGS - far)))
        for cost, expected in ((4.0, -2.0), (-9.0, 0.0)):
            found = LagProfile.of([*parabola(), fit(far, cost, is_apart=True)]).by_fits
            assert found[there] == pytest.approx(expected, abs=1e-3)

    def test_a_thirtieth_of_the_simulations_are_misled(self):
        """Of the probability 3 % are √10 times as wide: its logarithm is a tenth there."""
        profile = LagProfile.of(parabola())
        told, sharp = np.exp(profile.log_likelihood), np.exp(profile.by_fits)
        blunt = np.exp(-0.5 * (LAGS / SIGMA) ** 2 / (10.0 * SHARPNESS))
        expected = 0.97 * sharp / np.sum(sharp) + 0.03 * blunt / np.sum(blunt)
        np.testing.assert_allclose(told / np.sum(told), expected, rtol=1e-6)
        assert profile.spread == pytest.approx(SIGMA * math.sqrt(SHARPNESS), rel=1e-2)

    def test_one_near_is_of_the_same_valley(self):
        assert not LagProfile.of([*parabola(), fit(5.9 * SIGMA, 0.0, is_apart=True)]).apart

    def test_none_without_a_lag_or_with_an_absurd_one(self):
        assert LagProfile.of([fit(0.15, 0.0)]) is None
        assert LagProfile.of([fit(0.0, 0.0, is_apart=True)]) is None

    def test_numbers_along_it(self):
        """Linear between fits, the linear model's slope beyond, and of a fit apart its own."""
        fits = [*parabola(), fit(0.1, 0.0, is_apart=True)]
        found = LagProfile.of(fits).along({one: 7.0 + 100.0 * one.lag for one in fits}, -3.0)
        at = dict(zip(np.round(LAGS, 6), found, strict=True))
        assert at[0.005] == pytest.approx(7.5)
        assert at[-0.03] == pytest.approx(5.0 + 0.03)
        assert at[0.1] == at[0.12] == pytest.approx(17.0)


@pytest.mark.parametrize(
    ("cost", "is_apart", "residual", "is_taken"),
    [
        (98.5, False, 12.0, True),
        (99.5, False, 8.0, False),
        (65.0, True, 8.0, True),
        (75.0, True, 8.0, False),
        (65.0, True, 12.0, False),
    ],
)
def test_a_slow_sensor_is_no_better_for_the_noise_in_its_jumps(cost, is_apart, residual, is_taken):
    """Apart, a fit must lie 30 lower than the best, and its plain sum of squares below, too."""
    best, other = fit(0.0, 100.0, residual=10.0), fit(0.1, cost, is_apart, residual)
    assert _lowest([best, other]) is (other if is_taken else best)
