# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Derivatives, noise, smoothing and runs of one signal; no ROS.

Inequalities decide whether the simulated stem rests or slides, so the effect of pressure noise does
not average to zero. A plain smoother rounds the corners where the commanded pressure changes, which
is where the stem reverses. The corners of a drive are therefore found first, and the signal is
smoothed between them.

"""

import math
from bisect import bisect_left
from functools import cache, cached_property
from itertools import pairwise
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.recording import Recording, StampedSignal


class Derivatives(NamedTuple):
    """Velocity and acceleration at every sample with a full window around it.

    Attributes
    ----------
    velocity : ndarray of float, shape (n − d + 1,)
        Velocity, m/s.
    acceleration : ndarray of float, shape (n − d + 1,)
        Acceleration, m/s².
    margin : int
        Samples without a full window at either end, (d − 1)/2: entry 0 belongs to sample `margin`.
    """

    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    margin: int

    def inner(self, samples: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the part of `samples`, shape (n,), with derivatives, shape (n − d + 1,)."""
        return samples[self.margin : samples.size - self.margin]


def savgol_weights(
    window: int, order: int, degree: int = 0, sample_period: float = 1.0
) -> NDArray[np.float64]:
    """Return the weights of a Savitzky–Golay filter over `window` samples, the last sample's first.

    Polynomials of an `order` below the window give the derivative of a `degree` in its middle; 0
    smooths. The weights equal those of `scipy.signal.savgol_coeffs`, whose import takes half a
    second.
    """
    # On the interval from −1 to 1 the powers stay well-conditioned for any window length.
    powers = np.vander(np.linspace(-1.0, 1.0, window), order + 1, increasing=True)
    size = 0.5 * (window - 1) * sample_period
    weights = np.linalg.pinv(powers)[degree] * (math.factorial(degree) / size**degree)
    return np.asarray(weights[::-1], dtype=np.float64)


def differentiate(
    position: NDArray[np.float64], sample_period: float, window: int = 31, order: int = 3
) -> Derivatives:
    """Differentiate sampled positions by a least-squares polynomial in a sliding window.

    Equation (20) and the two that follow it, evaluated at the middle of each window: a
    Savitzky–Golay filter. The first and last (d − 1)/2 samples have no full window. They get no
    derivative, because a one-sided window is less accurate.

    Parameters
    ----------
    position : ndarray of float, shape (n,)
        Stem position, m, n at least `window`.
    sample_period : float
        Time between two samples, s.
    window : int
        Window length d, samples, odd.
    order : int
        Polynomial order n, at least 2 and below `window`.

    Returns
    -------
    Derivatives
        Exact where the position is a polynomial of degree `order` or lower.

    Raises
    ------
    ValueError
        If there are fewer samples than `window`.

    References
    ----------
    A. Savitzky and M. J. E. Golay, Analytical Chemistry 36 (1964) 1627–1639.
    """
    if position.size < window:
        raise ValueError(
            f"{position.size} samples are fewer than the derivative window of {window}: "
            "use a longer record or a shorter window"
        )
    velocity, acceleration = (
        np.convolve(position, savgol_weights(window, order, degree, sample_period), "valid")
        for degree in (1, 2)
    )
    return Derivatives(
        np.asarray(velocity, dtype=np.float64),
        np.asarray(acceleration, dtype=np.float64),
        window // 2,
    )


_KEPT = 0.9
"""Share of the second differences that is used. Chosen: jerks take far less than a tenth of a
record, and each further tenth left out widens the scatter of the estimate."""

_KEPT_MEAN = 0.657347
"""Mean magnitude of the smallest 90 % of standard normal numbers: 2·(φ(0) − φ(1.645))/0.9."""


def position_noise(position: NDArray[np.float64]) -> float:
    """Estimate the standard deviation of white noise on the stem position, m.

    The estimate uses second differences, which the motion of the stem hardly changes: for white
    noise of deviation s their deviation is √6·s. The largest tenth is left out, because the stem
    may have jerked there. A mean is used because a median can only take values of converter codes.
    """
    if position.size < 3:
        return 0.0
    magnitudes = np.abs(np.diff(position, 2))
    kept = max(int(_KEPT * magnitudes.size), 1)
    smallest = np.partition(magnitudes, kept - 1)[:kept]
    return float(np.mean(smallest)) / (_KEPT_MEAN * math.sqrt(6.0))


