"""Steps of a command in service: one hold, a jump, another hold."""

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from valve_friction_ros.signals.noise import position_noise
from valve_friction_ros.streams import Samples

__all__ = ["Change", "CommandHolds"]

_SAME = 1e-3
"""Share of the travel within which a command still holds. Chosen: a tenth of the dead band of a
good valve (1 %)."""

_GATE = 6.0
"""Standard deviations of the noise beyond which a sample has left its hold."""

_TRANSIT = 0.1
"""Longest time of a jump, s. Chosen: the cycle of a fast controller."""

_SHARP = 0.7
"""Share of the change that lies between two samples in a jump; in a ramp it is spread."""

_NOISE_SAMPLES, _FEWEST, _SAMPLED = 256, 32, 0.5
"""Samples that the noise is estimated from, their least number, and their longest period, s."""

_Transit = tuple[int, float, float, float]


class Change(NamedTuple):
    """A change of the command, as soon as it has reached its next value.

    Attributes
    ----------
    stamp : int
        When it began, ns.
    before, after : float
        The command before and after, in the unit of the samples.
    held : float
        Time for which it stood still before, s.
    is_step : bool
        Whether it jumped; a ramp is no step.
    """

    stamp: int
    before: float
    after: float
    held: float
    is_step: bool


class CommandHolds:
    """Finds the changes of a command that holds its value until the next sample.

    So it may be published at each cycle or only when it changes. Its noise is estimated, and does
    not count as a change.
    """

    def __init__(self, travel: float) -> None:
        self._least = _SAME * travel
        self._gate = self._least
        self._recent: deque[tuple[int, float]] = deque(maxlen=_NOISE_SAMPLES)
        self._level = math.nan
        self._count = 0
        self._since = 0
        self._last = math.nan
        self._transit: _Transit | None = None

    @property
    def least_step(self) -> float:
        """Smallest change that counts as a step."""
        return 2 * self._gate

    def take(self, samples: Samples) -> list[Change]:
        """Take samples, in the order of their stamps; return the changes that they end."""
        if not samples.stamps.size:
            return []
        self._recent.extend(zip(*(part.tolist() for part in samples), strict=True))
        if float(np.ptp(samples.values)) > 0:
            self._gate = max(self._least, _GATE * self._noise())
        found: list[Change] = []
        for stamp, value in zip(samples.stamps.tolist(), samples.values.tolist(), strict=True):
            found += self.advance(stamp)
            self._take_one(stamp, value)
            self._last = value
        return found

    def _noise(self) -> float:
        """Estimate the noise; a command that comes only when it changes has none."""
        stamps, values = (np.array(part) for part in zip(*self._recent, strict=True))
        if values.size < _FEWEST or float(np.median(np.diff(stamps))) > _SAMPLED * 1e9:
            return 0.0
        # Not `sensor_noise`: the levels of a command are not the codes of a converter.
        return position_noise(values)

    def advance(self, stamp: int) -> list[Change]:
        """Note that no sample has come until `stamp`, ns; return the change that this ends."""
        if self._transit is None or (stamp - self._transit[0]) / 1e9 < _TRANSIT:
            return []
        start, before, held, last = self._transit
        self._transit = None
        change = abs(self._level - before)
        is_step = change >= self.least_step and abs(self._level - last) >= _SHARP * change
        return [Change(start, before, self._level, held, is_step)]

    def _take_one(self, stamp: int, value: float) -> None:
        if abs(value - self._level) <= self._gate:
            self._count += 1
            self._level += (value - self._level) / self._count
            return
        if self._transit is None and self._count:
            self._transit = stamp, self._level, (stamp - self._since) / 1e9, self._last
            self._since = stamp
        elif not self._count:
            self._since = stamp
        self._level, self._count = value, 1
