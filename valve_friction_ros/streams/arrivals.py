"""Samples of both signals in the order in which they came."""

import math
from collections.abc import Iterable, Sequence
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from valve_friction_ros.streams.samples import Samples

__all__ = ["COLUMNS", "MOST_POSITION", "Arrivals", "Kind", "rows_arrived"]

COLUMNS = ("time", "pressure", "position")
"""Columns of a table of samples: s, Pa, m."""


MOST_POSITION = 10.0
"""Largest reading of a stem position, m, either way. Chosen: the longest pistons of control valves
travel 0.6 m, the gates of dams some metres, and a sensor's zero may lie elsewhere."""

_SECOND = 1_000_000_000
"""Nanoseconds of a second."""

_LATEST = 9.2e9
"""Largest time, s, rounded down: 64 bits of nanoseconds hold 9.22e9 s."""


class Kind(IntEnum):
    """Kind of a sample that arrived."""

    PRESSURE = 0
    POSITION = 1
    NO_POSITION = 2
    """A message of the stem without a position of the joint."""


class Arrivals(NamedTuple):
    """Samples that arrived since the last call.

    Attributes
    ----------
    kinds : ndarray of uint8, shape (n,)
        A `Kind` for each.
    stamps : ndarray of int64, shape (n,)
        Times, ns.
    values : ndarray of float, shape (n,)
        Pressures (Pa) and positions (m); nan where there is none.
    """

    kinds: NDArray[np.uint8]
    stamps: NDArray[np.int64]
    values: NDArray[np.float64]

    @classmethod
    def joined(cls, parts: "Iterable[Arrivals]") -> "Arrivals":
        """Join what arrived one after the other; none are an empty one."""
        nothing = cls(np.empty(0, np.uint8), np.empty(0, np.int64), np.empty(0))
        return cls(*map(np.concatenate, zip(nothing, *parts, strict=True)))

    def plausible(self) -> "Arrivals":
        """Return them with nan for positions that no valve has."""
        beyond = (self.kinds == Kind.POSITION) & (np.abs(self.values) > MOST_POSITION)
        if not beyond.any():
            return self
        return self._replace(values=np.where(beyond, np.nan, self.values))

    def samples(self, kind: Kind) -> Samples:
        """Return the samples of one kind."""
        wanted = self.kinds == kind
        return Samples(self.stamps[wanted], self.values[wanted])


def rows_arrived(table: ArrayLike, labels: Sequence[str] = COLUMNS) -> Arrivals:
    """Split a table into samples of both signals: of each row the pressure, then the position.

    The table has the shape (n, 3), one row per sample, and its `labels` are `COLUMNS`. A time is
    rounded to the finest decimal that floats of this size resolve: nanoseconds below 97 days,
    microseconds for seconds since 1970. So a time of whole microseconds comes back exactly.

    Raises ValueError if the table has another shape or other columns, or a time does not fit a
    64-bit clock.
    """
    if tuple(labels) != COLUMNS:
        raise ValueError(f"the columns are {','.join(labels)!r}, not {','.join(COLUMNS)!r}")
    rows = np.asarray(table, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != len(COLUMNS):
        raise ValueError(f"the shape is {rows.shape}, not (n, {len(COLUMNS)})")
    kinds = np.tile(np.array([Kind.PRESSURE, Kind.POSITION], np.uint8), len(rows))
    return Arrivals(kinds, np.repeat(_stamps(rows[:, 0]), 2), rows[:, 1:].ravel())


def _stamps(seconds: NDArray[np.float64]) -> NDArray[np.int64]:
    if not (np.abs(seconds) < _LATEST).all():
        raise ValueError(
            "a time is not finite, or beyond the year 2262, the end of 64-bit nanoseconds"
        )
    apart = 1e9 * np.spacing(np.abs(seconds).max(initial=0.0))
    step = 10 ** max(0, math.ceil(math.log10(apart)))
    whole = np.floor(seconds)
    steps = np.rint((seconds - whole) * (_SECOND / step))
    stamps: NDArray[np.int64] = whole.astype(np.int64) * _SECOND + steps.astype(np.int64) * step
    return stamps
