"""Sensor noise, read from signals whose noise is known."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from valve_friction_ros.signals.noise import (
    position_noise,
    quantisation_step,
    sensor_noise,
)

SIZE = 100_000


def white(seed=0):
    return np.random.default_rng(seed).standard_normal(SIZE)


@pytest.mark.parametrize("deviation", [1e-9, 28.6e-6, 165.0])
def test_white_noise_at_any_scale(deviation):
    """A mean of n dependent magnitudes errs by some 2/√n; five of these."""
    assert sensor_noise(deviation * white()) == pytest.approx(deviation, rel=10 / math.sqrt(SIZE))


def test_normal_second_differences():
    """Their quantiles in any order: √6 times the noise, and nine tenths of them are kept."""
    middle = (np.arange(SIZE) + 0.5) / SIZE
    quantiles = np.random.default_rng(2).permutation(norm.ppf(middle))
    position = np.cumsum(np.cumsum(math.sqrt(6) * quantiles))
    assert position_noise(position) == pytest.approx(1.0, rel=1e-4)


def test_a_million_samples_of_white_noise():
    """The same bound as above, 2/√n, five times."""
    many = np.random.default_rng(3).standard_normal(1_000_000)
    assert position_noise(many) == pytest.approx(1.0, rel=0.01)


def test_scales_with_the_signal():
    assert sensor_noise(1e3 * white()) == pytest.approx(1e3 * sensor_noise(white()), rel=1e-12)


def test_a_jerk_now_and_then_is_no_noise():
    """A hundred jumps touch two or three of 100 000 second differences each: far below a tenth."""
    jumps = np.repeat(np.random.default_rng(1).choice([-50.0, 50.0], 100), SIZE // 100)
    quiet = sensor_noise(white())
    assert sensor_noise(white() + jumps) == pytest.approx(quiet, rel=0.01)


@pytest.mark.parametrize("deviation", [1.0, 2.0, 3.0])
def test_coarse_converter_adds_its_twelfth_twice_at_the_most(deviation):
    """Rounded noise has the variance σ² + q²/12, to which another q²/12 is added on purpose."""
    found = sensor_noise(np.round(deviation * white()))
    tolerance = 10 / math.sqrt(SIZE)
    assert found > (1 - tolerance) * math.hypot(deviation, 12**-0.5)
    assert found < (1 + 2 * tolerance) * math.hypot(deviation, (2 / 12) ** 0.5)


def test_resting_signal_keeps_the_rounding_error():
    """Codes that hardly change leave no second differences, yet the error is q/√12."""
    slow = np.round(np.linspace(0.0, 30.0, SIZE)) * 0.25
    assert position_noise(slow) == 0.0
    assert sensor_noise(slow) == pytest.approx(0.25 / math.sqrt(12), rel=1e-12)


@given(
    codes=st.lists(st.integers(-2048, 2047), min_size=2, max_size=30, unique=True),
    step=st.floats(1e-6, 1e3),
)
def test_step_is_the_smallest_distance_on_a_lattice(codes, step):
    signal = step * np.repeat(np.array(codes, dtype=float), 4)
    expected = step * np.diff(np.sort(codes)).min()
    # The values are rounded at the size of the largest, 2048 steps.
    assert quantisation_step(signal) == pytest.approx(expected, rel=2048 * 4e-16)


def test_no_step_in_a_signal_that_was_never_quantised_or_never_moved():
    assert quantisation_step(white()) == 0.0
    assert quantisation_step(np.full(50, 3.25)) == 0.0


def test_step_survives_numbers_that_differ_by_rounding_alone():
    """0.1·3 and 0.3 are neighbours in the last digit, and one code."""
    signal = np.tile([0.1 * 3, 0.3, 0.1, 0.2], 50)
    assert quantisation_step(signal) == pytest.approx(0.1, rel=1e-12)
