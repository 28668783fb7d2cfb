# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Usage of a valve: distance, reversals, breakaways, time at each travel; no ROS.

`UsageCounter` derives it from the stream of stem positions, with a dead band that noise and
resolution of the sensor may raise. `ValveUsage` keeps it by day and since the packing was renewed.
`UsageLimits` define when the packing is due for replacement.
"""

import itertools
import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.trust.uncertainty import MEDIAN_MAGNITUDE
from valve_friction_ros.model.checks import require_non_negative, require_positive
from valve_friction_ros.signals import quantisation_step
from valve_friction_ros.streams import DAY, END_OF_TIME
from valve_friction_ros.streams.samples import Samples
from valve_friction_ros.wording import Code, Statement, said, sentence

BINS = 20
"""Bins of the histogram: 5 % of the travel each."""


@dataclass(frozen=True)
class Usage:
    """Usage of a valve while it was monitored; usages can be added.

    Attributes
    ----------
    distance : float
        Travelled distance, m: the sum of the strokes between reversals, each longer than the
        counting dead band.
    reversals : int
        Changes of direction followed by a stroke beyond the counting dead band.
    breakaways : int
        Starts of the stem after a rest of one full second of the stamps (`Breakaways`).
    histogram : tuple of int
        Time at each 5 % of the travel, ns, from position 0 upwards; the first and the last bin
        include positions beyond the stops.

    Raises
    ------
    ValueError
        If a number is negative or not finite, or the histogram does not have `BINS` bins.
    """

    distance: float = 0.0
    reversals: int = 0
    breakaways: int = 0
    histogram: tuple[int, ...] = (0,) * BINS

    def __post_init__(self) -> None:
        for name in ("distance", "reversals", "breakaways"):
            require_non_negative(name, getattr(self, name))
        if len(self.histogram) != BINS or min(self.histogram) < 0:
            raise ValueError(f"the histogram must have {BINS} times of at least 0 ns")

    def __add__(self, other: "Usage") -> "Usage":
        return Usage(
            self.distance + other.distance,
            self.reversals + other.reversals,
            self.breakaways + other.breakaways,
            tuple(map(sum, zip(self.histogram, other.histogram, strict=True))),
        )

    @property
    def time_watched(self) -> int:
        """Time for which the valve was monitored, ns: the sum of the histogram."""
        return sum(self.histogram)

    def strokes(self, travel: float) -> float:
        """Return the distance in full strokes over `travel`, m; nan for a machine without stops."""
        return self.distance / travel if math.isfinite(travel) else math.nan

    def time_near_seat(self, seat_is_at_travel: bool = False) -> int:
        """Return the time within 5 % of the travel from the seat, ns.

        The seat is at position 0 (air to open), or at the travel (air to close).
        """
        return self.histogram[-1 if seat_is_at_travel else 0]

    def to_dict(self) -> dict[str, Any]:
        """Return a mapping of plain values: m, numbers and seconds."""
        return {
            "distance": self.distance,
            "reversals": self.reversals,
            "breakaways": self.breakaways,
            "time_watched": self.time_watched / 1e9,
            "histogram": [time / 1e9 for time in self.histogram],
        }


def total(usages: Iterable[Usage]) -> Usage:
    """Add up any number of usages."""
    return sum(usages, Usage())


class StrokeCounter:
    """Adds up the strokes between reversals.

    The stem has reversed once it has returned by more than the dead band from the farthest point of
    its stroke, its turning point. The distance is the sum of the strokes between turning points, up
    to the farthest point of the present stroke. A signal within the dead band thus adds nothing.
    The travel accumulators and cycle counters of digital valve controllers are alike, but here a
    stroke is added in full length once it exceeds the dead band.

    Attributes
    ----------
    distance : float
        Distance, m.
    reversals : int
        Number of reversals.
    """

    def __init__(self) -> None:
        self.distance = 0.0
        self.reversals = 0
        self._farthest = 0.0
        """Farthest point of the present stroke, measured in its direction, m."""
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget the position of the stem; the next position adds no distance."""
        self._direction = 0
        self._low, self._high = math.inf, -math.inf

    def add(self, position: NDArray[np.float64], band: float) -> None:
        """Process finite positions, m, shape (n,), with a dead band, m."""
        begin = 0
        while begin < position.size:
            follow = self._follow if self._direction else self._wait
            begin += follow(position[begin:], band)

    def _wait(self, position: NDArray[np.float64], band: float) -> int:
        """Follow the stem until its first stroke; return the number of positions used."""
        low = np.minimum(np.minimum.accumulate(position), self._low)
        high = np.maximum(np.maximum.accumulate(position), self._high)
        last = _first_or_last(high - low > band)
        self._low, self._high, here = float(low[last]), float(high[last]), float(position[last])
        if self._high - self._low > band:
            self._direction = 1 if here == self._high else -1
            self._farthest = self._direction * here
            self.distance += self._high - self._low
        return last + 1

    def _follow(self, position: NDArray[np.float64], band: float) -> int:
        """Follow a stroke to its end; return the number of positions used."""
        along = self._direction * position
        farthest = np.maximum(np.maximum.accumulate(along), self._farthest)
        last = _first_or_last(farthest - along > band)
        turn, here = float(farthest[last]), float(along[last])
        self.distance += turn - self._farthest
        self._farthest = turn
        if turn - here > band:
            self.distance += turn - here
            self.reversals += 1
            self._direction, self._farthest = -self._direction, -here
        return last + 1


