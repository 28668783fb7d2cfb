"""Whether the positioner or the valve is to blame: the actuator pressure tells."""

import math
from collections.abc import Callable, Sequence
from enum import Enum
from itertools import combinations

import numpy as np

from valve_friction_ros.response.move import Move

__all__ = ["Cause", "blamed", "deviation_cause", "late_cause", "slow_cause", "travel_per_pressure"]

_DOMINANT = 0.6
"""Share of a time, or of a deviation, above which one part of it is the cause."""

_STICKY = 0.02
"""Pressure that friction takes, as the travel that it would make, above which it is to blame:
twice the dead band of a good valve (1 %)."""

_FREE = 0.01
"""As above: what a good valve takes."""

_FEWEST = 5
"""Moves that a verdict needs."""

_AGREEING = 0.8
"""Share of them that must agree."""

_LEAST_SPREAD = 0.05
"""Share of the travel over which steady positions must lie to give the travel per pressure."""

_MOST_POINTS = 30

_FEWEST_OF_A_DIRECTION = 3


class Cause(Enum):
    """What makes a stem late, slow or wrong."""

    FRICTION = "the pressure answers and friction holds the stem: check packing and guide"
    LATE = "the pressure itself answers late: check the positioner"
    SLOW = "the pressure itself is slow: check positioner, air supply and volume"
    SETTING = (
        "the stem follows its pressure, which stops short: check calibration and gain of the "
        "positioner, and the air supply"
    )
    UNKNOWN = "pressure and stem do not tell whether positioner or valve is to blame"


def travel_per_pressure(moves: Sequence[Move]) -> float:
    """Return the share of the travel that a pascal makes; nan if not known.

    It is the median slope between the ends of two moves of one direction (Theil and Sen), which
    friction holds off to the same side.
    """
    slopes = []
    for way in (-1.0, 1.0):
        ends = [(m.pressure, m.position) for m in moves if m.change * way > 0 and not m.at_stop]
        slopes += [
            (x - other_x) / (p - other_p)
            for (p, x), (other_p, other_x) in combinations(ends[-_MOST_POINTS:], 2)
            if abs(x - other_x) >= _LEAST_SPREAD and p != other_p
        ]
    if len(slopes) < _FEWEST:
        return math.nan
    slope = float(np.median(slopes))
    return slope if slope > 0 else math.nan


def _by_push(move: Move, slope: float, otherwise: Cause) -> Cause:
    """Blame friction if it took much pressure, and `otherwise` if it took little."""
    push = move.push * slope
    if push >= _STICKY:
        return Cause.FRICTION
    return otherwise if push <= _FREE else Cause.UNKNOWN


def late_cause(move: Move, slope: float) -> Cause:
    """Return why a stem began to move late, or did not."""
    total = move.dead_time if move.moved else move.held
    if not move.pressure_rested:
        return _by_push(move, slope, Cause.UNKNOWN)
    late = total if math.isnan(move.pressure_delay) else min(move.pressure_delay, total)
    if late >= _DOMINANT * total:
        return Cause.LATE
    if late <= (1 - _DOMINANT) * total:
        return _by_push(move, slope, Cause.SLOW)
    return Cause.UNKNOWN


def slow_cause(move: Move, slope: float) -> Cause:
    """Return why a stem had late what it should have had at T86."""
    if not move.t86 > 0 or not move.pressure_rested:
        return Cause.UNKNOWN
    late = min(move.pressure_delay, move.dead_time)
    if late >= _DOMINANT * move.t86:
        return Cause.LATE
    if move.dead_time - late >= _DOMINANT * move.t86:
        return _by_push(move, slope, Cause.SLOW)
    moving = move.t86 - move.dead_time
    if moving < _DOMINANT * move.t86:
        return Cause.UNKNOWN
    with_pressure = (move.pressure_t86 - move.dead_time) / moving
    if with_pressure >= _DOMINANT:
        return Cause.SLOW
    return Cause.UNKNOWN


def deviation_cause(moves: Sequence[Move], slope: float) -> Cause:
    """Return why a stem comes to rest where the command does not want it.

    Friction leaves it behind after moves of either direction. Where the stem is off to one side
    after both, its pressure has been led there, if the stem moves at all.
    """
    resting = [m for m in moves if m.settled and not m.at_stop]
    follows = 2 * sum(m.moved for m in resting) > len(resting)
    errors = {way: [m.steady_error for m in resting if m.change * way > 0] for way in (1.0, -1.0)}
    if min(map(len, errors.values())) < _FEWEST_OF_A_DIRECTION:
        return Cause.UNKNOWN
    up, down = (float(np.median(each)) for each in errors.values())
    size = float(np.median(np.abs([*errors[1.0], *errors[-1.0]])))
    offset, behind = abs(up + down) / 2, (up - down) / 2
    if offset >= _DOMINANT * size and abs(behind) <= (1 - _DOMINANT) * size:
        return Cause.SETTING if follows else Cause.UNKNOWN
    if behind < _DOMINANT * size:
        return Cause.UNKNOWN
    pushes = [m.push * slope for m in moves if m.rested and not m.at_stop]
    push = float(np.percentile(pushes or [math.nan], 75))
    if push >= max(_STICKY, behind):
        return Cause.FRICTION
    return Cause.SETTING if follows and push <= _FREE < behind else Cause.UNKNOWN


def blamed(moves: Sequence[Move], slope: float, cause_of: Callable[[Move, float], Cause]) -> Cause:
    """Return what most moves blame.

    Moves from or to a stop, and of a stem that did not rest, are left out. Fewer than five, or
    less than four in five that agree, tell nothing.
    """
    asked = [cause_of(m, slope) for m in moves if m.rested and not m.at_stop]
    if len(asked) >= _FEWEST:
        for cause in Cause:
            if asked.count(cause) >= _AGREEING * len(asked):
                return cause
    return Cause.UNKNOWN
