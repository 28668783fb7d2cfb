"""Samples of a valve in service, cut into moves."""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.evidence.moves import Move
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals.noise import position_noise, quantisation_step
from valve_friction_ros.streams.samples import Samples

__all__ = ["Cut", "moves_in", "rest_band"]

REST = 0.5
"""Time, s, over which a stem at rest does not move by more than the band of rest.

Chosen: longer than the pause of a slip between two samples at 20 Hz, shorter than that between two
set points."""

_BAND_NOISE = 5.0
_BAND_STEPS = 1.6
_BAND_TRAVEL = 1.5e-3
"""Band of rest: multiples of the noise (3.5 standard deviations of a difference) and of the step
of a converter, and share of the travel."""

_LEAST = 3.0
"""Least distance of a move, in bands of rest. Chosen: the ends are then known to a few percent."""

_LONGEST = 10.0
"""Time, s, after which a motion without a rest is cut. So slow a stem has no kinetic energy that
counts: at 10 mm/s, 1 kg has 5·10⁻⁵ J, and 100 N over 1 mm are 0.1 J."""

_GAP = 10
_STOPS = 0.01
"""Sampling periods beyond which a pause is a gap, and share of the travel at either stop in which
the stem may be pressed onto it."""

_LAG = 0.05
"""Shift, s, of the pressure by which its rate over the distance is measured."""


class Cut(NamedTuple):
    """Moves of some samples.

    Attributes
    ----------
    moves : tuple of Move
        Moves that have ended, oldest first.
    settled : int
        Stamp, ns, before which no sample is needed any more.
    """

    moves: tuple[Move, ...]
    settled: int


