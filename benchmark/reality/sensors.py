# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sensors, their messages and their time stamps."""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from benchmark.reality.plants.kernel import GRID, Motion


@dataclass(frozen=True)
class Stamping:
    """The clock of one signal.

    Attributes
    ----------
    rate : float
        Samples per second.
    jitter : float
        Largest shift of a sampling instant, share of the period; the stamp is correct.
    stamp_error : float
        Largest error of a stamp in either direction, s, independent per sample.
    offset : float
        Time by which the stamps are late, s.
    drops : float
        Share of lost messages, independent per message.
    bursts, burst : int and float
        Number and length (s) of pauses in which all messages are lost.
    resolution : float
        Resolution to which stamps are truncated, s; 0 for a nanosecond.
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
        Sampling times, s from the start of the record.
    written : ndarray of float, shape (n,)
        Readings of the clock at these times, s.
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
    """Return the stamps, ns, for the times of a clock, s."""
    stamps: NDArray[np.int64] = np.rint((written + stamping.offset) * 1e9).astype(np.int64)
    if stamping.resolution > 0.0:
        unit = round(stamping.resolution * 1e9)
        stamps -= stamps % unit
    return stamps


class Signal(NamedTuple):
    """A topic, or a column with its times.

    Attributes
    ----------
    stamps : ndarray of int64, shape (n,)
        Written times, ns, non-decreasing.
    values : ndarray of float, shape (n,)
        Pa or m.
    """

    stamps: NDArray[np.int64]
    values: NDArray[np.float64]


@dataclass(frozen=True)
class Sensor:
    """The sensor of one quantity.

    Attributes
    ----------
    noise : float
        Standard deviation, SI unit.
    colour : float
        Correlation time of the noise, s; 0 for white noise.
    low, high : float
        Range, SI unit, for the converter and the dead band.
    bits : int
        Resolution of the converter; 0 for exact values.
    lag : float
        First-order lag, s.
    drift : float
        Drift of the zero, SI unit/s.
    hold : float
        Time for which a value is repeated, s; 0 for a new value in each sample.
    dead_band : float
        Change of the value that triggers a message, share of the range; 0 to send all.
    silence : float
        Longest time without a message under a dead band, s.
    """

    noise: float
    low: float
    high: float
    colour: float = 0.0
    bits: int = 0
    lag: float = 0.0
    drift: float = 0.0
    hold: float = 0.0
    dead_band: float = 0.0
    silence: float = 10.0


@dataclass(frozen=True)
class Instruments:
    """Both sensors and their clocks.

    Attributes
    ----------
    pressure, position : Sensor
        The sensors.
    pressure_stamping, position_stamping : Stamping
        Their clocks.
    together : bool
        Whether both are sampled at the same instants and lost together, like rows of a table.
    """

    pressure: Sensor = field(default_factory=lambda: Sensor(100.0, 0.0, 250e3))
    position: Sensor = field(default_factory=lambda: Sensor(10e-6, 0.0, 0.030))
    pressure_stamping: Stamping = field(default_factory=Stamping)
    position_stamping: Stamping = field(default_factory=Stamping)
    together: bool = True


def measured(
    motion: Motion, instruments: Instruments, duration: float, seed: int
) -> tuple[Signal, Signal]:
    """Measure a motion.

    Parameters
    ----------
    motion : Motion
        The true signals.
    instruments : Instruments
        Sensors and clocks.
    duration : float
        Length of the record, s.
    seed : int
        Seed of the noise and of all effects on the messages.

    Returns
    -------
    tuple of Signal
        Pressure and position.
    """
    streams = np.random.SeedSequence([seed, 2]).spawn(4)
    first, second, third, fourth = (np.random.default_rng(stream) for stream in streams)
    pressure_times = sampling_times(instruments.pressure_stamping, duration, first)
    position_times = pressure_times
    if not instruments.together:
        position_times = sampling_times(instruments.position_stamping, duration, second)
    pressure = _values(motion, motion.pressure, instruments.pressure, pressure_times, third)
    position = _values(motion, motion.position, instruments.position, position_times, fourth)
    return (
        _signal(instruments.pressure_stamping, pressure_times, *pressure),
        _signal(instruments.position_stamping, position_times, *position),
    )


def _signal(
    stamping: Stamping, times: Times, values: NDArray[np.float64], sent: NDArray[np.bool_]
) -> Signal:
    arrived = sent & ~times.lost
    return Signal(stamped(stamping, times.written[arrived]), values[arrived])


def _lagged(values: NDArray[np.float64], lag: float) -> NDArray[np.float64]:
    """Return the response of a first-order lag to a signal that is linear between points."""
    decay = np.exp(-GRID / lag)
    memory = (1.0 - decay) * lag / GRID
    ahead, behind = 1.0 - memory, memory - decay
    start = [values[0] * (1.0 - ahead)]
    response: NDArray[np.float64] = lfilter([ahead, behind], [1.0, -decay], values, zi=start)[0]
    return response


def _noise(sensor: Sensor, times: Times, random: np.random.Generator) -> NDArray[np.float64]:
    white = random.standard_normal(times.taken.size)
    if sensor.colour == 0.0 or times.taken.size < 2:
        return sensor.noise * white
    decay = float(np.exp(-times.period / sensor.colour))
    white[1:] *= math.sqrt(1.0 - decay**2)
    coloured = np.asarray(lfilter([1.0], [1.0, -decay], white), dtype=np.float64)
    return sensor.noise * coloured


def _values(
    motion: Motion,
    exact: NDArray[np.float64],
    sensor: Sensor,
    times: Times,
    random: np.random.Generator,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the values of the samples, and whether each is sent."""
    seen = _lagged(exact, sensor.lag) if sensor.lag > 0.0 else exact
    values: NDArray[np.float64] = np.interp(times.taken, motion.time, seen)
    values = values + sensor.drift * times.taken + _noise(sensor, times, random)
    if sensor.bits:
        unit = (sensor.high - sensor.low) / 2**sensor.bits
        values = sensor.low + unit * np.round((values - sensor.low) / unit)
    if sensor.hold > 0.0:
        phase = sensor.hold * random.random()
        renewed = phase + sensor.hold * np.floor((times.taken - phase) / sensor.hold)
        values = values[np.searchsorted(times.taken, renewed - 1e-9)]
    sent: NDArray[np.bool_] = np.ones(values.size, dtype=np.bool_)
    if sensor.dead_band > 0.0:
        band = sensor.dead_band * (sensor.high - sensor.low)
        sent = _sent_by_exception(values, times.taken, band, sensor.silence)
    return values, sent


def _sent_by_exception(
    values: NDArray[np.float64], times: NDArray[np.float64], band: float, silence: float
) -> NDArray[np.bool_]:
    """Return which values differ from the last value sent, or follow a long silence."""
    sent: NDArray[np.bool_] = np.zeros(values.size, dtype=np.bool_)
    value, moment = np.inf, -np.inf
    for sample, (now, time) in enumerate(zip(values.tolist(), times.tolist(), strict=True)):
        if abs(now - value) > band or time - moment >= silence:
            sent[sample] = True
            value, moment = now, time
    return sent
