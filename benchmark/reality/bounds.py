"""What an identification must reach."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from benchmark.reality.answers import Outcome
from benchmark.reality.counts import by_class, ideals_of, tally

__all__ = ["Bound", "bounds"]

_IDEAL_DURATION = 65.0
"""Longest of the ideal records to which the first bound of the time applies, s."""

_IDEAL_SECONDS = 0.2
_ANY_SECONDS = 2.0


@dataclass(frozen=True)
class Bound:
    """A requirement.

    Attributes
    ----------
    what, reached : str
        What is required, and what was reached.
    met : bool
        Whether that is enough.
    """

    what: str
    reached: str
    met: bool


def _share(what: str, part: int, whole: int, least: float) -> Bound:
    required = f"{what}: at least {least:.0%}"
    if not whole:
        return Bound(required, "not measured", False)
    share = part / whole
    return Bound(required, f"{part} of {whole} ({share:.1%})", share >= least)


def _largest(what: str, seconds: Sequence[float], most: float) -> Bound:
    largest = max(seconds, default=math.nan)
    over = sum(one > most for one in seconds)
    reached = f"{largest:.2f} s, {over} of {len(seconds)} longer"
    return Bound(f"{what}: at most {most:g} s", reached, not largest > most)


def bounds(outcomes: Sequence[Outcome]) -> list[Bound]:
    """Return the requirements and what was reached."""
    ideals = ideals_of(outcomes)
    whole = tally(outcomes, ideals)
    classes = by_class(outcomes)
    low = [f"{name} {one.coverage:.0%}" for name, one in classes.items() if one.coverage < 0.9]
    aimed = tally((one for one in outcomes if one.drive in ("random", "triangle")), ideals)
    ideal = [
        one.processor_seconds
        for one in outcomes
        if one.imperfection == "ideal" and one.duration < _IDEAL_DURATION
    ]
    return [
        Bound("identified and wrong: none", str(len(whole.wrong)), not whole.wrong),
        _share("truth inside the interval", whole.inside, whole.numbers, 0.93),
        Bound("the same in each class: at least 90%", ", ".join(low) or "all", not low),
        _share("sliding friction usable", whole.usable, whole.unchanged, 0.85),
        _share("on random levels and triangles", aimed.usable, aimed.unchanged, 0.95),
        Bound("alarms of an unchanged valve: none", str(len(whole.alarms)), not whole.alarms),
        _share("growth declared on random levels", whole.declared, whole.grown, 0.90),
        _share("doubted records that name why", whole.named, whole.doubted, 0.80),
        _largest("ideal record", ideal, _IDEAL_SECONDS),
        _largest("any record", whole.seconds, _ANY_SECONDS),
        Bound("no failures", str(whole.failed), not whole.failed),
    ]