class _Signals(NamedTuple):
    """Force at the times of the positions: seconds from the first, N, m."""

    origin: int
    time: NDArray[np.float64]
    position: NDArray[np.float64]
    force_time: NDArray[np.float64]
    force: NDArray[np.float64]
    pauses: NDArray[np.float64]

    def force_at(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        force: NDArray[np.float64] = np.interp(time, self.force_time, self.force)
        return force


def rest_band(position: NDArray[np.float64], travel: float) -> float:
    """Return the displacement, m, that noise or a converter alone may show."""
    step = quantisation_step(position)
    noise = math.hypot(position_noise(position), step / math.sqrt(12.0))
    least = _BAND_TRAVEL * travel if math.isfinite(travel) else 1e-3 * float(np.ptp(position))
    return max(_BAND_NOISE * noise, _BAND_STEPS * step, least)


def moves_in(pressure: Samples, position: Samples, valve: Valve, band: float) -> Cut:
    """Cut samples into moves.

    Parameters
    ----------
    pressure, position : Samples
        Both signals; Pa and m.
    valve : Valve
        Gives area, reference and stops.
    band : float
        Band of rest, m (`rest_band`).

    Returns
    -------
    Cut
        The moves that have surely ended. A move with a gap in either signal is left out, and the
        parts of a motion near a stop.
    """
    newest = int(min(pressure.stamps[-1], position.stamps[-1]))
    both = _signals(pressure, position, valve, newest)
    if both.time.size < 4 or not band > 0:
        return Cut((), int(position.stamps[0]))
    runs = _motions(both, band)
    end = both.time.size - 1
    settled = both.time[-1] - 2 * REST
    done = -math.inf
    found: list[Move] = []
    for first, final in runs:
        last = final
        if both.time[last] > both.time[-1] - 3 * REST:  # perhaps not at rest yet
            if both.time[end] - both.time[first] < _LONGEST:
                settled = min(settled, max(both.time[first] - 2 * REST, done))
                break
            last, settled = end, both.time[end]
        done = both.time[last]
        found += _moves_of(both, first, last, valve, band)
    return Cut(tuple(found), both.origin + round(settled * 1e9))


def _signals(pressure: Samples, position: Samples, valve: Valve, newest: int) -> _Signals:
    origin = int(position.stamps[0])
    begin = max(origin, int(pressure.stamps[0]))
    inside = (position.stamps >= begin) & (position.stamps <= newest)
    time = (position.stamps[inside] - origin) / 1e9
    force_time = (pressure.stamps - origin) / 1e9
    pauses = np.array([])
    limits = [_GAP * float(np.median(np.diff(t))) for t in (time, force_time) if t.size > 1]
    if len(limits) == 2:
        gaps = [
            t[:-1][np.diff(t) > limit] for t, limit in zip((time, force_time), limits, strict=True)
        ]
        ends = [
            t[1:][np.diff(t) > limit] for t, limit in zip((time, force_time), limits, strict=True)
        ]
        pauses = np.column_stack((np.concatenate(gaps), np.concatenate(ends)))
    force = np.asarray(valve.actuator_force(pressure.values), dtype=np.float64)
    return _Signals(origin, time, position.values[inside], force_time, force, pauses)


def _motions(both: _Signals, band: float) -> list[tuple[int, int]]:
    """Return first and last sample of each motion: displaced by more than the band within REST."""
    time, position = both.time, both.position
    before = np.searchsorted(time, time - 0.5 * REST)
    after = np.minimum(np.searchsorted(time, time + 0.5 * REST), time.size - 1)
    moving = np.abs(position[after] - position[before]) > band
    edges = np.flatnonzero(np.diff(np.concatenate(([False], moving, [False]))))
    return [(int(first), int(last) - 1) for first, last in edges.reshape(-1, 2)]


def _moves_of(both: _Signals, first: int, last: int, valve: Valve, band: float) -> list[Move]:
    """Return the moves of one motion: cut where it turns, and where it lasts too long."""
    found = []
    margin = 2
    begin, end = max(first - margin, 0), min(last + margin, both.time.size - 1)
    for low, high in _one_way(both.position, begin, end, band):
        chunks = max(1, math.ceil((both.time[high] - both.time[low]) / _LONGEST))
        cuts = np.linspace(low, high, chunks + 1).round().astype(int)
        for b, e in pairwise(cuts.tolist()):
            rested = b == begin and both.time[first] - both.time[0] >= REST
            move = _move(both, b, e, valve, band, rested)
            if move is not None:
                found.append(move)
    return found


def _one_way(
    position: NDArray[np.float64], begin: int, end: int, band: float
) -> list[tuple[int, int]]:
    """Split a motion where it turns by more than the band."""
    part = position[begin : end + 1]
    way = 1.0 if part[-1] >= part[0] else -1.0
    ahead = way * part
    fallen = np.maximum.accumulate(ahead) - ahead
    if fallen.max() <= band or end - begin < 4:
        return [(begin, end)]
    bottom = int(np.argmax(fallen))
    top = int(np.argmax(ahead[: bottom + 1]))
    cuts = sorted({begin, begin + top, begin + bottom, end})
    found: list[tuple[int, int]] = []
    for b, e in pairwise(cuts):
        found += [(b, e)] if (b, e) == (begin, end) else _one_way(position, b, e, band)
    return found


def _move(
    both: _Signals, begin: int, end: int, valve: Valve, band: float, rested: bool
) -> Move | None:
    if math.isfinite(valve.travel):
        inside = (both.position[begin : end + 1] > _STOPS * valve.travel) & (
            both.position[begin : end + 1] < (1 - _STOPS) * valve.travel
        )
        if not inside.all():
            rested = False
            places = np.flatnonzero(inside)
            if places.size < 3 or places[-1] - places[0] + 1 != places.size:
                return None
            begin, end = begin + int(places[0]), begin + int(places[-1])
    time, position = both.time[begin : end + 1], both.position[begin : end + 1]
    length = float(position[-1] - position[0])
    if time.size < 3 or abs(length) < _LEAST * band:
        return None
    if both.pauses.size and np.any((both.pauses[:, 0] < time[-1]) & (both.pauses[:, 1] > time[0])):
        return None
    if time[0] < both.force_time[0] or time[-1] > both.force_time[-1]:
        return None
    steps = np.diff(position)
    force, earlier, later = (
        0.5 * float(np.sum((f[1:] + f[:-1]) * steps)) / length
        for f in (both.force_at(time + shift) for shift in (0.0, -_LAG, _LAG))
    )
    onset = _onset(both, begin, end, band) if rested else (math.nan,) * 3
    return Move(
        begin=both.origin + round(float(time[0]) * 1e9),
        end=both.origin + round(float(time[-1]) * 1e9),
        start=float(position[0]),
        stop=float(position[-1]),
        force=force,
        force_rate=(later - earlier) / (2 * _LAG),
        speed=_speed(time, position),
        onset_force=onset[0],
        onset_position=onset[1],
        onset_rate=onset[2],
    )


def _speed(time: NDArray[np.float64], position: NDArray[np.float64]) -> float:
    """Return the mean speed over the distance, between points 0.1 s apart where it can be."""
    count = max(2, min(time.size, 1 + round(float(time[-1] - time[0]) / 0.1)))
    grid = np.linspace(time[0], time[-1], count)
    steps = np.diff(np.interp(grid, time, position))
    return float(np.sum(steps**2) / np.sum(np.abs(steps)) / (grid[1] - grid[0]))


def _onset(both: _Signals, begin: int, end: int, band: float) -> tuple[float, float, float]:
    """Return force, position and rate of the force when the stem leaves its rest.

    It leaves between the last sample inside half a band and the next one.
    """
    position = both.position[begin : end + 1]
    rest = float(np.mean(position[:2]))
    out = np.flatnonzero(np.abs(position - rest) > 0.5 * band)
    if not out.size or out[0] == 0:
        return (math.nan,) * 3
    place = begin + int(out[0]) - 1
    moment = 0.5 * (both.time[place] + both.time[place + 1])
    force, before, after = both.force_at(moment + np.array([0.0, -_LAG, _LAG]))
    return float(force), float(both.position[place]), float(after - before) / (2 * _LAG)
