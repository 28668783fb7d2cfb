# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Drives of a valve: test signals, moves in closed loop, and hunting loops."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from benchmark.reality.plants import GRID, Loop, open_loop
from benchmark.reality.valves import DrawnValve, log_uniform


class Kind(Enum):
    """Motion of the valve in a record."""

    SQUARE = "square"
    RAMP = "ramp"
    LEVELS = "levels"
    MULTISINE = "multisine"
    LOOP = "loop"
    HUNTING = "hunting"
    STEPS = "steps"
    FROM_STOP = "from_stop"
    FROM_MIDDLE = "from_middle"
    CYLINDER = "cylinder"


@dataclass(frozen=True, eq=False)
class Drive:
    """Arguments of `plants.move`."""

    loop: Loop  # converter and controller
    signal: NDArray[np.float64]  # command or set point on the grid; shape (n,)
    disturbance: NDArray[np.float64]  # measurement noise of the controller; shape (m,)
    # time from the first point to the start of the record, and length of the record, s
    before: float
    duration: float


_Signal = NDArray[np.float64]
_Random = np.random.Generator

_CONTROLLED = 2e-4
"""Measurement noise of a controller, share of the travel."""


def _time(before: float, duration: float) -> _Signal:
    count = round((before + duration) / GRID) + 1
    return GRID * np.arange(count, dtype=np.float64) - before


