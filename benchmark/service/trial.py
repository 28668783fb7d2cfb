"""One valve over hours of service: what its evidence says, beside what is true."""

import contextlib
import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from benchmark.service.plants import PLANTS, Duty, ServiceValve
from benchmark.service.service import STRETCH, Stretch, stretches
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

__all__ = ["Number", "Task", "Told", "tried"]

_PER_HOUR = round(3600.0 / STRETCH)
_BEFORE = 3
_DAY = 24.0
_BEGIN = 1_700_000_000
_SAME = 3600e9
"""Time of the first sample, s; and between two dates of one change, ns."""


@dataclass(frozen=True)
class Task:
    """What is tried: a plant, hours, a seed, and what its friction does: steady, step or slow."""

    plant: str
    hours: int
    seed: int
    course: str


@dataclass(frozen=True)
class Number:
    """A number of one hour's moves beside the truth; nan where it was withheld."""

    name: str
    truth: float
    value: float
    half_width: float


@dataclass
class Told:
    """What became of a task.

    Attributes
    ----------
    task : Task
        The task.
    numbers : list of Number
        Of each hour by itself.
    changes, alarms : int
        Declared changes, and rises of the level against the baseline, before friction changed.
    declared, alarmed : float
        Hours from the change of friction until it was declared, and until the level rose; nan
        where it was not. For slow growth, from when it has reached 1.5.
    alarmed_by_reference : float
        As `alarmed`, of a valve without a baseline, by what its moves said first.
    dated : bool or None
        Whether the change lies in its interval.
    late : list of Number
        Sliding friction by all evidence at the end.
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


def _arrivals(stretch: Stretch) -> Arrivals:
    stamps = np.concatenate(stretch.stamps)
    kinds = np.repeat(np.array([0, 1], np.uint8), [one.size for one in stretch.stamps])
    order = np.argsort(stamps, kind="stable")
    values = np.concatenate((stretch.pressure, stretch.position))
    return Arrivals(kinds[order], stamps[order], values[order])


class _Course:
    """What friction, preload and set points do; all but friction is no change."""

    def __init__(self, task: Task, valve: ServiceValve) -> None:
        self._task = task
        self._duty = valve.duty
        self._random = np.random.default_rng([task.seed, 3])
        self._phase = self._random.uniform(0, _DAY)
        self._phases: dict[int, Duty] = {}
        self.at = float(_BEFORE + self._random.integers(1, 6)) + 0.5
        self._drift = 0.15 * valve.plant.friction.coulomb

    def friction(self, hour: float) -> float:
        if self._task.course == "step":
            return 1.5 if hour >= self.at else 1.0
        if self._task.course == "slow":
            return min(1.0 + 0.5 * max(hour - _BEFORE, 0.0) / (self._task.hours - 5), 1.5)
        return 1.0

    def offset(self, hour: float) -> float:
        """Return how far a warm day moves the zero of the pressure, N."""
        return self._drift * math.sin(2 * math.pi * (hour - self._phase) / _DAY)

    def duty(self, hour: float) -> Duty:
        """Return other steps, periods and ranges in each part of some days, from the second on."""
        part = int(hour // 8)
        if part == 0 or self._duty.high - self._duty.low < 0.1:
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
        return self._task.course == "slow" and hour > _BEFORE

    @property
    def reached(self) -> float:
        """Hour at which friction has reached 1.5."""
        return self.at if self._task.course == "step" else float(self._task.hours - 2)


def _truths(
    evidence: Evidence, valve: ServiceValve, friction: float, sliding: float
) -> Iterator[Number]:
    static, spring = valve.plant.friction.static * friction, valve.plant.body.spring
    for name, truth in (
        ("sliding_friction", sliding),
        ("static_friction", static),
        ("dead_band", (sliding + static) / spring),
    ):
        one = evidence.parameters[name]
        yield Number(name, truth, one.value, one.half_width)


class _Watched:
    """The evidence of a valve, as an identifier gathers it, and what it declares."""

    def __init__(self, task: Task, valve: Valve, course: _Course) -> None:
        self._valve, self._course = valve, course
        self._stream, self._limits = MoveStream(valve), FrictionLimits()
        self._ledger: deque[Move] = deque(maxlen=MOST_MOVES)
        self._baseline: Baseline | None = None
        self._reference: Reference | None = None
        self._known: list[int] = []
        self._high: set[str] = set()
        self.told = Told(task)
        self.evidence = evidence_of([], valve)

    def take(self, hour: float, stretch: Stretch) -> tuple[Move, ...]:
        """Take ten minutes that end at an hour; return their moves."""
        moves = self._stream.take(_arrivals(stretch))
        self._ledger.extend(moves)
        self.evidence = evidence_of(list(self._ledger), self._valve)
        self._reference = self._reference or reference_by_evidence(self.evidence)
        if hour == _BEFORE:
            with contextlib.suppress(RefusalError):
                self._baseline = baseline_by_evidence(self.evidence)
        self._declare(hour)
        self._alarm(hour)
        return moves

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
        """Note the alarms with a baseline, and those of a valve that has none."""
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
    """Simulate the service of a task, and take its evidence every ten minutes."""
    plant = PLANTS[task.plant]
    body, course = plant.plant.body, _Course(task, plant)
    valve = Valve(body.area, body.pressure_reference, body.travel)
    watched = _Watched(task, valve, course)
    told, moves = watched.told, []
    work = distance = 0.0
    service = stretches(plant, task.hours, task.seed, course.friction, course.offset, course.duty)
    for count, stretch in enumerate(service, start=1):
        moves += watched.take(count / _PER_HOUR, stretch)
        work, distance = work + stretch.work, distance + stretch.distance
        if count % _PER_HOUR:
            continue
        hour = count // _PER_HOUR
        scale = course.friction(hour - 1e-6)
        if distance > 0:  # a stem that stood still has no sliding friction
            truth = work / distance
            if scale == course.friction(hour - 1.0):
                told.numbers += _truths(evidence_of(moves, valve), plant, scale, truth)
            told.late = list(_truths(watched.evidence, plant, scale, truth))
        moves, work, distance = [], 0.0, 0.0
    if task.course == "step" and (change := watched.evidence.change) is not None:
        begin = _BEGIN + course.at * 3600
        told.dated = change.earliest / 1e9 <= begin <= change.latest / 1e9
    return told
