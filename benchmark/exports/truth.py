# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Randomly generated valves and motions, from a simulation that shares no code with the package."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

STEP = 1e-3
DURATION = 40.0
"""Simulated time step and duration, s."""


@dataclass(frozen=True, eq=False)
class Truth:
    """A valve and its motion.

    Attributes
    ----------
    area, travel, friction : float
        m², m, N.
    time : ndarray of float, shape (n,)
        s since `start`.
    pressure, position : ndarray of float, shape (n,)
        Pa, gauge; m.
    start : int
        Time of the first sample, ns since 1970.
    """

    area: float
    travel: float
    friction: float
    time: NDArray[np.float64]
    pressure: NDArray[np.float64]
    position: NDArray[np.float64]
    start: int

    @property
    def stamps(self) -> NDArray[np.int64]:
        """Times, ns since 1970."""
        return self.start + np.rint(self.time * 1e9).astype(np.int64)


def draw(count: int, seed: int) -> list[Truth]:
    """Draw valves, move each by random ramps, and sample each at its own rate.

    The massless stem has Coulomb friction, viscous friction and a spring.
    """
    random = np.random.default_rng(seed)
    area = random.uniform(0.01, 0.12, count)
    travel = random.uniform(0.015, 0.1, count)
    low = random.uniform(2e4, 6e4, count)
    high = low + random.uniform(6e4, 2e5, count)
    spring = area * (high - low) / travel
    friction = random.uniform(0.01, 0.06, count) * area * (high - low)
    viscous = random.uniform(0.02, 0.1, count) * spring
    steps = round(DURATION / STEP)
    corners = np.linspace(0, DURATION, 12)
    shares = random.uniform(0.1, 0.9, (corners.size, count))
    time = np.arange(steps) * STEP
    drive = np.stack([np.interp(time, corners, shares[:, one]) for one in range(count)], axis=1)
    pressure = low + drive * (high - low)
    position = np.empty_like(pressure)
    stem = shares[0] * travel
    for step in range(steps):
        surplus = area * (pressure[step] - low) - spring * stem
        sliding = np.maximum(np.abs(surplus) - friction, 0) * np.sign(surplus)
        stem = np.clip(stem + STEP * sliding / viscous, 0, travel)
        position[step] = stem
    found = []
    for one in range(count):
        every = int(random.choice([5, 10, 20, 50]))
        # 2026-01-01 or up to 299 days later, with whole seconds
        day = int(random.integers(0, 300))
        start = 1_767_225_600_000_000_000 + day * 86_400_000_000_000
        start += int(random.integers(6 * 3600, 20 * 3600)) * 1_000_000_000
        signals = (time[::every], pressure[::every, one], position[::every, one])
        sizes = (float(values[one]) for values in (area, travel, friction))
        found.append(Truth(*sizes, *signals, start))
    return found
