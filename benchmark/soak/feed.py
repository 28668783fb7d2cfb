# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sensor data of valves: records, a piece at a time, or nonsense."""

import math
from collections.abc import Iterator
from dataclasses import replace
from enum import Enum
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import FluidPressure, JointState

from valve_friction_ros.model import (
    BENCH_VALVE,
    LOW_FRICTION,
    Recording,
    SensorNoise,
    SineWave,
    simulate,
)
from valve_friction_ros.nodes.plumbing.messages import time_message

PIECE = 50
"""Rows per piece, sent at once."""

_ROWS, _RATE = 500, 100.0
"""Rows per record, and rows per second of the valve's time."""
_STEPS = 20
"""Number of steps in which friction grows over the month."""

PERIOD = 0.05
"""Sample period of nonsense, s."""
TOLD_WITHIN = 5.0
"""Time limit, s, for a node to report nonsense."""

_BAR, _MM = 1e5, 1e-3
_SECOND = 10**9
_FAR = 3 * 10**8 * _SECOND


class Piece(NamedTuple):
    """Rows sent at once: stamps, ns, and measured values, Pa and m."""

    stamps: NDArray[np.int64]
    pressure: NDArray[np.float64]
    position: NDArray[np.float64]


@lru_cache
def _record(growth: float) -> Recording:
    """Return five seconds of a valve with friction grown by a factor."""
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
    """Records of one valve with friction that grows over the month by a factor."""

    def __init__(self, growth: float) -> None:
        self._growth = growth
        self.clock_error = 0
        """Time by which the sensors' clock is ahead, ns."""
        self.bad_rows = 0
        """Number of rows in the next record with a pressure of nan."""

    def record(self, share: float, now: int) -> Iterator[Piece]:
        """Yield a record for a share of the month, starting at a time, ns."""
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


def stamped(stamp: int, pressure: float, position: float) -> tuple[FluidPressure, JointState]:
    """Return the messages of both sensors at a time, ns."""
    drive = FluidPressure(fluid_pressure=pressure)
    stem = JointState(name=["stem"], position=[position])
    drive.header.stamp = stem.header.stamp = time_message(stamp)
    return drive, stem


class Nonsense(Enum):
    """Kinds of nonsense, with the words expected from the node."""

    WRONG_JOINT = "no position for the joint 'stem'"
    PRESSURE_NAN = "actuator_pressure: 100 % of its samples are rejected"
    POSITION_NAN = "stem_state: 100 % of its samples are rejected"
    PRESSURE_ABOVE = "9e+05 Pa is outside the sensor's range"
    PRESSURE_BELOW = "-1e+04 Pa is outside the sensor's range"
    STEM_IN_MM = "stem_state: 100 % of its samples lie outside the travel"
    STEM_ENDLESS = "1e+308 m is outside the range of any valve"
    STEM_LATE = "later than actuator_pressure"
    CLOCK_AHEAD = "3e+08 s ahead of the clock"
    CLOCK_BEHIND = "3e+08 s behind the clock"
    NO_STAMPS = "time stamps are repeated"


def said(kind: Nonsense | None, now: int) -> tuple[FluidPressure, JointState]:
    """Return the messages of both sensors at a time, ns; None for the truth."""
    phase = 2 * math.pi * (now / _SECOND % 8.0) / 8.0
    pressure = {
        Nonsense.PRESSURE_NAN: math.nan,
        Nonsense.PRESSURE_ABOVE: 9 * _BAR,
        Nonsense.PRESSURE_BELOW: -0.1 * _BAR,
    }.get(kind, (1.2 + 0.3 * math.sin(phase)) * _BAR)
    truth = (6.0 + 2.0 * math.sin(phase)) * _MM
    position = {
        Nonsense.POSITION_NAN: math.nan,
        Nonsense.STEM_IN_MM: truth / _MM,
        Nonsense.STEM_ENDLESS: 1e308,
    }.get(kind, truth)
    off = {Nonsense.CLOCK_AHEAD: _FAR, Nonsense.CLOCK_BEHIND: -_FAR, Nonsense.NO_STAMPS: -now}
    stamp = now + off.get(kind, 0)
    drive, stem = stamped(stamp, pressure, position)
    if kind is Nonsense.STEM_LATE:
        stem.header.stamp = time_message(stamp + 5 * _SECOND)
    if kind is Nonsense.WRONG_JOINT:
        stem.name = ["arm"]
    return drive, stem
