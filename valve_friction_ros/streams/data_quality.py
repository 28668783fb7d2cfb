"""Whether the samples of a valve can be used: faults of the data, with their numbers.

`DataQuality` sees each arrival, what became of it, and the clocks. It judges by arrivals alone: a
sensor that reports seldom, and a stem that stands still, are no faults. What a signal advances from
one look to the next is allowed between both, so a recording may be played at any speed.
"""

import math
from collections import Counter, deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.trust.plausible_units import position_question
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams.arrivals import MOST_POSITION, Arrivals, Kind
from valve_friction_ros.streams.record_buffer import Intake, SampleFault, Signal

__all__ = ["DataFault", "DataQuality", "FaultKind"]

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
    def what(self) -> str:
        """What is wrong, in words that do not change while it lasts."""
        subject = "the stamps" if self.signal is None else self.signal.value
        return (
            f"{subject}: {'' if self.cause is None else f'{self.cause.value}, '}{self.kind.value}"
        )

    def message(self, valve: Valve, joint: str = "") -> str:
        """Return one sentence: what is wrong, where, and the remedy.

        An empty `joint` is the first one.
        """
        if self.kind is FaultKind.REJECTED:
            return self._rejected(valve, joint)
        if self.kind is FaultKind.OUTSIDE_TRAVEL:
            question = position_question(abs(self.reading), valve.travel)
            return (
                f"stem_state: {_percent(self.share)} of its samples lie outside the travel, as at "
                f"{self.reading:.4g} m, and the travel is 0 to {valve.travel:.4g} m: check unit "
                "(m), zero and travel"
                f"{question and f': {question}'}"
            )
        if self.kind is FaultKind.SKEW:
            way = "later" if self.seconds > 0 else "earlier"
            return (
                f"stem_state is stamped {abs(self.seconds):.3g} s {way} than actuator_pressure: "
                "synchronise the clocks of both sensors, and check delays on the way"
            )
        way = "ahead of" if self.seconds > 0 else "behind"
        subject = "both inputs" if self.signal is None else self.signal.value
        return (
            f"the stamps of {subject} are {abs(self.seconds):.3g} s {way} the clock of this node: "
            "synchronise the clocks; for a recording set use_sim_time and play it with --clock, "
            "or set clock_tolerance to 0"
        )

    def _rejected(self, valve: Valve, joint: str) -> str:
        signal, cause = self.signal or Signal.POSITION, self.cause or SampleFault.NOT_FINITE
        named = f"joint '{joint}'" if joint else "joint"
        unit = "Pa" if signal is Signal.PRESSURE else "m"
        if signal is Signal.PRESSURE:
            span = f"the sensor's range {valve.pressure_minimum:g} to {valve.pressure_maximum:g} Pa"
            remedy = "check sensor and unit (Pa), or correct pressure_minimum and pressure_maximum"
        else:
            span = f"the range of any valve, up to {MOST_POSITION:g} m"
            remedy = "check sensor and unit (m)"
        why = {
            SampleFault.DAMAGED: "they are damaged messages: check the publisher",
            SampleFault.NO_JOINT: f"they have no position of the {named}: name it in the messages, "
            "or set joint",
            SampleFault.NOT_FINITE: "not finite: check sensor, cable and driver",
            SampleFault.OUT_OF_RANGE: f"{self.reading:.4g} {unit} is outside {span}: {remedy}",
            SampleFault.REPEATED: "they repeat a stamp: give each sample the time at which it was "
            "measured",
            SampleFault.OVERTAKEN: "they arrive out of order: look at the network between them",
            SampleFault.BACK: "their stamps go back: check for a second publisher, and the clock "
            "of the sensor",
        }[cause]
        known = "no sample was usable yet"
        if math.isfinite(self.unusable):
            known = f"the last usable one came {self.unusable:.0f} s ago"
        only = f", {known}" if self.share == 1.0 else ""
        return f"{signal.value}: {_percent(self.share)} of its samples are rejected{only}: {why}"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= _BEGINS else f"{100 * share:.1f} %"


class _Batch(NamedTuple):
    """Samples of one signal that arrived together."""

    time: float
    size: int
    rejected: Mapping[SampleFault, int]
    outside: int


class _SignalQuality:
    """What is known of one signal."""

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

    def forget_stamp(self) -> None:
        self.stamp, self.advance = None, math.inf

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
            quality.forget_stamp()
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
