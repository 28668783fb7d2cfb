# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The last seconds of two signals, thinned to the resolution of a screen."""

import threading
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.streams.samples import Samples

_STILL = 2.0
"""Time without a sample, s, after which the axis moves on by itself."""

_Floats = NDArray[np.float64]


class Strip(NamedTuple):
    """A signal to draw: times, s before now, and values."""

    times: _Floats
    values: _Floats


def envelope(times: _Floats, values: _Floats, columns: int, span: float) -> Strip:
    """Return the lowest and highest sample per column of pixels, in order of time.

    The columns divide the last `span` seconds before time 0. A signal with at most two samples per
    column is returned whole. A screen of this width shows no difference.
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

    It keeps the samples of the last `span` seconds, at most `most` per signal. `trouble` says why
    no samples can arrive; it is empty if no fault is known.
    """

    def __init__(
        self, span: float, most: int = 120_000, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.span = span
        self.trouble = ""
        self._most, self._clock = most, clock
        self._lock = threading.Lock()
        self._signals = [Samples.joined(), Samples.joined()]
        self._arrivals: list[float | None] = [None, None]
        self._count = 0

    def add(self, signal: int, stamps: NDArray[np.int64], values: _Floats) -> None:
        """Add samples of pressure (0), Pa, or stem (1), m, with stamps in ns.

        A stamp that goes back, as when a bag restarts, clears the signal.
        """
        if not stamps.size:
            return
        with self._lock:
            kept = self._signals[signal]
            if kept.stamps.size and stamps[-1] < kept.stamps[-1] - 1_000_000_000:
                kept = Samples.joined()
            both = Samples.joined(kept, Samples(stamps, values))
            stamps, values = both.stamps[-self._most :], both.values[-self._most :]
            begin = int(np.argmax(stamps >= stamps[-1] - round(self.span * 1e9)))
            self._signals[signal] = Samples(stamps[begin:], values[begin:])
            self._arrivals[signal] = self._clock()
            self._count += 1

    @property
    def revision(self) -> tuple[int, int]:
        """Revision that changes with each arrival, and each second while the axis moves alone."""
        still = self._still()
        return self._count, int(min(still, self.span + 1.0)) if still > _STILL else 0

    def _still(self) -> float:
        """Return the time since the last sample of either signal, s; 0 before the first."""
        known = [one for one in self._arrivals if one is not None]
        return max(0.0, self._clock() - max(known)) if known else 0.0

    def note(self) -> str:
        """Return which signal is missing; empty while both arrive."""
        if self.trouble:
            return self.trouble
        pressure, stem = self._arrivals
        if pressure is None and stem is None:
            return "No samples have been received yet."
        if (still := self._still()) > _STILL:
            return f"no sample for {still:.0f} s"
        late = [
            f"no {name}" + ("" if at is None else f" for {self._clock() - at:.0f} s")
            for name, at in (("pressure", pressure), ("stem", stem))
            if at is None or self._clock() - at > _STILL
        ]
        return "".join(late)

    def strips(self, columns: int) -> tuple[Strip, Strip]:
        """Return pressure and stem, each with at most two points per column of pixels.

        The newest sample is at 0 s while samples arrive, and then moves to the left.
        """
        with self._lock:
            signals = tuple(self._signals)
        newest = max((int(stamps[-1]) for stamps, _ in signals if stamps.size), default=0)
        still = self._still()
        shift = still if still > _STILL else 0.0
        pressure, stem = (
            envelope((stamps - newest) / 1e9 - shift, values, columns, self.span)
            for stamps, values in signals
        )
        return pressure, stem

    def loop(self, most: int) -> Strip:
        """Return stem over pressure with at most `most` samples, as (pressure, position)."""
        with self._lock:
            (stamps, pressures), (times, positions) = self._signals
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
