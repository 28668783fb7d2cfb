# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Instruments of the bench: the V/P converter before the valve, the sensors behind it."""

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from valve_friction_ros.model.checks import require_non_negative, require_positive
from valve_friction_ros.model.drive import DEFAULT_LAG
from valve_friction_ros.model.recording import Recording


def converter_response(
    command: NDArray[np.float64],
    sample_period: float,
    lag: float = DEFAULT_LAG,
    initial: float | None = None,
) -> NDArray[np.float64]:
    """Pressure behind a V/P converter, a first-order lag stepped exactly.

    Parameters
    ----------
    command : ndarray of float, shape (n,)
        Commanded pressure, Pa, each value held for one period.
    sample_period : float
        Time between two samples, s.
    lag : float
        Time constant of the converter, s. Zero: the command passes unchanged.
    initial : float, optional
        Pressure at the first sample, Pa; by default the first command, in steady state.

    Returns
    -------
    ndarray of float, shape (n,)
        Actuator pressure, Pa.
    """
    period = require_positive("sample_period", sample_period)
    if require_non_negative("lag", lag) == 0:
        return np.array(command, dtype=np.float64)
    decay = np.exp(-period / lag)
    start = float(command[0]) if initial is None else initial
    held = np.concatenate(([0.0], command[:-1]))
    pressure: NDArray[np.float64]
    pressure, _ = scipy.signal.lfilter(
        [1.0 - decay], [1.0, -decay], held[1:], zi=np.array([decay * start])
    )
    return np.concatenate(([start], pressure))


@dataclass(frozen=True)
class SensorNoise:
    """White Gaussian noise of the two sensors, reproducible by its seed.

    Attributes
    ----------
    position : float
        Standard deviation of the stem sensor, m.
    pressure : float
        Standard deviation of the pressure sensor, Pa.
    seed : int
        Seed of the random numbers.

    Examples
    --------
    >>> import numpy as np
    >>> import valve_friction_ros as vf
    >>> rest = vf.Recording(1e-3, np.full(10_000, 1e5), np.zeros(10_000))
    >>> noisy = vf.SensorNoise(position=10e-6, pressure=100.0, seed=1).applied_to(rest)
    >>> bool(9.8e-6 < noisy.position.std() < 10.2e-6)
    True
    """

    position: float = 0.0
    pressure: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse negative deviations."""
        require_non_negative("position", self.position)
        require_non_negative("pressure", self.pressure)

    def applied_to(self, recording: Recording) -> Recording:
        """Return `recording` with the noise of these sensors."""
        generator = np.random.default_rng(self.seed)
        size = len(recording)
        return Recording(
            recording.sample_period,
            recording.pressure + self.pressure * generator.standard_normal(size),
            recording.position + self.position * generator.standard_normal(size),
            recording.start_time,
            gap=recording.gap,
        )
