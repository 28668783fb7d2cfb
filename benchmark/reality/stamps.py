# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""When a sensor samples, which of its messages arrive, and what time they bear."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Stamping:
    """The clock of one signal.

    Attributes
    ----------
    rate : float
        Samples a second.
    jitter : float
        Largest shift of an instant from its place, share of the period; the stamp is right.
    stamp_error : float
        Largest error of a stamp, s, to either side, each for itself.
    offset : float
        Time by which the stamps are late, s.
    drops : float
        Share of the messages that are lost, each for itself.
    bursts, burst : int and float
        Number and length (s) of the pauses in which all messages are lost.
    resolution : float
        Step to which stamps are cut, s; 0: a nanosecond.
    """

    rate: float = 1000.0
    jitter: float = 0.0
    stamp_error: float = 0.0
    offset: float = 0.0
    drops: float = 0.0
    bursts: int = 0
    burst: float = 0.0
    resolution: float = 0.0


class Times(NamedTuple):
    """Instants of a signal.

    Attributes
    ----------
    period : float
        Nominal time between two samples, s.
    taken : ndarray of float, shape (n,)
        When the samples were taken, s from the begin of the record.
    written : ndarray of float, shape (n,)
        What the clock said then, s.
    lost : ndarray of bool, shape (n,)
        Whether the message is lost.
    """

    period: float
    taken: NDArray[np.float64]
    written: NDArray[np.float64]
    lost: NDArray[np.bool_]


def sampling_times(stamping: Stamping, duration: float, random: np.random.Generator) -> Times:
    """Return the instants of a record of `duration` seconds."""
    period = 1.0 / stamping.rate
    count = int(duration / period)
    steps = np.arange(count, dtype=np.float64)
    if stamping.jitter > 0.0:
        steps += stamping.jitter * random.uniform(-1.0, 1.0, count)
    taken = np.clip(steps * period, 0.0, duration)
    written = taken
    if stamping.stamp_error > 0.0:
        written = taken + stamping.stamp_error * random.uniform(-1.0, 1.0, count)
        written = np.maximum.accumulate(written)
    lost = random.random(count) < stamping.drops
    for begin in random.uniform(0.05, 0.95, stamping.bursts) * (duration - stamping.burst):
        lost |= (taken >= begin) & (taken < begin + stamping.burst)
    return Times(period, taken, written, lost)


def stamped(stamping: Stamping, written: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the stamps, ns, with which a clock writes its times (s)."""
    stamps: NDArray[np.int64] = np.rint((written + stamping.offset) * 1e9).astype(np.int64)
    if stamping.resolution > 0.0:
        unit = round(stamping.resolution * 1e9)
        stamps -= stamps % unit
    return stamps
