# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The paper's bench valve with its three packings, and the pressure excitations of its programme.

Sources: section 4 and Table 1 ("model 1") for the valve and its Teflon packing, lightly and
strongly tightened; the bias of 1.13 mm follows (16). The graphite set shows a slip jump.

The excitations are those before the lag of the V/P converter. An excitation is a frozen
description; `sample` evaluates it at any times, so that a node can publish it block by block and a
script in one call. Levels are pressures in Pa.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from valve_friction_ros.model.checks import require_finite, require_positive
from valve_friction_ros.model.valve import KarnoppParameters, Valve

PRESSURE_RANGE = (41740.0, 206840.0)
"""Input range of the bench, Pa: 0 % and 100 % of the paper's excitations."""

BENCH_VALVE = Valve(
    diaphragm_area=0.0445,
    pressure_reference=PRESSURE_RANGE[0],
    travel=0.028575,
    pressure_minimum=0.0,
    pressure_maximum=250000.0,
)
"""Fisher ET globe valve; force is measured from the bottom of the pressure range."""

_POSITION_BIAS = 1.13e-3
"""x̄, m: the mean of (16)."""

_SPRING_CONSTANT = 2.05e5
"""k of Table 1, model 1, N/m."""

LOW_FRICTION = KarnoppParameters(
    mass=1.542,
    viscous_friction=4865.0,
    coulomb_friction=152.7,
    static_friction=152.7,
    spring_constant=_SPRING_CONSTANT,
    spring_preload=_SPRING_CONSTANT * _POSITION_BIAS,
)
"""Packing lightly tightened: Table 1, model 1."""

HIGH_FRICTION = KarnoppParameters(
    mass=1.75,
    viscous_friction=4.48e4,
    coulomb_friction=606.0,
    static_friction=606.0,
    spring_constant=_SPRING_CONSTANT,
    spring_preload=_SPRING_CONSTANT * _POSITION_BIAS,
)
"""Packing strongly tightened: Table 1, model 1."""

GRAPHITE_VALVE = replace(BENCH_VALVE, pressure_reference=0.0)
"""The same body with a gauge pressure sensor, for the graphite packing."""

GRAPHITE_PACKING = KarnoppParameters(
    mass=1.6,
    viscous_friction=7.05e4,
    coulomb_friction=665.4,
    static_friction=942.4,
    spring_constant=2.069e5,
    spring_preload=2571.0,
)
"""Graphite packing: static above Coulomb friction, so the stem jumps as it breaks away."""

ISA_STEP_SIZES = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
"""Steps of the ISA test (section 5) as shares of the input range."""


def pressure_at(share: float) -> float:
    """Pressure in Pa at `share` (0 to 1) of the input range of the bench."""
    lowest, highest = PRESSURE_RANGE
    return lowest + share * (highest - lowest)


class Excitation(ABC):
    """A pressure signal that is defined at every time."""

    @abstractmethod
    def sample(self, time: ArrayLike) -> NDArray[np.float64]:
        """Pressure in Pa at each `time` (s since the start), in the shape of `time`."""


@dataclass(frozen=True)
class _Wave(Excitation):
    """A periodic signal between two pressures, beginning at the lower one."""

    low: float
    high: float
    period: float

    def __post_init__(self) -> None:
        """Refuse a wave without height or length."""
        require_positive("period", self.period)
        if not require_finite("low", self.low) < require_finite("high", self.high):
            raise ValueError(f"low ({self.low:g}) must be below high ({self.high:g})")

    def sample(self, time: ArrayLike) -> NDArray[np.float64]:
        """Pressure in Pa at each `time` (s since the start), in the shape of `time`."""
        phase = np.mod(np.asarray(time, dtype=np.float64) / self.period, 1.0)
        return self.low + (self.high - self.low) * self._shape(phase)

    @abstractmethod
    def _shape(self, phase: NDArray[np.float64]) -> NDArray[np.float64]:
        """Height, 0 to 1, at each phase, 0 to 1 of the period."""


