# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The buffer of an identifier: both signals of a valve, and the rejected samples."""

import math
from collections import Counter, deque
from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams.samples import (
    MOST_POSITION,
    Arrivals,
    Kind,
    SampleBuffer,
    Samples,
    nanoseconds,
    uniform_recording,
)
from valve_friction_ros.wording import Code, Statement, said

_REJECTIONS_KEPT = 10_000
"""Most rejections in memory. Chosen: ten seconds at 1 kHz, so that a broken sensor does not fill
the memory."""


class Signal(Enum):
    """A signal of a valve, by the name of its topic."""

    PRESSURE = "actuator_pressure"
    POSITION = "stem_state"


class SampleFault(Enum):
    """Why a sample is rejected."""

    DAMAGED = "damaged"
    """Not a message of the topic's type: it has neither stamp nor value."""
    NO_JOINT = "no joint"
    NOT_FINITE = "not finite"
    OUT_OF_RANGE = "out of range"
    REPEATED = "repeated"
    OVERTAKEN = "overtaken"
    """Its stamp is slightly before the last one; only this sample is dropped."""
    BACK = "back"
    """Its stamp goes back further, which clears the buffer."""


class Rejection(NamedTuple):
    """A rejected sample: stamp (ns) and cause."""

    stamp: int
    cause: Statement


class Intake(NamedTuple):
    """Result of taking arrivals into the buffer.

    Attributes
    ----------
    rejected : mapping of (Signal, SampleFault) to int
        Number of rejected samples.
    cleared : Statement or None
        Cause of the first clearing of the buffer.
    """

    rejected: Mapping[tuple[Signal, SampleFault], int] = MappingProxyType({})
    cleared: Statement | None = None


