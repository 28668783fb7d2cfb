"""The dead band that the noise and the resolution of a position sensor need."""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.signals.noise import quantisation_step

__all__ = ["SensorBand"]

_ORDER = 4
_GAIN = math.sqrt(math.comb(2 * _ORDER, _ORDER))
"""Deviation of the fourth differences of white noise of deviation 1: √70."""
_MEDIAN = 0.6744898
"""Median magnitude of a standard normal number."""
_MOST_SEEN = 16
"""Blocks whose noise is remembered. Chosen: the stem rests in some of them."""
_NOISE = 14.0
"""Dead band over the deviation of the noise.

Noise counts when two samples of one rest lie a dead band apart. Of 10⁹ samples, some ten days at
1 kHz, the farthest lie 12 deviations apart; the estimate may be a tenth too small."""
_STEPS = 2.0
"""Dead band over the step of a converter: it may flicker between three codes."""
_MANY_CODES = 8
"""Different values in a block that show a converter's codes. Chosen: fewer may be places at which
a noiseless stem has rested."""


class SensorBand:
    """Follows the noise and the resolution of a sensor, block by block.

    The noise of a block is read from fourth differences, in which the motion of a stem all but
    vanishes, by their median, which jumps do not change. Where a stem moves fast against the
    sampling rate some motion is left, so the lower quartile of the last blocks counts. The step of
    a converter is the smallest difference in blocks of many codes, or of values that come and go
    from one sample to the next.
    """

    def __init__(self) -> None:
        self._noises: deque[float] = deque(maxlen=_MOST_SEEN)
        self._step = self._band = 0.0

    @property
    def band(self) -> float:
        """The least dead band, m."""
        return self._band

    def add(self, position: NDArray[np.float64]) -> None:
        """Take a block of positions, m, shape (n,)."""
        if position.size <= _ORDER:
            return
        self._follow_step(position)
        differences = np.sort(np.abs(np.diff(position, _ORDER)))
        self._noises.append(float(differences[differences.size // 2]) / (_MEDIAN * _GAIN))
        noise = sorted(self._noises)[len(self._noises) // 4]
        self._band = max(_NOISE * noise, _STEPS * self._step)

    def _follow_step(self, position: NDArray[np.float64]) -> None:
        first, middle, last = position[:-2], position[1:-1], position[2:]
        flickers = np.count_nonzero((first == last) & (first != middle)) > 1
        values = np.unique(position)
        if values.size > 0.5 * position.size or (not flickers and values.size < _MANY_CODES):
            return
        step = quantisation_step(position)
        if step > 0:
            self._step = step if self._step == 0 else min(self._step, step)