def quantisation_step(signal: NDArray[np.float64]) -> float:
    """Estimate the step of a converter: the smallest difference between two values of `signal`.

    Zero where more than half of the samples are distinct, as in a signal without quantisation.
    """
    values = np.unique(signal)
    if values.size < 2 or values.size > 0.5 * signal.size:
        return 0.0
    gaps = np.diff(values)
    return float(gaps[gaps > 1e-6 * gaps.max()].min())


def rounding_noise(signal: NDArray[np.float64]) -> float:
    """Estimate the deviation of a converter's rounding, 1/√12 of its step, in the signal's unit."""
    return quantisation_step(signal) / math.sqrt(12.0)


def sensor_noise(signal: NDArray[np.float64]) -> float:
    """Estimate the deviation of a sensor's noise including rounding, in the unit of `signal`.

    Second differences (`position_noise`) miss the rounding error of a converter where the signal
    hardly changes, and the error is not white where the signal drifts slowly. Therefore 1/√12 of
    the step is added in quadrature.
    """
    return math.hypot(position_noise(signal), rounding_noise(signal))


def velocity_noise(noise: float, sample_period: float, window: int, order: int) -> float:
    """Propagate white position `noise` in m to the standard deviation of the velocity in m/s."""
    weights = savgol_weights(window, order, 1, sample_period)
    return noise * float(np.linalg.norm(weights))


_stamped_noises: WeakKeyDictionary[StampedSignal, float] = WeakKeyDictionary()
"""Cache of the noise of each signal, which several parts of an identification need."""


def stamped_noise(signal: StampedSignal) -> float:
    """Estimate the deviation of a sensor's white noise including rounding, in the signal's unit.

    Each sample is compared with the straight line between its neighbours. If the share a of the
    time between the neighbours follows the sample, the difference of white noise of deviation s has
    the variance

        s²·(1 + a² + (1 − a)²) ,

    for any spacing. The largest tenth is left out, because the stem may have jerked there. 1/√12 of
    a converter's step is added in quadrature: where the signal hardly changes, the differences miss
    the rounding.
    """
    if (known := _stamped_noises.get(signal)) is not None:
        return known
    time, value = signal.time, signal.value
    share = (time[2:] - time[1:-1]) / (time[2:] - time[:-2])
    line = share * value[:-2] + (1.0 - share) * value[2:]
    distance = np.abs(value[1:-1] - line) / np.sqrt(1.0 + share**2 + (1.0 - share) ** 2)
    kept = max(int(_KEPT * distance.size), 1)
    white = float(np.mean(np.partition(distance, kept - 1)[:kept])) / _KEPT_MEAN
    noise = math.hypot(white, rounding_noise(value))
    _stamped_noises[signal] = noise
    return noise


_ORDER = 3
"""Order of the smoothing polynomials: the paper's n for derivatives."""

_CORNER_GATE = 8.0
"""Jump of the slope that makes a corner, in standard deviations.

Chosen: exceeded by chance in 1 of 10¹⁵ windows, so a false corner never splits a smooth signal."""

_CORNER_SHARPNESS = 3.0
"""Least ratio of a corner's jump to the jumps one window away. Chosen: those are zero at the corner
of a ramp and equal on a parabola; three separates both in noise."""

_LEAST_DETERMINANT = 1e-9
"""Determinant of two unit vectors below which they are parallel up to rounding. One sample
after a corner gives 1e-15, two give 0.05 and more."""

_CORNER_SCALES = (1, 2, 4)
"""Windows of the search for corners, over the shortest. Chosen: the noise of a slope falls with the
1.5th power of the window, so the longest finds corners eight times smaller."""

_LONG_WINDOW = 512
"""Number of weights from which a Fourier transform is faster than direct convolution."""

_RESIDUAL_GATE = 4.0
"""Standard deviations above the expected variance beyond which a residual contains signal: exceeded
by chance in 3 of 100,000 windows."""


