# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The records of one valve, a piece at a time, with the faults of its sensors."""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model import (
    BENCH_VALVE,
    LOW_FRICTION,
    Recording,
    SensorNoise,
    SineWave,
    simulate,
)

__all__ = ["PIECE", "Feed", "Piece"]

PIECE = 50
"""Rows that are sent at once."""

_ROWS, _RATE = 500, 100.0
"""Rows of a record, and rows a second of the valve's time."""
_STEPS = 20
"""Steps in which the friction grows over the month."""


class Piece(NamedTuple):
    """Rows that are sent at once: stamps, ns, and what the sensors say, Pa and m."""

    stamps: NDArray[np.int64]
    pressure: NDArray[np.float64]
    position: NDArray[np.float64]


@lru_cache
def _record(growth: float) -> Recording:
    """Return five seconds of a valve whose friction has grown by a factor."""
    time = np.arange(_ROWS) / _RATE
    friction = replace(
        LOW_FRICTION,
        coulomb_friction=growth * LOW_FRICTION.coulomb_friction,
        static_friction=growth * LOW_FRICTION.static_friction,
    )
    pressure = SineWave(period=5.0).sample(time)
    position = simulate(BENCH_VALVE, friction, pressure, 1 / _RATE).position
    return SensorNoise(5e-6, 50.0, seed=1).applied_to(Recording(1 / _RATE, pressure, position))


class Feed:
    """Records of one valve.

    Parameters
    ----------
    growth : float
        Friction at the end of the month over that at its begin.
    """

    def __init__(self, growth: float) -> None:
        self._growth = growth
        self.clock_error = 0
        """How far the clock of the sensors is ahead, ns."""
        self.bad_rows = 0
        """Rows of the next record whose pressure is not a number."""

    def record(self, share: float, now: int) -> Iterator[Piece]:
        """Yield a record at a share of the month, that begins at a time (ns)."""
        step = round(share * _STEPS) / _STEPS
        record = _record(1.0 + (self._growth - 1.0) * step)
        period = round(1e9 / _RATE)
        stamps = now + self.clock_error + period * np.arange(_ROWS, dtype=np.int64)
        pressure = record.pressure.copy()
        pressure[: self.bad_rows] = math.nan
        self.bad_rows = 0
        for begin in range(0, _ROWS, PIECE):
            piece = slice(begin, begin + PIECE)
            yield Piece(stamps[piece], pressure[piece], record.position[piece])