def _open(valve: DrawnValve, signal: _Signal, before: float, duration: float) -> Drive:
    loop = open_loop(valve.low, valve.high - valve.low, valve.filling)
    return Drive(loop, signal, np.zeros(signal.size // loop.every + 1), before, duration)


def _closed(
    valve: DrawnValve,
    random: _Random,
    signal: _Signal,
    before: float,
    duration: float,
    gain: float,
    integral_time: float,
    process_lag: float = 0.0,
    filling: float = 0.0,
    period: float = 0.0,
) -> Drive:
    """Control the position or, with a `process_lag`, s, the flow that follows it."""
    every = round((period or float(random.choice([0.02, 0.05, 0.1]))) / GRID)
    loop = Loop(
        closed=True,
        flow=process_lag > 0.0,
        gain=gain,
        integral_time=integral_time,
        every=every,
        process_lag=process_lag or 1.0,
        bottom=valve.low,
        span=valve.high - valve.low,
        converter_lag=filling or valve.filling,
    )
    noise = _CONTROLLED * random.standard_normal(signal.size // every + 1)
    return Drive(loop, signal, noise, before, duration)


def _held(time: _Signal, moments: list[float], values: list[float]) -> _Signal:
    """Return steps: each value holds from its moment."""
    return np.array(values)[np.searchsorted(moments, time, side="right") - 1]


def _square(valve: DrawnValve, random: _Random) -> Drive:
    half = max(log_uniform(random, 3.0, 8.0) * valve.settling, 2.0)
    low, high = random.uniform(0.12, 0.35), random.uniform(0.65, 0.88)
    duration = min(6.0 * half, 150.0)
    time = _time(1.5 * half, duration)
    phase = (time / (duration / 3.0) + random.random()) % 1.0
    return _open(valve, np.where(phase < 0.5, high, low), 1.5 * half, duration)


def _ramp(valve: DrawnValve, random: _Random) -> Drive:
    duration = log_uniform(random, 30.0, 120.0)
    low, high = random.uniform(0.12, 0.25), random.uniform(0.75, 0.88)
    rest = 0.05 * duration
    moments = [0.0, rest, 0.5 * duration, 0.5 * duration + rest, duration - rest]
    time = _time(5.0, duration)
    return _open(valve, np.interp(time, moments, [low, low, high, high, low]), 5.0, duration)


def _levels(valve: DrawnValve, random: _Random) -> Drive:
    hold = max(log_uniform(random, 2.0, 5.0) * valve.settling, 1.0)
    duration = float(np.clip(15.0 * hold, 40.0, 100.0))
    before = 3.0 * hold
    moments, values = _random_levels(random, -before, duration, hold, (0.12, 0.88), (0.15, 0.9))
    time = _time(before, duration)
    return _open(valve, _held(time, moments, values), before, duration)


def _random_levels(
    random: _Random,
    begin: float,
    end: float,
    hold: float,
    among: tuple[float, float],
    steps: tuple[float, float],
) -> tuple[list[float], list[float]]:
    """Hold levels for 0.5 to 1.5 `hold`; successive levels differ by `steps`, shares of a range."""
    low, high = among
    moments, values = [begin], [float(random.uniform(low, high))]
    while moments[-1] < end:
        moments.append(moments[-1] + hold * float(random.uniform(0.5, 1.5)))
        change = (high - low) * random.uniform(*steps, 50) * random.choice([-1.0, 1.0], 50)
        values.append(float(next(x for x in values[-1] + change if low <= x <= high)))
    return moments, values


def _multisine(valve: DrawnValve, random: _Random) -> Drive:
    duration = log_uniform(random, 40.0, 100.0)
    highest = float(np.clip(log_uniform(random, 0.05, 0.2) / valve.settling, 4 / duration, 1.0))
    count = int(random.integers(4, 9))
    harmonics = np.unique(np.geomspace(1.0, highest * duration, count).round())
    before = 10.0
    time = _time(before, duration)
    phases = random.uniform(0.0, 2.0 * np.pi, harmonics.size)
    sizes = harmonics ** -random.uniform(0.0, 0.7)
    wave = np.zeros_like(time)
    for harmonic, phase, size in zip(harmonics, phases, sizes, strict=True):
        wave += size * np.sin(2.0 * np.pi * harmonic * time / duration + phase)
    wave *= random.uniform(0.3, 0.38) / np.abs(wave).max()
    return _open(valve, 0.5 + wave, before, duration)


def _integral_time(valve: DrawnValve, random: _Random) -> float:
    return max(log_uniform(random, 1.0, 3.0) * valve.settling, 0.4)


def _loop(valve: DrawnValve, random: _Random) -> Drive:
    """Move by 1 to 5 % of the travel, like a loop in service."""
    hold = max(log_uniform(random, 3.0, 8.0) * valve.settling, 3.0)
    duration, before = float(np.clip(15.0 * hold, 60.0, 120.0)), 15.0
    place = random.uniform(0.3, 0.7)
    band = (place - 0.06, place + 0.06)
    moments, values = _random_levels(random, -before, duration, hold, band, (0.08, 0.42))
    time = _time(before, duration)
    gain, integral = log_uniform(random, 0.7, 4.0), _integral_time(valve, random)
    signal = _held(time, moments, values)
    return _closed(valve, random, signal, before, duration, gain, integral)


def _hunting(valve: DrawnValve, random: _Random) -> Drive:
    """Let a flow controller hunt around a nearly constant set point."""
    friction = valve.plant.friction
    lag = log_uniform(random, 0.5, 2.0)
    filling = min(valve.filling, lag)
    # Without slip the loop would be stable.
    slowest = lag + valve.settling - valve.filling + filling
    gain, integral = random.uniform(0.6, 1.6), slowest * log_uniform(random, 0.8, 1.6)
    # The integral passes through twice F_c while the error is about F_s − F_c.
    half = integral * 2.0 * friction.coulomb / (friction.static - friction.coulomb) / gain
    duration, before = (
        float(np.clip(20.0 * half, 90.0, 240.0)),
        float(np.clip(5.0 * half, 20.0, 60.0)),
    )
    time = _time(before, duration)
    place = random.uniform(0.35, 0.6)
    moved = place + random.uniform(-0.1, 0.1)
    moment = random.uniform(0.2, 1.5) * duration
    signal = _held(time, [-before, moment], [place, moved])
    return _closed(valve, random, signal, before, duration, gain, integral, lag, filling)


def _steps(valve: DrawnValve, random: _Random) -> Drive:
    """Step by 1, 2, 5 and 10 % up and down, as in ISA-75.25."""
    place = float(random.uniform(0.35, 0.55))
    hold = float(np.clip(log_uniform(random, 3.0, 8.0) * valve.settling, 2.0, 12.0))
    values = [place]
    for size in (0.01, 0.02, 0.05, 0.1):
        values += [place + size, place, place - size, place]
    before, duration = 10.0, len(values) * hold
    moments = [-before, *(hold * number for number in range(1, len(values)))]
    time = _time(before, duration)
    gain, integral = log_uniform(random, 2.0, 10.0), _integral_time(valve, random)
    signal = _held(time, moments, values)
    return _closed(valve, random, signal, before, duration, gain, integral)


def _command(valve: DrawnValve, place: float, way: float) -> float:
    """Return the command at which a stem slides slowly past a place, up (1) or down (−1)."""
    body, friction = valve.plant.body, valve.plant.friction
    force = body.preload + body.spring * body.travel * place + way * friction.coulomb
    pressure = body.pressure_reference + force / body.area
    return (pressure - valve.low) / (valve.high - valve.low)


def _partial(valve: DrawnValve, random: _Random, start: float, away: float, back: float) -> Drive:
    """Ramp once from a command to another and back, with rests before and after."""
    moving = max(log_uniform(random, 3.0, 15.0), 2.0 * valve.settling)
    rests = [log_uniform(random, 2.0, 15.0) for _ in range(3)]
    moments = [0.0, rests[0], rests[0] + moving, rests[0] + moving + 0.3 * rests[1]]
    moments.append(moments[-1] + moving)
    duration = moments[-1] + rests[2] + 3.0 * valve.settling
    before = 5.0 + 5.0 * valve.settling
    time = _time(before, duration)
    signal = np.interp(time, moments, [start, start, away, away, back])
    return _open(valve, signal, before, duration)


def _from_stop(valve: DrawnValve, random: _Random) -> Drive:
    upper = random.random() < 0.7
    place, way = (1.0, -1.0) if upper else (0.0, 1.0)
    pressed = _command(valve, place, -way) - way * random.uniform(0.0, 0.1)
    away = _command(valve, place + 0.1 * way, way)
    return _partial(valve, random, pressed, away, pressed)


def _from_middle(valve: DrawnValve, random: _Random) -> Drive:
    place, way = random.uniform(0.35, 0.65), float(random.choice([-1.0, 1.0]))
    start = _command(valve, place, 0.0)
    away = _command(valve, place + 0.1 * way, way)
    return _partial(valve, random, start, away, _command(valve, place, -way))


_FAST = 0.002
"""Period of the controller that represents a machine, s."""


def _cylinder(valve: DrawnValve, random: _Random) -> Drive:
    """Move a cylinder to and fro with a controller that follows its set point closely."""
    body, friction = valve.plant.body, valve.plant.friction
    # Pressure and controller lag; Routh's criterion with mass and damping.
    late = valve.filling + _FAST
    stiffest = 0.2 * friction.viscous * (1.0 / late + friction.viscous / body.mass)
    stiffest = min(stiffest, 0.2 * friction.viscous / _FAST)
    gain = stiffest * body.travel / (body.area * (valve.high - valve.low))
    period = log_uniform(random, 4.0, 20.0)
    duration, before = float(np.clip(4.0 * period, 40.0, 80.0)), 10.0
    time = _time(before, duration)
    swing = 0.5 * random.uniform(0.3, 0.7)
    phase = time / period + random.random()
    wave = np.sin(2.0 * np.pi * phase)
    if random.random() < 0.5:
        wave = 4.0 * np.abs(phase % 1.0 - 0.5) - 1.0
    # At zero error the command gives zero force.
    wave[0] = 0.0
    signal = 0.5 + swing * wave
    return _closed(valve, random, signal, before, duration, gain, 1e9, period=_FAST)


_DRIVES = {
    Kind.SQUARE: _square,
    Kind.RAMP: _ramp,
    Kind.LEVELS: _levels,
    Kind.MULTISINE: _multisine,
    Kind.LOOP: _loop,
    Kind.HUNTING: _hunting,
    Kind.STEPS: _steps,
    Kind.FROM_STOP: _from_stop,
    Kind.FROM_MIDDLE: _from_middle,
    Kind.CYLINDER: _cylinder,
}


def drawn_drive(kind: Kind, valve: DrawnValve, random: np.random.Generator) -> Drive:
    """Draw a drive of this kind for a valve."""
    return _DRIVES[kind](valve, random)
