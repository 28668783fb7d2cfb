# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Covariances of estimates whose uncertainty is known from theory."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import sqrtm
from scipy.signal import lfilter

from valve_friction_ros.identification.trust.uncertainty import (
    block_covariance,
    half_width,
    stroke_length,
)


def of_mean(signal, block):
    """The covariance of θ in Σ (θ − y) = 0, whose root is the mean."""
    return block_covariance(np.ones((signal.size, 1)), signal.mean() - signal, block)


class TestBlocks:
    SIZE = 200_000
    BLOCK = 1000

    def variance_of_mean(self, signal):
        return float(of_mean(signal, self.BLOCK).matrix[0, 0])

    def noise(self):
        return np.random.default_rng(0).standard_normal(self.SIZE)

    @property
    def tolerance(self):
        """A variance from 200 blocks errs by √(2/200); three of these."""
        return 3 * math.sqrt(2 * self.BLOCK / self.SIZE)

    @pytest.mark.parametrize("memory", [0.0, 0.5, 0.9, 0.98])
    def test_mean_of_an_autoregression(self, memory):
        """Var = σ²/(n·(1 − φ)²); the textbook's σ_y²/n is 99 times too small at φ = 0.98."""
        signal = lfilter([1.0], [1.0, -memory], self.noise())
        expected = 1 / (self.SIZE * (1 - memory) ** 2)
        # A block forgets what came before it within 1/(1 − φ) samples.
        edges = 1 / (1 - memory) / self.BLOCK
        assert self.variance_of_mean(signal) == pytest.approx(expected, rel=self.tolerance + edges)

    @pytest.mark.parametrize("weight", [-0.5, 1.0])
    def test_mean_of_a_moving_average(self, weight):
        signal = lfilter([1.0, weight], [1.0], self.noise())
        expected = (1 + weight) ** 2 / self.SIZE
        assert self.variance_of_mean(signal) == pytest.approx(expected, rel=self.tolerance)


class TestBlocksOfLeastSquares:
    """A regression of unequal strokes, with the whole matrices written out."""

    SAMPLES, FREE, BLOCKS = 80, 3, 8
    LENGTH = SAMPLES // BLOCKS
    TREND = np.linspace(0.2, 2.0, SAMPLES)[:, None]
    SLOPE = TREND * np.random.default_rng(3).standard_normal((SAMPLES, FREE))
    INVERSE = np.linalg.inv(SLOPE.T @ SLOPE)
    RESIDUAL_OF = np.eye(SAMPLES) - SLOPE @ INVERSE @ SLOPE.T
    GRADIENT = np.array([1.0, -2.0, 0.5])

    def covariance(self, noise):
        return block_covariance(self.SLOPE, self.RESIDUAL_OF @ noise, self.LENGTH)

    def maps(self):
        """For each block the matrix that makes its contribution from the noise, (b, p, n)."""
        maps = []
        for block in range(self.BLOCKS):
            rows = slice(block * self.LENGTH, (block + 1) * self.LENGTH)
            left = self.RESIDUAL_OF[rows, rows]
            undone = np.linalg.inv(sqrtm(left))
            maps.append(self.INVERSE @ self.SLOPE[rows].T @ undone @ self.RESIDUAL_OF[rows])
        return np.array(maps)

    def test_contributions(self):
        noise = np.random.default_rng(4).standard_normal(self.SAMPLES)
        expected = self.maps() @ noise
        np.testing.assert_allclose(self.covariance(noise).contributions, expected, rtol=1e-9)

    def test_unbiased_where_the_noise_is_white(self):
        """The mean over all white noise, by its unit vectors, is σ²·(SᵀS)⁻¹."""
        mean = sum(self.covariance(unit).matrix for unit in np.eye(self.SAMPLES))
        np.testing.assert_allclose(mean, self.INVERSE, rtol=1e-9)

    def test_freedom_is_satterthwaite_s(self):
        """2·mean²/variance of the sum of squares Σ (gᵀL_b·e)² over white Gaussian e."""
        rows = np.einsum("p,bpn->bn", self.GRADIENT, self.maps())
        moments = rows @ rows.T
        expected = np.trace(moments) ** 2 / np.sum(moments**2)
        noise = np.random.default_rng(5).standard_normal(self.SAMPLES)
        assert self.covariance(noise).freedom(self.GRADIENT) == pytest.approx(expected, rel=1e-9)
        assert 1 < expected < self.BLOCKS - 1

    def test_standard_error_is_that_of_the_matrix(self):
        covariance = self.covariance(np.random.default_rng(6).standard_normal(self.SAMPLES))
        variance = self.GRADIENT @ covariance.matrix @ self.GRADIENT
        error = covariance.standard_error(self.GRADIENT)
        assert error == pytest.approx(math.sqrt(variance), rel=1e-12)
        expected = half_width(error, covariance.freedom(self.GRADIENT))
        assert covariance.half_width(self.GRADIENT) == expected

    def test_intervals_cover(self):
        """Of 2000 white noises 95 % are covered, within three standard deviations of that count."""
        generator = np.random.default_rng(7)
        covered = 0
        for _ in range(2000):
            noise = generator.standard_normal(self.SAMPLES)
            error = self.GRADIENT @ self.INVERSE @ self.SLOPE.T @ noise
            covered += abs(error) <= self.covariance(noise).half_width(self.GRADIENT)
        assert covered / 2000 == pytest.approx(0.95, abs=3 * math.sqrt(0.95 * 0.05 / 2000))


