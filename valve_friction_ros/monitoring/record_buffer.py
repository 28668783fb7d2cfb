"""What an identifier has gathered: both signals of a valve, and what was wrong with them."""

import math
from collections import Counter, deque
from typing import NamedTuple

import numpy as np

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.monitoring.resampling import uniform_recording
from valve_friction_ros.monitoring.samples import SampleBuffer, Samples, nanoseconds

__all__ = ["RecordBuffer", "Rejection", "Snapshot"]

_REJECTIONS_KEPT = 10_000


class Rejection(NamedTuple):
    """A sample that was not taken: its stamp (ns) and what was wrong with it."""

    stamp: int
    cause: str


class Snapshot(NamedTuple):
    """A copy of a buffer, to be identified while the buffer goes on.

    `cleared_because` tells why the buffer was last emptied, until it has filled again.
    """

    pressure: Samples
    position: Samples
    rejections: tuple[Rejection, ...]
    cleared_because: str | None

    def causes(self) -> str:
        """Tell what was wrong with the rejected samples, and with how many of them."""
        counts = Counter(rejection.cause for rejection in self.rejections)
        return "; ".join(f"{cause} ({count} samples)" for cause, count in counts.items())

    def recording(self) -> Recording:
        """Bring both signals onto one grid.

        Raises
        ------
        RefusalError
            If samples were rejected within the window, or the signals do not make a record.
        """
        if self.rejections:
            raise RefusalError(
                f"bad samples in the window: {self.causes()}; mend the source, then clear the "
                "buffer or wait until they have left it"
            )
        return uniform_recording(self.pressure, self.position)


class RecordBuffer:
    """The last seconds of pressure and stem position of one valve.

    A sample that cannot be true is not taken and is remembered with its cause; a stamp that
    goes back means that time has jumped, and clears the buffer.

    Parameters
    ----------
    valve : Valve
        Tells the range of the pressure sensor.
    window : float
        Time to keep, s.
    """

    def __init__(self, valve: Valve, window: float) -> None:
        self._valve = valve
        self._window = nanoseconds(window)
        self._pressure = SampleBuffer(window)
        self._position = SampleBuffer(window)
        self._rejections: deque[Rejection] = deque(maxlen=_REJECTIONS_KEPT)
        self._first_stamp: int | None = None
        self._cleared_because: str | None = None

    def __len__(self) -> int:
        """Count the samples of both signals."""
        return len(self._pressure) + len(self._position)

    def add_pressure(self, stamp: int, pressure: float) -> str | None:
        """Take a pressure (Pa) stamped `stamp` (ns); return what was wrong with it, if anything."""
        lowest, highest = self._valve.pressure_minimum, self._valve.pressure_maximum
        cause = None
        if not lowest <= pressure <= highest and math.isfinite(pressure):
            cause = f"actuator_pressure outside the sensor's range {lowest:g} to {highest:g} Pa"
        return self._add("actuator_pressure", self._pressure, stamp, pressure, cause)

    def add_position(self, stamp: int, position: float | None) -> str | None:
        """Take a stem position (m) stamped `stamp` (ns); return what was wrong, if anything.

        None stands for a message that held no position.
        """
        if position is None:
            return self._reject(stamp, "stem_state without a position of the joint")
        return self._add("stem_state", self._position, stamp, position, None)

    def _add(
        self, name: str, buffer: SampleBuffer, stamp: int, value: float, cause: str | None
    ) -> str | None:
        last = buffer.last_stamp
        if last is not None and stamp < last:
            cause = f"stamps of {name} went back by {(last - stamp) / 1e9:.3g} s"
            self.clear(cause)
            return cause + ": the buffer was cleared"
        if last is not None and stamp == last:
            cause = f"{name} repeats a stamp"
        elif not math.isfinite(value):
            cause = f"{name} is not finite"
        if cause is not None:
            return self._reject(stamp, cause)
        buffer.append(stamp, value)
        self._first_stamp = stamp if self._first_stamp is None else self._first_stamp
        return None

    def _reject(self, stamp: int, cause: str) -> str:
        self._rejections.append(Rejection(stamp, cause))
        return cause

    def clear(self, cause: str) -> None:
        """Forget everything; `cause` is told with a refusal that follows from it."""
        self._pressure.clear()
        self._position.clear()
        self._rejections.clear()
        self._first_stamp = None
        self._cleared_because = cause

    def snapshot(self) -> Snapshot:
        """Copy the samples and the rejections of the last window."""
        pressure, position = self._pressure.samples(), self._position.samples()
        newest = int(np.concatenate((pressure.stamps, position.stamps)).max(initial=0))
        rejections = tuple(
            rejection for rejection in self._rejections if rejection.stamp >= newest - self._window
        )
        is_full = self._first_stamp is not None and newest - self._first_stamp >= self._window
        return Snapshot(pressure, position, rejections, None if is_full else self._cleared_because)