class Snapshot(NamedTuple):
    """A copy of a buffer, for an identification while the buffer takes further samples.

    `cleared_because` gives the cause of the last clearing until the buffer is full again.
    """

    pressure: Samples
    position: Samples
    rejections: tuple[Rejection, ...]
    cleared_because: Statement | None

    def causes(self) -> str:
        """Return the causes of the rejections, with the number of samples for each."""
        counts = Counter(rejection.cause for rejection in self.rejections)
        return "; ".join(f"{cause} ({count} samples)" for cause, count in counts.items())

    def thinned(self, most: int) -> "tuple[Snapshot, int]":
        """Return a snapshot with at most `most` samples per signal, and the samples per mean.

        If a signal has more, each `n` successive samples are replaced by their mean
        (`Samples.averaged`), with the smallest `n` that suffices. Both signals are cut to the time
        that both cover. A signal with no more than `most` samples is not averaged. Signals with
        equal stamps keep equal stamps.
        """
        pressure, position = self.pressure, self.position
        longest = max(pressure.stamps.size, position.stamps.size)
        if longest <= most or not min(pressure.stamps.size, position.stamps.size):
            return self, 1
        begin = max(int(pressure.stamps[0]), int(position.stamps[0]))
        end = min(int(pressure.stamps[-1]), int(position.stamps[-1]))
        count = -(-longest // most)
        signals = (
            one.within(begin, end).averaged(count if one.stamps.size > most else 1)
            for one in (pressure, position)
        )
        return self._replace(pressure=next(signals), position=next(signals)), count

    def recording(self) -> Recording:
        """Put both signals on one time grid.

        Raises RefusalError if samples were rejected within the window, or the signals cannot form
        a record.
        """
        if self.rejections:
            raise RefusalError(
                f"bad samples in the window: {self.causes()}; correct the source, then clear the "
                "buffer or wait until these samples have left it"
            )
        return uniform_recording(self.pressure, self.position)


def _are_good(last_stamp: int | None, samples: Samples) -> bool:
    """Return whether all values are finite and the stamps increase from the last stamp on."""
    stamps, values = samples
    if stamps.size == 0:
        return True
    follows = last_stamp is None or bool(stamps[0] > last_stamp)
    return follows and bool((stamps[1:] > stamps[:-1]).all() and np.isfinite(values).all())


def _cause(signal: Signal, fault: SampleFault, **facts: Statement) -> Statement:
    return said(Code[f"SAMPLE_{fault.name}"], signal=signal.value, **facts)


class RecordBuffer:
    """The last `window` seconds of pressure and stem position of one valve.

    An impossible sample, such as a pressure outside the sensor's range, is rejected and recorded
    with its cause. A stamp that goes back means that the clock has jumped, and clears the buffer.
    A stamp that goes back by at most 1.5 sampling periods was overtaken in transport; only that
    sample is dropped. `taken` is the number of samples of both signals taken in total.
    """

    def __init__(self, valve: Valve, window: float) -> None:
        self._ranges = {
            Signal.PRESSURE: (
                *valve.readings,
                said(
                    Code.SENSOR_RANGE,
                    lowest=valve.pressure_minimum,
                    highest=valve.pressure_maximum,
                ),
            ),
            Signal.POSITION: (
                -MOST_POSITION,
                MOST_POSITION,
                said(Code.ANY_VALVE_RANGE, lowest=-MOST_POSITION, highest=MOST_POSITION),
            ),
        }
        self._valve = valve
        self._window = nanoseconds(window)
        self._pressure = SampleBuffer(window)
        self._position = SampleBuffer(window)
        self._rejections: deque[Rejection] = deque(maxlen=_REJECTIONS_KEPT)
        self._first_stamp: int | None = None
        self._cleared_because: Statement | None = None
        self.taken = 0
        self._rejected: Counter[Statement] = Counter()

    def __len__(self) -> int:
        """Count the samples of both signals."""
        return len(self._pressure) + len(self._position)

    @property
    def counts(self) -> tuple[int, int]:
        """Number of pressure samples and of position samples."""
        return len(self._pressure), len(self._position)

    @property
    def rejected(self) -> Mapping[Statement, int]:
        """Number of samples rejected in total, by cause."""
        return MappingProxyType(self._rejected)

    @property
    def nbytes(self) -> int:
        """Memory used by the samples of both signals, bytes."""
        return self._pressure.nbytes + self._position.nbytes

    @property
    def last_stamps(self) -> tuple[int | None, int | None]:
        """Stamps of the newest pressure and the newest position, ns, or None."""
        return self._pressure.last_stamp, self._position.last_stamp

    @property
    def newest_stamp(self) -> int | None:
        """Stamp of the newest sample of either signal, ns, or None."""
        return max((stamp for stamp in self.last_stamps if stamp is not None), default=None)

    def add_pressure(self, stamp: int, pressure: float) -> Statement | None:
        """Take a pressure (Pa) stamped `stamp` (ns); return the cause of a rejection."""
        _, cause = self._add(Signal.PRESSURE, stamp, pressure)
        return cause

    def add_position(self, stamp: int, position: float | None) -> Statement | None:
        """Take a stem position (m) stamped `stamp` (ns); return the cause of a rejection.

        None means a message without a position.
        """
        _, cause = self._add(Signal.POSITION, stamp, position)
        return cause

    def in_order(self, arrivals: Arrivals) -> Arrivals:
        """Leave out samples that were overtaken in transport, and count them as rejected."""
        found = np.zeros(arrivals.stamps.size, np.bool_)
        for kind, signal, buffer in (
            (Kind.PRESSURE, Signal.PRESSURE, self._pressure),
            (Kind.POSITION, Signal.POSITION, self._position),
        ):
            places = np.flatnonzero(arrivals.kinds == kind)
            found[places] = overtaken = buffer.overtaken(arrivals.stamps[places])
            if overtaken.any():
                self._rejected[_cause(signal, SampleFault.OVERTAKEN)] += int(overtaken.sum())
        if not found.any():
            return arrivals
        kinds, stamps, values = arrivals
        return Arrivals(kinds[~found], stamps[~found], values[~found])

    def add_arrivals(self, arrivals: Arrivals) -> Intake:
        """Take samples of both signals in the order of their arrival.

        Arrivals without a fault are taken as a whole. Otherwise each sample is taken or rejected by
        itself, because the order decides which samples remain after a clearing.
        """
        pressure, position = arrivals.samples(Kind.PRESSURE), arrivals.samples(Kind.POSITION)
        if not (
            pressure.stamps.size + position.stamps.size == arrivals.stamps.size
            and _are_good(self._pressure.last_stamp, pressure)
            and _are_good(self._position.last_stamp, position)
            and self._valve.sensor_reads(pressure.values).all()
            and (np.abs(position.values) <= MOST_POSITION).all()
        ):
            return self._add_one_by_one(arrivals)
        self._pressure.extend(pressure)
        self._position.extend(position)
        self.taken += arrivals.stamps.size
        if self._first_stamp is None and arrivals.stamps.size:
            self._first_stamp = int(arrivals.stamps[0])
        return Intake()

    def _add_one_by_one(self, arrivals: Arrivals) -> Intake:
        rejected: Counter[tuple[Signal, SampleFault]] = Counter()
        cleared: Statement | None = None
        for kind, stamp, value in zip(*(part.tolist() for part in arrivals), strict=True):
            signal = Signal.PRESSURE if kind == Kind.PRESSURE else Signal.POSITION
            fault, cause = self._add(signal, stamp, None if kind == Kind.NO_POSITION else value)
            if fault is not None:
                rejected[signal, fault] += 1
            if fault is SampleFault.BACK:
                cleared = cleared or cause
        return Intake(rejected, cleared)

    def drop_damaged(self, signal: Signal, count: int) -> Intake:
        """Count messages on the topic of a signal that hold no sample."""
        self._rejected[_cause(signal, SampleFault.DAMAGED)] += count
        return Intake({(signal, SampleFault.DAMAGED): count})

    def _add(
        self, signal: Signal, stamp: int, value: float | None
    ) -> tuple[SampleFault | None, Statement | None]:
        """Take a sample, or return the fault for which it is rejected and the cause."""
        buffer = self._pressure if signal is Signal.PRESSURE else self._position
        last = buffer.last_stamp
        if value is None:
            return self._reject(stamp, signal, SampleFault.NO_JOINT)
        if buffer.overtaken(np.array([stamp], np.int64)).any():
            self._rejected[overtaken := _cause(signal, SampleFault.OVERTAKEN)] += 1
            return SampleFault.OVERTAKEN, overtaken
        if last is not None and stamp < last:
            seconds = (last - stamp) / 1e9
            cause = said(Code.STAMPS_WENT_BACK, signal=signal.value, seconds=seconds)
            self.clear(cause)
            self._rejected[_cause(signal, SampleFault.BACK)] += 1
            return SampleFault.BACK, said(Code.BUFFER_CLEARED, because=cause)
        if stamp == last or not math.isfinite(value):
            fault = SampleFault.REPEATED if stamp == last else SampleFault.NOT_FINITE
            return self._reject(stamp, signal, fault)
        lowest, highest, span = self._ranges[signal]
        if not lowest <= value <= highest:
            return self._reject(stamp, signal, SampleFault.OUT_OF_RANGE, span=span)
        buffer.append(stamp, value)
        self.taken += 1
        self._first_stamp = stamp if self._first_stamp is None else self._first_stamp
        return None, None

    def _reject(
        self, stamp: int, signal: Signal, fault: SampleFault, **facts: Statement
    ) -> tuple[SampleFault, Statement]:
        cause = _cause(signal, fault, **facts)
        self._rejections.append(Rejection(stamp, cause))
        self._rejected[cause] += 1
        return fault, cause

    def clear(self, cause: Statement) -> None:
        """Remove all samples; refusals name `cause` until the buffer is full again."""
        self._pressure.clear()
        self._position.clear()
        self._rejections.clear()
        self._first_stamp = None
        self._cleared_because = cause

    def snapshot(self) -> Snapshot:
        """Copy the samples and the rejections of the last window."""
        pressure, position = self._pressure.samples(), self._position.samples()
        newest = self.newest_stamp or 0
        rejections = tuple(
            rejection for rejection in self._rejections if rejection.stamp >= newest - self._window
        )
        is_full = self._first_stamp is not None and newest - self._first_stamp >= self._window
        return Snapshot(pressure, position, rejections, None if is_full else self._cleared_because)
