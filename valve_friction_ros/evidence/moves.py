# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Moves of the stem in service: cut from the arriving samples, each condensed to a few numbers.

`MoveStream` turns samples into `Move` objects; `Moves` holds several in columns. `stamp_problem`
checks the stamps of a move before it is stored.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.held_signals import without_repeats
from valve_friction_ros.model.checks import (
    equal_by_fields,
    require_finite,
    require_non_negative,
    require_positive,
)
from valve_friction_ros.model.recording import StampedSignal
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import position_noise, quantisation_step, runs_of
from valve_friction_ros.streams import DAY
from valve_friction_ros.streams.samples import Arrivals, Kind, Samples


@equal_by_fields
@dataclass(frozen=True)
class Move:
    """One motion of the stem in one direction, from rest to rest.

    The stem has no kinetic energy at either end, so the work balance holds whatever inertia and
    stick-slip did between them:

        ∫ S_a·(P − P_ref) dx = k·(x₂² − x₁²)/2 + F_0·(x₂ − x₁) + F·|x₂ − x₁| .

    Division by x₂ − x₁ gives one linear equation: ``force`` = k·x̄ + F_0 ± F, with the mean
    position x̄ of the two ends.

    Attributes
    ----------
    begin, end : int
        When the move began and ended, ns since 1970 (UTC).
    start, stop : float
        Position of the stem before and after the move, m.
    force : float
        Mean force of the actuator over the distance, N.
    force_rate : float
        Mean rate of that force over the distance, N/s: what a lag of one second would add.
    speed : float
        Mean speed over the distance, ∫|v|·|dx| / ∫|dx|, m/s.
    onset_force, onset_position, onset_rate : float
        Force (N), position (m) and rate of the force (N/s) when the stem broke away from rest;
        nan if it did not rest before.

    Raises
    ------
    ValueError
        If a number is impossible.
    """

    begin: int
    end: int
    start: float
    stop: float
    force: float
    force_rate: float
    speed: float
    onset_force: float = math.nan
    onset_position: float = math.nan
    onset_rate: float = math.nan

    def __post_init__(self) -> None:
        if not self.begin < self.end:
            raise ValueError(f"a move must end after it begins, got {self.begin} to {self.end} ns")
        for name in ("start", "stop", "force", "force_rate"):
            require_finite(name, getattr(self, name))
        require_positive("distance", self.distance)
        require_non_negative("speed", self.speed)

    @property
    def distance(self) -> float:
        """Distance between its ends, m."""
        return abs(self.stop - self.start)

    @property
    def direction(self) -> int:
        """+1 up, −1 down."""
        return 1 if self.stop > self.start else -1


@dataclass(frozen=True, eq=False)
class Moves:
    """Columns of several moves, shape (n,) each; see `Move`.

    Attributes
    ----------
    time : ndarray of float
        End of each move, s after the first move began.
    """

    time: NDArray[np.float64]
    place: NDArray[np.float64]
    distance: NDArray[np.float64]
    direction: NDArray[np.float64]
    force: NDArray[np.float64]
    force_rate: NDArray[np.float64]
    speed: NDArray[np.float64]
    onset_force: NDArray[np.float64]
    onset_position: NDArray[np.float64]
    onset_rate: NDArray[np.float64]

    @classmethod
    def of(cls, moves: Sequence[Move]) -> "Moves":
        """Return the columns of moves, oldest first."""
        origin = moves[0].begin if moves else 0
        rows = np.array(
            [
                (
                    (one.end - origin) / 1e9,
                    0.5 * (one.start + one.stop),
                    one.distance,
                    one.direction,
                    one.force,
                    one.force_rate,
                    one.speed,
                    one.onset_force,
                    one.onset_position,
                    one.onset_rate,
                )
                for one in moves
            ],
            dtype=np.float64,
        ).reshape(-1, len(fields(cls)))
        return cls(*rows.T)

    def __len__(self) -> int:
        return self.time.size

    def __getitem__(self, chosen: slice | NDArray[np.bool_] | NDArray[np.intp]) -> "Moves":
        return Moves(*(getattr(self, field.name)[chosen] for field in fields(self)))


_MINUTE = 60_000_000_000
_DELAY = 10 * _MINUTE
"""Longest delay, ns, of a move whose stamps agree with the node's clock."""

_CLOCK_IS_SET = 10**18
"""Time, ns, of 2001-09-09: a clock that reads less is not set, or belongs to a simulation."""


