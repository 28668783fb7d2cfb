"""The moves of a valve, taken from its samples as they arrive."""

import math

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.evidence.cutting import moves_in, rest_band
from valve_friction_ros.evidence.moves import Move
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams.arrivals import Arrivals, Kind
from valve_friction_ros.streams.samples import Samples

__all__ = ["MoveStream"]

_EVERY = 1_000_000_000
"""Nanoseconds of samples that are looked at together."""

_SHORTEST = 0.02
"""Sampling period, s, below which samples are averaged. Chosen: a stem slides for longer."""

_PAUSE = 0.1
_PAUSES = 10
"""A pause of this many seconds, and of so many periods, is a gap."""

_MOST_WAITING = 50_000
"""Samples that are looked at together at most, whatever their stamps."""

_MEMORY = 60.0
_LOOK = 10.0
_FADING = 0.95
"""The band of rest is read from the last minute, every ten seconds; a smaller one replaces it by
and by."""

_SIGNALS = (Kind.PRESSURE, Kind.POSITION)
_NOTHING = Samples.joined()


class MoveStream:
    """Cuts the samples of one valve into moves, in bounded memory.

    Bad samples, gaps, and stamps that go back end a move without evidence. Of samples with the same
    stamp the first counts.

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
        """Samples in memory."""
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
        """Take samples in the order in which they came; return the moves that have ended."""
        if not arrivals.stamps.size:
            return ()
        self._waiting.append(arrivals)
        newest = int(arrivals.stamps[-1])
        if self._due is None:
            self._due = int(arrivals.stamps[0]) + _EVERY
        self._held += arrivals.stamps.size
        if self._due - 2 * _EVERY <= newest < self._due and self._held < _MOST_WAITING:
            return ()
        self._held = 0
        self._due = newest + _EVERY
        waiting = Arrivals.joined(self._waiting)
        self._waiting = []
        if not self._extended(waiting):
            self.forget()
            return ()
        moves = self._moves()
        self._trim()
        return moves

    def _trim(self) -> None:
        """Drop what has waited too long for the other signal."""
        for kind, kept in self._kept.items():
            if kept.stamps.size:
                oldest = int(kept.stamps[-1]) - round(1e9 * _MEMORY)
                first = int(np.searchsorted(kept.stamps, oldest))
                self._kept[kind] = Samples(kept.stamps[first:], kept.values[first:])

    def _extended(self, arrivals: Arrivals) -> bool:
        """Add samples; tell whether there is no fault in them."""
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
            together = max(1, round(_SHORTEST / period))
            longest = 1e9 * max(_PAUSE, _PAUSES * period)
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
        """Follow the noise of the position."""
        most = max(round(_MEMORY / period), 50)
        self._seen = np.concatenate((self._seen, position))[-most:]
        self._count += position.size
        if self._count * period < _LOOK:
            return
        self._count = 0
        band = rest_band(self._seen, self._valve.travel)
        self._band = max(band, _FADING * self._band) if self._band > 0 else band

    def _moves(self) -> tuple[Move, ...]:
        pressure, position = (self._kept[kind] for kind in _SIGNALS)
        if min(pressure.stamps.size, position.stamps.size) < 2 or not self._band > 0:
            return ()
        cut = moves_in(pressure, position, self._valve, self._band)
        for kind in _SIGNALS:
            kept = self._kept[kind]
            first = max(int(np.searchsorted(kept.stamps, cut.settled)) - 1, 0)
            self._kept[kind] = Samples(kept.stamps[first:], kept.values[first:])
        return cut.moves


def _means(values: NDArray[np.int64] | NDArray[np.float64], together: int) -> NDArray[np.float64]:
    if together == 1:
        return values.astype(np.float64)
    means: NDArray[np.float64] = values.reshape(-1, together).mean(axis=1)
    return means