def _first_or_last(is_so: NDArray[np.bool_]) -> int:
    """Return the index of the first True, or the last index if there is none."""
    place = int(is_so.argmax())
    return place if is_so[place] else is_so.size - 1


_SECOND = 1_000_000_000


class Breakaways:
    """Counts how often a resting stem starts.

    Time is divided into whole seconds of the stamps. The stem rests in a second if it stays within
    the dead band; otherwise it moves. A breakaway is a second of motion after a second of rest.
    During stick-slip each slip beyond the dead band is thus a breakaway, while a stem that creeps
    by less than the dead band per second has none.

    Attributes
    ----------
    count : int
        Number of breakaways.
    """

    def __init__(self) -> None:
        self.count = 0
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget the motion of the stem; it must rest again before the next breakaway."""
        self._rested = False
        self._is_whole = False
        self._second: int | None = None
        self._low = self._high = self._last = 0.0
        self._band = 0.0

    def add(self, stamps: NDArray[np.int64], position: NDArray[np.float64], band: float) -> None:
        """Process positions, m, at increasing stamps, ns, shape (n,) each; dead band in m."""
        self._band = band
        seconds = stamps // _SECOND
        begins = np.flatnonzero(np.diff(seconds, prepend=seconds[0] - 1))
        lows = np.minimum.reduceat(position, begins).tolist()
        highs = np.maximum.reduceat(position, begins).tolist()
        lasts = position[np.append(begins[1:], position.size) - 1].tolist()
        for second, low, high, last in zip(
            seconds[begins].tolist(), lows, highs, lasts, strict=True
        ):
            if second != self._second:
                self._end_second()
                self._second = second
            self._low, self._high = min(self._low, low), max(self._high, high)
            self._last = last

    def _end_second(self) -> None:
        """Evaluate the past second; the next second starts at the present position."""
        if self._second is None:
            self._low, self._high = np.inf, -np.inf
            return
        moved = self._high - self._low > self._band
        self.count += moved and self._rested
        self._rested = self._is_whole and not moved
        self._is_whole = True
        self._low = self._high = self._last


_DIFFERENCE_ORDER = 4
_GAIN = math.sqrt(math.comb(2 * _DIFFERENCE_ORDER, _DIFFERENCE_ORDER))
"""Standard deviation of the fourth differences of white noise of deviation 1: √70."""
_MOST_SEEN = 16
"""Number of blocks whose noise is kept. Chosen: the stem rests in some of them."""
_BAND_NOISE = 14.0
"""Dead band over the deviation of the noise.

