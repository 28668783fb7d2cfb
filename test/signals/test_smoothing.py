"""Smoothing between corners: what it must not touch, and what it must take away."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import find_peaks, oaconvolve, savgol_coeffs, savgol_filter

from valve_friction_ros.signals import smoothing
from valve_friction_ros.signals.smoothing import (
    find_corners,
    independent_halves,
    longest_faithful_window,
    smooth_between,
)

NO_CORNERS = np.empty(0, dtype=np.intp)


def white(size, seed=0):
    return np.random.default_rng(seed).standard_normal(size)


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
    @given(
        coefficients=st.lists(st.floats(-1.0, 1.0), min_size=8, max_size=8),
        corner=st.integers(60, 240),
        window=st.sampled_from([5, 21, 47]),
    )
    def test_cubics_between_corners_pass_unchanged(self, coefficients, corner, window):
        place = np.linspace(-1.0, 1.0, 300)
        signal = np.concatenate(
            [
                np.polyval(coefficients[:4], place[:corner]),
                np.polyval(coefficients[4:], place[corner:]),
            ]
        )
        smooth = smooth_between(signal, np.array([corner]), window)
        np.testing.assert_allclose(smooth, signal, rtol=0, atol=1e-11)

    def test_nothing_crosses_a_corner(self):
        signal = np.zeros(200)
        signal[100:] = white(100)
        assert not smooth_between(signal, np.array([100]), 31)[:100].any()

    def test_a_stretch_too_short_for_a_cubic_stays(self):
        signal = white(100)
        smooth = smooth_between(signal, np.array([50, 54]), 21)
        np.testing.assert_array_equal(smooth[50:54], signal[50:54])

    def test_noise_that_is_left_follows_from_the_weights(self):
        smooth = smooth_between(white(100_000), NO_CORNERS, 51)
        kept = np.linalg.norm(savgol_coeffs(51, 3))
        # n/d independent values, five standard errors.
        assert smooth.std() == pytest.approx(kept, rel=5 / np.sqrt(2 * 100_000 / 51))


@pytest.mark.parametrize("window", [5, 31, 151])
def test_between_corners_it_is_the_filter_of_savitzky_and_golay(window):
    signal = 1e5 + 1e3 * np.random.default_rng(0).standard_normal(1000)
    corners = np.array([400, 460])
    found = smooth_between(signal, corners, window)
    for begin, end in ((0, 400), (400, 460), (460, 1000)):
        length = min(window, end - begin - 1 + (end - begin) % 2)
        expected = savgol_filter(signal[begin:end], length, 3, mode="interp")
        np.testing.assert_allclose(found[begin:end], expected, rtol=1e-12, atol=1e-6)


class TestHalves:
    CORNERS = np.array([101, 240])

    def test_each_depends_on_its_own_samples_alone(self):
        """The noise of the halves is independent because no sample has a share in both."""
        signal = white(400)
        for first in (0, 1):
            changed = signal.copy()
            changed[first::2] += white(200, 1)
            before = independent_halves(signal, self.CORNERS, 41)
            after = independent_halves(changed, self.CORNERS, 41)
            np.testing.assert_array_equal(before[1 - first], after[1 - first])
            assert (before[first] != after[first]).all()

    @given(
        slopes=st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6),
        window=st.sampled_from([5, 21, 41]),
    )
    def test_unbiased_on_straight_lines_between_corners(self, slopes, window):
        """Also at the corners and at both ends, where one half has no sample of its own."""
        place = np.arange(400.0)
        pieces = np.split(place, self.CORNERS)
        signal = np.concatenate(
            [slopes[i] + slopes[i + 3] * (piece - piece[0]) for i, piece in enumerate(pieces)]
        )
        for half in independent_halves(signal, self.CORNERS, window):
            np.testing.assert_allclose(half, signal, rtol=0, atol=1e-10)

    def test_uncorrelated_under_noise(self):
        one, two = independent_halves(white(100_000), NO_CORNERS, 41)
        # 100 000/41 independent stretches.
        assert abs(np.corrcoef(one, two)[0, 1]) < 5 / np.sqrt(100_000 / 41)


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
        found = smoothing._peaks(signal, least, distance)
        assert found.tolist() == expected.tolist()

    @pytest.mark.parametrize("size", [100, 1024, 1025, 5000])
    @pytest.mark.parametrize("window", [5, 99, 801, 1001])
    def test_convolution(self, size, window):
        if window > size:
            pytest.skip("there is no full overlap")
        rng = np.random.default_rng(size + window)
        signal, weights = rng.normal(size=size), rng.normal(size=window) / window
        expected = oaconvolve(signal, weights, mode="valid")
        assert smoothing._convolved(signal, weights) == pytest.approx(expected, abs=1e-13)
