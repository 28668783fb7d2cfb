"""How the valve is driven: test signals through a converter, and moves in closed loop."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmark.reality.plants.kernel import GRID, Loop
from benchmark.reality.plants.parameters import PRESSURE_RANGE

__all__ = ["DEVELOPMENT", "HELD_OUT", "REACH", "Drive", "Excitation", "Kind", "drive"]

REACH = (-0.12, 1.1)
"""Commands that press the stem onto both stops."""


class Kind(Enum):
    """Shape of the signal."""

    SQUARE = "square"
    RANDOM = "random"
    TRIANGLE = "triangle"
    SERVICE = "service"
    HUNTING = "hunting"


@dataclass(frozen=True)
class Excitation:
    """A drive but for its seed and the amplitude.

    Attributes
    ----------
    kind : Kind
        Shape.
    duration, before : float
        Length of the record, and of the motion before it begins, s.
    period : float
        Of the square wave and the triangle; mean time between two levels or set points, s.
    low, high : float
        Levels of the command or the set point, share of the range.
    converter_lag : float
        First-order lag of the converter, s.
    gain, integral_time, action_period, process_lag : float
        Of the controller (1, s, s) and the flow that it controls (s).
    measurement_noise : float
        Standard deviation of what the controller measures, share of the range.
    """

    kind: Kind
    duration: float
    before: float
    period: float
    low: float
    high: float
    converter_lag: float
    gain: float = 0.0
    integral_time: float = 1.0
    action_period: float = 0.1
    process_lag: float = 1.0
    measurement_noise: float = 0.0


DEVELOPMENT: Mapping[Kind, Excitation] = MappingProxyType(
    {
        Kind.SQUARE: Excitation(Kind.SQUARE, 62.0, 12.0, 10.4, 0.15, 0.75, 1.3),
        Kind.RANDOM: Excitation(Kind.RANDOM, 62.0, 8.0, 4.0, 0.15, 0.85, 1.3),
        Kind.TRIANGLE: Excitation(Kind.TRIANGLE, 120.0, 15.0, 54.0, 0.15, 0.75, 1.3),
        Kind.SERVICE: Excitation(
            Kind.SERVICE, 120.0, 15.0, 8.0, 0.2, 0.8, 0.5, 0.8, 2.0, 0.1, 1.0, 2e-4
        ),
        Kind.HUNTING: Excitation(
            Kind.HUNTING, 120.0, 60.0, 60.0, 0.35, 0.65, 0.5, 2.2, 3.0, 0.25, 2.0, 2e-4
        ),
    }
)
"""Signals of the development set."""

HELD_OUT: Mapping[Kind, Excitation] = MappingProxyType(
    {
        Kind.SQUARE: Excitation(Kind.SQUARE, 62.0, 14.0, 12.6, 0.2, 0.8, 0.95),
        Kind.RANDOM: Excitation(Kind.RANDOM, 62.0, 8.0, 3.4, 0.2, 0.8, 0.8),
        Kind.TRIANGLE: Excitation(Kind.TRIANGLE, 120.0, 15.0, 38.0, 0.2, 0.8, 0.95),
        Kind.SERVICE: Excitation(
            Kind.SERVICE, 120.0, 15.0, 10.0, 0.25, 0.75, 0.7, 0.7, 1.5, 0.05, 1.0, 3e-4
        ),
        Kind.HUNTING: Excitation(
            Kind.HUNTING, 120.0, 60.0, 80.0, 0.4, 0.7, 0.4, 2.8, 4.0, 0.2, 2.5, 3e-4
        ),
    }
)
"""Signals that nothing was developed with."""


class Drive(NamedTuple):
    """What `plants.move` takes.

    Attributes
    ----------
    loop : Loop
        Converter and controller.
    signal : ndarray of float, shape (n,)
        Command or set point on the grid.
    disturbance : ndarray of float, shape (m,)
        Noise of what the controller measures.
    before : float
        Time between the first point and the begin of the record, s.
    """

    loop: Loop
    signal: NDArray[np.float64]
    disturbance: NDArray[np.float64]
    before: float


def _square(
    one: Excitation, time: NDArray[np.float64], random: np.random.Generator
) -> NDArray[np.float64]:
    phase = (time / one.period + random.random()) % 1.0
    return np.where(phase < 0.5, one.high, one.low)


def _triangle(
    one: Excitation, time: NDArray[np.float64], random: np.random.Generator
) -> NDArray[np.float64]:
    phase = (time / one.period + random.random()) % 1.0
    return one.low + (one.high - one.low) * (1.0 - np.abs(2.0 * phase - 1.0))


def _levels(
    one: Excitation,
    time: NDArray[np.float64],
    random: np.random.Generator,
    least: float,
    largest: float,
) -> NDArray[np.float64]:
    """Hold levels for 0.5 to 1.5 periods; two in a row differ by at least and at most so much."""
    width = one.high - one.low
    level = one.low + width * random.random()
    begins, levels = [float(time[0])], [level]
    while begins[-1] < time[-1]:
        begins.append(begins[-1] + one.period * random.uniform(0.5, 1.5))
        candidates = level + width * random.uniform(least, largest, 50) * random.choice([-1, 1], 50)
        level = float(next(x for x in candidates if one.low <= x <= one.high))
        levels.append(level)
    return np.array(levels)[np.searchsorted(begins, time, side="right") - 1]


def _signal(
    one: Excitation, time: NDArray[np.float64], random: np.random.Generator
) -> NDArray[np.float64]:
    if one.kind is Kind.SQUARE:
        return _square(one, time, random)
    if one.kind is Kind.TRIANGLE:
        return _triangle(one, time, random)
    if one.kind is Kind.RANDOM:
        return _levels(one, time, random, 0.15, 0.9)
    if one.kind is Kind.SERVICE:
        return _levels(one, time, random, 0.05, 0.3)
    return _levels(one, time, random, 0.1, 0.5)


def drive(one: Excitation, seed: int) -> Drive:
    """Return the drive of a seed, which chooses phase, levels and times."""
    random = np.random.default_rng([seed, 1])
    count = round((one.before + one.duration) / GRID) + 1
    time: NDArray[np.float64] = GRID * np.arange(count, dtype=np.float64) - one.before
    signal = _signal(one, time, random)
    every = round(one.action_period / GRID)
    bottom, top = PRESSURE_RANGE
    loop = Loop(
        closed=one.kind in (Kind.SERVICE, Kind.HUNTING),
        flow=one.kind is Kind.HUNTING,
        gain=one.gain,
        integral_time=one.integral_time,
        every=every,
        process_lag=one.process_lag,
        bottom=bottom,
        span=top - bottom,
        converter_lag=one.converter_lag,
    )
    noise = one.measurement_noise * random.standard_normal(count // every + 1)
    return Drive(loop, signal, noise, one.before)
