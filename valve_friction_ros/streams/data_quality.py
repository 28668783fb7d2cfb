# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Whether the samples of a valve can be used: faults of the data, with their numbers.

`DataQuality` sees each arrival, what became of it, and the clocks. It judges by arrivals alone: a
sensor that reports seldom, and a stem that stands still, are no faults. What a signal advances from
one look to the next is allowed between both, so a recording may be played at any speed.
`LossCounter` counts messages that never arrived, by the numbers that their publishers gave them.
"""

import math
from collections import Counter, deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.trust.plausible_units import position_question
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams.record_buffer import Intake, SampleFault, Signal
from valve_friction_ros.streams.samples import MOST_POSITION, Arrivals, Kind
from valve_friction_ros.wording import Code, Statement, said

_LOSS_HORIZON = 60.0
"""Time, s, over which the share of lost messages is told."""
_MOST_A_SECOND = 1e6
"""Messages a second of one publisher beyond which a jump of the numbers is another publisher's."""
_MOST_PUBLISHERS = 16
"""Publishers of a stream that are told apart; then the one that was silent longest is forgotten."""


class Losses(NamedTuple):
    """Messages of a stream.

    Attributes
    ----------
    lost : int
        Those that were published and never taken, in all.
    recently_lost, recently_taken : int
        Those of the last minute.
    silence : float
        Time since the last loss was seen, s; infinite without any.
    """

    lost: int = 0
    recently_lost: int = 0
    recently_taken: int = 0
    silence: float = float("inf")

    @property
    def share(self) -> float:
        """Lost messages over all that were published in the last minute; 0 without any."""
        published = self.recently_lost + self.recently_taken
        return self.recently_lost / published if published else 0.0


@dataclass
class _Publisher:
    """The next number that is expected of a publisher, and when the last one was seen, s."""

    expected: int
    seen: float


class LossCounter:
    """Counts the messages that are missing between those that were taken.

    Each publisher numbers its messages one by one. Which publisher a message is of is not told, so
    a number is that of the publisher which comes closest below it; one that no publisher could have
    reached, or that lies below all, is the first of another publisher.
    """

    def __init__(self) -> None:
        self._publishers: list[_Publisher] = []
        self._recent: deque[list[float]] = deque()
        """Of each second of the last minute: its begin, s, and the lost and the taken messages."""
        self._lost = 0
        self._last_loss: float | None = None

    def take(self, numbers: Sequence[int], now: float) -> None:
        """Take the numbers of messages in the order in which they came, at the time `now`, s."""
        if not numbers:
            return
        lost = 0
        if not self._are_next(numbers, now):
            found = np.asarray(numbers, dtype=np.int64)
            begin = 0
            for end in (*np.flatnonzero(np.diff(found) != 1).tolist(), found.size - 1):
                lost += self._followed(int(found[begin]), int(found[end]), now)
                begin = end + 1
        if not self._recent or now - self._recent[-1][0] >= 1.0:
            self._recent.append([now, 0, 0])
            self._drop_old(now)
        self._recent[-1][1] += lost
        self._recent[-1][2] += len(numbers)
        if lost:
            self._lost, self._last_loss = self._lost + lost, now

    def _are_next(self, numbers: Sequence[int], now: float) -> bool:
        """Take the numbers of a single publisher without a loss; tell if that is what they are."""
        one = self._publishers[0] if len(self._publishers) == 1 else None
        if (
            one is None
            or numbers[0] != one.expected
            or numbers[-1] - one.expected != len(numbers) - 1
        ):
            return False
        one.expected, one.seen = numbers[-1] + 1, now
        return True

    def _drop_old(self, now: float) -> None:
        while self._recent and now - self._recent[0][0] > _LOSS_HORIZON:
            self._recent.popleft()

    def _followed(self, first: int, last: int, now: float) -> int:
        """Take a piece of numbers; return how many are missing before it."""
        known = [one for one in self._publishers if one.expected <= first]
        one = max(known, key=lambda one: one.expected, default=None)
        # What comes within one look was sent since the look before.
        if one is None or first - one.expected > _MOST_A_SECOND * max(now - one.seen, 1e-3):
            if len(self._publishers) >= _MOST_PUBLISHERS:
                self._publishers.remove(min(self._publishers, key=lambda one: one.seen))
            self._publishers.append(_Publisher(last + 1, now))
            return 0
        missing, one.expected, one.seen = first - one.expected, last + 1, now
        return missing

    def forget(self) -> None:
        """Forget the publishers: what comes next is the first of each; the counts stay."""
        self._publishers.clear()

    def losses(self, now: float) -> Losses:
        """Return the counts at the time `now`, s."""
        if self._last_loss is None:
            return Losses()
        self._drop_old(now)
        return Losses(
            self._lost,
            round(sum(lost for _, lost, _ in self._recent)),
            round(sum(taken for _, _, taken in self._recent)),
            now - self._last_loss,
        )


