"""How far the noise of a drive requires it to be smoothed."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.signals.smoothing import find_corners, longest_faithful_window

__all__ = ["DriveSmoothing", "smoothing_of"]

_CORNER_TIME = 0.04
_CORNER_SAMPLES = 8
"""Least time, s, and samples over which the slopes on both sides of a corner are compared.

Chosen: short against the 1.3 s lag of the bench's converter; a slope over 8 samples has 0.15 of
the noise per sample. An absolute time."""

_LONGEST_SMOOTHING = 0.5
"""Longest smoothing window of the drive, s. Chosen: it bounds the time of the search.

`longest_faithful_window` decides before that where the signal bends. An absolute time."""


class DriveSmoothing(NamedTuple):
    """Smoothing of the drive, as far as its noise requires.

    Attributes
    ----------
    corners : ndarray of int
        Samples at which the slope of the drive jumps; it is smoothed between them.
    window : int
        Window to smooth over, samples; 1 for a noiseless drive.
    """

    corners: NDArray[np.intp]
    window: int


def smoothing_of(signal: NDArray[np.float64], noise: float, period: float) -> DriveSmoothing:
    """Choose corners and window for a signal with white noise, `period` s between samples."""
    corners = find_corners(signal, noise, max(round(_CORNER_TIME / period), _CORNER_SAMPLES))
    longest = max(round(_LONGEST_SMOOTHING / period), 1)
    return DriveSmoothing(corners, longest_faithful_window(signal, corners, noise, longest))
