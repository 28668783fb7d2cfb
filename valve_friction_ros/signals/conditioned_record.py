"""The record that the refinement uses: smoothed pressure, at a sufficient sampling rate."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.recording import Recording
from valve_friction_ros.signals.measured_record import measured
from valve_friction_ros.signals.smoothing import (
    independent_halves,
    smooth_between,
)

__all__ = ["ConditionedRecord", "condition", "smoothed_drive"]

_SAMPLES_A_WINDOW = 32
"""Samples of the thinned record in a smoothing window. Chosen: a cubic needs far fewer, so nothing
that the window passes is lost."""

_LONGEST_PERIOD = 5e-3
"""Longest sample period of a thinned record, s. Chosen: the error in the time of a corner of the
pressure; an absolute time, 1/260 of the bench's converter lag."""


@dataclass(frozen=True, eq=False)
class ConditionedRecord:
    """Smoothed pressure, its two halves with independent noise, and the averaged position.

    Attributes
    ----------
    sample_period : float
        Time between two samples, s.
    pressure : ndarray of float, shape (n,)
        Smoothed pressure, Pa.
    halves : tuple of two ndarray of float, shape (n,)
        The pressure smoothed from its even and from its odd samples alone, Pa: each carries the
        signal, and their noise is independent.
    position : ndarray of float, shape (n,)
        Stem position, averaged around each sample, m.
    noise : float
        Standard deviation of the noise of `position`, m.
    smoothing_window : int
        Smoothing window of the pressure, samples of the original record.
    stride : int
        Samples of the original record for each sample of this record.
    """

    sample_period: float
    pressure: NDArray[np.float64]
    halves: tuple[NDArray[np.float64], NDArray[np.float64]]
    position: NDArray[np.float64]
    noise: float
    smoothing_window: int
    stride: int


def condition(recording: Recording) -> ConditionedRecord:
    """Smooth the pressure as far as its noise requires, and thin the record out accordingly.

    The noise of the sensors sets the window (`longest_faithful_window`); a 32nd of it, or 5 ms
    at most, is the new sample period. A noiseless record passes unchanged.
    """
    record = measured(recording)
    pressure, period = record.drive, record.sample_period
    corners, window = record.drive_smoothing
    stride = max(min(window // _SAMPLES_A_WINDOW, int(_LONGEST_PERIOD / period)), 1)
    if window == 1:
        whole = pressure[::stride]
        halves = whole, whole  # one object: without noise there is nothing to cross
    else:
        whole = smooth_between(pressure, corners, window)[::stride]
        one, two = independent_halves(pressure, corners, window)
        halves = one[::stride], two[::stride]
    position, kept = _averaged(record.position, stride)
    return ConditionedRecord(
        stride * period,
        whole,
        halves,
        position,
        kept * record.position_noise,
        window,
        stride,
    )


def smoothed_drive(recording: Recording) -> NDArray[np.float64]:
    """Smooth the drive between its corners as far as its noise requires, shape (n,)."""
    corners, window = measured(recording).drive_smoothing
    if window == 1:
        return recording.drive
    return smooth_between(recording.drive, corners, window)


def _averaged(signal: NDArray[np.float64], stride: int) -> tuple[NDArray[np.float64], float]:
    """Average around every `stride`-th sample with weights that fall linearly to its neighbours.

    These are the weights of the two samples in linear interpolation.
    Returns the averages and the share of white noise that they keep.
    """
    if stride == 1:
        return signal, 1.0
    weights = 1.0 - np.abs(np.arange(1 - stride, stride)) / stride
    total = np.convolve(signal, weights, "same")
    normal = np.convolve(np.ones_like(signal), weights, "same")
    return (total / normal)[::stride], float(np.linalg.norm(weights) / weights.sum())
