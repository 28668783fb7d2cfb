"""Parts of the fit with imperfections, each against what can be derived."""

import numpy as np
import pytest

from valve_friction_ros.identification.robust.bounded_step import bounded_minimum
from valve_friction_ros.identification.robust.weights import inflation
from valve_friction_ros.model.stamped import StampedSignal
from valve_friction_ros.signals.stamped_noise import stamped_noise


@pytest.mark.parametrize("jitter", [0.0, 0.3])
@pytest.mark.parametrize("lost", [0.0, 0.2])
def test_noise_does_not_depend_on_the_stamps(jitter, lost):
    generator = np.random.default_rng(1)
    time = np.arange(20_000) * 1e-3 + 1e-3 * jitter * generator.uniform(-1, 1, 20_000)
    time = time[generator.random(time.size) >= lost]
    values = np.sin(time) + 0.01 * generator.standard_normal(time.size)
    assert stamped_noise(StampedSignal(time, values)) == pytest.approx(0.01, rel=0.03)


def test_minimum_inside_the_bounds_is_that_of_the_form():
    curvature, slope = np.array([[1.0, 0.3], [0.3, 1.0]]), np.array([1.0, 2.0])
    found = bounded_minimum(curvature, slope, np.full(2, -np.inf))
    np.testing.assert_allclose(found, np.linalg.solve(curvature, slope))


def test_minimum_at_a_bound_moves_the_other_coordinate():
    """With q₀ held at 0, q₁ is b₁/A₁₁."""
    curvature, slope = np.array([[1.0, 0.9], [0.9, 1.0]]), np.array([-1.0, 0.5])
    found = bounded_minimum(curvature, slope, np.array([0.0, -np.inf]))
    np.testing.assert_allclose(found, [0.0, 0.5])


def test_white_residuals_are_not_inflated():
    scaled = np.random.default_rng(0).standard_normal(100_000)
    assert inflation(scaled, 1000) == pytest.approx(1.0, abs=0.6)


def test_lasting_residuals_are_inflated_by_their_length():
    """Blocks of 64 equal numbers: a mean over them has 64 times the variance of white noise."""
    scaled = np.repeat(np.random.default_rng(0).standard_normal(4096), 64)
    assert inflation(scaled, 64) == pytest.approx(64.0, rel=0.1)
