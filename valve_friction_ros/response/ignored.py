"""Large steps that the stem has ignored: a seized stem, a frozen sensor, or no pressure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from valve_friction_ros.response.move import Move

__all__ = ["ANSWER_TIME", "IgnoredSteps", "has_ignored", "ignored_steps", "large_step"]

ANSWER_TIME = 5.0
"""Time, s, for which a step must last before a stem that rests has ignored it."""

_LATEST, _MOST_ANSWERED = 5, 1
"""Latest large steps that are judged, and how many of them a stem in trouble may have answered."""

_LEAST, _LARGE = 0.02, 0.05
"""Share of the travel: no step below the first is large, twice the dead band of a good valve (1 %),
and every step of the second is, unless the dead band is known to be wider. Chosen."""

_FROM_STOP = 0.1
"""Share of the travel that a step from or to a stop must have: a positioner may hold the stem on
its seat up to a few percent (cut-off). Chosen."""


@dataclass(frozen=True)
class IgnoredSteps:
    """The latest large steps, most of which the stem has ignored.

    Attributes
    ----------
    latest : tuple of Move
        They, the answered ones too.
    least : float
        Share of the travel from which a step is large.
    """

    latest: tuple[Move, ...]
    least: float

    @property
    def number(self) -> int:
        """How many were ignored."""
        return sum(map(has_ignored, self.latest))

    @property
    def remaining_causes(self) -> str:
        """What the pressure has left to suspect."""
        answered = [math.isfinite(m.pressure_delay) for m in self.latest if has_ignored(m)]
        if all(answered):
            return (
                "the pressure answers: the stem is stuck, or its position sensor has stopped: "
                "look at the stem"
            )
        if not any(answered):
            return (
                "nor does the pressure answer: it does not reach the actuator: check the "
                "positioner, its command and the air supply"
            )
        return (
            "the pressure answers some of them: the stem is stuck, its position sensor has "
            "stopped, or the pressure does not always reach the actuator"
        )


def has_ignored(move: Move) -> bool:
    """Return whether a step lasted long enough and did not move the stem."""
    return not move.moved and move.held >= ANSWER_TIME


def large_step(moves: Sequence[Move], dead_band: float = math.nan) -> float:
    """Return from which size on a stem should answer a step, share of the travel.

    It is the dead band where that is known, else the median of the steps that were answered, or 5 %
    if none was.
    """
    if math.isfinite(dead_band):
        return max(dead_band, _LEAST)
    sizes = [abs(m.change) for m in moves if m.moved]
    # Commands of one size differ by their rounding.
    usual = (1 - 1e-6) * float(np.median(sizes)) if sizes else _LARGE
    return min(max(usual, _LEAST), (1 - 1e-6) * _LARGE)


def ignored_steps(moves: Sequence[Move], dead_band: float = math.nan) -> IgnoredSteps | None:
    """Return the latest five large steps if at most one of them was answered; else None.

    Parameters
    ----------
    moves : sequence of Move
        Oldest first.
    dead_band : float
        Share of the travel; nan if not known.
    """
    least = large_step(moves, dead_band)
    large = [
        m
        for m in moves
        if abs(m.change) >= (max(least, _FROM_STOP) if m.at_stop else least)
        and (m.moved or has_ignored(m))
    ]
    found = IgnoredSteps(tuple(large[-_LATEST:]), least)
    enough = len(found.latest) == _LATEST
    return found if enough and found.number >= _LATEST - _MOST_ANSWERED else None
