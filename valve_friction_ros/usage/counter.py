"""Counts the usage of a valve from its stem position, as it comes."""

import itertools

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.checks import require_positive
from valve_friction_ros.streams import DAY
from valve_friction_ros.streams.samples import Samples
from valve_friction_ros.usage.breakaways import Breakaways
from valve_friction_ros.usage.sensor_band import SensorBand
from valve_friction_ros.usage.strokes import StrokeCounter
from valve_friction_ros.usage.usage import BINS, Usage

__all__ = ["DEFAULT_BAND", "UsageCounter"]

DEFAULT_BAND = 0.01
"""Counting dead band as a share of the travel, the usual one of digital valve controllers."""

_BLOCK, _LARGEST_BLOCK = 256, 1024
"""Fewest and most samples that are counted together; between them a second is enough. Chosen: a
block costs as much as its 250 samples."""
_SECOND = 1_000_000_000
_LARGEST_GAP = 10
"""Sampling periods above which a pause is a gap, as in a record."""
_LONG_GAP = 1_000_000_000
"""Gap, ns, after which it is not known whether the stem has rested. Chosen."""
_FARTHEST = 0.5
"""Distance beyond a stop, in travels, from which a reading is no position of the stem. Chosen."""


class UsageCounter:
    """Adds up the usage of one valve day by day (UTC, by the stamps).

    Samples are counted in blocks of 256 to 1024, whatever blocks they come in, so that how they
    come changes nothing. Within a block:

    - Readings that are not finite, or lie more than half a travel beyond the stops, and repeated
      stamps are left out.
    - The pause after a sample counts as time at its position. A pause of more than ten sampling
      periods is a gap: it counts no time. The stem has moved at least from the one end of
      the gap to the other, so that distance counts.
    - A stamp that goes back means that the clock has jumped: what the stem did meanwhile is not
      known, and counting begins anew with the next sample.

    Parameters
    ----------
    travel : float
        Travel between the stops, m, finite.
    share : float
        Counting dead band as a share of the travel.
    """

    def __init__(self, travel: float, share: float = DEFAULT_BAND) -> None:
        require_positive("travel", travel)
        require_positive("counting_dead_band", share)
        self._travel = travel
        self._share = share
        self._sensor = SensorBand()
        self._strokes = StrokeCounter()
        self._breakaways = Breakaways()
        self._last: tuple[int, float] | None = None
        self._waiting: list[Samples] = []
        self._count = 0
        self._days: dict[int, Usage] = {}

    def drain(self) -> dict[int, Usage]:
        """Return what was counted since the last call, by days since 1970 (UTC)."""
        days, self._days = self._days, {}
        return days

    @property
    def band(self) -> float:
        """The counting dead band in force, m."""
        return max(self._share * self._travel, self._sensor.band)

    @property
    def is_raised(self) -> bool:
        """Whether the sensor's noise or resolution demands more than the given dead band."""
        return self._sensor.band > self._share * self._travel

    def add(self, samples: Samples) -> None:
        """Take the next samples of the stem position, m."""
        if samples.stamps.size == 0:
            return
        self._waiting.append(samples)
        self._count += samples.stamps.size
        lasts = int(samples.stamps[-1] - self._waiting[0].stamps[0])
        if self._count >= _LARGEST_BLOCK or (self._count >= _BLOCK and lasts >= _SECOND):
            self._count_whole_blocks()

    def _count_whole_blocks(self) -> None:
        stamps, position = Samples.joined(*self._waiting)
        while stamps.size >= _BLOCK:
            ends = stamps[_BLOCK - 1 : _LARGEST_BLOCK] - stamps[0] >= _SECOND
            place = int(ends.argmax())
            if not ends[place] and stamps.size < _LARGEST_BLOCK:
                break
            end = _BLOCK + place if ends[place] else _LARGEST_BLOCK
            self._count_block(stamps[:end], position[:end])
            stamps, position = stamps[end:], position[end:]
        self._waiting = [Samples(stamps, position)] if stamps.size else []
        self._count = stamps.size

    def flush(self) -> None:
        """Count what waits for a whole block, at the end of a stream."""
        if self._count:
            stamps, position = Samples.joined(*self._waiting)
            self._count_block(stamps, position)
        self._waiting, self._count = [], 0

    def _count_block(self, stamps: NDArray[np.int64], position: NDArray[np.float64]) -> None:
        """Count samples; the dead band is that of all samples up to the last one of the block."""
        beyond = _FARTHEST * self._travel
        good = (position >= -beyond) & (position <= self._travel + beyond)  # nan is not
        stamps, position = stamps[good], position[good]
        good = np.diff(stamps, prepend=np.iinfo(np.int64).min // 2) != 0
        if self._last is not None and good.size:
            good[0] = stamps[0] != self._last[0]
        stamps, position = stamps[good], position[good]
        if stamps.size == 0:
            return
        stamp, place = self._last or (int(stamps[0]), float(position[0]))
        self._last = int(stamps[-1]), float(position[-1])
        self._sensor.add(position)
        pauses = np.diff(stamps, prepend=stamp)
        forward = np.sort(pauses[pauses > 0])
        longest = _LARGEST_GAP * int(forward[forward.size // 2]) if forward.size else 0
        times = np.where((pauses > 0) & (pauses <= longest), pauses, 0)
        bins = np.concatenate(([place], position[:-1])) * (BINS / self._travel)
        bins = np.clip(bins, 0, BINS - 1).astype(np.int64)
        days = stamps // DAY
        is_unseen = (pauses < 0) | (pauses > max(longest, _LONG_GAP))
        begins = np.flatnonzero(is_unseen | (np.diff(days, prepend=days[0]) != 0))
        edges = np.unique(np.concatenate(([0], begins, [stamps.size]))).tolist()
        for begin, end in itertools.pairwise(edges):
            if is_unseen[begin]:
                self._breakaways.begin_anew()
            if pauses[begin] < 0:
                self._strokes.begin_anew()
            part = slice(begin, end)
            # Sums of whole nanoseconds below 2**53 are exact in floats.
            histogram = np.bincount(bins[part], times[part], BINS).astype(np.int64)
            self._count_part(int(days[begin]), stamps[part], position[part], histogram)

    def _count_part(
        self,
        day: int,
        stamps: NDArray[np.int64],
        position: NDArray[np.float64],
        histogram: NDArray[np.int64],
    ) -> None:
        """Count samples of one day without a jump of the clock or a long gap between them."""
        strokes, breakaways, band = self._strokes, self._breakaways, self.band
        before = strokes.distance, strokes.reversals, breakaways.count
        strokes.add(position, band)
        breakaways.add(stamps, position, band)
        counted = Usage(
            strokes.distance - before[0],
            strokes.reversals - before[1],
            breakaways.count - before[2],
            tuple(histogram.tolist()),
        )
        self._days[day] = self._days.get(day, Usage()) + counted
