# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Where the steps of an input signal begin."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.signals import find_corners, position_noise, sensor_noise

_GATE = 6.0
"""Standard deviations of the noise beyond which a sample has left its level: 2 of 10⁹ by chance."""

_LEAST_SHARE = 1e-6
"""Noise of a noiseless signal, as a share of its range. Chosen: above rounding, below every
step."""

_LEVEL_SAMPLES = 10
"""Samples of a level. Chosen: their mean has a third of the noise of one sample."""

_JUMP_SAMPLES = 3
"""Samples within which a command has jumped. Chosen: three in a row are no single glitch."""

_JUMP_SHARE = 0.9
"""Share of the change that these samples hold in a jump. Chosen: a lag of 30 samples reaches
0.1."""

_CORNER_SAMPLES = 40
"""Samples on either side of a corner over which slopes are compared (`find_corners`).

Chosen: 40 ms at 1 kHz, as for a pressure, short against the lag of a converter. A number of
samples,
because the function knows no time: at 10 Hz it is 4 s."""


def find_steps(signal: NDArray[np.float64]) -> list[int]:
    """Find the samples at which a signal leaves its level for another.

    A command jumps: the first of three samples in a row beyond six standard deviations of the
    noise from the level before begins the step. A pressure behind a lag bends instead, and its
    steps begin where its slope jumps (`find_corners`). Without noise a millionth of the range
    takes the place of its standard deviation.

    Parameters
    ----------
    signal : ndarray of float, shape (n,)
        Input signal, at least ten samples a level.

    Returns
    -------
    list of int
        Increasing; empty for a signal on one level.
    """
    # A command has levels without noise; they are not codes of a converter.
    measured = position_noise(signal) > 0
    noise = max(sensor_noise(signal) if measured else 0.0, _LEAST_SHARE * float(np.ptp(signal)))
    if noise == 0 or signal.size <= _LEVEL_SAMPLES:
        return []
    starts = _departures(signal, _GATE * noise)
    edges = [] if starts is None else [*starts, signal.size]
    if starts is not None and all(_is_jump(signal, a, b) for a, b in pairwise(edges)):
        return starts
    return [int(corner) for corner in find_corners(signal, noise, _CORNER_SAMPLES)]


def _is_jump(signal: NDArray[np.float64], start: int, end: int) -> bool:
    """Return whether three samples hold nearly the whole change."""
    before = float(np.mean(signal[max(start - _LEVEL_SAMPLES, 0) : start]))
    at_once = float(np.mean(signal[start : start + _JUMP_SAMPLES])) - before
    in_the_end = float(np.mean(signal[max(end - _LEVEL_SAMPLES, start) : end])) - before
    return abs(at_once) >= _JUMP_SHARE * abs(in_the_end)


def _departures(signal: NDArray[np.float64], gate: float) -> list[int] | None:
    """Find where a signal leaves a level, which lasts ten samples at least, by more than `gate`.

    None where it takes more than three samples to reach the next level.
    """
    windows = np.lib.stride_tricks.sliding_window_view(signal, _LEVEL_SAMPLES)
    levels = np.flatnonzero(np.ptp(windows, axis=1) <= 2 * gate)
    starts: list[int] = []
    begin = 0
    while (place := int(np.searchsorted(levels, begin))) < levels.size:
        if starts and levels[place] > begin + _JUMP_SAMPLES:
            return None
        begin = int(levels[place])
        away = np.abs(signal[begin:] - np.mean(signal[begin : begin + _LEVEL_SAMPLES])) > gate
        lasting = np.convolve(away, np.ones(_JUMP_SAMPLES), "valid") == _JUMP_SAMPLES
        if not lasting.any():
            break
        begin += int(np.argmax(lasting))
        starts.append(begin)
    return starts
