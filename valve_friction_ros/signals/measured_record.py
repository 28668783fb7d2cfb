"""A recording with its noise, smoothing and derivatives, each computed once."""

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.recording import Recording
from valve_friction_ros.signals.derivatives import Derivatives, differentiate
from valve_friction_ros.signals.noise import position_noise, quantisation_step
from valve_friction_ros.signals.smoothing import find_corners, longest_faithful_window

__all__ = ["DriveSmoothing", "MeasuredRecord", "measured"]

_CORNER_TIME = 0.04
_CORNER_SAMPLES = 8
"""Least time, s, and samples over which the slopes on both sides of a corner are compared.

Chosen: short against the 1.3 s lag of the bench's converter; a slope over 8 samples has 0.15 of
the noise per sample. An absolute time."""

_LONGEST_SMOOTHING = 0.5
"""Longest smoothing window of the drive, s. Chosen: it bounds the time of the search.

`longest_faithful_window` decides before that where the signal bends. An absolute time."""

_LONGEST_DERIVATIVE_WINDOW = 1.0
"""Longest derivative window, s, and a twentieth of the record at most. Chosen as above."""

_NO_CORNERS = np.empty(0, dtype=np.intp)


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
        """Standard deviation of the noise of the position, m, rounding included."""
        return math.hypot(self.white_noise, quantisation_step(self.position) / math.sqrt(12.0))

    @cached_property
    def drive_noise(self) -> float:
        """Standard deviation of the noise of the drive, Pa or N, rounding included."""
        white = position_noise(self.drive)
        return math.hypot(white, quantisation_step(self.drive) / math.sqrt(12.0))

    @cached_property
    def drive_smoothing(self) -> DriveSmoothing:
        """Corners of the drive, and the window to smooth it over between them."""
        period = self.sample_period
        reach = max(round(_CORNER_TIME / period), _CORNER_SAMPLES)
        corners = find_corners(self.drive, self.drive_noise, reach)
        longest = max(round(_LONGEST_SMOOTHING / period), 1)
        window = longest_faithful_window(self.drive, corners, self.drive_noise, longest)
        return DriveSmoothing(corners, window)

    @cached_property
    def _faithful_window(self) -> int:
        longest = min(round(_LONGEST_DERIVATIVE_WINDOW / self.sample_period), len(self) // 20)
        return longest_faithful_window(self.position, _NO_CORNERS, self.position_noise, longest)

    def fitting_window(self, order: int) -> int:
        """Choose the derivative window from noise and bandwidth of the stem position.

        Parameters
        ----------
        order : int
            Polynomial order of the derivatives; the window holds at least order + 2 samples.

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
        """Differentiate the position (`differentiate`) over `window` samples by order `order`."""
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
        driven_by=recording.driven_by,
        gap=recording.gap,
    )
