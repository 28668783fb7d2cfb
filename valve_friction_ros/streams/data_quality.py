# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Quality of the samples of a valve: faults of the data, with their numbers.

`DataQuality` sees each arrival, whether it was accepted, and the clocks. It judges by arrivals
alone: neither a rarely reporting sensor nor a stem at rest is a fault. The stamps of both may
differ by as much as a signal advances from one look to the next, so a recording may be played at
any speed. `LossCounter` counts messages that never arrived, and the publishers that send at once,
by the sequence numbers of the publishers.
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
"""Time, s, over which the share of lost messages is reported."""
_MOST_A_SECOND = 1e6
"""Messages per second of one publisher. A jump of the numbers beyond it means another publisher."""
_MOST_PUBLISHERS = 16
"""Most publishers that are tracked per stream; beyond it the longest silent is forgotten."""
_SENDS = 5.0
"""Time, s, for which a silent publisher still counts among those that send."""
_SIDE_BY_SIDE = 2.0
"""Time, s, for which several publishers must send to be reported: a restart is shorter."""


class Losses(NamedTuple):
    """Lost messages of a stream.

    Attributes
    ----------
    lost : int
        Number of messages that were published but not received, in total.
    recently_lost, recently_taken : int
        Number of messages lost and received in the last minute.
    silence : float
        Time since the last loss was detected, s; infinite without losses.
    """

    lost: int = 0
    recently_lost: int = 0
    recently_taken: int = 0
    silence: float = float("inf")

    @property
    def share(self) -> float:
        """Lost over published messages in the last minute; 0 without messages."""
        published = self.recently_lost + self.recently_taken
        return self.recently_lost / published if published else 0.0


@dataclass
class _Publisher:
    """The next number expected from a publisher, and its first and last message, s."""

    expected: int
    seen: float
    since: float


class LossCounter:
    """Counts the messages missing between received messages.

    Each publisher numbers its messages consecutively, but a message does not name its publisher. A
    number is therefore assigned to the publisher whose expected number is closest below it. A
    number that no publisher could have reached, or that is below all, starts another publisher.
    """

    def __init__(self) -> None:
        self._publishers: list[_Publisher] = []
        self._recent: deque[list[float]] = deque()
        """For each second of the last minute: begin, s, lost messages and received messages."""
        self._lost = 0
        self._last_loss: float | None = None

    def take(self, numbers: Sequence[int], now: float) -> None:
        """Take the numbers of messages in the order of arrival, at the time `now`, s."""
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
        """Take numbers if they come from a single publisher without a loss; return whether so."""
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
        """Take consecutive numbers; return how many are missing before the first."""
        known = [one for one in self._publishers if one.expected <= first]
        one = max(known, key=lambda one: (one.expected, one.seen), default=None)
        # Messages that arrive within one look were sent since the previous look.
        if one is None or first - one.expected > _MOST_A_SECOND * max(now - one.seen, 1e-3):
            if len(self._publishers) >= _MOST_PUBLISHERS:
                self._publishers.remove(min(self._publishers, key=lambda one: one.seen))
            self._publishers.append(_Publisher(last + 1, now, now))
            return 0
        if now - one.seen > _SENDS:
            one.since = now
        missing, one.expected, one.seen = first - one.expected, last + 1, now
        return missing

    def senders(self, now: float) -> int:
        """Return how many publishers have been sending at once for a while, at `now`, s."""
        live = [one for one in self._publishers if now - one.seen <= _SENDS]
        if len(live) < 2:
            return len(live)
        both = min(one.seen for one in live) - max(one.since for one in live)
        return len(live) if both >= _SIDE_BY_SIDE else 1

    def forget(self) -> None:
        """Forget the publishers but keep the counts: each publisher starts anew."""
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
"""Time, s, over which shares of samples are taken. Chosen: a fault appears within this time, and
disappears after it."""

_BEGINS, _ENDS = 0.05, 0.01
"""Share of bad samples from which a fault begins, and below which it ends. Chosen: a rare glitch is
not a fault."""

_OUTSIDE = 0.05
"""Distance beyond a stop, over the travel, from which a position is outside, as in a record."""

_LASTS = 1.0
"""Time, s, for which stamps must be wrong before this is a fault: a node that was blocked first
takes old samples."""

_APART = 1.0
"""Difference, s, between the stamps of both signals that transport can explain, beyond the advance
of a signal from one look to the next. Chosen: a bus delays a signal by less."""

_TOGETHER = 1.0
"""Longest time, s, between arrivals of both signals whose stamps are compared."""


class FaultKind(Enum):
    """Kind of a data fault of a valve."""

    REJECTED = "rejected"
    """Samples of a signal are rejected."""
    OUTSIDE_TRAVEL = "outside travel"
    """Positions lie outside the travel of the valve."""
    SKEW = "skew"
    """The stamps of the two signals differ."""
    CLOCK = "clock"
    """Stamps differ from the node's clock."""


