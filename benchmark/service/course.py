# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Hours of service of a valve, and the moves extracted from its samples."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmark.reality.plants.parameters import constants
from benchmark.service.kernel import SUMS, new_state, runner_of
from benchmark.service.plants import Duty, Senses, ServiceValve, valve_of
from valve_friction_ros.evidence import Move, MoveStream
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams import Arrivals

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
        Measured values, Pa and m.
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
    """Simulate hours of service with random set points and noise; yield ten minutes at a time.

    Parameters
    ----------
    friction : callable
        Friction at an hour, over that of the plant.
    offset : callable
        Shift of the preload at an hour, N.
    duty : callable
        Set points at an hour.
    spacing : float
        Time, s, between the starts of successive stretches; in between the valve is shut off in its
        present state.
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


PER_HOUR = round(3600.0 / STRETCH)
"""Stretches per hour."""

BEFORE = 3
"""Hours before friction may change."""

_DAY = 24.0
_QUIET = 4 * 3600.0
"""Time, s, between the starts of two working stretches of a quiet valve."""

_SLOW = ("slow", "weeks")


@dataclass(frozen=True)
class Task:
    """A trial: plant, hours, seed, and course of the friction.

    Friction is steady, or grows to 1.5 times: in a step, slowly, or over `weeks` in a valve that
    works ten minutes in every four hours.
    """

    plant: str
    hours: int
    seed: int
    course: str


@dataclass(frozen=True)
class Served:
    """Ten minutes of service up to an hour: completed moves, ∫|F·dx| (J) and ∫|dx| (m)."""

    hour: float
    moves: tuple[Move, ...]
    work: float
    distance: float


class Course:
    """Course of friction, preload and set points; only friction is a change to declare."""

    def __init__(self, task: Task, valve: ServiceValve) -> None:
        self._task = task
        self._duty = valve.duty
        self._random = np.random.default_rng([task.seed, 3])
        self._phase = self._random.uniform(0, _DAY)
        self._phases: dict[int, Duty] = {}
        self.at = float(BEFORE + self._random.integers(1, 6)) + 0.5
        self._drift = 0.15 * valve.plant.friction.coulomb

    def friction(self, hour: float) -> float:
        """Return the friction at an hour, over that of the plant."""
        if self._task.course == "step":
            return 1.5 if hour >= self.at else 1.0
        if self._task.course in _SLOW:
            return min(1.0 + 0.5 * max(hour - BEFORE, 0.0) / (self._task.hours - 5), 1.5)
        return 1.0

    def offset(self, hour: float) -> float:
        """Return the daily drift of the pressure zero with temperature, N."""
        return self._drift * math.sin(2 * math.pi * (hour - self._phase) / _DAY)

    def duty(self, hour: float) -> Duty:
        """Return steps, period and range, which change every eight hours after the first eight."""
        part = int(hour // 8)
        if self._task.course == "weeks" or part == 0 or self._duty.high - self._duty.low < 0.1:
            return self._duty
        if part not in self._phases:
            middle = self._random.uniform(0.35, 0.65)
            self._phases[part] = replace(
                self._duty,
                step=float(self._random.choice([0.03, 0.04, 0.06])),
                period=float(self._random.choice([12.0, 20.0, 30.0])),
                low=middle - 0.15,
                high=middle + 0.15,
            )
        return self._phases[part]

    def has_changed(self, hour: float) -> bool:
        """Return whether friction has begun to change before an hour."""
        if self._task.course == "step":
            return hour > self.at
        return self._task.course in _SLOW and hour > BEFORE

    @property
    def reached(self) -> float:
        """Hour at which friction has reached 1.5 times."""
        return self.at if self._task.course == "step" else float(self._task.hours - 2)


def known_valve(valve: ServiceValve) -> Valve:
    """Return the valve as an identifier knows it."""
    body = valve.plant.body
    return Valve(body.area, body.pressure_reference, body.travel)


def served(task: Task) -> Iterator[Served]:
    """Simulate the service of a task, and extract its moves."""
    valve = valve_of(task.plant)
    course, stream = Course(task, valve), MoveStream(known_valve(valve))
    spacing = _QUIET if task.course == "weeks" else STRETCH
    courses = course.friction, course.offset, course.duty
    parts = stretches(valve, task.hours, task.seed, *courses, spacing)
    for number, one in enumerate(parts):
        hour = (number * spacing + STRETCH) / 3600.0
        yield Served(hour, stream.take(_arrivals(one)), one.work, one.distance)


def _arrivals(stretch: Stretch) -> Arrivals:
    stamps = np.concatenate(stretch.stamps)
    kinds = np.repeat(np.array([0, 1], np.uint8), [one.size for one in stretch.stamps])
    order = np.argsort(stamps, kind="stable")
    values = np.concatenate((stretch.pressure, stretch.position))
    return Arrivals(kinds[order], stamps[order], values[order])
