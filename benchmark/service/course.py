# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a valve in service does over hours, and the moves that its samples are cut into."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmark.service.plants import Duty, ServiceValve, valve_of
from benchmark.service.service import STRETCH, Stretch, stretches
from valve_friction_ros.evidence import Move, MoveStream
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams import Arrivals

PER_HOUR = round(3600.0 / STRETCH)
"""Stretches of an hour."""

BEFORE = 3
"""Hours before friction may change."""

_DAY = 24.0
_QUIET = 4 * 3600.0
"""Time, s, from one ten minutes of work of a quiet valve to the next."""

_SLOW = ("slow", "weeks")


@dataclass(frozen=True)
class Task:
    """What is tried: a plant, hours, a seed, and what its friction does.

    It is steady, or grows to 1.5 times in a step, or slowly, or over `weeks` in a valve that works
    ten minutes in every four hours.
    """

    plant: str
    hours: int
    seed: int
    course: str


@dataclass(frozen=True)
class Served:
    """Ten minutes of service, until an hour: moves that ended, and ∫|F·dx| (J) and ∫|dx| (m)."""

    hour: float
    moves: tuple[Move, ...]
    work: float
    distance: float


class Course:
    """What friction, preload and set points do; all but friction is no change."""

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
        """Return how far a warm day moves the zero of the pressure, N."""
        return self._drift * math.sin(2 * math.pi * (hour - self._phase) / _DAY)

    def duty(self, hour: float) -> Duty:
        """Return other steps, periods and ranges in each part of some days, from the second on."""
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
        """Hour at which friction has reached 1.5."""
        return self.at if self._task.course == "step" else float(self._task.hours - 2)


def known_valve(valve: ServiceValve) -> Valve:
    """Return what an identifier knows of it."""
    body = valve.plant.body
    return Valve(body.area, body.pressure_reference, body.travel)


def served(task: Task) -> Iterator[Served]:
    """Simulate the service of a task, and cut it into moves."""
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
