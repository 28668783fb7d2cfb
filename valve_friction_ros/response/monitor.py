# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Responses of one valve in service: from samples to moves."""

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.response.moves import (
    CommandHolds,
    CommandStep,
    Hunting,
    StepAnswer,
    evaluated,
    hunting,
)
from valve_friction_ros.response.summary import Spread, summarised
from valve_friction_ros.streams import Arrivals, Kind, Samples
from valve_friction_ros.streams.samples import SampleBuffer

_SECOND = 1_000_000_000

_TICK = 10_000_000
"""Least time between two kept samples, ns."""

_SLOW_TICK = 100_000_000
"""Least time between two samples kept for hunting and deviation, ns."""

_LONGEST = 60.0
"""Time, s, after which a move ends even if it has not settled."""

_SHORTEST = 1.0
"""Time, s, for which the command must be constant before and after a step."""

_ANSWER_TIME = 10.0
"""Time, s, after which a stem that rests under a constant pressure has ignored a step."""

_FIRST_LOOK, _LOOKS = 2.0, 1.25
"""Time of the first check whether the stem has settled, s after the step; and the factor from the
time of one check to the next."""

_HUNTING_WINDOW, _HUNTING_PERIOD = 300.0, 5.0
"""Window that is searched for hunting, and interval between searches, s."""

_MOST_AHEAD = 10_000
"""Command samples that may wait for stem samples; beyond it the oldest are dropped."""

_AHEAD, _BEHIND = 10.0, 60.0
"""Lead and lag of the command over the stem, s, beyond which their clocks disagree."""

_RECENT = 200
"""Number of latest moves that are kept."""

_HOUR = 3600


