"""What an identification answers, and what the benchmark keeps of it."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Protocol

from benchmark.reality.records import Record
from benchmark.reality.truth import NAMES, TrueValue

__all__ = ["IDENTIFIED", "Answer", "Identification", "Number", "Outcome", "read_outcomes"]

IDENTIFIED = "identified"
"""Verdict of a number that is said to be right within its interval; any other one doubts it."""


@dataclass(frozen=True)
class Number:
    """A number of an answer, with its interval and verdict.

    Attributes
    ----------
    value, half_width : float
        SI unit; nan where there is none.
    verdict : str
        "identified", "weak", "not identifiable" or "fixed".
    """

    value: float
    half_width: float
    verdict: str


@dataclass(frozen=True)
class Answer:
    """What an identification says of a record.

    Attributes
    ----------
    numbers : mapping of str to Number
        By the names of `truth.NAMES`; others are not compared.
    sentences : tuple of str
        Reasons, warnings, and the refusal if it is one.
    refused : bool
        Whether there is no estimate.
    native : object
        The identification's own result, for its comparison with a baseline.
    """

    numbers: Mapping[str, Number]
    sentences: tuple[str, ...]
    refused: bool = False
    native: Any = None


class Identification(Protocol):
    """What is measured; a module with these two functions is one."""

    def identify(self, record: Record) -> Answer:
        """Identify a record; a refusal is an answer."""

    def alarm(self, record: Record, answer: Answer, baseline: Answer) -> str:
        """Compare with a baseline: "high", "low", or "" for no alarm about friction."""


@dataclass(frozen=True)
class Outcome:
    """What became of one case.

    Attributes
    ----------
    name, imperfection, label, packing, drive : str
        The case.
    seed : int
        Its seed.
    growth : float
        Its friction over that of the baseline.
    duration : float
        Length of the record, s.
    words : tuple of str
        Beginnings of words that name the imperfection.
    truth : mapping of str to TrueValue
        What is true.
    numbers : mapping of str to Number
        What was answered.
    sentences : tuple of str
        What was said.
    refused : bool
        Whether there is no estimate.
    failure : str
        Why there is no answer at all: an error, or too long; else empty.
    alarm : str
        "high", "low" or empty.
    seconds, processor_seconds : float
        Time that the identification took, by the clock and of the processor.
    """

    name: str
    imperfection: str
    label: str
    packing: str
    drive: str
    seed: int
    growth: float
    duration: float
    words: tuple[str, ...]
    truth: Mapping[str, TrueValue] = field(default_factory=dict)
    numbers: Mapping[str, Number] = field(default_factory=dict)
    sentences: tuple[str, ...] = ()
    refused: bool = False
    failure: str = ""
    alarm: str = ""
    seconds: float = 0.0
    processor_seconds: float = 0.0

    def as_line(self) -> str:
        """Write it as one line of JSON."""
        return json.dumps(asdict(self), ensure_ascii=False)

    @classmethod
    def from_line(cls, line: str) -> "Outcome":
        """Read it from a line of JSON."""
        parts = json.loads(line)
        parts["words"], parts["sentences"] = tuple(parts["words"]), tuple(parts["sentences"])
        parts["truth"] = {
            name: TrueValue(**one) for name, one in parts["truth"].items() if name in NAMES
        }
        parts["numbers"] = {name: Number(**one) for name, one in parts["numbers"].items()}
        return cls(**parts)


def read_outcomes(path: Path) -> list[Outcome]:
    """Read a file of outcomes."""
    with path.open(encoding="utf-8") as lines:
        return [Outcome.from_line(line) for line in lines]