_HORIZON = 2.0
"""Time, s, over which shares of samples are taken. Chosen: a fault is known within it, and over
after it."""

_BEGINS, _ENDS = 0.05, 0.01
"""Share of bad samples from which it is a fault, and below which the fault is over. Chosen: a rare
glitch is none."""

_OUTSIDE = 0.05
"""Distance beyond a stop, over the travel, from which a position lies outside, as in a record."""

_LASTS = 1.0
"""Time, s, for which stamps must be wrong before it is a fault: a node that was held up takes old
samples first."""

_APART = 1.0
"""Distance, s, between the stamps of both signals that transport explains, beyond what a signal
advances from one look to the next. Chosen: a bus delays a signal by less."""

_TOGETHER = 1.0
"""Longest time, s, between arrivals of both signals whose stamps are compared."""


class FaultKind(Enum):
    """What may be wrong with the data of a valve."""

    REJECTED = "rejected"
    """Samples of a signal are rejected."""
    OUTSIDE_TRAVEL = "outside travel"
    """Positions lie outside the travel of the valve."""
    SKEW = "skew"
    """The stamps of both signals are apart."""
    CLOCK = "clock"
    """Stamps are apart from the node's clock."""


@dataclass(frozen=True)
class DataFault:
    """One fault of the data.

    Attributes
    ----------
    kind : FaultKind
        What is wrong.
    signal : Signal or None
        The signal that it is about; None: both.
    cause : SampleFault or None
        Why most of the samples are rejected, where they are.
    share : float
        Share of the signal's samples of the last seconds that are bad.
    unusable : float
        Time since the last usable sample of the signal, s; inf: there was none.
    seconds : float
        How far stamps are ahead, s: of the clock, or those of the stem of those of the pressure.
    reading : float
        The worst reading, Pa or m; nan where none is bad.
    """

    kind: FaultKind
    signal: Signal | None = None
    cause: SampleFault | None = None
    share: float = field(default=math.nan, compare=False)
    unusable: float = field(default=0.0, compare=False)
    seconds: float = field(default=math.nan, compare=False)
    reading: float = field(default=math.nan, compare=False)

    @property
    def is_of_clock(self) -> bool:
        """Whether stamps differ from the clock of the node."""
        return self.kind is FaultKind.CLOCK

    @property
    def what(self) -> Statement:
        """What is wrong, which does not change while it lasts."""
        signal = None if self.signal is None else self.signal.value
        cause = None if self.cause is None else self.cause.name
        return said(Code.DATA_FAULT, signal=signal, cause=cause, kind=self.kind.name)

    def statement(self, valve: Valve, joint: str = "") -> Statement:
        """Return what is wrong, where, and the remedy.

        An empty `joint` is the first one.
        """
        signal = None if self.signal is None else self.signal.value
        if self.kind is FaultKind.REJECTED:
            return self._rejected(valve, joint)
        if self.kind is FaultKind.OUTSIDE_TRAVEL:
            return said(
                Code.OUTSIDE_TRAVEL,
                share=self.share,
                reading=self.reading,
                travel=valve.travel,
                question=position_question(abs(self.reading), valve.travel) or None,
            )
        code = Code.STAMPS_APART if self.kind is FaultKind.SKEW else Code.STAMPS_OFF_CLOCK
        return said(code, signal=signal, seconds=abs(self.seconds), is_ahead=self.seconds > 0)

    def _rejected(self, valve: Valve, joint: str) -> Statement:
        signal, cause = self.signal or Signal.POSITION, self.cause or SampleFault.NOT_FINITE
        facts: dict[str, object] = {"cause": cause.name}
        code = Code.REJECTED_FOR
        if cause is SampleFault.NO_JOINT:
            code, facts = Code.REJECTED_WITHOUT_JOINT, {"joint": joint or None}
        elif cause is SampleFault.OUT_OF_RANGE:
            is_pressure = signal is Signal.PRESSURE
            low, high = valve.pressure_minimum, valve.pressure_maximum
            code = Code.PRESSURE_OUT_OF_RANGE if is_pressure else Code.POSITION_OUT_OF_RANGE
            facts = {"reading": self.reading, "lowest": low, "highest": high}
            if not is_pressure:
                facts = {"reading": self.reading, "highest": MOST_POSITION}
        usable = said(Code.NONE_USABLE)
        if math.isfinite(self.unusable):
            usable = said(Code.LAST_USABLE, seconds=self.unusable)
        return said(
            Code.REJECTED,
            signal=signal.value,
            share=self.share,
            usable=usable if self.share == 1.0 else None,
            why=said(code, **facts),
        )


