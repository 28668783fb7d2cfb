"""Hunting: a stem that swings though its command stands still."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.response.move import stem_noise
from valve_friction_ros.streams import Samples

__all__ = ["Hunting", "hunting"]

_LEAST = 3e-3
"""Share of the travel of the smallest swing that counts."""

_GATE = 8.0
"""Standard deviations of the noise of the smallest swing."""

_SWINGS = 5
"""Swings, half periods, that hunting needs, the latest ones."""

_REGULAR = 2.5
"""Longest over shortest of them, and largest over smallest, of one limit cycle."""

_OVER = 2.0
"""Longest half periods without a turn after which it is over."""

_NEAR = 0.1
"""Share of a swing at either end that counts as resting there: a sine is there for 0.41 of the
time, a triangle for 0.2, a square for all of it."""

_DRIVEN = 0.25
"""Share of a swing by which the command itself may swing with it: noise hides it where it is small,
so that the command seems to stand still."""

_SQUARE, _SWINGING = 0.7, 0.5

_Values = NDArray[np.float64]


@dataclass(frozen=True)
class Hunting:
    """A limit cycle at a command that stands still.

    Attributes
    ----------
    period : float
        s.
    amplitude : float
        From end to end, share of the travel.
    sticks : bool
        Whether the stem rests at both ends and jumps while the pressure swings on: stiction, and
        integral action of the positioner. False: it cannot be told.
    """

    period: float
    amplitude: float
    sticks: bool


def _turns(values: _Values, gate: float) -> list[int]:
    """Return the samples of the extremes that lie at least `gate` from the one before."""
    turns: list[int] = []
    low = high = 0
    way = 0
    for place, value in enumerate(values.tolist()):
        if value > values[high]:
            high = place
        if value < values[low]:
            low = place
        if way >= 0 and values[high] - value > gate:
            turns.append(high)
            way, low = -1, place
        elif way <= 0 and value - values[low] > gate:
            turns.append(low)
            way, high = 1, place
        if way > 0 and value > values[high]:
            high = place
    return turns


def _crossing(values: _Values, turn: int, following: int) -> int:
    """Return the sample at which a swing passes its middle; ends are blurred by noise."""
    swing = values[turn : following + 1] - values[turn]
    return turn + int(np.argmax(np.abs(swing) >= abs(swing[-1]) / 2))


def _near_ends(values: _Values, gate: float) -> float:
    """Return the share of the time that a signal spends near the ends of its range."""
    low, high = (float(each) for each in np.percentile(values, (2, 98)))
    near = max(_NEAR * (high - low), gate)
    return float(np.mean((values <= low + near) | (values >= high - near)))


def _means(times: _Values, wanted: _Values, edges: _Values) -> _Values:
    """Return the means of a command, which holds its value until its next sample, between edges."""
    areas = np.concatenate([[0.0], np.cumsum(wanted[:-1] * np.diff(times))])
    last = np.maximum(np.searchsorted(times, edges, side="right") - 1, 0)
    means: _Values = np.diff(areas[last] + wanted[last] * (edges - times[last])) / np.diff(edges)
    return means


def _own_swing(turns: _Values, times: _Values, wanted: _Values) -> float:
    """Return how much the command swings with a stem that turns at these times.

    It is the change of its mean from one swing to the next, and that a quarter of a period later,
    as the square root of the sum of their squares: so the lag of the stem does not matter. Of a
    sine it is 4/π of the amplitude.
    """
    edges = turns, (turns[1:] + turns[:-1]) / 2
    changes = [np.median(np.abs(np.diff(_means(times, wanted, each)))) for each in edges]
    return float(np.hypot(*changes))


def hunting(
    stem: Samples, pressure: Samples, wanted: Samples, since: int, travel: float
) -> Hunting | None:
    """Look for a limit cycle since the command stands still.

    Parameters
    ----------
    stem, pressure, wanted : Samples
        Position, m, pressure, Pa, and command, m, at about ten samples a second or, of the command,
        when it changes.
    since : int
        Since when the command stands still, ns.
    travel : float
        m.

    Returns
    -------
    Hunting or None
        None without five regular swings, or where the command itself swings with them.
    """
    held = stem.stamps >= since
    times, x = (stem.stamps[held] - since) / 1e9, stem.values[held] / travel
    if x.size < 4 * _SWINGS or pressure.stamps.size < 2:
        return None
    gate = max(_LEAST, _GATE * stem_noise(x))
    turns = _turns(x, gate)[-_SWINGS - 1 :]
    if len(turns) <= _SWINGS:
        return None
    swings = np.abs(np.diff(x[turns]))
    halves = np.diff(times[[_crossing(x, *pair) for pair in pairwise(turns)]])
    # Halves may differ, as friction up and down does; whole periods must not.
    wholes = halves[1:] + halves[:-1]
    if (
        min(float(swings.min()), float(wholes.min())) <= 0
        or max(float(swings.max() / swings.min()), float(wholes.max() / wholes.min())) > _REGULAR
    ):
        return None
    if times[-1] - times[turns[-1]] > _OVER * halves.max():
        return None
    asked = (wanted.stamps - since) / 1e9, wanted.values / travel
    if _own_swing(times[turns], *asked) > _DRIVEN * float(np.median(swings)):
        return None
    cycle = slice(turns[0], turns[-1] + 1)
    p = np.interp(times[cycle] * 1e9 + since, pressure.stamps, pressure.values)
    quiet = _GATE / 2 * stem_noise(x)
    sticks = _near_ends(x[cycle], quiet) >= _SQUARE and _near_ends(p, 0.0) <= _SWINGING
    return Hunting(float(np.mean(wholes)), float(np.median(swings)), sticks)