Noise adds distance if two samples of one rest lie a dead band apart. Among 10⁹ samples, about ten
days at 1 kHz, the extremes lie 12 deviations apart; the estimate may be a tenth too small."""
_BAND_STEPS = 2.0
"""Dead band over the step of a converter, which may flicker between three codes."""
_MANY_CODES = 8
"""Distinct values in a block from which they are codes of a converter. Chosen: fewer may be the
resting positions of a noiseless stem."""


class SensorBand:
    """Tracks the noise and the resolution of a sensor, block by block.

    The noise of a block is the median of its fourth differences: the motion of a stem almost
    vanishes in them, and jumps do not change the median. Some motion is left if the stem moves fast
    for the sampling rate, so the lower quartile of the last blocks is used. The step of a converter
    is the smallest difference in blocks with many codes, or with values that flicker from sample to
    sample.

    Attributes
    ----------
    band : float
        The least dead band, m.
    """

    def __init__(self) -> None:
        self._noises: deque[float] = deque(maxlen=_MOST_SEEN)
        self._step = self.band = 0.0

    def add(self, position: NDArray[np.float64]) -> None:
        """Process a block of positions, m, shape (n,)."""
        if position.size <= _DIFFERENCE_ORDER:
            return
        self._follow_step(position)
        differences = np.sort(np.abs(np.diff(position, _DIFFERENCE_ORDER)))
        self._noises.append(float(differences[differences.size // 2]) / (MEDIAN_MAGNITUDE * _GAIN))
        noise = sorted(self._noises)[len(self._noises) // 4]
        self.band = max(_BAND_NOISE * noise, _BAND_STEPS * self._step)

    def _follow_step(self, position: NDArray[np.float64]) -> None:
        first, middle, last = position[:-2], position[1:-1], position[2:]
        flickers = np.count_nonzero((first == last) & (first != middle)) > 1
        values = np.unique(position)
        if values.size > 0.5 * position.size or (not flickers and values.size < _MANY_CODES):
            return
        step = quantisation_step(position)
        if step > 0:
            self._step = step if self._step == 0 else min(self._step, step)


DEFAULT_BAND = 0.01
"""Counting dead band as a share of the travel, as usual in digital valve controllers."""

_BLOCK, _LARGEST_BLOCK = 256, 1024
"""Least and largest number of samples in a block; between them a block ends after one second.
Chosen: a block costs as much as its 250 samples."""
_LARGEST_GAP = 10
"""Number of sampling periods beyond which a pause is a gap, as in a record."""
_LONG_GAP = 1_000_000_000
"""Gap, ns, beyond which it is unknown whether the stem has rested. Chosen."""
_FARTHEST = 0.5
"""Distance beyond a stop, over the travel, beyond which a reading is not a position. Chosen."""


class UsageCounter:
    """Adds up the usage of one valve by day (UTC, from the stamps).

    Samples are processed in blocks of 256 to 1024, however they arrive, so that the result does not
    depend on their arrival. Within a block:

    - Readings that are not finite or lie more than half a travel beyond the stops, and repeated
      stamps, are left out.
    - The pause after a sample is time at its position. A pause of more than ten sampling periods is
      a gap and adds no time. It does add distance: the stem has moved at least from one end of the
      gap to the other.
    - A stamp that goes back means that the clock has jumped. The motion in between is unknown, and
      counting starts afresh with the next sample.

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
        """Return and clear the usage since the last call, by days since 1970 (UTC)."""
        days, self._days = self._days, {}
        return days

    @property
    def band(self) -> float:
        """The present counting dead band, m."""
        return max(self._share * self._travel, self._sensor.band)

    @property
    def is_raised(self) -> bool:
        """Whether noise or resolution of the sensor demands more than the given dead band."""
        return self._sensor.band > self._share * self._travel

    def add(self, samples: Samples) -> None:
        """Process the next samples of the stem position, m."""
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
        """Process an incomplete block at the end of a stream."""
        if self._count:
            stamps, position = Samples.joined(*self._waiting)
            self._count_block(stamps, position)
        self._waiting, self._count = [], 0

    def _count_block(self, stamps: NDArray[np.int64], position: NDArray[np.float64]) -> None:
        """Process a block; its dead band follows from all samples up to the end of the block."""
        beyond = _FARTHEST * self._travel
        good = (position >= -beyond) & (position <= self._travel + beyond)  # rejects nan
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
            # Floats are exact for sums of whole nanoseconds below 2**53.
            histogram = np.bincount(bins[part], times[part], BINS).astype(np.int64)
            self._count_part(int(days[begin]), stamps[part], position[part], histogram)

    def _count_part(
        self,
        day: int,
        stamps: NDArray[np.int64],
        position: NDArray[np.float64],
        histogram: NDArray[np.int64],
    ) -> None:
        """Process samples of one day that contain no clock jump and no long gap."""
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


