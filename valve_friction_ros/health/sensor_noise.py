# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Noise of both sensors of a record, where the record shows it as noise and as nothing else."""

import math

import numpy as np

from valve_friction_ros.health.measured import Measured
from valve_friction_ros.model.recording import Recording, StampedSignal
from valve_friction_ros.signals import stamped_noise, without_repeats

_FEWEST = 200
_LIKE_WHITE = 1.25
"""Noise of every second sample over that of all, up to which it counts.

It is 1 for white noise. Where it is more, the noise has a memory, or the signal itself moves as
much from sample to sample: the number then depends on rate and drive, and not on the sensor."""

_FINEST = 1e-4
"""Share of the signal's range below which a noise is not told apart from none."""


def sensor_noises(recording: Recording) -> dict[str, Measured]:
    """Return ``drive_noise`` (Pa or N) and ``stem_noise`` (m), standard deviations.

    One that depends on rate or drive is left out. Of one below the resolution, which grows with the
    stroke, only that is known: its interval goes from zero to the resolution.
    """
    if (stamped := recording.stamped) is not None:
        signals = stamped.drive, stamped.position
    elif len(recording) >= _FEWEST:
        time = recording.time
        drive, position = recording.drive, recording.position
        signals = StampedSignal(time, drive), StampedSignal(time, position)
    else:
        return {}
    named = zip(("drive_noise", "stem_noise"), map(_noise, signals), strict=True)
    return {name: noise for name, noise in named if noise is not None}


def _noise(signal: StampedSignal) -> Measured | None:
    fresh = without_repeats(signal)
    if fresh.time.size < _FEWEST:
        return None
    noise = stamped_noise(fresh)
    sparse = stamped_noise(StampedSignal(fresh.time[::2], fresh.value[::2]))
    finest = _FINEST * float(np.ptp(fresh.value))
    if sparse > _LIKE_WHITE * max(noise, finest):
        return None
    if noise < finest:
        return Measured(0.5 * finest, 0.5 * finest)
    chance = 2.0 * noise / math.sqrt(fresh.time.size)
    return Measured(noise, math.hypot(chance, sparse - noise))