@dataclass(frozen=True)
class SquareWave(_Wave):
    """Half a period low, half a period high; the paper's identification signal by default."""

    low: float = pressure_at(0.15)
    high: float = pressure_at(0.75)
    period: float = 10.4

    def _shape(self, phase: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(phase < 0.5, 0.0, 1.0)


@dataclass(frozen=True)
class TriangleWave(_Wave):
    """Up and down at a constant rate; gives the valve signature.

    The paper names no period; the default of 60 s keeps the stem slow, as a signature test does.
    """

    low: float = pressure_at(0.0)
    high: float = pressure_at(1.0)
    period: float = 60.0

    def _shape(self, phase: NDArray[np.float64]) -> NDArray[np.float64]:
        return 1.0 - np.abs(1.0 - 2.0 * phase)


@dataclass(frozen=True)
class SineWave(_Wave):
    """A sine that begins at its lowest point; the paper's validation signal by default."""

    low: float = 63950.0
    high: float = 160440.0
    period: float = 35.5

    def _shape(self, phase: NDArray[np.float64]) -> NDArray[np.float64]:
        return 0.5 - 0.5 * np.cos(2.0 * np.pi * phase)


@dataclass(frozen=True)
class IsaSteps(Excitation):
    """Steps of growing size around a middle pressure, up, back, down and back.

    Attributes
    ----------
    centre : float
        Pressure before each group of steps, Pa.
    span : float
        Input range to which the step sizes refer, Pa.
    sizes : tuple of float
        Step sizes as shares of `span`. A step of 50 % around mid-range spans the whole range.
    hold : float
        Time at each level, s.
    """

    centre: float = pressure_at(0.5)
    span: float = PRESSURE_RANGE[1] - PRESSURE_RANGE[0]
    sizes: tuple[float, ...] = ISA_STEP_SIZES
    hold: float = 10.0

    def __post_init__(self) -> None:
        """Refuse an empty sequence."""
        require_finite("centre", self.centre)
        require_positive("span", self.span)
        require_positive("hold", self.hold)
        if not self.sizes:
            raise ValueError("sizes must hold at least one step")
        for size in self.sizes:
            require_positive("step size", size)

    @property
    def levels(self) -> NDArray[np.float64]:
        """Pressure of each hold in turn, Pa, shape (1 + 4·steps,)."""
        offsets = [0.0]
        for size in self.sizes:
            offsets += [size, 0.0, -size, 0.0]
        return self.centre + self.span * np.array(offsets)

    @property
    def duration(self) -> float:
        """Time of the whole sequence, s; the last level is held beyond it."""
        return self.levels.size * self.hold

    def sample(self, time: ArrayLike) -> NDArray[np.float64]:
        """Pressure in Pa at each `time` (s since the start), in the shape of `time`."""
        levels = self.levels
        index = np.floor(np.asarray(time, dtype=np.float64) / self.hold).astype(np.intp)
        return np.asarray(np.take(levels, index, mode="clip"), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class SampledPressure(Excitation):
    """Sampled pressure: linear between the samples, constant after the last.

    Attributes
    ----------
    times : ndarray of float, shape (n,)
        Times of the samples, s, increasing.
    pressures : ndarray of float, shape (n,)
        Pressure at those times, Pa.
    """

    times: NDArray[np.float64] = field(repr=False)
    pressures: NDArray[np.float64] = field(repr=False)

    def __post_init__(self) -> None:
        """Refuse samples that do not make a signal, and freeze the arrays."""
        for name in ("times", "pressures"):
            values = np.array(getattr(self, name), dtype=np.float64)
            if values.ndim != 1 or values.size == 0 or not np.isfinite(values).all():
                raise ValueError(f"{name} must be a non-empty row of finite numbers")
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        if self.times.shape != self.pressures.shape:
            raise ValueError(f"{self.times.size} times for {self.pressures.size} pressures")
        if not (np.diff(self.times) > 0).all():
            raise ValueError("times must increase")

    def sample(self, time: ArrayLike) -> NDArray[np.float64]:
        """Pressure in Pa at each `time` (s since the first sample), in the shape of `time`."""
        since_start = np.asarray(time, dtype=np.float64) + self.times[0]
        pressure: NDArray[np.float64] = np.interp(since_start, self.times, self.pressures)
        return pressure