_PACE_DAYS = 14
"""Number of recent days with samples that determine the pace. Chosen: two working weeks with their
weekends."""
_KEPT_DAYS = 31
_LEAST_WATCHED = DAY
"""Least monitored time, ns, for a pace. Chosen: a day includes everything that recurs daily."""


class UsedDay(NamedTuple):
    """Usage of one day.

    Attributes
    ----------
    day : int
        Days since 1970 (UTC), by the stamps.
    renewal : int
        When the packing then in use was renewed, ns since 1970 (UTC); 0: unknown.
    usage : Usage
        Usage on that day.
    """

    day: int
    renewal: int
    usage: Usage


class Pace(NamedTuple):
    """Usage per monitored day: distance, m, and reversals."""

    distance: float
    reversals: float


@dataclass(frozen=True)
class ValveUsage:
    """The usage of a valve.

    Attributes
    ----------
    days : tuple of UsedDay
        Sorted by packing, oldest first, then by day; each pair of renewal and day occurs once.
    renewal : int
        When the packing was last renewed, ns since 1970 (UTC); 0: unknown.
    """

    days: tuple[UsedDay, ...] = ()
    renewal: int = 0

    @classmethod
    def of(cls, days: Iterable[UsedDay], renewal: int = 0) -> "ValveUsage":
        """Sort days, and add up those that occur more than once."""
        found: dict[tuple[int, int], Usage] = {}
        for one in days:
            key = one.renewal, one.day
            found[key] = found[key] + one.usage if key in found else one.usage
        sums = (UsedDay(day, since, found[since, day]) for since, day in sorted(found))
        return cls(tuple(sums), renewal)

    @property
    def total(self) -> Usage:
        """Total usage."""
        return total(one.usage for one in self.days)

    @property
    def since_renewal(self) -> Usage:
        """Usage since the packing was last renewed; total usage if no renewal is known."""
        return total(one.usage for one in self._of_this_packing())

    def pace(self) -> Pace | None:
        """Return the usage per monitored day, over the last days of this packing.

        None until the valve has been monitored for a day.
        """
        recent = total(one.usage for one in self._of_this_packing()[-_PACE_DAYS:])
        if recent.time_watched < _LEAST_WATCHED:
            return None
        share = DAY / recent.time_watched
        return Pace(recent.distance * share, recent.reversals * share)

    def condensed(self) -> "ValveUsage":
        """Return the same usage with at most 31 single days of this packing, the rest summed."""
        recent = set(self._of_this_packing()[-_KEPT_DAYS:])
        sums: dict[int, UsedDay] = {}
        for one in self.days:
            if one not in recent:
                before = sums.get(one.renewal, UsedDay(one.day, one.renewal, Usage()))
                sums[one.renewal] = UsedDay(one.day, one.renewal, before.usage + one.usage)
        return ValveUsage.of((*sums.values(), *recent), self.renewal)

    def _of_this_packing(self) -> tuple[UsedDay, ...]:
        return tuple(one for one in self.days if one.renewal == self.renewal)

    def to_dict(self) -> dict[str, Any]:
        """Return a mapping of plain values: m, numbers, seconds; times are ns since 1970 (UTC)."""
        pace = self.pace()
        return {
            "renewal": self.renewal or None,
            "since_renewal": self.since_renewal.to_dict(),
            "total": self.total.to_dict(),
            "pace": None if pace is None else pace._asdict(),
            "days": [
                {"day": one.day * DAY, "renewal": one.renewal or None, **one.usage.to_dict()}
                for one in self.days
            ],
        }


