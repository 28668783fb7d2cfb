# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A valve with a pneumatic positioner, simulated in fine steps without code of the package.

The stem has the set-valued friction of `benchmark.reality` and compresses the air. The air flow is
limited. The positioner has a delay, a gain and optional integral action.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from benchmark.reality.plants import (
    INNER,
    Body,
    Constants,
    Friction,
    Plant,
    V,
    X,
    constants,
    moreau,
)

STEP = 1e-4
FAULTS = ("healthy", "sticky", "late", "slow", "setting")

_BODY = Body(mass=1.6, spring=2.05e5, preload=250.0)
_SPAN = _BODY.spring * _BODY.travel / _BODY.area
"""Pressure change over the whole travel, Pa."""


class Positioner(NamedTuple):
    """A proportional (pressure per error) or integrating (flow per error) positioner."""

    # pressure change, in spans, per error, in travels; per second for an integrating positioner
    gain: float
    # integral rate per error of a proportional positioner, 1/s; 0 for no integral action
    integral: float
    rate: float  # largest rate of the pressure, spans per second
    # lag of the amplifier, s; delay, s; calibration error, share of the travel
    lag: float
    delay: float
    offset: float
    integrates: bool  # whether flow, not pressure, is proportional to the error
    dead_zone: float  # error, share of the travel, without effect


@dataclass(frozen=True)
class Case:
    """A fault with its valve, its positioner, and the noise of their sensors."""

    fault: str
    friction: Friction
    positioner: Positioner
    position_noise: float
    pressure_noise: float
    sample_period: float
    jitter: float


class Record(NamedTuple):
    """Command and position, shares of the travel, and pressure, Pa, each with stamps, s."""

    command_stamps: NDArray[np.float64]
    command: NDArray[np.float64]
    stamps: NDArray[np.float64]
    position: NDArray[np.float64]
    pressure_stamps: NDArray[np.float64]
    pressure: NDArray[np.float64]


def case_of(fault: str, seed: int) -> Case:
    """Draw a valve with one fault."""
    rng = np.random.default_rng([FAULTS.index(fault), seed])
    band = rng.uniform(0.04, 0.1) if fault == "sticky" else rng.uniform(0.002, 0.008)
    coulomb = band * _BODY.spring * _BODY.travel / 2
    friction = Friction(coulomb, coulomb * rng.uniform(1.0, 1.4), rng.uniform(2e3, 1e4), 1e-3)
    integrates = bool(rng.random() < 0.5)
    gain = rng.uniform(1.0, 4.0) if integrates else rng.uniform(8.0, 25.0)
    integral = 0.0 if integrates else rng.uniform(0.5, 3.0)
    rate = rng.uniform(0.3, 1.0)
    delay = rng.uniform(0.02, 0.1)
    offset = 0.0
    dead_zone = rng.choice([0.0, rng.uniform(0.001, 0.005)])
    if fault == "late":
        delay = rng.uniform(0.8, 3.0)
        gain = rng.uniform(0.15, 0.35) / delay if integrates else 0.0
        integral = rng.uniform(0.15, 0.35) / delay
    elif fault == "slow":
        rate = rng.uniform(0.008, 0.03)
    elif fault == "setting":
        offset = rng.uniform(0.02, 0.05) * rng.choice([-1.0, 1.0])
    positioner = Positioner(
        gain, integral, rate, rng.uniform(0.05, 0.3), delay, offset, integrates, dead_zone
    )
    return Case(
        fault,
        friction,
        positioner,
        rng.uniform(0.5e-4, 3e-4),
        rng.uniform(30.0, 300.0),
        1.0 / rng.choice([20.0, 50.0, 100.0]),
        rng.uniform(0.0, 0.2),
    )


@numba.njit
def _run(
    c: Constants,
    p: Positioner,
    command: NDArray[np.float64],
    each: int,
    span: float,
    outputs: NDArray[np.float64],
) -> None:
    """Fill the rows of `outputs`, position (share) and pressure, every `each` steps."""
    state = np.zeros(INNER + 6)
    state[X] = command[0] * c.travel
    balance = c.pressure_reference + (c.preload + c.spring * state[X]) / c.area
    pressure, sent, integral = balance, balance, 0.0
    delay = round(p.delay / STEP)
    waiting = np.full(delay + 1, balance if not p.integrates else 0.0)
    for step in range(command.size * each):
        wanted = command[step // each] + p.offset
        error = wanted - state[X] / c.travel
        error = np.sign(error) * max(abs(error) - p.dead_zone, 0.0)
        place = step % (delay + 1)
        due = waiting[place]
        if p.integrates:
            waiting[place] = p.gain * error
            rate = due
        else:
            integral += STEP * p.integral * error
            follow = c.pressure_reference + (c.preload + c.spring * wanted * c.travel) / c.area
            waiting[place] = follow + span * (p.gain * error + integral)
            rate = (due - pressure) / (span * p.lag)
        sent += STEP / p.lag * (rate - sent) if p.integrates else rate - sent
        limited = min(max(sent, -p.rate), p.rate)
        squeezed = -0.3 * state[V] / c.travel  # the moving stem expands or compresses the air
        pressure += STEP * span * (limited + squeezed)
        pressure = min(max(pressure, 0.5 * c.pressure_reference), 2.5 * span)
        pull = c.area * (pressure - c.pressure_reference) - c.preload - c.spring * state[X]
        moreau(c, state, pull, 1.0, STEP)
        after = state[X] + STEP * state[V]
        if after < 0.0 or after > c.travel:
            after = min(max(after, 0.0), c.travel)
            state[V] = 0.0
        state[X] = after
        if (step + 1) % each == 0:
            outputs[0, step // each] = state[X] / c.travel
            outputs[1, step // each] = pressure


def steps(rng: np.random.Generator, count: int, largest: float) -> list[tuple[float, float]]:
    """Draw a schedule of hold times, s, and commands."""
    level, schedule = 0.5, [(8.0, 0.5)]
    for _ in range(count):
        size = rng.uniform(0.005, largest) * rng.choice([-1.0, 1.0])
        if not 0.15 < level + size < 0.85:
            size = -size
        level += size
        schedule.append((float(rng.uniform(12.0, 35.0)), level))
    return schedule


def simulated(case: Case, seed: int, schedule: list[tuple[float, float]]) -> Record:
    """Simulate a case, and sample each signal with noise and its own stamps."""
    rng = np.random.default_rng([seed, 7])
    each = 10
    dense = np.concatenate([np.full(round(s / STEP / each), u) for s, u in schedule])
    outputs = np.empty((2, dense.size))
    plant = Plant(_BODY, case.friction)
    c = constants(plant)
    start = case.positioner
    _run(c, start, dense, each, _SPAN, outputs)
    times = (np.arange(dense.size) + 1) * STEP * each

    def stamps(period: float) -> NDArray[np.float64]:
        ticks = np.arange(period, times[-1] - period, period)
        return ticks + case.jitter * period * rng.uniform(-0.5, 0.5, ticks.size)

    at, air, told = stamps(case.sample_period), stamps(case.sample_period), stamps(0.1)
    position = np.interp(at, times, outputs[0])
    pressure = np.interp(air, times, outputs[1])
    return Record(
        told,
        dense[np.searchsorted(times, told).clip(0, dense.size - 1)],
        at,
        position + case.position_noise * rng.standard_normal(at.size),
        air,
        pressure + case.pressure_noise * rng.standard_normal(air.size),
    )
