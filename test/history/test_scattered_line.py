# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A line through estimates that scatter: closed forms, and coverage."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import linregress

from valve_friction_ros.history.trend import ScatteredLine, fit_line

TIMES = np.array([0.0, 1.0, 3.0, 4.0, 7.0])


def test_exact_estimates_on_a_line():
    line = fit_line(TIMES, 100.0 + 2.0 * TIMES, np.zeros(5))
    assert line.slope == pytest.approx(2.0, rel=1e-9)
    assert line.at(10.0) == pytest.approx(120.0, rel=1e-9)
    assert line.scatter == 0.0
    assert line.slope_half_width < 1e-6


def test_known_errors_alone():
    """Without scatter, the textbook's weighted line; its errors are not scaled down."""
    errors = np.array([1.0, 2.0, 1.0, 4.0, 2.0])
    line = fit_line(TIMES, 5.0 - 0.5 * TIMES, errors)
    weights = errors**-2
    centre = weights @ TIMES / weights.sum()
    assert line.centre == pytest.approx(centre)
    assert line.level_error == pytest.approx(weights.sum() ** -0.5)
    assert line.slope_error == pytest.approx((weights @ (TIMES - centre) ** 2) ** -0.5)
    assert line.scatter == 0.0


def test_scatter_alone_is_the_ordinary_regression():
    """Estimates that look exact: their intervals tell nothing, their scatter all."""
    values = np.array([100.0, 104.0, 103.0, 109.0, 111.0])
    line, ordinary = fit_line(TIMES, values, np.full(5, 1e-6)), linregress(TIMES, values)
    assert line.slope == pytest.approx(ordinary.slope, rel=1e-9)
    assert line.slope_error == pytest.approx(ordinary.stderr, rel=1e-6)
    residual = values - ordinary.intercept - ordinary.slope * TIMES
    assert line.scatter == pytest.approx(math.sqrt(residual @ residual / 3), rel=1e-6)
    assert line.freedom == 3
    assert line.quantile == pytest.approx(3.182446, rel=1e-6)  # of Student's t, from the tables


def test_scatter_brings_chi_squared_to_its_freedom():
    values = np.array([100.0, 106.0, 101.0, 111.0, 109.0])
    errors = np.array([1.0, 2.0, 1.5, 1.0, 3.0])
    line = fit_line(TIMES, values, errors)
    assert line.scatter > 0
    residual = values - line.at(TIMES)
    assert residual**2 @ (1 / (errors**2 + line.scatter**2)) == pytest.approx(3.0, rel=1e-9)


@given(st.floats(-1e6, 1e6), st.floats(0.01, 1e4), st.integers(0, 2**32))
def test_units_do_not_matter(origin, unit, seed):
    rng = np.random.default_rng(seed)
    values, errors = 100 + rng.normal(0, 3, 5), rng.uniform(0.5, 3, 5)
    line, other = fit_line(TIMES, values, errors), fit_line(TIMES, unit * values, unit * errors)
    assert other.slope == pytest.approx(unit * line.slope, rel=1e-6, abs=1e-9 * unit)
    assert other.slope_error == pytest.approx(unit * line.slope_error, rel=1e-6)
    moved = fit_line(TIMES + origin, values, errors)
    assert moved.slope == pytest.approx(line.slope, rel=1e-6, abs=1e-6)


def line_with(**changes):
    defaults = {
        "centre": 2.0,
        "level": 100.0,
        "slope": 5.0,
        "level_error": 1.0,
        "slope_error": 0.5,
        "scatter": 0.0,
        "freedom": 10,
    }
    return ScatteredLine(**{**defaults, **changes})


@pytest.mark.parametrize("slope", [5.0, -5.0])
@pytest.mark.parametrize("level", [150.0, 101.0, 20.0])
@pytest.mark.parametrize("level_error", [0.0, 2.0])
def test_the_crossing_is_where_line_and_level_are_as_far_apart_as_their_interval(
    slope, level, level_error
):
    line = line_with(slope=slope)
    expected, *ends = line.crossing(level, level_error)
    assert line.at(expected) == pytest.approx(level)
    assert ends[0] < expected < ends[1]
    for end in ends:
        error = math.hypot(line.half_width(end), line.quantile * level_error)
        assert abs(line.at(end) - level) == pytest.approx(error)


def test_no_crossing_without_a_slope():
    assert line_with(slope_error=2.3).crossing(150.0, 0.0) is None  # 2.3 · 2.228 > 5
    assert line_with(slope_error=2.2).crossing(150.0, 0.0) is not None


@pytest.mark.parametrize("times", [TIMES[:3], np.zeros(5)], ids=["three", "one time"])
def test_too_little(times):
    with pytest.raises(ValueError, match="a line needs 4 estimates at several times"):
        fit_line(times, np.ones(times.size), np.ones(times.size))
