# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One valve over hours of service: its evidence compared with the truth."""

import contextlib
import math
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from benchmark.reality.plants.kernel import stem_pull
from benchmark.reality.plants.parameters import constants
from benchmark.service.course import BEFORE, PER_HOUR, Course, Served, Task, known_valve, served
from benchmark.service.plants import ServiceValve, valve_of
from valve_friction_ros.evidence import MOST_MOVES, Evidence, Move, evidence_of
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
    """The outcome of a task.

    Attributes
    ----------
    task : Task
        The task.
    numbers : list of Number
        Numbers from single hours.
    changes, alarms : int
        Declared changes, and rises of the level against the baseline, before friction changed.
    declared, alarmed : float
        Hours from the change of friction to its declaration, and to the rise of the level; nan if
        it did not happen. For slow growth, hours after friction reached 1.5 times.
    alarmed_by_reference : float
        Like `alarmed`, for a valve without a baseline, by the reference from its first moves.
    dated : bool or None
        Whether the true time of the change lies in its interval.
    late : list of Number
        Numbers from all evidence at the end.
    """

    task: Task
    numbers: list[Number] = field(default_factory=list)
    changes: int = 0
    alarms: int = 0
    declared: float = math.nan
    alarmed: float = math.nan
    alarmed_by_reference: float = math.nan
    dated: bool | None = None
    late: list[Number] = field(default_factory=list)


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
    return judged(task, served(task))


def judged(task: Task, service: Iterable[Served]) -> Told:
    """Evaluate a service every ten minutes."""
    plant = valve_of(task.plant)
    course, valve = Course(task, plant), known_valve(plant)
    watched = _Watched(task, valve, course)
    told = watched.told
    moves: list[Move] = []
    work = distance = 0.0
    for count, part in enumerate(service, start=1):
        moves += part.moves
        watched.take(part.hour, part.moves)
        work, distance = work + part.work, distance + part.distance
        if count % PER_HOUR:
            continue
        hour = part.hour
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
