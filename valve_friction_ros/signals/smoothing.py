"""Pressure without its sensor noise, and with its corners kept.

Inequalities decide whether the simulated stem rests or slides, so the effect of pressure noise does
not average to zero. A plain smoother rounds the corners where the commanded pressure changes, which
is where the stem reverses. Therefore the corners are found first, and the signal is smoothed
between them.
"""

import math
from bisect import bisect_left
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.signals.derivatives import savgol_weights

__all__ = [
    "find_corners",
    "independent_halves",
    "longest_faithful_window",
    "smooth_between",
    "smoothing_leverage",
]

_ORDER = 3
"""Order of the smoothing polynomials: the paper's n for derivatives."""

_CORNER_GATE = 8.0
"""Standard deviations of a jump of the slope that make a corner.

Chosen: 1 of 10¹⁵ windows by chance, so that a false corner never splits a smooth signal."""

_CORNER_SHARPNESS = 3.0
"""Ratio of a corner's jump to the jumps one window away. Chosen: at a corner of a ramp they are
zero, on a parabola equal; three separates both in noise."""

_LEAST_DETERMINANT = 1e-9
"""Determinant of two unit vectors below which they are parallel but for rounding. One sample
after a corner gives 1e-15, two give 0.05 and more."""

_CORNER_SCALES = (1, 2, 4)
"""Windows over which corners are searched, over the shortest. Chosen: a slope's noise falls with
the 1.5th power of the window, so the longest finds corners eight times smaller."""

_LONG = 512
"""Weights from which a Fourier transform is quicker than their products."""

_DEVIATIONS = 4.0
"""Standard deviations above the expected variance beyond which a residual holds signal: 3 of
100,000 windows by chance."""


def _window_slopes(signal: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """Slope per sample of the straight line through each window, by its first sample."""
    place = np.arange(window) - (window - 1) / 2
    weights = (place / (place @ place))[::-1]
    return np.asarray(np.convolve(signal, weights, "valid"), dtype=np.float64)


def _peaks(signal: NDArray[np.float64], least: float, distance: int) -> NDArray[np.intp]:
    """Find local maxima of at least `least`, the highest of those nearer than `distance`.

    A plateau has its maximum in its middle; none is at an end of the signal.
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
    """Find where the slopes over `window` samples on both sides differ, unlike those nearby."""
    if signal.size < 4 * window:
        return np.empty(0, dtype=np.intp)
    place = np.arange(window) - (window - 1) / 2
    slopes = _window_slopes(signal, window)
    jump = np.abs(slopes[window:] - slopes[:-window]) / (noise * np.sqrt(2 / (place @ place)))
    peaks = _peaks(jump, _CORNER_GATE, window)
    before = jump[np.maximum(peaks - window, 0)]
    after = jump[np.minimum(peaks + window, jump.size - 1)]
    background = np.maximum(np.maximum(before, after), _CORNER_GATE / _CORNER_SHARPNESS)
    return np.asarray(peaks[jump[peaks] > _CORNER_SHARPNESS * background] + window, dtype=np.intp)


def _localised(signal: NDArray[np.float64], corner: int, window: int) -> int:
    """Move a corner, within half a window, to where the signal bends most.

    The model of the signal is a parabola, plus a second parabola that begins at zero at the corner.
    The corner with the smallest residual is returned. Where too few samples follow a candidate to
    tell its parabola from a line, it is left out.
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
        Samples on either side over which the slopes are compared, at least 3. Corners below the
        noise at this scale are searched over twice and four times as many samples.

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
    """Orthonormal cubics over a window, shape (window, 4)."""
    place = np.linspace(-1.0, 1.0, window)
    return np.asarray(np.linalg.qr(np.vander(place, _ORDER + 1))[0], dtype=np.float64)


def smoothing_leverage(size: int, corners: NDArray[np.intp], window: int) -> NDArray[np.float64]:
    """Return the share of the noise's variance that `smooth_between` leaves at each sample.

    It is 9/4 over the window inside a stretch, and rises to 16 over the window at its ends, where
    the cubic is held from one side only.
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
    """Convolve a signal with fewer weights, where they overlap in full."""
    if weights.size < _LONG:
        return np.asarray(np.convolve(signal, weights, "valid"), dtype=np.float64)
    length = 1 << (signal.size - 1).bit_length()  # what goes round is before the full overlap
    product = np.fft.rfft(signal, length) * np.fft.rfft(weights, length)
    return np.asarray(np.fft.irfft(product, length)[weights.size - 1 : signal.size])


def _local_cubics(stretch: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """Filter as Savitzky and Golay, the ends by the cubics of the first and the last window.

    The result is that of `scipy.signal.savgol_filter` with ``mode="interp"``. That function repeats
    the fit of the cubics for each part, and takes n·window products; the Fourier transform needs
    fewer where the window is long.
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
    of the block averages. Windows that grow by half are tried, the longest first and then by
    bisection: a window within a faithful one is faithful too. `corners` are the samples where the
    slope jumps (`find_corners`), `noise` is the standard deviation of the white noise; without
    noise the window is 1.
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
    highest = expected**2 * (1 + _DEVIATIONS * math.sqrt(2 / blocks))
    return float(np.mean(means**2)) <= highest


def independent_halves(
    signal: NDArray[np.float64], corners: NDArray[np.intp], window: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Smooth the even and the odd samples separately, and interpolate each to all samples.

    The noise of the two results is independent, as the noise of the samples is.
    """
    places = np.arange(signal.size)
    halves = []
    for first in (0, 1):
        chosen = places[first::2]
        corners_there = np.searchsorted(chosen, corners)
        smooth = smooth_between(signal[first::2], corners_there, (window // 2) | 1)
        halves.append(_onto_all(places, chosen, smooth, corners))
    return halves[0], halves[1]


def _onto_all(
    places: NDArray[np.intp],
    chosen: NDArray[np.intp],
    values: NDArray[np.float64],
    corners: NDArray[np.intp],
) -> NDArray[np.float64]:
    """Interpolate linearly between neighbours, and extend the line at corners and ends."""
    on_all = np.interp(places, chosen, values)
    edges = (0, *corners.tolist(), places.size)
    for begin, end in pairwise(edges):
        first, last = np.searchsorted(chosen, begin), np.searchsorted(chosen, end) - 1
        if last - first < 1:
            continue
        if chosen[first] > begin:
            on_all[begin] = 1.5 * values[first] - 0.5 * values[first + 1]
        if chosen[last] < end - 1:
            on_all[end - 1] = 1.5 * values[last] - 0.5 * values[last - 1]
    return on_all
