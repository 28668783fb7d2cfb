# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Eleven kinds of nonsense that the sensors of a valve say, stamped as they are sent."""

import math
from enum import Enum

from sensor_msgs.msg import FluidPressure, JointState

from valve_friction_ros.nodes.plumbing.messages import time_message

__all__ = ["PERIOD", "TOLD_WITHIN", "Nonsense", "said"]

PERIOD = 0.05
"""Time from one sample to the next, s."""
TOLD_WITHIN = 5.0
"""Time, s, within which nonsense must be told."""

_BAR, _MM = 1e5, 1e-3
_SECOND = 10**9
_FAR = 3 * 10**8 * _SECOND


class Nonsense(Enum):
    """What is wrong, with words that the node must find for it."""

    WRONG_JOINT = "no position of the joint 'stem'"
    PRESSURE_NAN = "actuator_pressure: 100 % of its samples are rejected"
    POSITION_NAN = "stem_state: 100 % of its samples are rejected"
    PRESSURE_ABOVE = "9e+05 Pa is outside the sensor's range"
    PRESSURE_BELOW = "-1e+04 Pa is outside the sensor's range"
    STEM_IN_MM = "stem_state: 100 % of its samples lie outside the travel"
    STEM_ENDLESS = "1e+308 m is outside the range of any valve"
    STEM_LATE = "later than actuator_pressure"
    CLOCK_AHEAD = "3e+08 s ahead of the clock"
    CLOCK_BEHIND = "3e+08 s behind the clock"
    NO_STAMPS = "they repeat a stamp"


def said(kind: Nonsense | None, now: int) -> tuple[FluidPressure, JointState]:
    """Return what both sensors say at a time, ns; None: the truth."""
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
    late = 5 * _SECOND if kind is Nonsense.STEM_LATE else 0
    drive = FluidPressure(fluid_pressure=pressure)
    drive.header.stamp = time_message(stamp)
    joint = "arm" if kind is Nonsense.WRONG_JOINT else "stem"
    stem = JointState(name=[joint], position=[position])
    stem.header.stamp = time_message(stamp + late)
    return drive, stem
