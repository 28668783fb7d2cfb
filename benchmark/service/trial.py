"""One valve over hours of service: what its evidence says, beside what is true."""

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
    baseline_by_evidence,
    diagnosis_by_evidence,
)
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams import Arrivals

__all__ = ["Number", "Task", "Told", "tried"]

_PER_HOUR = round(3600.0 / STRETCH)
_BEFORE = 3
_DAY = 24.0


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
        """A warm day moves the zero of the pressure, or the preload."""
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

    @property
    def reached(self) -> float:
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


def tried(task: Task) -> Told:
    """Simulate the service of a task, and take its evidence every ten minutes."""
    plant = PLANTS[task.plant]
    body = plant.plant.body
    valve = Valve(body.area, body.pressure_reference, body.travel)
    course, told = _Course(task, plant), Told(task)
    stream, limits = MoveStream(valve), FrictionLimits()
    ledger: deque[Move] = deque(maxlen=MOST_MOVES)
    baseline: Baseline | None = None
    known: set[int] = set()
    high = False
    hourly: list[Move] = []
    work = distance = 0.0
    evidence = evidence_of([], valve)
    service = stretches(
        plant, task.hours, task.seed, course.friction, course.offset, course.duty
    )
    for count, stretch in enumerate(service, start=1):
        hour = count / _PER_HOUR
        moves = stream.take(_arrivals(stretch))
        ledger.extend(moves)
        hourly.extend(moves)
        work, distance = work + stretch.work, distance + stretch.distance
        evidence = evidence_of(list(ledger), valve)
        if hour == _BEFORE:
            try:
                baseline = baseline_by_evidence(evidence)
            except RefusalError:
                baseline = None
        after = task.course != "steady" and hour > (
            course.at if task.course == "step" else _BEFORE
        )
        if (change := evidence.change) is not None and not any(
            abs(change.latest - one) < 3.6e12 for one in known
        ):
            known.add(change.latest)
            if not after:
                told.changes += 1
            elif math.isnan(told.declared):
                told.declared = hour - course.reached
        diagnosis = diagnosis_by_evidence(evidence, valve, baseline, limits)
        is_high = diagnosis is not None and diagnosis.level >= Level.WARN
        if is_high and not high and not after:
            told.alarms += 1
        if is_high and after and math.isnan(told.alarmed):
            told.alarmed = hour - course.reached
        high = is_high
        if count % _PER_HOUR == 0:
            if course.friction(hour - 1e-6) == course.friction(hour - 1.0):
                scale = course.friction(hour - 1e-6)
                alone = evidence_of(hourly, valve)
                told.numbers += _truths(alone, plant, scale, work / distance)
            hourly, work, distance, last = [], 0.0, 0.0, work / distance
            if hour == task.hours:
                scale = course.friction(hour - 1e-6)
                told.late = list(_truths(evidence, plant, scale, last))
    if task.course == "step" and evidence.change is not None:
        begin = 1_700_000_000 + course.at * 3600
        told.dated = evidence.change.earliest / 1e9 <= begin <= evidence.change.latest / 1e9
    return told