def stamp_problem(move: Move, last: int | None, now: int) -> str:
    """Return why a move cannot be stored after the kept moves; empty if it can.

    Parameters
    ----------
    move : Move
        A new move.
    last : int or None
        End of the newest kept move, ns since 1970 (UTC); None without kept moves.
    now : int
        The node's clock, ns since 1970 (UTC).
    """
    if last is not None and move.begin < last:
        return "earlier than those stored"
    if now > _CLOCK_IS_SET and move.end > max(now, last or 0) + DAY:
        return "more than a day ahead of the clock and of those stored"
    return ""


def is_clock_reset(move: Move, last: int, now: int) -> bool:
    """Return whether a move agrees with the clock while the newest kept move is ahead of both.

    Several such moves show that the clock was ahead before. A single move shows little: a machine
    that has just started may not have set its clock yet.

    Parameters
    ----------
    move : Move
        A new move.
    last : int
        End of the newest kept move, ns since 1970 (UTC).
    now : int
        The node's clock, ns since 1970 (UTC).
    """
    agrees = now - _DELAY <= move.end <= now + _MINUTE
    return now > _CLOCK_IS_SET and agrees and last > max(now + _MINUTE, move.begin)


REST = 0.5
"""Time, s, over which a stem at rest does not move by more than the band of rest.

Chosen: longer than the pause of a slip between two samples at 20 Hz, shorter than the pause between
two set points."""

_BAND_NOISE = 5.0
_BAND_STEPS = 1.6
_BAND_TRAVEL = 1.5e-3
"""Band of rest: multiples of the noise (3.5 standard deviations of a difference) and of the
converter step, and share of the travel."""

_LEAST_DISTANCE = 3.0
"""Least distance of a move, in bands of rest. Chosen: the ends are then known to a few percent."""

_LONGEST_MOTION = 10.0
"""Time, s, after which a motion without a rest is cut. The kinetic energy of so slow a stem is
negligible: at 10 mm/s, 1 kg has 5·10⁻⁵ J, and 100 N over 1 mm are 0.1 J."""

_MARGIN = 2
"""Samples before and after a motion that belong to its moves, unless to the motion before."""

_GAP_PERIODS = 10
_STOPS = 0.01
"""Sampling periods beyond which a pause is a gap; and distance from a stop, share of the travel,
within which the stem may be pressed onto the stop."""

_LAG = 0.05
"""Time shift, s, of the pressure that gives the rate of the force over the distance."""


