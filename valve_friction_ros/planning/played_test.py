# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A planned stroke test as it is played on a valve: set points in time, and limits that end it.

This module has no clock and no bus: its caller gives the time and the received samples.
"""

import math
from dataclasses import dataclass
from enum import Enum, auto

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.excitations import SampledPressure
from valve_friction_ros.wording import Code, Statement, said


class PlayPhase(Enum):
    """Phase of a test."""

    WAITING = auto()
    """No pressure is set."""
    PLAYING = auto()
    ENDED = auto()
    """Played to its end; the last set point stays."""
    BACK = auto()
    """Aborted; the initial pressure is set."""


PRESSURE_MARGIN = 1e4
"""Distance, Pa, of the limits of the measured pressure from the set points, unless set. Chosen."""


@dataclass(frozen=True)
class PlayLimits:
    """Limits that end a test at once.

    Raises
    ------
    ValueError
        If a range is empty or open, or a time is not above zero.
    """

    position: tuple[float, float]
    """Lowest and highest position of the stem, m."""
    pressure: tuple[float, float]
    """Lowest and highest measured pressure, Pa."""
    silence: float = 1.0
    """Longest time without a sample of either signal, and between two set points, s."""
    duration: float = 3600.0
    """Longest time that a test may take, s."""

    def __post_init__(self) -> None:
        """Refuse limits that would never end a test."""
        for name in ("position", "pressure"):
            low, high = getattr(self, name)
            if not -math.inf < low < high < math.inf:
                raise ValueError(
                    f"the limits of the {name} must be two numbers in order, got {low:g} and "
                    f"{high:g}: give the limits at which the test must abort"
                )
        for name in ("silence", "duration"):
            if not 0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be above 0 s, got {getattr(self, name):g}")


class PlayedTest:
    """A stroke test that is played once per start, and returns to its initial pressure on an abort.

    Times are seconds of a clock that does not go back.

    Parameters
    ----------
    signal : SampledPressure
        The pressure to set; its first value is set by hand before the start.
    limits : PlayLimits
        Limits that end the test.

    Attributes
    ----------
    phase : PlayPhase
        Phase of the test.
    aborted : Statement or None
        Why it was aborted.
    """

    def __init__(self, signal: SampledPressure, limits: PlayLimits) -> None:
        self.signal, self.limits = signal, limits
        self.phase, self.aborted = PlayPhase.WAITING, None
        self._begun = self._stepped = 0.0
        self._heard: dict[str, tuple[float, float]] = {}
        self._pending: Statement | None = None
        if self.duration > limits.duration:
            raise ValueError(
                f"the test takes {self.duration:g} s, but only {limits.duration:g} s are allowed: "
                "plan a shorter test, or allow more time"
            )

    aborted: Statement | None

    @property
    def duration(self) -> float:
        """Length of the test, s."""
        return float(self.signal.times[-1] - self.signal.times[0])

    @property
    def home(self) -> float:
        """Initial pressure, Pa, to which an abort returns."""
        return float(self.signal.pressures[0])

    def heard_stem(self, position: float, now: float) -> None:
        """Receive a position of the stem, m; a sample beyond the limits ends a playing test."""
        self._hear("position", position, now)

    def heard_pressure(self, pressure: float, now: float) -> None:
        """Receive a measured pressure, Pa."""
        self._hear("pressure", pressure, now)

    def _hear(self, name: str, value: float, now: float) -> None:
        self._heard[name] = value, now
        if self.phase is PlayPhase.PLAYING and self._pending is None:
            self._pending = self._beyond(name)

    def _beyond(self, name: str) -> Statement | None:
        """Say that the last sample of a signal is beyond its limits, or nan."""
        low, high = getattr(self.limits, name)
        value, _ = self._heard[name]
        if low <= value <= high:
            return None
        code = Code[f"{name.upper()}_BEYOND_LIMIT"]
        return said(code, found=value, limit=low if value < low else high)

    def _doubt(self, now: float) -> Statement | None:
        """Say why the test must not go on; None if it may."""
        for name, silent in (("position", Code.STEM_SILENT), ("pressure", Code.PRESSURE_SILENT)):
            _, at = self._heard.get(name, (math.nan, -math.inf))
            if not now - at <= self.limits.silence:
                return said(silent, found=now - at, limit=self.limits.silence)
            if (beyond := self._beyond(name)) is not None:
                return beyond
        return None

    def start(self, now: float) -> None:
        """Begin to play.

        Raises RefusalError if the test is playing already, or the signals are missing or beyond
        their limits.
        """
        if self.phase is PlayPhase.PLAYING:
            raise RefusalError("the test is running: stop it first")
        if (doubt := self._doubt(now)) is not None:
            raise RefusalError(f"not started: {doubt}")
        self.phase, self.aborted, self._pending = PlayPhase.PLAYING, None, None
        self._begun = self._stepped = now

    def abort(self, why: Statement) -> None:
        """Return to the initial pressure at once, if the test is playing."""
        if self.phase is PlayPhase.PLAYING:
            self.phase, self.aborted = PlayPhase.BACK, why

    def step(self, now: float) -> float | None:
        """Return the pressure, Pa, to set now; None if no pressure is set."""
        if self.phase is PlayPhase.WAITING:
            return None
        if self.phase is PlayPhase.PLAYING:
            late = now - self._stepped
            doubt = self._pending or self._doubt(now)
            if doubt is None and late > self.limits.silence:
                doubt = said(Code.PLAYER_STALLED, found=late, limit=self.limits.silence)
            self._stepped = now
            if doubt is not None:
                self.abort(doubt)
            elif now - self._begun >= self.duration:
                self.phase = PlayPhase.ENDED
        if self.phase is PlayPhase.BACK:
            return self.home
        return float(self.signal.sample(min(now - self._begun, self.duration)))

    def __str__(self) -> str:
        """Return the state of the test, on one line."""
        return {
            PlayPhase.WAITING: "waiting for start",
            PlayPhase.PLAYING: f"plays for {self.duration:.4g} s",
            PlayPhase.ENDED: "completed",
            PlayPhase.BACK: f"returned to {self.home / 1e3:.4g} kPa: {self.aborted}",
        }[self.phase]
