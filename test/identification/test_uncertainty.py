"""Covariances of estimates whose uncertainty is known from theory."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from valve_friction_ros.identification.uncertainty import (
    block_covariance,
    half_width,
    stroke_length,
    worst_case,
)


def mean_equation(signal):
    """Σ (θ − y) = 0, whose root is the mean."""
    return (signal.mean() - signal)[:, None], np.array([[float(signal.size)]])


class TestBlocks:
    SIZE = 200_000
    BLOCK = 1000

    def variance_of_mean(self, signal):
        return float(block_covariance(*mean_equation(signal), self.BLOCK).matrix[0, 0])

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


def test_formula_block_by_block():
    """The sandwich with each sum and each inverse written out."""
    generator = np.random.default_rng(3)
    scores = generator.standard_normal((103, 2))
    root = generator.standard_normal((2, 2))
    curvature = root @ root.T + np.eye(2)
    found = block_covariance(scores, curvature, 10)
    middle = np.zeros((2, 2))
    for block in range(10):
        total = scores[10 * block : 10 * block + 10].sum(axis=0)
        middle += np.outer(total, total)
    inverse = np.linalg.inv(curvature)
    np.testing.assert_allclose(found.matrix, inverse @ middle @ inverse.T * 10 / 8, rtol=1e-12)
    assert found.freedom == 8


def test_blocks_are_shortened_to_eight_or_twice_the_parameters():
    generator = np.random.default_rng(4)
    for free, blocks in ((1, 8), (4, 8), (6, 12)):
        scores = generator.standard_normal((240, free))
        assert block_covariance(scores, np.eye(free), 240).freedom == blocks - free


@given(scales=st.lists(st.floats(1e-6, 1e6), min_size=3, max_size=3))
def test_units_of_the_parameters_do_not_matter(scales):
    generator = np.random.default_rng(5)
    scores = generator.standard_normal((90, 3))
    curvature = scores.T @ scores
    unit = np.array(scales)
    plain = block_covariance(scores, curvature, 9).matrix
    scaled = block_covariance(scores * unit, curvature * np.outer(unit, unit), 9).matrix
    np.testing.assert_allclose(scaled * np.outer(unit, unit), plain, rtol=1e-9)


def test_unknown_where_the_equation_is_singular_or_the_record_too_short():
    scores = np.random.default_rng(6).standard_normal((50, 2))
    assert np.isnan(block_covariance(scores, np.ones((2, 2)), 5).matrix).all()
    assert np.isnan(block_covariance(scores, np.diag([1.0, 0.0]), 5).matrix).all()
    assert np.isnan(block_covariance(scores[:2], np.eye(2), 5).matrix).all()


def test_half_width_is_students():
    """Tabulated quantiles at 97.5 %."""
    for freedom, quantile in ((1, 12.7062), (5, 2.57058), (10, 2.22814), (10**7, 1.95996)):
        assert half_width(2.0, freedom) == pytest.approx(2 * quantile, rel=1e-5)


def test_stroke_length_between_reversals():
    """Up, rest, down, up: 4 stretches but 3 strokes; a rest is no reversal."""
    moves = np.concatenate([np.ones(30), np.zeros(30), np.ones(10), -np.ones(20), np.ones(29)])
    simulated = np.concatenate([[0.0], np.cumsum(moves)])
    assert stroke_length(simulated) == 120 // 3
    assert stroke_length(np.zeros(50)) == 50


class TestWorstCase:
    SENSITIVITY = np.random.default_rng(7).standard_normal((200, 3)) * [1.0, 5.0, 0.1]

    def bound(self, misfit):
        gram = self.SENSITIVITY.T @ self.SENSITIVITY
        return worst_case(2 * gram, 200, misfit)

    def moved(self, residual):
        return np.linalg.lstsq(self.SENSITIVITY, residual, rcond=None)[0]

    @pytest.mark.parametrize("index", range(3))
    def test_attained_by_the_worst_residual(self, index):
        """The residual along S·(SᵀS)⁻¹·e_i moves θ_i by the whole bound."""
        gram = self.SENSITIVITY.T @ self.SENSITIVITY
        worst = self.SENSITIVITY @ np.linalg.inv(gram)[:, index]
        worst *= 0.7 / np.sqrt(np.mean(worst**2))
        bound = math.sqrt(self.bound(0.7)[index, index])
        assert self.moved(worst)[index] == pytest.approx(bound, rel=1e-12)

    @given(seed=st.integers(0, 10_000))
    def test_no_residual_moves_more(self, seed):
        residual = np.random.default_rng(seed).standard_normal(200)
        misfit = float(np.sqrt(np.mean(residual**2)))
        bound = np.sqrt(np.diag(self.bound(misfit)))
        assert (np.abs(self.moved(residual)) <= bound).all()

    def test_unknown_without_curvature(self):
        assert np.isnan(worst_case(np.diag([1.0, 0.0]), 10, 1.0)).all()
