"""One case tried: made, identified within a time limit, and compared with its baseline."""

import importlib
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import cast

from benchmark.reality.answers import Answer, Identification, Outcome
from benchmark.reality.records import Case, Record, make_record
from benchmark.reality.truth import NAMES

__all__ = ["Trials", "failed"]

_BASELINE_SEEDS = 1000
"""Distance of the seed of a baseline from that of its case."""


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """Raise TimeoutError in what takes more processor time; compiled code notices at its return."""

    def stop(*_: object) -> None:
        raise TimeoutError(f"more than {seconds:g} s of the processor")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def failed(case: Case, failure: str) -> Outcome:
    """Return the outcome of a case without an answer."""
    return Outcome(
        name=case.name,
        imperfection=case.imperfection,
        label=case.label,
        packing=case.packing,
        drive=case.excitation.kind.value,
        seed=case.seed,
        growth=case.growth,
        duration=case.excitation.duration,
        words=case.words,
        failure=failure,
    )


@dataclass
class _Clock:
    """Time that something took."""

    seconds: float = 0.0
    processor_seconds: float = 0.0


@dataclass
class Trials:
    """Tries cases with one identification, and keeps the baselines.

    Attributes
    ----------
    module : str
        Name of a module with `identify` and `alarm`; or ``module:method``, whose `identification`
        returns an object with both.
    limit : float
        Processor time for one identification, s.
    """

    module: str
    limit: float
    _baselines: dict[Case, Answer] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Load the identification."""
        name, _, method = self.module.partition(":")
        module = importlib.import_module(name)
        made = module.identification(method) if method else module
        self._identification = cast("Identification", made)

    def baseline(self, case: Case) -> Answer:
        """Identify the plant of a case while nothing is wrong, under the same drive; once."""
        healthy = case.ideal(case.seed + _BASELINE_SEEDS)
        if healthy not in self._baselines:
            self._baselines[healthy] = self._identified(make_record(healthy), _Clock())
        return self._baselines[healthy]

    def _identified(self, record: Record, clock: _Clock) -> Answer:
        begin, processor = time.perf_counter(), time.process_time()
        try:
            with _limited(self.limit):
                return self._identification.identify(record)
        except Exception as error:  # noqa: BLE001  whatever it is, the suite goes on
            return Answer({}, (f"{type(error).__name__}: {error}",), refused=True, native=error)
        finally:
            clock.seconds = time.perf_counter() - begin
            clock.processor_seconds = time.process_time() - processor

    def tried(self, case: Case) -> Outcome:
        """Try a case."""
        baseline = self.baseline(case)
        record, clock = make_record(case), _Clock()
        answer = self._identified(record, clock)
        if isinstance(answer.native, Exception):
            return failed(case, answer.sentences[0])
        alarm = ""
        if not isinstance(baseline.native, Exception):
            alarm = self._identification.alarm(record, answer, baseline)
        blank = failed(case, "")
        return Outcome(
            **{name: getattr(blank, name) for name in _CASE},
            truth={name: getattr(record.truth, name) for name in NAMES},
            numbers=answer.numbers,
            sentences=answer.sentences,
            refused=answer.refused,
            alarm=alarm,
            seconds=clock.seconds,
            processor_seconds=clock.processor_seconds,
        )


_CASE = (
    "name",
    "imperfection",
    "label",
    "packing",
    "drive",
    "seed",
    "growth",
    "duration",
    "words",
)