class _Signals(NamedTuple):
    """Position (m) and force (N), each at its own times, s after the first position."""

    origin: int
    time: NDArray[np.float64]
    position: NDArray[np.float64]
    force_time: NDArray[np.float64]
    force: NDArray[np.float64]
    pauses: NDArray[np.float64]

    def is_broken(self, begin: float, end: float) -> bool:
        """Whether there is a gap in either signal between two times, s."""
        if not self.pauses.size:
            return False
        return bool(np.any((self.pauses[:, 0] < end) & (self.pauses[:, 1] > begin)))

    def force_at(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        force: NDArray[np.float64] = np.interp(time, self.force_time, self.force)
        return force


def _rest_band(position: NDArray[np.float64], travel: float) -> float:
    """Return the displacement, m, that noise or a converter alone may cause."""
    step = quantisation_step(position)
    noise = math.hypot(position_noise(position), step / math.sqrt(12.0))
    least = _BAND_TRAVEL * travel if math.isfinite(travel) else 1e-3 * float(np.ptp(position))
    return max(_BAND_NOISE * noise, _BAND_STEPS * step, least)


def _moves_in(
    pressure: Samples, position: Samples, valve: Valve, band: float
) -> tuple[tuple[Move, ...], int]:
    """Cut samples into moves, with a band of rest, m (`_rest_band`).

    Returns the moves that have certainly ended, oldest first, and the stamp, ns, before which
    samples are no longer needed. Moves with a gap in either signal, and the parts of a motion near
    a stop, are left out.
    """
    newest = int(min(pressure.stamps[-1], position.stamps[-1]))
    both = _signals(pressure, position, valve, newest)
    if both.time.size < 4 or not band > 0:
        return (), int(position.stamps[0])
    runs = _motions(both, band)
    end = both.time.size - 1
    settled = both.time[-1] - 2 * REST
    done = 0
    found: list[Move] = []
    for first, final in runs:
        last = final
        if both.time[last] > both.time[-1] - 3 * REST:  # perhaps not at rest yet
            if both.time[end] - both.time[first] < _LONGEST_MOTION:
                settled = min(settled, both.time[first] - 2 * REST)
                break
            last, settled = end, both.time[end]
        begin, done = max(first - _MARGIN, done), min(last + _MARGIN, end)
        found += _moves_of(both, begin, done, first, valve, band)
    return tuple(found), both.origin + round(max(settled, both.time[done]) * 1e9)


def _signals(pressure: Samples, position: Samples, valve: Valve, newest: int) -> _Signals:
    origin = int(position.stamps[0])
    begin = max(origin, int(pressure.stamps[0]))
    inside = (position.stamps >= begin) & (position.stamps <= newest)
    time = (position.stamps[inside] - origin) / 1e9
    force_time = (pressure.stamps - origin) / 1e9
    pauses = np.array([])
    limits = [_GAP_PERIODS * float(np.median(np.diff(t))) for t in (time, force_time) if t.size > 1]
    if len(limits) == 2:
        pairs = [
            np.column_stack((t[:-1], t[1:]))[np.diff(t) > limit]
            for t, limit in zip((time, force_time), limits, strict=True)
        ]
        pauses = np.concatenate(pairs)
    force_time, values = _fresh(force_time, pressure.values)
    force = np.asarray(valve.actuator_force(values), dtype=np.float64)
    return _Signals(origin, time, position.values[inside], force_time, force, pauses)


def _fresh(
    time: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Drop repeats of a held signal: on average they lag by half of the hold."""
    if time.size < StampedSignal.FEWEST:
        return time, values
    fresh = without_repeats(StampedSignal(time, values))
    if fresh.time.size == time.size:
        return time, values
    inner = (fresh.time > time[0]) & (fresh.time < time[-1])
    return (
        np.concatenate((time[:1], fresh.time[inner], time[-1:])),
        np.concatenate((values[:1], fresh.value[inner], values[-1:])),
    )


def _motions(both: _Signals, band: float) -> list[tuple[int, int]]:
    """Return first and last sample of each motion: more than the band of rest within `REST`."""
    time, position = both.time, both.position
    before = np.searchsorted(time, time - 0.5 * REST)
    after = np.minimum(np.searchsorted(time, time + 0.5 * REST), time.size - 1)
    moving = np.abs(position[after] - position[before]) > band
    return [(first, end - 1) for first, end in runs_of(moving)]


def _moves_of(
    both: _Signals, begin: int, end: int, first: int, valve: Valve, band: float
) -> list[Move]:
    """Return the moves from begin to end, cut where they reverse and where they last too long.

    The motion is detected from sample `first` on. A motion with a gap yields no
    move: if a clock was set, the gap may span years.
    """
    found: list[Move] = []
    if both.is_broken(both.time[begin], both.time[end]):
        return found
    for low, high in _one_way(both.position, begin, end, band):
        chunks = max(1, math.ceil((both.time[high] - both.time[low]) / _LONGEST_MOTION))
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
    """Split a motion where it reverses by more than the band."""
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
    if time.size < 3 or abs(length) < _LEAST_DISTANCE * band:
        return None
    if both.is_broken(time[0], time[-1]):
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
    """Return the mean speed over the distance, between points 0.1 s apart if possible."""
    count = max(2, min(time.size, 1 + round(float(time[-1] - time[0]) / 0.1)))
    grid = np.linspace(time[0], time[-1], count)
    steps = np.diff(np.interp(grid, time, position))
    return float(np.sum(steps**2) / np.sum(np.abs(steps)) / (grid[1] - grid[0]))


def _onset(both: _Signals, begin: int, end: int, band: float) -> tuple[float, float, float]:
    """Return force, position and rate of the force when the stem leaves its rest.

    It leaves between the last sample inside half a band and the next sample.
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


_BATCH = 2_000_000_000
"""Duration of the samples that are processed together, ns. Chosen: each batch costs 0.9 ms, and a
move is seen to have ended only after a rest."""

_SHORTEST_PERIOD = 0.02
"""Sampling period, s, below which samples are averaged. Chosen: a stem slides for longer."""

_PAUSE = 0.1
_PAUSE_PERIODS = 10
"""A pause beyond both this time, s, and this number of sampling periods is a gap."""

_MOST_WAITING = 50_000
"""Most samples that are processed together, whatever their stamps."""

_BAND_MEMORY = 60.0
_BAND_PERIOD = 10.0
_BAND_FADING = 0.95
"""The band of rest is updated from the last minute every ten seconds. It shrinks only gradually."""

_SIGNALS = (Kind.PRESSURE, Kind.POSITION)
_NOTHING = Samples.joined()


class MoveStream:
    """Cuts the samples of one valve into moves, in bounded memory.

    Bad samples, gaps, and stamps that go back discard the unfinished move. Of several samples with
    the same stamp, the first is used.

    Parameters
    ----------
    valve : Valve
        Gives area, reference, stops and the range of the pressure sensor.
    """

    def __init__(self, valve: Valve) -> None:
        self._valve = valve
        self._band = math.nan
        self._seen: NDArray[np.float64] = np.empty(0)
        self.forget()

    @property
    def size(self) -> int:
        """Number of samples in memory."""
        parts = (*self._raw.values(), *self._kept.values())
        return self._held + sum(part.stamps.size for part in parts)

    def forget(self) -> None:
        """Drop the samples that are not part of a finished move."""
        self._waiting: list[Arrivals] = []
        self._held = 0
        self._count = 0
        self._due: int | None = None
        self._raw = dict.fromkeys(_SIGNALS, _NOTHING)
        self._kept = dict.fromkeys(_SIGNALS, _NOTHING)

    def take(self, arrivals: Arrivals) -> tuple[Move, ...]:
        """Take samples in the order of their arrival; return the moves that have ended."""
        if not arrivals.stamps.size:
            return ()
        self._waiting.append(arrivals)
        newest = int(arrivals.stamps[-1])
        if self._due is None:
            self._due = int(arrivals.stamps[0]) + _BATCH
        self._held += arrivals.stamps.size
        if self._due - 2 * _BATCH <= newest < self._due and self._held < _MOST_WAITING:
            return ()
        self._held = 0
        self._due = newest + _BATCH
        waiting = Arrivals.joined(self._waiting)
        self._waiting = []
        if not self._extended(waiting):
            self.forget()
            return ()
        moves = self._moves()
        self._trim()
        return moves

    def _trim(self) -> None:
        """Drop samples that have waited too long for the other signal."""
        for kind, kept in self._kept.items():
            if kept.stamps.size:
                oldest = int(kept.stamps[-1]) - round(1e9 * _BAND_MEMORY)
                first = int(np.searchsorted(kept.stamps, oldest))
                self._kept[kind] = Samples(kept.stamps[first:], kept.values[first:])

    def _extended(self, arrivals: Arrivals) -> bool:
        """Add samples; return whether they are free of faults."""
        if np.any(arrivals.kinds == Kind.NO_POSITION):
            return False
        for kind in _SIGNALS:
            new = arrivals.samples(kind)
            raw = Samples.joined(self._raw[kind], new)
            kept = self._kept[kind].stamps
            last = kept[-1:] if kept.size else raw.stamps[:1] - 1
            pauses = np.diff(raw.stamps, prepend=last)
            if np.any(pauses < 0) or not np.isfinite(new.values).all():
                return False
            if kind is Kind.PRESSURE and not self._valve.sensor_reads(new.values).all():
                return False
            raw = Samples(raw.stamps[pauses > 0], raw.values[pauses > 0])
            if raw.stamps.size < 2:
                self._raw[kind] = raw
                continue
            period = float(np.median(np.diff(raw.stamps))) / 1e9
            together = max(1, round(_SHORTEST_PERIOD / period))
            longest = 1e9 * max(_PAUSE, _PAUSE_PERIODS * period)
            if together > 1 and np.any(np.diff(raw.stamps) > longest):
                return False  # no mean may bridge a gap
            whole = raw.stamps.size // together * together
            averaged = Samples(
                raw.stamps[0]
                + _means(raw.stamps[:whole] - raw.stamps[0], together).astype(np.int64),
                _means(raw.values[:whole], together),
            )
            self._raw[kind] = Samples(raw.stamps[whole:], raw.values[whole:])
            self._kept[kind] = Samples.joined(self._kept[kind], averaged)
            if kind is Kind.POSITION:
                self._look(averaged.values, together * period)
        return True

    def _look(self, position: NDArray[np.float64], period: float) -> None:
        most = max(round(_BAND_MEMORY / period), 50)
        self._seen = np.concatenate((self._seen, position))[-most:]
        self._count += position.size
        if self._count * period < _BAND_PERIOD:
            return
        self._count = 0
        band = _rest_band(self._seen, self._valve.travel)
        self._band = max(band, _BAND_FADING * self._band) if self._band > 0 else band

    def _moves(self) -> tuple[Move, ...]:
        pressure, position = (self._kept[kind] for kind in _SIGNALS)
        if min(pressure.stamps.size, position.stamps.size) < 2 or not self._band > 0:
            return ()
        moves, settled = _moves_in(pressure, position, self._valve, self._band)
        for kind in _SIGNALS:
            kept = self._kept[kind]
            # From the end of a motion that was cut: an earlier sample would make its rest overlap.
            first = max(int(np.searchsorted(kept.stamps, settled, side="right")) - 1, 0)
            self._kept[kind] = Samples(kept.stamps[first:], kept.values[first:])
        return moves


def _means(values: NDArray[np.int64] | NDArray[np.float64], together: int) -> NDArray[np.float64]:
    if together == 1:
        return values.astype(np.float64)
    means: NDArray[np.float64] = values.reshape(-1, together).mean(axis=1)
    return means