def _peaks(signal: NDArray[np.float64], least: float, distance: int) -> NDArray[np.intp]:
    """Find local maxima of at least `least`; of those nearer than `distance`, keep the highest.

    The maximum of a plateau is its middle. The ends of the signal are not maxima.
    """
    begins = np.flatnonzero(np.diff(signal, prepend=np.nan))
    levels = signal[begins]
    middles = (begins + np.append(begins[1:], signal.size) - 1) // 2
    inner = levels[1:-1]
    is_peak = (inner > levels[:-2]) & (inner > levels[2:]) & (inner >= least)
    peaks = middles[1:-1][is_peak]
    kept = np.ones(peaks.size, dtype=np.bool_)
    for highest in np.argsort(signal[peaks], kind="stable")[::-1].tolist():
        if kept[highest]:
            kept &= np.abs(peaks - peaks[highest]) >= distance
            kept[highest] = True
    return np.asarray(peaks[kept], dtype=np.intp)


def _sharp_jumps(signal: NDArray[np.float64], noise: float, window: int) -> NDArray[np.intp]:
    """Find where the slopes over `window` samples on both sides differ far more than nearby."""
    if signal.size < 4 * window:
        return np.empty(0, dtype=np.intp)
    place = np.arange(window) - (window - 1) / 2
    slopes = np.convolve(signal, (place / (place @ place))[::-1], "valid")  # of straight lines
    jump = np.abs(slopes[window:] - slopes[:-window]) / (noise * np.sqrt(2 / (place @ place)))
    peaks = _peaks(jump, _CORNER_GATE, window)
    before = jump[np.maximum(peaks - window, 0)]
    after = jump[np.minimum(peaks + window, jump.size - 1)]
    background = np.maximum(np.maximum(before, after), _CORNER_GATE / _CORNER_SHARPNESS)
    return np.asarray(peaks[jump[peaks] > _CORNER_SHARPNESS * background] + window, dtype=np.intp)


