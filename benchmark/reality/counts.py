"""Outcomes counted: identified numbers beside the truth, alarms, and names of imperfections."""

import math
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from benchmark.reality.answers import IDENTIFIED, Number, Outcome
from benchmark.reality.truth import TrueValue

__all__ = ["Count", "Judged", "by_class", "ideals_of", "judged", "tally"]

WIDEST_ERROR = 3.0
"""Half widths beyond which an identified number is wrong."""

LEAST_ERROR = 0.02
"""Share of the truth within which no identified number is wrong."""

USABLE = 0.10
"""Largest error and half width of a sliding friction that can be used, share of the truth."""

_FLOORS = {
    "clock_offset": 1e-3,
    "coulomb_asymmetry": 0.02,
    "viscous_asymmetry": 0.02,
    "limit_velocity": 1e-4,
    "stribeck_velocity": 1e-4,
}
"""Errors, SI unit, that are not wrong in numbers that may be zero."""

_MAIN = "coulomb_friction"


@dataclass(frozen=True)
class Judged:
    """An identified number beside the truth.

    Attributes
    ----------
    outcome : Outcome
        The case.
    name : str
        The number.
    truth, value, half_width : float
        SI unit.
    error : float
        Distance from all that can be called the truth, SI unit.
    """

    outcome: Outcome
    name: str
    truth: float
    value: float
    half_width: float
    error: float

    @property
    def is_inside(self) -> bool:
        """Whether the truth lies in the interval."""
        return self.error <= self.half_width

    @property
    def is_wrong(self) -> bool:
        """Whether it is confidently wrong."""
        least = max(LEAST_ERROR * abs(self.truth), _FLOORS.get(self.name, 0.0))
        return self.error > WIDEST_ERROR * self.half_width and self.error > least


def _one(outcome: Outcome, name: str, truth: TrueValue, number: Number) -> Judged:
    return Judged(
        outcome, name, truth.value, number.value, number.half_width, truth.error(number.value)
    )


def judged(outcome: Outcome) -> list[Judged]:
    """Return the numbers that an outcome calls identified, beside the truth."""
    return [
        _one(outcome, name, truth, outcome.numbers[name])
        for name, truth in outcome.truth.items()
        if name in outcome.numbers
        and outcome.numbers[name].verdict == IDENTIFIED
        and math.isfinite(truth.value)
    ]


@dataclass
class Count:
    """Counts over some outcomes.

    Attributes
    ----------
    records, refused, failed : int
        Records; those without an estimate; those without an answer.
    numbers, inside : int
        Identified numbers, and those whose interval holds the truth.
    wrong : list of Judged
        Identified numbers that are wrong.
    usable, sure : int
        Records of a valve that has not changed with a usable sliding friction, and with an F_c
        called identified.
    unusable : list of Outcome
        Those without a usable sliding friction.
    unchanged : int
        Records of a valve that has not changed.
    alarms : list of Outcome
        Those with an alarm.
    grown, declared : int
        Records of a valve whose friction has grown, and those with the alarm.
    doubted, named : int
        Records doubted for their imperfection, and those that name it.
    unnamed : list of Outcome
        The others.
    seconds : list of float
        Processor time of each.
    """

    records: int = 0
    refused: int = 0
    failed: int = 0
    numbers: int = 0
    inside: int = 0
    wrong: list[Judged] = field(default_factory=list)
    usable: int = 0
    sure: int = 0
    unusable: list[Outcome] = field(default_factory=list)
    unchanged: int = 0
    alarms: list[Outcome] = field(default_factory=list)
    grown: int = 0
    declared: int = 0
    doubted: int = 0
    named: int = 0
    unnamed: list[Outcome] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    @property
    def coverage(self) -> float:
        """Share of the identified numbers whose interval holds the truth."""
        return self.inside / self.numbers if self.numbers else math.nan

    @property
    def usable_share(self) -> float:
        """Share of the records of an unchanged valve with a usable sliding friction."""
        return self.usable / self.unchanged if self.unchanged else math.nan

    @property
    def sure_share(self) -> float:
        """Share of the records of an unchanged valve whose F_c is called identified."""
        return self.sure / self.unchanged if self.unchanged else math.nan

    @property
    def declared_share(self) -> float:
        """Share of the grown frictions that raise the alarm."""
        return self.declared / self.grown if self.grown else math.nan

    @property
    def named_share(self) -> float:
        """Share of the doubted records that name their imperfection."""
        return self.named / self.doubted if self.doubted else math.nan


def _is_usable(outcome: Outcome) -> bool:
    number, truth = outcome.numbers.get("sliding_friction"), outcome.truth.get("sliding_friction")
    if number is None or truth is None or not truth.value > 0:
        return False
    allowed = USABLE * truth.value
    return truth.error(number.value) <= allowed and number.half_width <= allowed


def _is_sure(outcome: Outcome) -> bool:
    number = outcome.numbers.get(_MAIN)
    return number is not None and number.verdict == IDENTIFIED


def _shape(sentence: str) -> str:
    """Return a sentence without its figures."""
    return re.sub(r"[-+−]?\d[\d.,e]*", "#", sentence.lower())


def _names(outcome: Outcome, ideal: Outcome) -> bool:
    """Tell whether a sentence that the ideal record does not bring names the imperfection."""
    known = {_shape(sentence) for sentence in ideal.sentences}
    new = [sentence for sentence in map(_shape, outcome.sentences) if sentence not in known]
    pattern = re.compile("|".join(rf"\b{re.escape(word)}" for word in outcome.words))
    return any(pattern.search(sentence) for sentence in new)


_Key = tuple[str, str, int, float]


def _key(outcome: Outcome) -> _Key:
    return outcome.packing, outcome.drive, outcome.seed, outcome.growth


def tally(outcomes: Iterable[Outcome], ideals: Mapping[_Key, Outcome]) -> Count:
    """Count some outcomes; `ideals` are those of the ideal records by packing, drive and seed."""
    count = Count()
    for outcome in outcomes:
        count.records += 1
        count.refused += outcome.refused
        count.failed += bool(outcome.failure)
        count.seconds.append(outcome.processor_seconds)
        numbers = judged(outcome)
        count.numbers += len(numbers)
        count.inside += sum(one.is_inside for one in numbers)
        count.wrong += [one for one in numbers if one.is_wrong]
        if outcome.growth != 1.0:
            count.grown += 1
            count.declared += outcome.alarm == "high"
            continue
        count.unchanged += 1
        count.sure += _is_sure(outcome)
        if _is_usable(outcome):
            count.usable += 1
        else:
            count.unusable.append(outcome)
        if outcome.alarm:
            count.alarms.append(outcome)
        ideal = ideals.get(_key(outcome))
        if ideal is None or not outcome.words or _is_sure(outcome) or not _is_sure(ideal):
            continue
        count.doubted += 1
        if _names(outcome, ideal):
            count.named += 1
        else:
            count.unnamed.append(outcome)
    return count


def ideals_of(outcomes: Iterable[Outcome]) -> dict[_Key, Outcome]:
    """Return the outcomes of the ideal records by packing, drive, seed and growth."""
    return {_key(one): one for one in outcomes if one.imperfection == "ideal"}


def by_class(
    outcomes: Sequence[Outcome], key: Callable[[Outcome], str] = lambda one: one.imperfection
) -> dict[str, Count]:
    """Count each class for itself, in the order in which they come."""
    ideals = ideals_of(outcomes)
    groups: dict[str, list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        groups[key(outcome)].append(outcome)
    return {name: tally(group, ideals) for name, group in groups.items()}
