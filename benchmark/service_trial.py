# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""The service of a valve, and what the evidence of its moves says."""

import contextlib
import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmark.reality.plants import constants, stem_pull
from benchmark.service_plants import (
    SUMS,
    Duty,
    Senses,
    ServiceValve,
    new_state,
    runner_of,
    valve_of,
)
from valve_friction_ros.evidence import MOST_MOVES, Evidence, Move, MoveStream, evidence_of
from valve_friction_ros.health import (
    Baseline,
    FrictionLimits,
    Level,
    Reference,
    baseline_by_evidence,
    diagnosis_by_evidence,
    reference_by_evidence,
)
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams import Arrivals

STRETCH = 600.0
"""Length of a stretch, s."""

_ORIGIN = 1_700_000_000_000_000_000


class Stretch(NamedTuple):
    """Ten minutes of service."""

    stamps: tuple[NDArray[np.int64], NDArray[np.int64]]  # times of pressure and position, ns
    # measured values, Pa and m
    pressure: NDArray[np.float64]
    position: NDArray[np.float64]
    # ∫|F·dx| and ∫|dx| of the true motion, J and m
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

    `friction`, over that of the plant, `offset` of the preload, N, and `duty` depend on the hour.
    `spacing` is the time, s, between the starts of successive stretches; in between the valve is
    shut off in its present state.
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


def _arrivals(stretch: Stretch) -> Arrivals:
    stamps = np.concatenate(stretch.stamps)
    kinds = np.repeat(np.array([0, 1], np.uint8), [one.size for one in stretch.stamps])
    order = np.argsort(stamps, kind="stable")
    values = np.concatenate((stretch.pressure, stretch.position))
    return Arrivals(kinds[order], stamps[order], values[order])


_BEGIN = 1_700_000_000
_SAME = 3600e9
"""Time of the first sample, s, and largest difference between two dates of the same change, ns."""


@dataclass(frozen=True)
class Number:
    """A number from the moves of one hour, with its truth; nan if withheld."""

    name: str
    truth: float
    value: float
    half_width: float


@dataclass
class Told:
    """The outcome of a task."""

    task: Task  # the task
    numbers: list[Number] = field(default_factory=list)  # numbers from single hours
    # declared changes, and rises of the level against the baseline, before friction changed
    changes: int = 0
    alarms: int = 0
    # hours from the change of friction to its declaration, and to the rise of the level; nan if it
    # did not happen. For slow growth, hours after friction reached 1.5 times
    declared: float = math.nan
    alarmed: float = math.nan
    # like `alarmed`, for a valve without a baseline, by the reference from its first moves
    alarmed_by_reference: float = math.nan
    dated: bool | None = None  # whether the true time of the change lies in its interval
    late: list[Number] = field(default_factory=list)  # numbers from all evidence at the end


def _truths(
    evidence: Evidence, valve: ServiceValve, friction: float, sliding: float
) -> Iterator[Number]:
    static, spring = valve.plant.friction.static * friction, _stiffness(valve)
    for name, truth in (
        ("sliding_friction", sliding),
        ("static_friction", static),
        ("dead_band", (sliding + static) / spring),
    ):
        one = evidence.parameters[name]
        yield Number(name, truth, one.value, one.half_width)


def _stiffness(valve: ServiceValve) -> float:
    """Return the mean stiffness over the range of the set points, N/m."""
    numbers, travel = constants(valve.plant), valve.plant.body.travel
    low, high = valve.duty.low * travel, valve.duty.high * travel
    return float(stem_pull(numbers, low, 0.0) - stem_pull(numbers, high, 0.0)) / (high - low)


class _Watched:
    """The evidence of a valve, gathered like in an identifier, and its declarations."""

    def __init__(self, task: Task, valve: Valve, course: Course) -> None:
        self._valve, self._course = valve, course
        self._limits = FrictionLimits()
        self._ledger: deque[Move] = deque(maxlen=MOST_MOVES)
        self._baseline: Baseline | None = None
        self._has_tried = False
        self._reference: Reference | None = None
        self._known: list[int] = []
        self._high: set[str] = set()
        self.told = Told(task)
        self.evidence = evidence_of([], valve)

    def take(self, hour: float, moves: Iterable[Move]) -> None:
        """Take the moves of the ten minutes before an hour."""
        self._ledger.extend(moves)
        self.evidence = evidence_of(list(self._ledger), self._valve)
        self._reference = self._reference or reference_by_evidence(self.evidence)
        if hour >= BEFORE and not self._has_tried:
            self._has_tried = True
            with contextlib.suppress(RefusalError):
                self._baseline = baseline_by_evidence(self.evidence)
        self._declare(hour)
        self._alarm(hour)

    def _declare(self, hour: float) -> None:
        told, change = self.told, self.evidence.change
        if change is None or any(abs(change.latest - one) < _SAME for one in self._known):
            return
        self._known.append(change.latest)
        if not self._course.has_changed(hour):
            told.changes += 1
        elif math.isnan(told.declared):
            told.declared = hour - self._course.reached

    def _alarm(self, hour: float) -> None:
        """Note the alarms with a baseline and without one."""
        told = self.told
        cases = (("alarmed", self._baseline, None), ("alarmed_by_reference", None, self._reference))
        for name, baseline, reference in cases:
            found = diagnosis_by_evidence(
                self.evidence, self._valve, baseline, self._limits, reference
            )
            if found is None or found.level < Level.WARN:
                self._high.discard(name)
                continue
            if not self._course.has_changed(hour):
                told.alarms += name not in self._high
            elif math.isnan(getattr(told, name)):
                setattr(told, name, hour - self._course.reached)
            self._high.add(name)


def tried(task: Task) -> Told:
    """Simulate the service of a task, and evaluate it every ten minutes."""
    plant = valve_of(task.plant)
    course, valve = Course(task, plant), known_valve(plant)
    watched, stream = _Watched(task, valve, course), MoveStream(valve)
    told = watched.told
    spacing = _QUIET if task.course == "weeks" else STRETCH
    courses = course.friction, course.offset, course.duty
    parts = stretches(plant, task.hours, task.seed, *courses, spacing)
    moves: list[Move] = []
    work = distance = 0.0
    for number, part in enumerate(parts):
        hour, new = (number * spacing + STRETCH) / 3600.0, stream.take(_arrivals(part))
        moves += new
        watched.take(hour, new)
        work, distance = work + part.work, distance + part.distance
        if (number + 1) % PER_HOUR:
            continue
        scale = course.friction(hour - 1e-6)
        if distance > 0:  # a resting stem has no sliding friction
            truth = work / distance
            if scale == course.friction(hour - 1.0):
                told.numbers += _truths(evidence_of(moves, valve), plant, scale, truth)
            told.late = list(_truths(watched.evidence, plant, scale, truth))
        moves, work, distance = [], 0.0, 0.0
    if task.course == "step" and (change := watched.evidence.change) is not None:
        begin = _BEGIN + course.at * 3600
        told.dated = change.earliest / 1e9 <= begin <= change.latest / 1e9
    return told