@dataclass(frozen=True)
class DataFault:
    """A fault of the data.

    Attributes
    ----------
    kind : FaultKind
        Kind of the fault.
    signal : Signal or None
        The signal concerned; None for both.
    cause : SampleFault or None
        Most frequent cause of rejected samples, if any are rejected.
    share : float
        Share of bad samples of the signal in the last seconds.
    unusable : float
        Time since the last usable sample of the signal, s; inf if there was none.
    seconds : float
        Lead of the stamps over the clock, or of the stem over the pressure, s.
    reading : float
        The latest bad reading, Pa or m; nan if none is bad.
    """

    kind: FaultKind
    signal: Signal | None = None
    cause: SampleFault | None = None
    share: float = field(default=math.nan, compare=False)
    unusable: float = field(default=0.0, compare=False)
    seconds: float = field(default=math.nan, compare=False)
    reading: float = field(default=math.nan, compare=False)

    @property
    def what(self) -> Statement:
        """What is wrong; unchanged while the fault lasts."""
        signal = None if self.signal is None else self.signal.value
        cause = None if self.cause is None else self.cause.name
        return said(Code.DATA_FAULT, signal=signal, cause=cause, kind=self.kind.name)

    def statement(self, valve: Valve, joint: str = "") -> Statement:
        """Return what is wrong, where, and the remedy.

        An empty `joint` means the first joint.
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
        if cause is SampleFault.NO_JOINT:
            why = said(Code.REJECTED_WITHOUT_JOINT, joint=joint or None)
        elif cause is not SampleFault.OUT_OF_RANGE:
            why = said(Code.REJECTED_FOR, cause=cause.name)
        elif signal is Signal.POSITION:
            why = said(Code.POSITION_OUT_OF_RANGE, reading=self.reading, highest=MOST_POSITION)
        else:
            why = said(
                Code.PRESSURE_OUT_OF_RANGE,
                reading=self.reading,
                lowest=valve.pressure_minimum,
                highest=valve.pressure_maximum,
            )
        usable = None
        if self.share == 1.0 and math.isfinite(self.unusable):
            usable = said(Code.LAST_USABLE, seconds=self.unusable)
        elif self.share == 1.0:
            usable = said(Code.NONE_USABLE)
        return said(Code.REJECTED, signal=signal.value, share=self.share, usable=usable, why=why)


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
        """When the last usable sample arrived, s of the steady clock."""
        self.reading = math.nan
        """The latest reading out of range or outside the travel."""
        self.stamp: int | None = None
        self.stamp_time = math.nan
        """Stamp of the newest arrival, ns, and when it arrived, s of the steady clock."""
        self.advance = math.inf
        """Advance of the stamps from the previous to the latest arrivals, s."""

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
        """Yield the faults of the samples of the last seconds, or else of the last arrivals."""
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
    """A difference of stamps that becomes a fault once arrivals have shown it for a while."""

    def __init__(self) -> None:
        self._since = self._last = math.nan
        self.seconds = math.nan

    def take(self, seconds: float, limit: float, now: float) -> None:
        """Note a difference, s, that is too large beyond `limit`."""
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
    """Finds the data faults of a valve.

    Parameters
    ----------
    valve : Valve
        Gives travel and range of the pressure sensor.

    Notes
    -----
    Times of arrivals are on a steady clock, s; `clock` is the node's time, ns.
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
            The samples that arrived.
        intake : Intake
            Which of the samples were rejected.
        now : float
            Steady time, s.
        clock : int, optional
            Time of the node, ns; None if it cannot be compared.
        tolerance : float
            Largest difference between stamps and clock, s; 0 for no limit.
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
            possible = np.abs(values) <= MOST_POSITION  # False for nan
            beyond = possible & ((values < -margin) | (values > self.valve.travel + margin))
            bad = beyond | (np.isfinite(values) & ~possible)
            outside = int(np.count_nonzero(beyond))
        if bad.any():
            quality.reading = float(values[bad][-1])
        return outside

    def _compare(self, now: float) -> None:
        """Compare the newest stamps of both signals if they arrived together."""
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
        """Forget the comparison of stamps, for example after a jump of the clock."""
        for quality in self._signals.values():
            quality.stamp, quality.advance = None, math.inf
        self._skew = _Lasting()
        self.forget_clocks()

    def forget_clocks(self) -> None:
        """Forget the comparison of stamps with the clock: those of a played recording are old."""
        self._clocks = {signal: _Lasting() for signal in Signal}

    def unusable(self, signal: Signal, now: float) -> float:
        """Return the time since the last usable sample of a signal, s; inf if there was none."""
        return self._signals[signal].unusable(now)

    def faults(self, now: float) -> tuple[DataFault, ...]:
        """Return the present faults."""
        found = [
            fault
            for signal, quality in self._signals.items()
            for fault in quality.faults(signal, now)
        ]
        if self._skew.is_fault:
            found.append(DataFault(FaultKind.SKEW, seconds=self._skew.seconds))
        wrong = {s: one.seconds for s, one in self._clocks.items() if one.is_fault}
        alike = len(wrong) == len(self._clocks) and not self._skew.is_fault
        if alike:
            found.append(DataFault(FaultKind.CLOCK, seconds=min(wrong.values(), key=abs)))
        else:
            found.extend(DataFault(FaultKind.CLOCK, s, seconds=one) for s, one in wrong.items())
        return tuple(found)
