"""How far the stem went in a record, and whether a stop held it there."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from valve_friction_ros.health.measured import Measured
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals.runs import runs_of

__all__ = ["stem_reach"]

_MEAN = 0.1
"""Time, s, over which the stem is averaged."""

_NEAR = 2e-3
"""Share of the range within which the stem is at its end: a seat gives way a little."""

_NOISE = 6.0
"""Deviations of the averaged stem's noise within which it is there, too."""

_SURELY = 2.0
"""Growth of the force over F_s − F_c: a stem that has jumped too far waits for twice as much."""

_SMALLEST, _LARGEST = 0.05, 0.25
"""Growth asked for at least, and where F_s − F_c is unknown, as shares of the force's range.

Chosen: within the near part of the way the force grows by the spring, too. In records of a
benchmark whose F_s is twice F_c, a stem waited for 0.15 to 0.2."""


def stem_reach(recording: Recording, valve: Valve, slip_force: float) -> dict[str, Measured]:
    """Return the ends of the stem's motion, m, and which of them are stops.

    A stem that has come to rest moves on as soon as the force has grown by F_s − F_c in the same
    direction. Where it rests at an end of its motion and the force grows by far more, a stop holds
    it.

    Parameters
    ----------
    recording : Recording
        Drive and stem.
    valve : Valve
        Makes the force from the drive.
    slip_force : float
        Largest F_s − F_c that there may be, N; nan where it is unknown.

    Returns
    -------
    dict
        ``lowest_position`` and ``highest_position``; ``lower_stop`` and ``upper_stop`` where met.
    """
    mean = max(round(_MEAN / recording.sample_period), 1)
    position = uniform_filter1d(recording.position, mean, mode="nearest")
    force = valve.actuator_force(uniform_filter1d(recording.drive, mean, mode="nearest"))
    noise = float(np.std(recording.position - position)) / math.sqrt(mean)
    near = max(_NEAR * float(np.ptp(position)), _NOISE * noise)
    least = _LARGEST * float(np.ptp(force))
    if not math.isnan(slip_force):
        least = max(_SURELY * slip_force, _SMALLEST * float(np.ptp(force)))
    found = {}
    for side, end, stop in (
        (-1.0, "lowest_position", "lower_stop"),
        (1.0, "highest_position", "upper_stop"),
    ):
        farthest = float(np.max(side * position))
        found[end] = Measured(side * farthest, near)
        held = _held(side * position >= farthest - near, side * force, least)
        if held.any():
            low, middle, high = np.quantile(position[held], (0.025, 0.5, 0.975)).tolist()
            found[stop] = Measured(middle, max(high - low, 0.5 * near))
    return found


def _held(at_end: NDArray[np.bool_], force: NDArray[np.float64], least: float) -> NDArray[np.bool_]:
    """Return the visits of an end in which the force grows by more than `least` after arrival.

    Nothing is known of the arrival of a visit with which the record begins.
    """
    held = np.zeros(at_end.size, dtype=np.bool_)
    for begin, end in runs_of(at_end):
        if begin > 0 and np.max(force[begin:end]) - force[begin] > least:
            held[begin:end] = True
    return held