class _Batch(NamedTuple):
    """Samples of one signal that arrived together."""

    time: float
    size: int
    rejected: Mapping[SampleFault, int]
    outside: int


class _SignalQuality:
    def __init__(self) -> None:
        self._batches: deque[_Batch] = deque()
        self._is_bad = dict.fromkeys((FaultKind.REJECTED, FaultKind.OUTSIDE_TRAVEL), False)
        self.usable = math.nan
        """When the last usable sample came, s of the steady clock."""
        self.reading = math.nan
        """The latest reading that was out of range, or outside the travel."""
        self.stamp: int | None = None
        self.stamp_time = math.nan
        """Stamp of the newest arrival, ns, and when it came, s of the steady clock."""
        self.advance = math.inf
        """How far the stamps went on from the arrivals before to the latest ones, s."""

    def add(self, batch: _Batch) -> None:
        self._batches.append(batch)
        if batch.size > sum(batch.rejected.values()):
            self.usable = batch.time

    def note_stamp(self, stamp: int, time: float) -> None:
        self.advance = math.inf if self.stamp is None else max(stamp - self.stamp, 0) / 1e9
        self.stamp, self.stamp_time = stamp, time

    def unusable(self, now: float) -> float:
        return math.inf if math.isnan(self.usable) else now - self.usable

    def faults(self, signal: Signal, now: float) -> Iterator[DataFault]:
        """Yield what is wrong with the samples of the last seconds, else with the last ones."""
        while len(self._batches) > 1 and self._batches[0].time < now - _HORIZON:
            self._batches.popleft()
        total = sum(one.size for one in self._batches)
        if not total:
            return
        causes: Counter[SampleFault] = Counter()
        for one in self._batches:
            causes.update(one.rejected)
        shares = {
            FaultKind.REJECTED: sum(causes.values()) / total,
            FaultKind.OUTSIDE_TRAVEL: sum(one.outside for one in self._batches) / total,
        }
        for kind, share in shares.items():
            self._is_bad[kind] = share >= (_ENDS if self._is_bad[kind] else _BEGINS)
            if self._is_bad[kind]:
                cause = causes.most_common(1)[0][0] if kind is FaultKind.REJECTED else None
                yield DataFault(
                    kind, signal, cause, share, self.unusable(now), reading=self.reading
                )


class _Lasting:
    """A distance of stamps that is a fault once arrivals have shown it for a while."""

    def __init__(self) -> None:
        self._since = self._last = math.nan
        self.seconds = math.nan

    def take(self, seconds: float, limit: float, now: float) -> None:
        """Note a distance, s, that is too long beyond `limit`."""
        if not abs(seconds) > limit:
            self._since = math.nan
            return
        if math.isnan(self._since):
            self._since = now
        self._last, self.seconds = now, seconds

    @property
    def is_fault(self) -> bool:
        return self._last - self._since >= _LASTS