LEAD = 30 * DAY
"""Lead time of the warning before the expected date, ns. Chosen: it allows time to order a packing
and plan its renewal."""
_DATE_DOUBT = 2 * DAY
"""Time, ns, by which the expected date may recede until the end of the day of the warning."""


@dataclass(frozen=True)
class UsageLimits:
    """Limits of the usage since the packing was renewed; 0: no limit.

    Attributes
    ----------
    travel : float
        Travelled distance, m.
    reversals : float
        Reversals.
    """

    travel: float = 0.0
    reversals: float = 0.0

    def __post_init__(self) -> None:
        require_non_negative("travel_limit", self.travel)
        require_non_negative("reversal_limit", self.reversals)


class LimitState(NamedTuple):
    """Usage of a packing compared with a limit.

    Attributes
    ----------
    name : str
        Parameter name of the limit.
    used, limit : float
        Usage since the packing was renewed, and the limit: m, or reversals.
    expected : int or None
        Expected date of the limit at the pace of the last days under continuous monitoring, ns
        since 1970 (UTC). None if the limit is reached, the pace is unknown, or the date is beyond
        the calendar.
    now : int
        Time of this state, ns.
    has_warned : bool
        Whether the limit has already warned: while a valve rests, the expected date recedes.
    """

    name: str
    used: float
    limit: float
    expected: int | None
    now: int
    has_warned: bool = False

    @property
    def is_reached(self) -> bool:
        """Whether the limit is reached."""
        return self.used >= self.limit

    @property
    def warns(self) -> bool:
        """Whether the limit is reached, expected within `LEAD`, or has already warned."""
        return self.is_reached or self.has_warned or self.is_expected_within(LEAD)

    def is_expected_within(self, lead: int) -> bool:
        """Return whether the limit is expected within `lead`, ns."""
        return self.expected is not None and self.expected - self.now <= lead

    @property
    def statement(self) -> Statement:
        """The figures, the expected date and the remedy."""
        state = said(Code.LIMIT_NEAR)
        if self.is_reached:
            state = said(Code.LIMIT_REACHED)
        elif self.expected is not None:
            state = said(Code.LIMIT_EXPECTED, expected=self.expected)
        of_travel = self.name == "travel_limit"
        code = Code.PACKING_TRAVEL if of_travel else Code.PACKING_REVERSALS
        return said(code, used=self.used, limit=self.limit, state=state)

    @property
    def message(self) -> str:
        """The statement as one sentence."""
        return sentence(self.statement)


def limit_states(
    used: Usage, pace: Pace | None, limits: UsageLimits, now: int
) -> tuple[LimitState, ...]:
    """Compare the usage since the renewal with each given limit, at the time `now`, ns."""
    found = []
    for name, value, limit, daily in (
        ("travel_limit", used.distance, limits.travel, pace and pace.distance),
        ("reversal_limit", float(used.reversals), limits.reversals, pace and pace.reversals),
    ):
        if limit > 0:
            days = (limit - value) / daily if daily else math.inf
            date = now + days * DAY
            expected = round(date) if value < limit and date < END_OF_TIME else None
            found.append(LimitState(name, value, limit, expected, now))
    return tuple(found)


def warned_limits(usage: ValveUsage, limits: UsageLimits) -> set[str]:
    """Return the names of the limits that have warned on a day of the present packing.

    Usage is known per whole day only, so limits due to warn within two days are included.
    """
    days = [one for one in usage.days if one.renewal == usage.renewal]
    found: set[str] = set()
    for count, last in enumerate(days, 1):
        then = ValveUsage(tuple(days[:count]), usage.renewal)
        states = limit_states(then.since_renewal, then.pace(), limits, (last.day + 1) * DAY)
        lead = LEAD + _DATE_DOUBT
        found |= {one.name for one in states if one.is_reached or one.is_expected_within(lead)}
    return found
