"""The last seconds of two signals, thinned to what a screen can show."""

import threading
from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["LiveStrip", "Strip", "envelope"]

_Floats = NDArray[np.float64]


class Strip(NamedTuple):
    """A signal as it is drawn: times (s, the newest sample of both signals is 0) and values."""

    times: _Floats
    values: _Floats


def envelope(times: _Floats, values: _Floats, columns: int, span: float) -> Strip:
    """Return the lowest and the highest sample of each column of pixels, in the order of time.

    The columns share the last `span` seconds before time 0. A signal with fewer than two samples
    a column is returned whole. Nothing that a screen of this width would show is lost.
    """
    inside = times >= -span
    times, values = times[inside], values[inside]
    if times.size <= 2 * columns:
        return Strip(times, values)
    column = np.clip(((times + span) * (columns / span)).astype(np.int64), 0, columns - 1)
    order = np.lexsort((values, column))
    edges = np.flatnonzero(np.diff(column[order])) + 1
    lowest, highest = order[np.r_[0, edges]], order[np.r_[edges - 1, order.size - 1]]
    kept = np.unique(np.concatenate([lowest, highest]))
    return Strip(times[kept], values[kept])


class LiveStrip:
    """Samples of pressure and stem of one valve, from its subscriptions, behind a lock.

    Parameters
    ----------
    span : float
        Seconds that are kept.
    most : int, optional
        Most samples of a signal that are kept.
    """

    def __init__(self, span: float, most: int = 120_000) -> None:
        self.span = span
        self._lock = threading.Lock()
        self._signals: tuple[deque[tuple[int, float]], ...] = tuple(
            deque(maxlen=most) for _ in range(2)
        )

    def add(self, signal: int, stamps: NDArray[np.int64], values: _Floats) -> None:
        """Add samples: of the pressure (0), Pa, or of the stem (1), m; the stamps are ns.

        A stamp that goes back, as when a bag begins again, empties the signal.
        """
        with self._lock:
            kept = self._signals[signal]
            if stamps.size and kept and int(stamps[-1]) < kept[-1][0] - 1_000_000_000:
                kept.clear()
            kept.extend(zip(stamps.tolist(), values.tolist(), strict=True))
            oldest = (kept[-1][0] if kept else 0) - round(self.span * 1e9)
            while kept and kept[0][0] < oldest:
                kept.popleft()

    def _samples(self) -> tuple[tuple[NDArray[np.int64], _Floats], ...]:
        with self._lock:
            copies = [list(kept) for kept in self._signals]
        return tuple(
            (
                np.array([stamp for stamp, _ in one], dtype=np.int64),
                np.array([value for _, value in one], dtype=np.float64),
            )
            for one in copies
        )

    def strips(self, columns: int) -> tuple[Strip, Strip]:
        """Return pressure and stem, each with two points a column of pixels at most."""
        signals = self._samples()
        newest = max((int(stamps[-1]) for stamps, _ in signals if stamps.size), default=0)
        pressure, stem = (
            envelope((stamps - newest) / 1e9, values, columns, self.span)
            for stamps, values in signals
        )
        return pressure, stem

    def loop(self, most: int) -> Strip:
        """Return the stem over the pressure: at most `most` samples, as (pressure, position)."""
        (stamps, pressures), (times, positions) = self._samples()
        if stamps.size < 2 or times.size < 2:
            return Strip(np.empty(0), np.empty(0))
        step = -(-stamps.size // most)
        at = stamps[::step]
        at = at[(at >= times[0]) & (at <= times[-1])]
        origin = int(stamps[0])
        return Strip(
            np.interp(at - origin, stamps - origin, pressures),
            np.interp(at - origin, times - origin, positions),
        )
