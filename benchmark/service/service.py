# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Hours of service of a valve, in stretches of ten minutes."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmark.reality.plants.parameters import constants
from benchmark.service.kernel import SUMS, new_state, runner_of
from benchmark.service.plants import Duty, Senses, ServiceValve

STRETCH = 600.0
"""Length of a stretch, s."""

_ORIGIN = 1_700_000_000_000_000_000


class Stretch(NamedTuple):
    """Ten minutes of service.

    Attributes
    ----------
    stamps : tuple of ndarray of int64
        Times of pressure and position, ns.
    pressure, position : ndarray of float
        What the sensors say, Pa and m.
    work, distance : float
        ∫|F·dx| and ∫|dx| of the true motion, J and m.
    """

    stamps: tuple[NDArray[np.int64], NDArray[np.int64]]
    pressure: NDArray[np.float64]
    position: NDArray[np.float64]
    work: float
    distance: float


def _set_points(duty: Duty, last: float, count: int, random: np.random.Generator) -> list[float]:
    levels = []
    for _ in range(count):
        up = random.random() < 0.5
        if last + duty.step > duty.high + 1e-9:
            up = False
        elif last - duty.step < duty.low - 1e-9:
            up = True
        last += duty.step if up else -duty.step
        levels.append(last)
    return levels


def _measured(
    values: NDArray[np.float64],
    noise: float,
    step: float,
    random: np.random.Generator,
    hold: int = 1,
) -> NDArray[np.float64]:
    seen = values + noise * random.standard_normal(values.size)
    if step > 0.0:
        seen = step * np.round(seen / step)
    return np.repeat(seen[::hold], hold)[: seen.size]


def _stamps(
    first: float, count: int, senses: Senses, late: float, random: np.random.Generator
) -> NDArray[np.int64]:
    times = first + np.arange(1, count + 1) / senses.rate + late
    shift = senses.jitter / senses.rate * random.standard_normal(count)
    times = times + np.clip(shift, -0.3 / senses.rate, 0.3 / senses.rate)
    return _ORIGIN + np.round(times * 1e9).astype(np.int64)


def stretches(
    valve: ServiceValve,
    hours: float,
    seed: int,
    friction: Callable[[float], float],
    offset: Callable[[float], float],
    duty: Callable[[float], Duty],
    spacing: float = STRETCH,
) -> Iterator[Stretch]:
    """Serve for some hours, by a seed of set points and noise; yield ten minutes at a time.

    Parameters
    ----------
    friction : callable
        Friction at an hour, over that of the plant.
    offset : callable
        Force, N, by which the preload has moved at an hour.
    duty : callable
        Set points at an hour.
    spacing : float
        Time, s, from the begin of one stretch to that of the next; between them the valve is shut
        off, as it stands.
    """
    random = np.random.default_rng([seed, 7])
    loop, senses, plant = valve.loop, valve.senses, valve.plant
    run = runner_of(plant.friction.law)
    level = 0.5 * (valve.duty.low + valve.duty.high) - 0.5 * valve.duty.step
    state = new_state(loop, level, plant.body.travel)
    count, actions = round(STRETCH * senses.rate), round(STRETCH / loop.action_period)
    for stretch in range(round(hours * 3600.0 / spacing)):
        begin = stretch * spacing
        hour = begin / 3600.0
        asked = duty(hour)
        levels = _set_points(asked, level, round(STRETCH / asked.period), random)
        level = levels[-1]
        asked_at = np.repeat(levels, round(asked.period / loop.action_period))[:actions]
        body = replace(plant.body, preload=plant.body.preload + offset(hour))
        outputs, sums = np.empty((2, count)), np.zeros(SUMS)
        run(
            constants(replace(plant, body=body)),
            loop,
            friction(hour),
            asked_at,
            3e-4 * random.standard_normal(actions),
            valve.step,
            1.0 / senses.rate,
            state,
            outputs,
            sums,
        )
        yield Stretch(
            (
                _stamps(begin, count, senses, senses.lag, random),
                _stamps(begin, count, senses, 0.0, random),
            ),
            _measured(outputs[0], senses.pressure_noise, senses.pressure_step, random, senses.hold),
            _measured(outputs[1], senses.position_noise, senses.position_step, random),
            float(sums[1]),
            float(sums[0]),
        )
