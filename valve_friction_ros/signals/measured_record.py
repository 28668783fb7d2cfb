"""A recording with its noise, smoothing and derivatives, each computed once."""

import math
from functools import cached_property

import numpy as np

from valve_friction_ros.model.recording import Recording
from valve_friction_ros.signals.derivatives import Derivatives, differentiate
from valve_friction_ros.signals.drive_smoothing import DriveSmoothing, smoothing_of
from valve_friction_ros.signals.noise import position_noise, quantisation_step
from valve_friction_ros.signals.smoothing import longest_faithful_window

__all__ = ["MeasuredRecord", "measured"]

_LONGEST_DERIVATIVE_WINDOW = 1.0
"""Longest derivative window, s, and a twentieth of the record at most.

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
        return smoothing_of(self.drive, self.drive_noise, self.sample_period)

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
