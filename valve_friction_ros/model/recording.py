# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A recording: drive and stem position on one uniform grid, and at their own stamps; sensors."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import scipy
from numpy.typing import NDArray

from valve_friction_ros.model.checks import require_finite, require_non_negative, require_positive
from valve_friction_ros.model.drive import DEFAULT_LAG, Drive


def require_row(name: str, values: object) -> NDArray[np.float64]:
    """Return a copy of a row of finite numbers, or raise ValueError with its name and the sample.

    A masked value of a numpy array is not a number.
    """
    try:
        row = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be a row of numbers: {error}") from None
    if row.ndim != 1 or row.size == 0:
        raise ValueError(f"{name} must be a row of samples, got shape {row.shape}")
    if isinstance(values, np.ma.MaskedArray):
        row[values.mask] = np.nan
    finite = np.isfinite(row)
    if not finite.all():
        raise ValueError(f"{name} is not finite at sample {int(np.argmin(finite))}")
    return row


@dataclass(frozen=True, eq=False)
class StampedSignal:
    """Samples of one sensor with their stamps.

    Attributes
    ----------
    time : ndarray of float, shape (n,)
        Time of each sample, s, increasing; kept as a read-only copy.
    value : ndarray of float, shape (n,)
        Values at those times, SI unit; kept as a read-only copy.

    Raises
    ------
    ValueError
        If the arrays differ in shape, hold fewer than three samples or a number that is not
        finite, or the times do not increase.
    """

    FEWEST: ClassVar[int] = 3

    time: NDArray[np.float64] = field(repr=False)
    value: NDArray[np.float64] = field(repr=False)

    def __post_init__(self) -> None:
        """Refuse arrays that do not make a signal, and freeze them."""
        for name in ("time", "value"):
            values = np.array(getattr(self, name), dtype=np.float64)
            if values.ndim != 1 or values.size < self.FEWEST or not np.isfinite(values).all():
                raise ValueError(f"{name} must be a row of {self.FEWEST} or more finite numbers")
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        if self.time.shape != self.value.shape:
            raise ValueError(f"{self.time.size} times for {self.value.size} values")
        if not (np.diff(self.time) > 0).all():
            raise ValueError("times must increase")

    def __setstate__(self, state: dict[str, object]) -> None:
        """Freeze the arrays of a copy, too."""
        self.__dict__.update(state)
        self.time.flags.writeable = self.value.flags.writeable = False

    @property
    def period(self) -> float:
        """Median time between two samples, s."""
        return float(np.median(np.diff(self.time)))


@dataclass(frozen=True, eq=False)
class StampedRecord:
    """Drive (Pa or N) and stem position (m), their times counted from one origin."""

    drive: StampedSignal
    position: StampedSignal
    driven_by: Drive = Drive.PRESSURE


_LARGEST = 1e12
"""Largest value of a sample, Pa, N or m.

Chosen: a million times beyond any sensor, and far below values whose squares overflow."""


@dataclass(frozen=True, eq=False)
class Recording:
    """Drive and stem position, sampled together at a constant period.

    Attributes
    ----------
    sample_period : float
        Time between two samples, s.
    drive : ndarray of float, shape (n,)
        Actuator pressure, Pa, or force, N. Kept as a read-only copy.
    position : ndarray of float, shape (n,)
        Stem position, m. Kept as a read-only copy.
    start_time : float
        Time of the first sample, s, on the clock of the stamps.
    stamped : StampedRecord, optional
        The samples at their own stamps, where those differ from the grid.
    driven_by : Drive
        Kind of `drive`.
    gap : str
        Message with which a method refuses a broken record; empty for an unbroken record. In a gap
        the samples are interpolated.

    Raises
    ------
    ValueError
        If the arrays differ in shape, are not one-dimensional, are empty, or hold a value
        that is not finite or above 1e12; the message names the array and the sample.

    Examples
    --------
    >>> import valve_friction_ros as vf
    >>> recording = vf.Recording(
    ...     sample_period=0.1, drive=[1e5, 1.1e5, 1.2e5], position=[0.0, 0.0, 1e-4]
    ... )
    >>> recording.duration
    0.2
    """

    sample_period: float
    drive: NDArray[np.float64] = field(repr=False)
    position: NDArray[np.float64] = field(repr=False)
    start_time: float = 0.0
    stamped: StampedRecord | None = field(default=None, repr=False)
    driven_by: Drive = Drive.PRESSURE
    gap: str = ""

    def __post_init__(self) -> None:
        """Refuse arrays that do not make a recording, and freeze them."""
        require_positive("sample_period", self.sample_period)
        require_finite("start_time", self.start_time)
        for name in ("drive", "position"):
            words = self.driven_by.words if name == "drive" else name
            values = require_row(words, getattr(self, name))
            largest = int(np.argmax(np.abs(values)))
            if abs(values[largest]) > _LARGEST:
                raise ValueError(
                    f"{words} is {values[largest]:.3g} at sample {largest}, beyond any sensor"
                )
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        if self.drive.shape != self.position.shape:
            raise ValueError(
                f"{self.driven_by.words} has {self.drive.size} samples, "
                f"position {self.position.size}"
            )

    def __setstate__(self, state: dict[str, object]) -> None:
        """Freeze the arrays of a copy, too."""
        self.__dict__.update(state)
        self.drive.flags.writeable = self.position.flags.writeable = False

    def __len__(self) -> int:
        """Count the samples."""
        return self.position.size

    @property
    def pressure(self) -> NDArray[np.float64]:
        """Actuator pressure, Pa, shape (n,); raises ValueError where a force drives the stem."""
        if self.driven_by is not Drive.PRESSURE:
            raise ValueError("the recording holds a force, not a pressure: use its drive, in N")
        return self.drive

    @property
    def duration(self) -> float:
        """Time from the first to the last sample, s."""
        return (len(self) - 1) * self.sample_period

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each sample since the first one, s, shape (n,)."""
        return np.arange(len(self), dtype=np.float64) * self.sample_period


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