def test_equal_blocks_of_a_mean_have_one_freedom_less_than_there_are():
    signal = np.random.default_rng(8).standard_normal(240)
    for block, blocks in ((30, 8), (20, 12), (240, 8)):  # at least 8
        assert of_mean(signal, block).freedom(np.ones(1)) == pytest.approx(blocks - 1, rel=1e-9)


def test_a_record_of_few_samples_has_a_block_for_each():
    signal = np.array([1.0, 3.0, 2.0, 7.0, 5.0])
    covariance = of_mean(signal, 30)
    assert covariance.freedom(np.ones(1)) == pytest.approx(4.0, rel=1e-9)
    assert covariance.matrix[0, 0] == pytest.approx(np.var(signal, ddof=1) / 5, rel=1e-9)


def test_a_block_with_nearly_all_the_information_counts_as_if_with_95_percent():
    """By hand for one coordinate: g_b = s_b / (A·√(1 − min(H_b, 0.95)))."""
    slope = np.array([30.0, *[1.0] * 7])
    residual = np.array([0.1, 3.0, -1.0, -2.0, 4.0, -3.0, 0.0, -2.0])
    shares = np.minimum(slope**2 / (slope @ slope), 0.95)
    assert shares[0] == 0.95
    expected = slope * residual / (slope @ slope) / np.sqrt(1 - shares)
    found = block_covariance(slope[:, None], residual, 1)
    np.testing.assert_allclose(found.contributions[:, 0], expected, rtol=1e-9)


def random_regression(samples, free, seed):
    generator = np.random.default_rng(seed)
    return generator.standard_normal((samples, free)), generator.standard_normal(samples)


@given(scales=st.lists(st.floats(1e-6, 1e6), min_size=3, max_size=3))
def test_units_of_the_parameters_do_not_matter(scales):
    (slope, residual), units = random_regression(90, 3, 5), np.array(scales)
    plain = block_covariance(slope, residual, 9).matrix
    scaled = block_covariance(slope / units, residual, 9).matrix
    np.testing.assert_allclose(scaled / np.outer(units, units), plain, rtol=1e-9)


def test_unknown_where_the_regression_is_singular_or_the_record_too_short():
    slope, _ = random_regression(50, 2, 6)
    for singular in (slope[:, [0, 0]], slope * [1.0, 0.0], slope[:2]):
        covariance = block_covariance(singular, np.ones(len(singular)), 5)
        assert np.isnan(covariance.matrix).all()
        assert np.isnan(covariance.half_width(np.ones(2)))
        assert np.isnan(covariance.freedom(np.ones(2)))


def test_half_width_is_students():
    """Tabulated quantiles at 97.5 %."""
    for freedom, quantile in ((1, 12.7062), (5, 2.57058), (10, 2.22814), (10**7, 1.95996)):
        assert half_width(2.0, freedom) == pytest.approx(2 * quantile, rel=1e-5)


def test_stroke_length_between_reversals():
    """Up, rest, down, up: 4 stretches but 3 strokes; a rest is no reversal."""
    moves = np.concatenate([np.ones(30), np.zeros(30), np.ones(10), -np.ones(20), np.ones(29)])
    simulated = np.concatenate([[0.0], np.cumsum(moves)])
    assert stroke_length(simulated) == 120 // 3
    assert stroke_length(simulated[:-1]) == 119 // 3
    assert stroke_length(np.zeros(50)) == 50
