"""The derivative window that fits a record: as long as its noise asks for and its motion allows."""

import numpy as np

from valve_friction_ros.model.recording import Recording
from valve_friction_ros.signals.noise import sensor_noise
from valve_friction_ros.signals.smoothing import longest_faithful_window

__all__ = ["fitting_window"]

_LONGEST = 1.0
_NO_CORNERS = np.empty(0, dtype=np.intp)


def fitting_window(recording: Recording, order: int) -> int:
    """Choose the derivative window by the noise and the bandwidth of the stem position.

    Parameters
    ----------
    recording : Recording
        Pressure and stem position.
    order : int
        Polynomial order of the derivatives; the window holds at least order + 2 samples.

    Returns
    -------
    int
        The longest odd window, up to a second, that smooths away nothing but noise.
    """
    noise = sensor_noise(recording.position)
    longest = min(round(_LONGEST / recording.sample_period), len(recording) // 20)
    window = longest_faithful_window(recording.position, _NO_CORNERS, noise, longest)
    return max(window, (order + 2) | 1)
