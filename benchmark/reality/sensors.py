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

from benchmark.reality.plants import GRID, Motion


@dataclass(frozen=True)
class Stamping:
    """The clock of one signal."""

    rate: float = 1000.0  # samples per second
    # largest shift of a sampling instant, share of the period; the stamp is correct
    jitter: float = 0.0
    # largest error of a stamp in either direction, s, independent per sample
    stamp_error: float = 0.0
    offset: float = 0.0  # time by which the stamps are late, s
    drops: float = 0.0  # share of lost messages, independent per message
    # number and length (s) of pauses in which all messages are lost
    bursts: int = 0
    burst: float = 0.0
    resolution: float = 0.0  # resolution to which stamps are truncated, s; 0 for a nanosecond


class Times(NamedTuple):
    """Instants of a signal."""

    period: float  # nominal time between two samples, s
    taken: NDArray[np.float64]  # sampling times, s from the start of the record; shape (n,)
    written: NDArray[np.float64]  # readings of the clock at these times, s; shape (n,)
    lost: NDArray[np.bool_]  # whether the message is lost; shape (n,)


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
    """A topic, or a column with its times."""

    stamps: NDArray[np.int64]  # written times, ns, non-decreasing; shape (n,)
    values: NDArray[np.float64]  # pa or m; shape (n,)


@dataclass(frozen=True)
class Sensor:
    """The sensor of one quantity."""

    noise: float  # standard deviation, SI unit
    # range, SI unit, for the converter and the dead band
    low: float
    high: float
    colour: float = 0.0  # correlation time of the noise, s; 0 for white noise
    bits: int = 0  # resolution of the converter; 0 for exact values
    lag: float = 0.0  # first-order lag, s
    drift: float = 0.0  # drift of the zero, SI unit/s
    hold: float = 0.0  # time for which a value is repeated, s; 0 for a new value in each sample
    # change of the value that triggers a message, share of the range; 0 to send all
    dead_band: float = 0.0
    silence: float = 10.0  # longest time without a message under a dead band, s


@dataclass(frozen=True)
class Instruments:
    """Both sensors and their clocks."""

    # the sensors
    pressure: Sensor = field(default_factory=lambda: Sensor(100.0, 0.0, 250e3))
    position: Sensor = field(default_factory=lambda: Sensor(10e-6, 0.0, 0.030))
    # their clocks
    pressure_stamping: Stamping = field(default_factory=Stamping)
    position_stamping: Stamping = field(default_factory=Stamping)
    # whether both are sampled at the same instants and lost together, like rows of a table
    together: bool = True


def measured(
    motion: Motion, instruments: Instruments, duration: float, seed: int
) -> tuple[Signal, Signal]:
    """Measure `duration` seconds of a motion; return pressure and position.

    `seed` is that of the noise and of all effects on the messages.
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
    return lfilter([ahead, behind], [1.0, -decay], values, zi=start)[0]


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
