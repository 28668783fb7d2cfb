# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Derivatives, noise and smoothing of one signal."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import find_peaks, oaconvolve, savgol_coeffs, savgol_filter
from scipy.stats import norm

from valve_friction_ros import signals
from valve_friction_ros.signals import (
    differentiate,
    find_corners,
    longest_faithful_window,
    position_noise,
    quantisation_step,
    savgol_weights,
    sensor_noise,
    smooth_between,
    velocity_noise,
)

EPS = np.finfo(float).eps
SETTINGS = [(31, 3), (5, 2), (15, 4), (101, 3), (7, 5)]


@pytest.mark.parametrize(("window", "order"), SETTINGS)
def test_the_window_is_full_everywhere(window, order):
    position = np.cumsum(np.random.default_rng(0).standard_normal(400))
    period = 0.05
    found = differentiate(position, period, window, order)
    assert found.margin == window // 2
    for degree, values in ((1, found.velocity), (2, found.acceleration)):
        weights = savgol_coeffs(window, order, deriv=degree, delta=period)
        expected = np.convolve(position, weights, "valid")
        assert values.shape == (400 - window + 1,)
        np.testing.assert_allclose(values, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_one_full_window_is_enough_and_less_is_refused():
    assert differentiate(np.zeros(31), 1e-3).velocity.shape == (1,)
    for size in (30, 1, 0):
        with pytest.raises(
            ValueError, match=rf"^{size} samples are fewer than the derivative window of 31"
        ):
            differentiate(np.zeros(size), 1e-3)


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize(("window", "order"), [(5, 3), (31, 3), (51, 4), (401, 3)])
def test_weights_are_those_of_scipy(window, order, degree):
    """Up to 1.5e-10, as its powers are not scaled."""
    expected = savgol_coeffs(window, order, deriv=degree, delta=0.01)
    found = savgol_weights(window, order, degree, 0.01)
    assert found == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


SIZE = 100_000


def white(size=SIZE, seed=0):
    return np.random.default_rng(seed).standard_normal(size)


@pytest.mark.parametrize("deviation", [1e-9, 28.6e-6, 165.0])
def test_white_noise_at_any_scale(deviation):
    """A mean of n dependent magnitudes errs by some 2/√n; five of these. Motion adds nothing."""
    stroke = 1000 * deviation * np.sin(2 * np.pi * 1e-4 * np.arange(SIZE))
    for signal in (deviation * white(), stroke + deviation * white()):
        assert sensor_noise(signal) == pytest.approx(deviation, rel=10 / math.sqrt(SIZE))


def test_none_in_a_straight_or_short_record():
    assert position_noise(np.linspace(0.0, 1.0, 257)) == 0.0
    assert position_noise(np.array([0.0, 1.0])) == 0.0


@pytest.mark.parametrize(("window", "order"), SETTINGS)
def test_velocity_noise_is_what_the_derivative_makes_of_it(window, order):
    expected = velocity_noise(10e-6, 1e-3, window, order)
    found = differentiate(10e-6 * white(seed=1), 1e-3, window, order).velocity.std()
    # The velocities are correlated over a window: n/d of them count, five standard errors.
    assert found == pytest.approx(expected, rel=5 / math.sqrt(2 * SIZE / window))


def test_normal_second_differences():
    """Their quantiles in any order: √6 times the noise, and nine tenths of them are kept."""
    middle = (np.arange(SIZE) + 0.5) / SIZE
    quantiles = np.random.default_rng(2).permutation(norm.ppf(middle))
    position = np.cumsum(np.cumsum(math.sqrt(6) * quantiles))
    assert position_noise(position) == pytest.approx(1.0, rel=1e-4)


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


NO_CORNERS = np.empty(0, dtype=np.intp)


class TestCorners:
    PLACES = (700, 1500, 2200)

    def bent(self, jump):
        """Straight lines whose slope jumps by `jump` a sample, up and down in turn."""
        place = np.arange(3000.0)
        return sum(
            sign * jump * np.maximum(place - corner, 0.0)
            for sign, corner in zip((1, -1, 1), self.PLACES, strict=True)
        )

    @pytest.mark.parametrize("seed", range(4))
    def test_located_to_the_sample(self, seed):
        """The place errs by σ/(jump·|step|), the step without what the local model explains of it.

        With the jump chosen so, five such errors are below half a sample.
        """
        place = np.linspace(-1.0, 1.0, 320)
        bend = np.maximum(place, 0.0)
        model = np.column_stack([np.vander(place, 3), bend, bend**2])
        step = (place > 0).astype(float)
        left = step - model @ np.linalg.lstsq(model, step, rcond=None)[0]
        jump = 10 / np.linalg.norm(left)
        found = find_corners(self.bent(jump) + white(3000, seed), 1.0, 40)
        np.testing.assert_array_equal(found, self.PLACES)

    @pytest.mark.parametrize("seed", range(4))
    def test_square_wave_through_a_lag_at_the_noise_of_a_real_sensor(self, seed):
        """76 Pa a millisecond of slope against 165 Pa of noise: within two samples."""
        time = np.arange(15_600)
        rise = 99_060 * -np.expm1(-np.maximum(time - 5200, 0) / 1300)
        fall = rise[10_400] * -np.expm1(-np.maximum(time - 10_400, 0) / 1300)
        wave = np.minimum(rise, rise[10_400]) - fall
        found = find_corners(wave + 165 * white(time.size, seed), 165.0, 40)
        assert found.size == 2
        assert np.abs(found - [5200, 10_400]).max() <= 2

    @pytest.mark.parametrize("left", [70, 75, 79])
    def test_near_the_end_of_the_record(self, left):
        """Candidates behind which no samples are left say nothing, and warn of nothing."""
        signal = 50.0 * np.maximum(np.arange(300.0) - (300 - left), 0.0)
        found = find_corners(signal + white(300), 1.0, 40)
        np.testing.assert_array_equal(found, [300 - left])

    def test_none_in_a_smooth_signal_nor_in_a_noiseless_one(self):
        smooth = 1000 * np.sin(2 * np.pi * np.arange(5000) / 5000)
        assert find_corners(smooth + white(5000), 1.0, 40).size == 0
        assert find_corners(self.bent(2.0), 0.0, 40).size == 0


class TestSmoothing:
    def test_nothing_crosses_a_corner(self):
        signal = np.zeros(200)
        signal[100:] = white(100)
        assert not smooth_between(signal, np.array([100]), 31)[:100].any()

    def test_a_stretch_too_short_for_a_cubic_stays(self):
        signal = white(100)
        smooth = smooth_between(signal, np.array([50, 54]), 21)
        np.testing.assert_array_equal(smooth[50:54], signal[50:54])


@pytest.mark.parametrize("window", [5, 31, 151])
def test_between_corners_it_is_the_filter_of_savitzky_and_golay(window):
    signal = 1e5 + 1e3 * np.random.default_rng(0).standard_normal(1000)
    corners = np.array([400, 460])
    found = smooth_between(signal, corners, window)
    for begin, end in ((0, 400), (400, 460), (460, 1000)):
        length = min(window, end - begin - 1 + (end - begin) % 2)
        expected = savgol_filter(signal[begin:end], length, 3, mode="interp")
        np.testing.assert_allclose(found[begin:end], expected, rtol=1e-12, atol=1e-6)


class TestWindow:
    def test_straight_line_allows_the_longest(self):
        """5, 7, 11, 17, 25, 37, 55, 83: growing by half, odd, up to 100."""
        line = 3.0 * np.arange(5000) + white(5000)
        assert longest_faithful_window(line, NO_CORNERS, 1.0, 100) == 83

    def test_one_without_noise(self):
        assert longest_faithful_window(np.arange(100.0), NO_CORNERS, 0.0, 50) == 1

    @pytest.mark.parametrize("period", [100, 400, 1600])
    def test_what_it_takes_from_a_wave_is_below_the_noise(self, period):
        """The wave itself, smoothed by what was chosen, loses less than a fifth of the noise."""
        wave = 100 * np.sin(2 * np.pi * np.arange(20_000) / period)
        window = longest_faithful_window(wave + white(20_000), NO_CORNERS, 1.0, 2000)
        lost = wave - smooth_between(wave, NO_CORNERS, window)
        assert np.sqrt(np.mean(lost**2)) < 0.2
        assert 0.1 * period < window < period

    def test_corners_left_out_shorten_it(self):
        place = np.arange(4000.0)
        bent = 2.0 * np.maximum(place - 2000, 0.0) + white(4000)
        with_corner = longest_faithful_window(bent, np.array([2000]), 1.0, 900)
        assert longest_faithful_window(bent, NO_CORNERS, 1.0, 900) < with_corner / 2


class TestWithoutScipy:
    """What takes the place of scipy.signal, beside it."""

    @given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.floats(0.0, 8.0))
    def test_peaks(self, seed, distance, least):
        rng = np.random.default_rng(seed)
        levels = rng.permutation(rng.integers(5, 60)) / 5.0  # no two alike: no ties in the order
        signal = np.repeat(levels, rng.integers(1, 4, levels.size))
        expected, _ = find_peaks(signal, height=least, distance=distance)
        found = signals._peaks(signal, least, distance)
        assert found.tolist() == expected.tolist()

    @pytest.mark.parametrize("size", [100, 1024, 1025, 5000])
    @pytest.mark.parametrize("window", [5, 99, 801, 1001])
    def test_convolution(self, size, window):
        if window > size:
            pytest.skip("there is no full overlap")
        rng = np.random.default_rng(size + window)
        signal, weights = rng.normal(size=size), rng.normal(size=window) / window
        expected = oaconvolve(signal, weights, mode="valid")
        assert signals._convolved(signal, weights) == pytest.approx(expected, abs=1e-13)
