"""One move of a stem in service: its answer to one step of the command."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.steps.step_response import first_beyond, step_test
from valve_friction_ros.response.command_steps import Change
from valve_friction_ros.signals.noise import position_noise, quantisation_step
from valve_friction_ros.streams import Samples

__all__ = ["Move", "evaluated", "is_quiet", "stem_noise"]

_PERIOD = 0.01
"""Least time between two points of the grid, s."""

_BEFORE = 0.5
"""Time before the step that gives the steady values, s."""

_VISIBLE = 1e-3
"""Share of the travel above which a movement counts. Chosen: a tenth of the dead band of a good
valve (1 %), above the creep of a stem before it breaks away."""

_GATE = 6.0
"""Standard deviations of the noise above which a change is seen."""

_COARSEST = 5e-3
"""Share of the travel of the coarsest step of a converter: 8 bits."""

_PRESSURE_SHARE = 0.02
"""Share of the pressure's largest change of a move at which it has begun to answer."""

_TAIL = 0.4
"""Share of the time since the step, at its end, that is quiet once the stem has settled."""

_T86 = -math.expm1(-2.0)

_Values = NDArray[np.float64]


@dataclass(frozen=True)
class Move:
    """The answer of stem and actuator to a step of the command.

    Positions are shares of the travel; times are since the step, s, nan where they are not known.

    Attributes
    ----------
    stamp : int
        Stamp of the step, ns.
    change : float
        Change of the command.
    held : float
        Time until it settled, or the next command came.
    moved : bool
        Whether the stem moved.
    settled : bool
        Whether stem and pressure came to rest.
    dead_time, t63, t86, overshoot : float
        As `StepMetrics` has them, of a stem that rested before; all but the dead time need one
        that settled.
    steady_error : float
        Command less position of the settled stem.
    deviation, high_deviation : float
        Mean, and 95th percentile in time, of the magnitude of command less position.
    pressure_delay : float
        Until the pressure began to change the way of the command; nan if it never did.
    pressure_t86 : float
        Until the pressure had 86.5 % of its change between the first movement of the stem and the
        end.
    push : float
        Change of the pressure, the way of the command, until the stem first moved; where it did
        not, the largest; Pa.
    pressure, position : float
        Means over the end, Pa and share of the travel.
    rested, pressure_rested : bool
        Whether the stem, and the pressure, rested before the step.
    at_stop : bool
        Whether it began or ended at a stop, where the pressure says nothing of friction.
    """

    stamp: int
    change: float
    held: float
    moved: bool
    settled: bool
    dead_time: float
    t63: float
    t86: float
    overshoot: float
    steady_error: float
    deviation: float
    high_deviation: float
    pressure_delay: float
    pressure_t86: float
    push: float
    pressure: float
    position: float
    rested: bool
    pressure_rested: bool
    at_stop: bool


_AT_STOP = 0.02
"""Share of the travel within which the stem is at a stop. Chosen: above the error of a position."""


def stem_noise(position: _Values) -> float:
    """Estimate the noise of a position, share of the travel, with the rounding of a converter.

    Two levels of a stem that jumps are no codes of a converter, so that its step is bounded.
    """
    step = min(quantisation_step(position), _COARSEST)
    return math.hypot(position_noise(position), step / math.sqrt(12.0))


def is_quiet(values: _Values, least: float) -> bool:
    """Return whether a signal stays within `least`, or within its noise, of one value."""
    if values.size < 2:
        return False
    band = max(least, 2 * _GATE * position_noise(values))
    # Thirds, because noise alone hides a slow drift.
    thirds = [float(np.mean(part)) for part in np.array_split(values, 3) if part.size]
    return float(np.ptp(values)) <= band and max(thirds) - min(thirds) <= max(least, band / 4)


def _steady(values: _Values) -> float:
    return float(np.mean(values))


def evaluated(
    change: Change, stem: Samples, pressure: Samples, end: int, travel: float
) -> Move | None:
    """Evaluate the move after a step of the command.

    Parameters
    ----------
    change : Change
        The step, m.
    stem, pressure : Samples
        Position, m, and pressure, Pa, from before the step on.
    end : int
        When it settled, or the next command came, ns.
    travel : float
        m.

    Returns
    -------
    Move or None
        None where the signals do not cover the step.
    """
    before = change.stamp - round(min(_BEFORE, change.held / 2) * 1e9)
    covered = all(s.stamps.size and s.stamps[0] <= before for s in (stem, pressure))
    if not covered or min(stem.stamps[-1], pressure.stamps[-1], end) <= change.stamp:
        return None
    period = max(float(np.median(np.diff(stem.stamps))) / 1e9, _PERIOD)
    start = max(math.ceil((change.stamp - before) / 1e9 / period), 2)
    count = start + round((end - change.stamp) / 1e9 / period)
    grid = (np.arange(count, dtype=np.float64) - start) * period
    x = np.interp(grid, (stem.stamps - change.stamp) / 1e9, stem.values) / travel
    p = np.interp(grid, (pressure.stamps - change.stamp) / 1e9, pressure.values)
    if count - start < 10:
        return None
    return _measured(change, grid, x, p, start, travel)


def _measured(
    change: Change, grid: _Values, x: _Values, p: _Values, start: int, travel: float
) -> Move:
    period, low, high = grid[1] - grid[0], change.before / travel, change.after / travel
    command = np.where(grid < 0, low, high)
    tail = slice(start + round((1 - _TAIL) * (grid.size - start)), None)
    way, span = math.copysign(1.0, high - low), float(np.ptp(p))
    settled = is_quiet(x[tail], _VISIBLE) and is_quiet(p[tail], 0.05 * span)
    least = max(_VISIBLE, _GATE * stem_noise(x))
    (step,) = step_test(command, x, period, [start], least).steps
    pre_x, pre_p = x[: start - 1], p[: start - 1]
    answer, rise = way * (x[start:] - _steady(pre_x)), way * (p[start:] - _steady(pre_p))
    dead_time = period * float(first_beyond(answer, least))
    moved = step.moved and math.isfinite(dead_time)
    gate = max(_GATE * position_noise(p), _PRESSURE_SHARE * float(np.max(np.abs(rise))))
    delay = period * float(first_beyond(rise, gate)) if gate > 0 else math.nan
    away = np.abs(command[start:] - x[start:])
    push, pressure_t86 = float(np.max(rise)), math.nan
    if moved:
        push = float(np.interp(dead_time, grid[start:], rise))
        rest = float(np.mean(rise[tail.start - start :])) - push
        pressure_t86 = period * float(first_beyond(rise, push + _T86 * max(rest, 0.0)))
    rested = is_quiet(pre_x, _VISIBLE)
    known = settled and moved and rested
    return Move(
        stamp=change.stamp,
        change=high - low,
        held=float(grid[-1]),
        moved=moved,
        settled=settled,
        dead_time=dead_time if moved and rested else math.nan,
        t63=step.t63 if known else math.nan,
        t86=step.t86 if known else math.nan,
        overshoot=step.overshoot if known else math.nan,
        steady_error=high - _steady(x[tail]) if settled else math.nan,
        deviation=float(np.mean(away)),
        high_deviation=float(np.percentile(away, 95)),
        pressure_delay=delay,
        pressure_t86=pressure_t86,
        push=push,
        pressure=_steady(p[tail]),
        position=_steady(x[tail]),
        rested=rested,
        pressure_rested=is_quiet(pre_p, 0.05 * span),
        at_stop=any(
            not _AT_STOP < each < 1 - _AT_STOP for each in (low, high, float(x[0]), float(x[-1]))
        ),
    )
