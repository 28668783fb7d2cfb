"""Appendix A: derivatives by local polynomials."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.signal import savgol_coeffs

from valve_friction_ros.signals import differentiate
from valve_friction_ros.signals.derivatives import savgol_weights
from valve_friction_ros.signals.noise import position_noise, velocity_noise

EPS = np.finfo(float).eps
SETTINGS = [(31, 3), (5, 2), (15, 4), (101, 3), (7, 5)]


@pytest.mark.parametrize(("window", "order"), SETTINGS)
@given(coefficients=st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6))
def test_exact_on_polynomials(window, order, coefficients):
    """A polynomial that the window fits without residual is differentiated by the book."""
    period = 0.02
    time = period * (np.arange(150) - 75)
    polynomial = Polynomial(coefficients[: order + 1])
    position = polynomial(time)
    found = differentiate(position, period, window, order)
    # The weights solve a least squares in powers of the sample number, of this condition.
    condition = np.linalg.cond(np.vander(np.arange(window) - window // 2, order + 1))
    for degree, values in ((1, found.velocity), (2, found.acceleration)):
        weights = savgol_coeffs(window, order, deriv=degree, delta=period)
        tolerance = condition * EPS * np.abs(weights).sum() * np.abs(position).max()
        expected = polynomial.deriv(degree)(found.inner(time))
        # A subnormal coefficient is no test of rounding.
        np.testing.assert_allclose(values, expected, rtol=0, atol=tolerance + 1e-300)


def test_not_exact_beyond_the_order():
    """The middle slope of t³ under a parabola is (3·h·(h+1) − 1)/5 periods², h = d//2 …"""
    period, half = 0.1, 4
    time = period * np.arange(-half, half + 1)
    found = differentiate(time**3, period, 2 * half + 1, 2)
    # … which is Σ t⁴/Σ t² over the window.
    assert found.velocity[0] == pytest.approx(np.sum(time**4) / np.sum(time**2), rel=1e-13)
    assert found.velocity[0] == pytest.approx(
        (3 * half * (half + 1) - 1) / 5 * period**2, rel=1e-13
    )


def exact_weights(window, order, degree):
    """The weights by the normal equations in fractions, rounded at the end alone."""
    places = range(-(window // 2), window // 2 + 1)
    rows = [
        [Fraction(sum(place ** (row + column) for place in places)) for column in range(order + 1)]
        + [Fraction(math.factorial(degree) * (row == degree))]
        for row in range(order + 1)
    ]
    for column in range(order + 1):
        pivot = next(row for row in range(column, order + 1) if rows[row][column])
        rows[column], rows[pivot] = rows[pivot], rows[column]
        rows[column] = [value / rows[column][column] for value in rows[column]]
        for row in set(range(order + 1)) - {column}:
            factor = rows[row][column]
            rows[row] = [
                one - factor * other for one, other in zip(rows[row], rows[column], strict=True)
            ]
    weights = [sum(row[-1] * place**power for power, row in enumerate(rows)) for place in places]
    return np.array([float(weight) for weight in weights])[::-1]


@pytest.mark.parametrize(("window", "order"), SETTINGS)
def test_the_window_is_full_everywhere(window, order):
    position = np.cumsum(np.random.default_rng(0).standard_normal(400))
    period = 0.05
    found = differentiate(position, period, window, order)
    assert found.margin == window // 2
    for degree, values in ((1, found.velocity), (2, found.acceleration)):
        weights = exact_weights(window, order, degree) / period**degree
        expected = np.convolve(position, weights, "valid")
        assert values.shape == (400 - window + 1,)
        np.testing.assert_allclose(
            values, expected, rtol=0, atol=100 * EPS * np.abs(expected).max()
        )


def test_inner_cuts_to_the_middle_of_each_window():
    time = 0.5 * np.arange(12)
    found = differentiate(time**2, 0.5, 5, 2)
    np.testing.assert_array_equal(found.inner(np.arange(12)), np.arange(2, 10))
    np.testing.assert_allclose(found.velocity, 2 * found.inner(time), atol=1e-12)


def test_paper_window_by_default():
    position = np.sin(0.01 * np.arange(200))
    default, named = differentiate(position, 1e-3), differentiate(position, 1e-3, 31, 3)
    np.testing.assert_array_equal(default.velocity, named.velocity)
    np.testing.assert_array_equal(default.acceleration, named.acceleration)


def test_one_full_window_is_enough_and_less_is_refused():
    assert differentiate(np.zeros(31), 1e-3).velocity.shape == (1,)
    for size in (30, 1, 0):
        with pytest.raises(
            ValueError, match=rf"^{size} samples are fewer than the derivative window of 31"
        ):
            differentiate(np.zeros(size), 1e-3)


class TestNoise:
    SIZE = 100_000
    DEVIATION = 10e-6

    def test_read_from_a_moving_stem(self):
        noise = self.DEVIATION * np.random.default_rng(0).standard_normal(self.SIZE)
        stroke = 0.01 * np.sin(2 * np.pi * 1e-4 * np.arange(self.SIZE))
        # A median of n magnitudes errs by √(π/2/n) or so, more for dependent differences: 5·2/√n.
        assert position_noise(stroke + noise) == pytest.approx(
            self.DEVIATION, rel=10 / math.sqrt(self.SIZE)
        )

    def test_none_in_a_straight_or_short_record(self):
        assert position_noise(np.linspace(0.0, 1.0, 257)) == 0.0
        assert position_noise(np.array([0.0, 1.0])) == 0.0

    @pytest.mark.parametrize(("window", "order"), SETTINGS)
    def test_velocity_noise_is_what_the_derivative_makes_of_it(self, window, order):
        noise = self.DEVIATION * np.random.default_rng(1).standard_normal(self.SIZE)
        expected = velocity_noise(self.DEVIATION, 1e-3, window, order)
        found = differentiate(noise, 1e-3, window, order).velocity.std()
        # The velocities are correlated over a window: n/d of them count, five standard errors.
        assert found == pytest.approx(expected, rel=5 / math.sqrt(2 * self.SIZE / window))


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize(("window", "order"), [(5, 3), (31, 3), (51, 4), (401, 3)])
def test_weights_are_exact(window, order, degree):
    """Those of scipy differ from the exact ones by up to 1.5e-10, as its powers are not scaled."""
    expected = exact_weights(window, order, degree) / 0.01**degree
    found = savgol_weights(window, order, degree, 0.01)
    assert found == pytest.approx(expected, abs=100 * EPS * np.abs(expected).max())
    scipys = savgol_coeffs(window, order, deriv=degree, delta=0.01)
    assert found == pytest.approx(scipys, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_weights_differentiate_a_polynomial_exactly(degree):
    curve = Polynomial([0.3, -1.2, 0.7, 2.0])
    times = 0.01 * np.arange(-15, 16)
    found = savgol_weights(31, 3, degree, 0.01)[::-1] @ curve(times)
    assert found == pytest.approx(curve.deriv(degree)(0.0) if degree else 0.3, rel=1e-10)