class ResponseMonitor:
    """Follows command, pressure and stem of one valve, in bounded memory.

    Parameters
    ----------
    travel : float
        Travel of the stem, m; finite.
    earlier : sequence of StepAnswer
        Earlier moves, oldest first; only the latest are kept.

    Attributes
    ----------
    summary : ResponseSummary
        Summary of the latest 200 moves.
    left_out : int
        Number of changes of the command that are not evaluated as moves.
    hunting : Hunting or None
        The present limit cycle.
    clock_offset : float
        Lead of the latest command over the stem, s; negative for a lag, 0 if small. A command more
        than 10 s ahead waits. A command more than 60 s behind finds no samples.
    """

    def __init__(self, travel: float, earlier: Sequence[StepAnswer] = ()) -> None:
        if not 0 < travel < math.inf:
            raise ValueError("the travel must be finite")
        self._travel = travel
        self._moves: deque[StepAnswer] = deque(earlier, maxlen=_RECENT)
        self._ended: deque[StepAnswer] = deque(maxlen=_RECENT)
        self.left_out = 0
        self.summary = summarised(tuple(self._moves))
        self.forget()

    def forget(self) -> None:
        """Drop the samples, for example when a clock goes back; keep the moves."""
        self._holds = CommandHolds(self._travel)
        self._ahead: deque[tuple[int, float]] = deque(maxlen=_MOST_AHEAD)
        self._fast = {kind: SampleBuffer(_LONGEST + 5.0) for kind in _SIGNALS}
        self._slow = {kind: SampleBuffer(_HUNTING_WINDOW) for kind in _SIGNALS}
        self._wanted = SampleBuffer(_HUNTING_WINDOW)
        self.clock_offset = 0.0
        self._command = math.nan
        self._steady_since: int | None = None
        self._change: CommandStep | None = None
        self._look_at = 0
        self._hunting_at = 0
        self.hunting: Hunting | None = None
        self._away: deque[tuple[float, float]] = deque(maxlen=_HOUR)
        self._second: list[float] = []
        self._second_of = 0

    @property
    def has_command(self) -> bool:
        """Whether a command has arrived."""
        return math.isfinite(self._command)

    def drain(self) -> tuple[StepAnswer, ...]:
        """Return the moves that ended since the last call, at most the latest 200."""
        ended = tuple(self._ended)
        self._ended.clear()
        return ended

    def deviation(self) -> tuple[Spread, float]:
        """Return the deviation over the last hour of samples: its magnitude and its signed mean.

        The deviation is command minus position, as a share of the travel. The spread holds the mean
        (as its median) and the 95 % quantile in time.
        """
        if not self._away:
            return Spread.of(()), math.nan
        signed, sizes = (np.array(each) for each in zip(*self._away, strict=True))
        mean, high = float(np.mean(sizes)), float(np.percentile(sizes, 95))
        return Spread(mean, float(np.min(sizes)), high, sizes.size), float(np.mean(signed))

    def take(self, command: Samples, arrivals: Arrivals) -> None:
        """Take samples of the command, m, and those of pressure and stem from the same time."""
        if self._goes_back(command, arrivals):
            self.forget()
        before = self._fast[Kind.POSITION].last_stamp
        for kind in _SIGNALS:
            self._keep(kind, arrivals.samples(kind))
        newest = self._fast[Kind.POSITION].last_stamp
        if command.stamps.size and self._ahead and int(command.stamps[0]) < self._ahead[-1][0]:
            self._ahead.clear()  # its clock was corrected
        self._ahead.extend(zip(*(part.tolist() for part in command), strict=True))
        changes = self._taken_command(newest)
        self._compare_clocks(command, before, newest)
        for change in changes:
            self._follow(change)
        if newest is not None and self.has_command:
            self._look(newest)

    def _compare_clocks(self, command: Samples, before: int | None, newest: int | None) -> None:
        """Note whether the latest command is far ahead of the stem, or far behind it."""
        if newest is None or not (command.stamps.size or self.clock_offset > 0):
            return
        last = self._ahead[-1][0] if self._ahead else newest
        ahead = (last - newest) / 1e9
        behind = 0.0
        if before is not None and command.stamps.size:
            behind = (before - int(command.stamps[-1])) / 1e9
        self.clock_offset = ahead if ahead > _AHEAD else -behind if behind > _BEHIND else 0.0

    def _taken_command(self, newest: int | None) -> list[CommandStep]:
        """Take the command up to the newest sample of the stem; later commands wait."""
        due: list[tuple[int, float]] = []
        while newest is not None and self._ahead and self._ahead[0][0] <= newest:
            due.append(self._ahead.popleft())
        changes: list[CommandStep] = []
        if due:
            stamps, values = (np.array(part) for part in zip(*due, strict=True))
            inside = np.clip(values, 0.0, self._travel)
            changes += self._holds.take(Samples(stamps, inside))
            new = _first_of_ticks(stamps, _SLOW_TICK, self._wanted.last_stamp)
            self._wanted.extend(Samples(stamps[new], inside[new]))
            self._command = float(inside[-1])
            if self._steady_since is None:
                self._steady_since = int(stamps[0])
        if newest is not None:
            changes += self._holds.advance(newest)
        return changes

    def _goes_back(self, command: Samples, arrivals: Arrivals) -> bool:
        stem = arrivals.samples(Kind.POSITION)
        last = self._fast[Kind.POSITION].last_stamp
        stamps = (stem.stamps, command.stamps)
        return any(bool((np.diff(each) < 0).any()) for each in stamps) or (
            last is not None and stem.stamps.size > 0 and int(stem.stamps[0]) < last
        )

    def _keep(self, kind: Kind, samples: Samples) -> None:
        good = np.isfinite(samples.values)
        stamps, values = samples.stamps[good], samples.values[good]
        for buffers, tick in ((self._fast, _TICK), (self._slow, _SLOW_TICK)):
            first = _first_of_ticks(stamps, tick, buffers[kind].last_stamp)
            if first.any():
                chosen = Samples(stamps[first], values[first])
                if buffers is self._slow and kind is Kind.POSITION:
                    self._deviate(chosen)
                buffers[kind].extend(chosen)

    def _deviate(self, stem: Samples) -> None:
        if not self.has_command:
            return
        for stamp, value in zip(stem.stamps.tolist(), stem.values.tolist(), strict=True):
            if stamp // _SECOND != self._second_of and self._second:
                signed = float(np.mean(self._second))
                self._away.append((signed, float(np.mean(np.abs(self._second)))))
                self._second.clear()
            self._second_of = stamp // _SECOND
            self._second.append((self._command - value) / self._travel)

    def _follow(self, change: CommandStep) -> None:
        """End the present move, and begin the next."""
        self._end(change.stamp)
        self._steady_since, self.hunting = change.stamp, None
        if change.is_step and change.held >= _SHORTEST:
            self._change = change
            self._look_at = change.stamp + round(_FIRST_LOOK * _SECOND)
        else:
            self.left_out += 1

    def _end(self, stamp: int) -> None:
        change, self._change = self._change, None
        if change is None:
            return
        long_enough = (stamp - change.stamp) / 1e9 >= _SHORTEST
        move = self._move(change, stamp) if long_enough else None
        if move is None:
            self.left_out += 1
            return
        self._moves.append(move)
        self._ended.append(move)
        self.summary = summarised(tuple(self._moves))

    def _move(self, change: CommandStep, end: int) -> StepAnswer | None:
        stem, pressure = (self._fast[kind].samples() for kind in (Kind.POSITION, Kind.PRESSURE))
        return evaluated(change, stem, pressure, end, self._travel)

    def _look(self, newest: int) -> None:
        """Check whether the present move has settled, and whether the stem hunts."""
        change = self._change
        if change is not None and newest >= self._look_at:
            elapsed = (newest - change.stamp) / 1e9
            self._look_at = change.stamp + round(_LOOKS * elapsed * _SECOND)
            move, enough = self._move(change, newest), _LONGEST
            if move is not None and move.settled:
                enough = 0.0 if move.moved else _ANSWER_TIME
            if elapsed >= enough:
                self._end(newest)
        if newest >= self._hunting_at and self._steady_since is not None:
            self._hunting_at = newest + round(_HUNTING_PERIOD * _SECOND)
            stem, pressure = (self._slow[kind].samples() for kind in (Kind.POSITION, Kind.PRESSURE))
            wanted = self._wanted.samples()
            self.hunting = hunting(stem, pressure, wanted, self._steady_since, self._travel)


def _first_of_ticks(stamps: NDArray[np.int64], tick: int, last: int | None) -> NDArray[np.bool_]:
    """Return which samples are the first of their tick, ns, and in a later tick than `last`."""
    ticks = stamps // tick
    return np.diff(ticks, prepend=-1 if last is None else last // tick) > 0


_SIGNALS = (Kind.PRESSURE, Kind.POSITION)