class DataQuality:
    """Finds what is wrong with the data of a valve.

    Parameters
    ----------
    valve : Valve
        Gives travel and range of the pressure sensor.

    Notes
    -----
    Times of arrivals are those of a steady clock, s; `clock` is the node's, ns.
    """

    def __init__(self, valve: Valve) -> None:
        self.valve = valve
        self._signals = {signal: _SignalQuality() for signal in Signal}
        self._skew = _Lasting()
        self._clocks = {signal: _Lasting() for signal in Signal}

    def see(
        self,
        arrivals: Arrivals,
        intake: Intake,
        now: float,
        clock: int | None = None,
        tolerance: float = 0.0,
    ) -> None:
        """Take note of arrivals.

        Parameters
        ----------
        arrivals : Arrivals
            What arrived.
        intake : Intake
            What became of it.
        now : float
            Steady time, s.
        clock : int, optional
            Time of the node, ns; None: it is not comparable.
        tolerance : float
            How far stamps may be apart from the clock, s; 0: any distance.
        """
        for signal, quality in self._signals.items():
            mine = (arrivals.kinds == Kind.PRESSURE) == (signal is Signal.PRESSURE)
            rejected = {f: n for (which, f), n in intake.rejected.items() if which is signal}
            damaged = rejected.get(SampleFault.DAMAGED, 0)
            count = int(np.count_nonzero(mine)) + damaged
            if not count:
                continue
            outside = self._look(signal, quality, arrivals.values[mine])
            quality.add(_Batch(now, count, rejected, outside))
            if count > damaged:
                stamp = int(arrivals.stamps[mine][-1])
                quality.note_stamp(stamp, now)
                apart = 0.0 if clock is None or not tolerance else (stamp - clock) / 1e9
                self._clocks[signal].take(apart, tolerance, now)
        self._compare(now)

    def _look(self, signal: Signal, quality: _SignalQuality, values: NDArray[np.float64]) -> int:
        """Remember the latest reading out of range; count positions outside the travel."""
        if signal is Signal.PRESSURE:
            bad = np.isfinite(values) & ~self.valve.sensor_reads(values)
            outside = 0
        else:
            margin = _OUTSIDE * self.valve.travel if math.isfinite(self.valve.travel) else math.inf
            possible = np.abs(values) <= MOST_POSITION  # not so where it is nan
            beyond = possible & ((values < -margin) | (values > self.valve.travel + margin))
            bad = beyond | (np.isfinite(values) & ~possible)
            outside = int(np.count_nonzero(beyond))
        if bad.any():
            quality.reading = float(values[bad][-1])
        return outside

    def _compare(self, now: float) -> None:
        """Compare the newest stamps of both signals, where they came at one time."""
        pressure, stem = (self._signals[signal] for signal in (Signal.PRESSURE, Signal.POSITION))
        if pressure.stamp is None or stem.stamp is None:
            return
        later = stem.stamp_time - pressure.stamp_time
        if now not in (pressure.stamp_time, stem.stamp_time) or abs(later) > _TOGETHER:
            return
        apart = (stem.stamp - pressure.stamp) / 1e9 - later
        limit = _APART + max(pressure.advance, stem.advance)
        self._skew.take(apart, limit, now)

    def forget_stamps(self) -> None:
        """Forget how stamps compare, as after a jump of the clock."""
        for quality in self._signals.values():
            quality.stamp, quality.advance = None, math.inf
        self._skew = _Lasting()
        self._clocks = {signal: _Lasting() for signal in Signal}

    def unusable(self, signal: Signal, now: float) -> float:
        """Return the time since the last usable sample of a signal, s; inf: there was none."""
        return self._signals[signal].unusable(now)

    def faults(self, now: float, is_played: bool = False) -> tuple[DataFault, ...]:
        """Return what is wrong now.

        The stamps of a recording that is played are not compared with the clock.
        """
        found = [
            fault
            for signal, quality in self._signals.items()
            for fault in quality.faults(signal, now)
        ]
        if self._skew.is_fault:
            found.append(DataFault(FaultKind.SKEW, seconds=self._skew.seconds))
        wrong = {
            s: one.seconds for s, one in self._clocks.items() if one.is_fault and not is_played
        }
        alike = len(wrong) == len(self._clocks) and not self._skew.is_fault
        if alike:
            found.append(DataFault(FaultKind.CLOCK, seconds=min(wrong.values(), key=abs)))
        else:
            found.extend(DataFault(FaultKind.CLOCK, s, seconds=one) for s, one in wrong.items())
        return tuple(found)