def _localised(signal: NDArray[np.float64], corner: int, window: int) -> int:
    """Move a corner, within half a window, to where the signal bends most.

    The signal is modelled as a parabola plus a second parabola that starts from zero at the corner.
    The candidate with the smallest residual is returned. A candidate is skipped if too few samples
    follow it to distinguish its parabola from a line.
    """
    first, last = max(corner - window, 0), min(corner + window, signal.size)
    place = np.linspace(-1.0, 1.0, last - first)
    smooth, _ = np.linalg.qr(np.vander(place, 3))
    half = min(window // 2, corner - first, last - 1 - corner)
    candidates = np.arange(corner - half, corner + half + 1)
    bent = np.maximum(place[:, None] - place[candidates - first], 0.0)
    one, two = (bends - smooth @ (smooth.T @ bends) for bends in (bent, bent**2))
    stretch = signal[first:last] - signal[corner]
    a, b, c = ((one * one).sum(0), (one * two).sum(0), (two * two).sum(0))
    p, q = stretch @ one, stretch @ two
    determinant = a * c - b * b
    told = determinant > _LEAST_DETERMINANT * a * c
    if not told.any():
        return corner
    explained = (c * p * p - 2 * b * p * q + a * q * q)[told] / determinant[told]
    return int(candidates[told][np.argmax(explained)])


def find_corners(signal: NDArray[np.float64], noise: float, window: int) -> NDArray[np.intp]:
    """Find the samples where the slope of a noisy signal jumps.

    Parameters
    ----------
    signal : ndarray of float, shape (n,)
        The signal.
    noise : float
        Standard deviation of its white noise.
    window : int
        Samples on either side over which the slopes are compared, at least 3. The search is
        repeated over twice and four times as many samples, for corners below the noise at shorter
        scales.

    Returns
    -------
    ndarray of int
        First sample of each new part of the signal. Empty for a noiseless signal.
    """
    corners: list[int] = []
    if noise > 0:
        for scale in _CORNER_SCALES:
            length = scale * window
            for corner in _sharp_jumps(signal, noise, length).tolist():
                if all(abs(corner - known) > length for known in corners):
                    corners.append(_localised(signal, corner, _CORNER_SCALES[-1] * window))
    return np.array(sorted(corners), dtype=np.intp)


def _odd_at_most(length: int, window: int) -> int:
    return min(window, length - 1 + length % 2)


def smooth_between(
    signal: NDArray[np.float64], corners: NDArray[np.intp], window: int
) -> NDArray[np.float64]:
    """Smooth `signal` by local cubics over `window` samples, separately between `corners`."""
    smooth = np.empty_like(signal)
    edges = (0, *corners.tolist(), signal.size)
    for begin, end in pairwise(edges):
        fitting = _odd_at_most(end - begin, window)
        stretch = signal[begin:end]
        smooth[begin:end] = _local_cubics(stretch, fitting) if fitting > _ORDER + 1 else stretch
    return smooth


@cache
def _cubics(window: int) -> NDArray[np.float64]:
    """Return orthonormal cubics over a window, shape (window, 4)."""
    place = np.linspace(-1.0, 1.0, window)
    return np.asarray(np.linalg.qr(np.vander(place, _ORDER + 1))[0], dtype=np.float64)


def smoothing_leverage(size: int, corners: NDArray[np.intp], window: int) -> NDArray[np.float64]:
    """Return the share of the noise variance that `smooth_between` leaves at each sample.

    It is 9/4 over the window inside a stretch, and rises to 16 over the window at the ends, where
    the cubic is supported from one side only.
    """
    shares = np.ones(size)
    edges = (0, *corners.tolist(), size)
    for begin, end in pairwise(edges):
        fitting = _odd_at_most(end - begin, window)
        if fitting <= _ORDER + 1:
            continue
        leverage = np.sum(_cubics(fitting) ** 2, axis=1)
        half = fitting // 2
        shares[begin:end] = leverage[half]
        shares[begin : begin + half] = leverage[:half]
        shares[end - half : end] = leverage[fitting - half :]
    return shares


def _convolved(signal: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Convolve a signal with a shorter array of weights, where both overlap fully."""
    if weights.size < _LONG_WINDOW:
        return np.asarray(np.convolve(signal, weights, "valid"), dtype=np.float64)
    length = 1 << (signal.size - 1).bit_length()  # wrapped products come before the full overlap
    product = np.fft.rfft(signal, length) * np.fft.rfft(weights, length)
    return np.asarray(np.fft.irfft(product, length)[weights.size - 1 : signal.size])


def _local_cubics(stretch: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """Apply a Savitzky–Golay filter; the cubics of the first and the last window give the ends.

    The result equals that of `scipy.signal.savgol_filter` with ``mode="interp"``. That function
    refits the cubics for each part and takes n·window products. The Fourier transform needs fewer
    for long windows.
    """
    cubics, half = _cubics(window), window // 2
    level = stretch[0]
    shifted = stretch - level
    first = cubics[:half] @ (cubics.T @ shifted[:window])
    last = cubics[window - half :] @ (cubics.T @ shifted[-window:])
    middle = _convolved(shifted, (cubics @ cubics[half])[::-1])
    return np.asarray(np.concatenate((first, middle, last)) + level, dtype=np.float64)


def longest_faithful_window(
    signal: NDArray[np.float64], corners: NDArray[np.intp], noise: float, longest: int
) -> int:
    """Find the longest smoothing window that removes only noise: odd, `longest` at most.

    The residual of a smoother on white noise, averaged over blocks of a quarter window, has a
    variance that follows from the weights. A smoother that removes signal leaves a larger variance
    of the block averages. The candidates grow by half from window to window. The search tries the
    longest first and then bisects, because a window shorter than a faithful one is faithful too.
    `corners` are the samples where the slope jumps (`find_corners`), and `noise` is the standard
    deviation of the white noise. Without noise the window is 1.
    """
    if noise == 0:
        return 1
    windows, window = [], _ORDER + 2
    while window <= min(longest, signal.size // 4):
        windows.append(window)
        window = (3 * window // 2) | 1
    if not windows:
        return 1

    def is_faithful(window: int) -> bool:
        return _is_noise(signal - smooth_between(signal, corners, window), noise, window)

    if is_faithful(windows[-1]):
        return windows[-1]
    return windows[bisect_left(windows[1:-1], True, key=lambda one: not is_faithful(one))]


def _is_noise(residual: NDArray[np.float64], noise: float, window: int) -> bool:
    """Return whether the block averages of a residual have the variance of white noise."""
    length = max(window // 4, 1)
    blocks = residual.size // length
    means = residual[: blocks * length].reshape(blocks, length).mean(axis=1)
    taken = -savgol_weights(window, _ORDER)
    taken[window // 2] += 1.0
    expected = noise * float(np.linalg.norm(np.convolve(taken, np.full(length, 1 / length))))
    highest = expected**2 * (1 + _RESIDUAL_GATE * math.sqrt(2 / blocks))
    return float(np.mean(means**2)) <= highest


_CORNER_TIME = 0.04
_CORNER_SAMPLES = 8
"""Least time, s, and samples over which the slopes on both sides of a corner are compared.

Chosen: short compared with the 1.3 s lag of the bench's converter; a slope over 8 samples has 0.15
of the noise per sample. An absolute time."""

_LONGEST_SMOOTHING = 0.5
"""Longest smoothing window of the drive, s. Chosen: it bounds the time of the search.

Where the signal bends, `longest_faithful_window` stops earlier. An absolute time."""


def smoothing_of(
    signal: NDArray[np.float64], noise: float, period: float
) -> tuple[NDArray[np.intp], int]:
    """Choose corners and window, in samples, to smooth a signal as far as its noise requires.

    The noise is white, with `period` s between samples. The window is 1 without noise.
    """
    corners = find_corners(signal, noise, max(round(_CORNER_TIME / period), _CORNER_SAMPLES))
    longest = max(round(_LONGEST_SMOOTHING / period), 1)
    return corners, longest_faithful_window(signal, corners, noise, longest)


_LONGEST_DERIVATIVE_WINDOW = 1.0
"""Longest derivative window, s; a twentieth of the record is a further limit.

Chosen: it bounds the time of the search. An absolute time."""

_NO_CORNERS = np.empty(0, dtype=np.intp)


class MeasuredRecord(Recording):
    """A recording whose noise, derivatives and smoothing are computed at most once.

    Its lifetime is one identification. `measured` makes it from a recording.
    """

    @cached_property
    def white_noise(self) -> float:
        """Standard deviation of the white noise of the position, m."""
        return position_noise(self.position)

    @cached_property
    def position_noise(self) -> float:
        """Standard deviation of the noise of the position including rounding, m."""
        return math.hypot(self.white_noise, rounding_noise(self.position))

    @cached_property
    def drive_noise(self) -> float:
        """Standard deviation of the noise of the drive including rounding, Pa or N."""
        return sensor_noise(self.drive)

    @cached_property
    def smoothed_drive(self) -> NDArray[np.float64]:
        """The drive smoothed between its corners as far as its noise requires, shape (n,)."""
        corners, window = smoothing_of(self.drive, self.drive_noise, self.sample_period)
        return self.drive if window == 1 else smooth_between(self.drive, corners, window)

    @cached_property
    def _faithful_window(self) -> int:
        longest = min(round(_LONGEST_DERIVATIVE_WINDOW / self.sample_period), len(self) // 20)
        return longest_faithful_window(self.position, _NO_CORNERS, self.position_noise, longest)

    def fitting_window(self, order: int) -> int:
        """Choose the derivative window from the noise and bandwidth of the stem position.

        Parameters
        ----------
        order : int
            Polynomial order of the derivatives; the window has at least order + 2 samples.

        Returns
        -------
        int
            The longest odd window, up to a second, that removes only noise.
        """
        return max(self._faithful_window, (order + 2) | 1)

    @cached_property
    def _differentiated(self) -> dict[tuple[int, int], Derivatives]:
        return {}

    def derivatives(self, window: int, order: int) -> Derivatives:
        """Differentiate the position (`differentiate`) with a given window and order."""
        known = self._differentiated
        if (window, order) not in known:
            known[window, order] = differentiate(self.position, self.sample_period, window, order)
        return known[window, order]


def measured(recording: Recording) -> MeasuredRecord:
    """Return `recording` if it is a `MeasuredRecord`, else make one from it."""
    if isinstance(recording, MeasuredRecord):
        return recording
    return MeasuredRecord(
        recording.sample_period,
        recording.drive,
        recording.position,
        recording.start_time,
        recording.stamped,
        recording.driven_by,
        recording.gap,
    )


def runs_of(active: NDArray[np.bool_]) -> list[list[int]]:
    """Return the first and the one-past-last index of each run of True."""
    edges: list[list[int]] = (
        np.flatnonzero(np.diff(active, prepend=False, append=False)).reshape(-1, 2).tolist()
    )
    return edges


def all_around(which: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """Return where all samples within `reach` before and after are True."""
    sums = np.concatenate([[0], np.cumsum(np.pad(which, reach, mode="edge"))])
    width = 2 * reach + 1
    return np.asarray(sums[width:] - sums[:-width] == width)
