# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The moves of the valve and their reference: held here, and kept in the history."""

import time
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from rclpy.node import Node

from valve_friction_ros import history as database
from valve_friction_ros.evidence import (
    MOST_MOVES,
    Evidence,
    FrictionChange,
    Move,
    is_clock_reset,
    stamp_problem,
)
from valve_friction_ros.health import Reference, reference_by_evidence
from valve_friction_ros.history import KeptValve
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.nodes.identifier.history_writer import HistoryWriter

if TYPE_CHECKING:
    from valve_friction_ros.history import HistoryFile

_WRITE_EVERY = 5.0
"""Time between two writings, s. A killed node loses so much, and a move that has not ended."""

_TOLD = 3
"""Moves in a row that are left out, from which it is a problem; one may have a stray stamp."""

_SURE = 8
"""Moves in a row that tell that the clock was ahead before. A clock that is not set yet after a
start is set within less time."""


@dataclass(eq=False)
class _Batch:
    """Moves to be written in the writer's thread, and whether they are."""

    valve: KeptValve
    built: Valve
    moves: tuple[Move, ...]
    days: float
    is_written: bool = False

    def __call__(self, file: "HistoryFile") -> None:
        database.keep_moves(file, self.valve, self.built, self.moves, self.days)
        self.is_written = True


class MoveLedger:
    """Moves of one actuator and one packing, oldest first; what they said first; their change.

    The last change of friction stays when the moves before it have gone.
    """

    def __init__(self, node: Node, history: HistoryWriter, built: Valve) -> None:
        self._node, self._history, self._built = node, history, built
        self._moves: deque[Move] = deque(history.moves()[-MOST_MOVES:], maxlen=MOST_MOVES)
        self._unwritten: deque[Move] = deque(maxlen=MOST_MOVES)
        self._batch: _Batch | None = None
        self._written_at = time.monotonic()
        self.reference: Reference | None = history.reference()
        self.change: FrictionChange | None = history.change()
        self.left_out = 0
        self._left_in_a_row = 0
        self._problem = ""
        self._behind: list[Move] = []

    @property
    def moves(self) -> tuple[Move, ...]:
        """The moves."""
        return tuple(self._moves)

    @property
    def newest(self) -> int:
        """End of the newest move, ns since 1970 (UTC); 0 without any."""
        return self._moves[-1].end if self._moves else 0

    def add(self, moves: Iterable[Move]) -> None:
        """Add moves, but those with impossible stamps; no kept move goes for them."""
        clock = self._node.get_clock()
        now = clock.now().nanoseconds
        for move in moves:
            if problem := stamp_problem(move, self.newest or None, now):
                self._leave_out(problem)
                # A recording that is played tells nothing of the clock.
                if clock.ros_time_is_active or not is_clock_reset(move, self.newest, now):
                    self._behind.clear()
                    continue
                self._behind.append(move)
                if len(self._behind) == _SURE:
                    self._drop_those_ahead()
                continue
            self._moves.append(move)
            self._unwritten.append(move)
            self._left_in_a_row = 0
            self._behind.clear()

    @property
    def problem(self) -> str:
        """Why the latest moves are all left out; empty if they are not."""
        if self._left_in_a_row < _TOLD:
            return ""
        return (
            f"the latest {self._left_in_a_row} moves in service are left out of the evidence: "
            f"their stamps lie {self._problem}: check the clocks of the sensors and of this "
            "machine, and give a recording that is played a history_file of its own"
        )

    def _drop_those_ahead(self) -> None:
        """Drop the kept moves that a clock which was ahead has stamped, here and in the file."""
        behind, self._behind = self._behind, []
        begin, count = behind[0].begin, len(self._moves)
        for kept in (self._moves, self._unwritten):
            while kept and kept[-1].end > begin:
                kept.pop()
        self._batch = None
        change = partial(database.forget_moves_after, valve=self._history.valve, time=begin)
        self._history.keep_soon(change)
        self._node.get_logger().warning(
            f"the clock was ahead, and has been set back: {count - len(self._moves)} kept moves in "
            "service with stamps of a time to come are dropped"
        )
        self.left_out -= len(behind)
        self.add(behind)

    def _leave_out(self, problem: str) -> None:
        self.left_out += 1
        self._left_in_a_row += 1
        self._problem = problem
        if self.left_out == 1:
            self._node.get_logger().warning(
                f"a move in service is left out of the evidence: its stamps lie {problem}; "
                "evidence left_out counts them: check the clocks of the sensors and of this "
                "machine, or set use_sim_time where a recording is played"
            )

    def refer(self, evidence: Evidence) -> None:
        """Take the first friction that is known well enough as the reference."""
        if self.reference is not None:
            return
        self.reference = reference_by_evidence(evidence)
        if self.reference is not None:
            valve = self._history.valve
            self._history.keep_soon(
                partial(
                    database.keep_reference,
                    valve=valve,
                    built=self._built,
                    reference=self.reference,
                )
            )

    def note_change(self, change: FrictionChange | None) -> None:
        """Keep a change of friction in place of the one before; None leaves that."""
        if change in (None, self.change):
            return
        self.change = change
        self._history.keep_soon(
            partial(
                database.keep_change, valve=self._history.valve, built=self._built, change=change
            )
        )

    def use(self, built: Valve) -> None:
        """Follow the valve; other forces need other moves, as they do in the file."""
        before, self._built = self._built, built
        if _actuator(before) != _actuator(built):
            self._written_with(before)
            self._clear()

    def renew(self) -> None:
        """Begin anew with a new packing; the history does so with `keep_renewal`."""
        self.close()
        self._clear()

    def keep(self) -> None:
        """Have the writer's thread write the new moves now and then, once those before are."""
        if time.monotonic() - self._written_at < _WRITE_EVERY:
            return
        self._written_at = time.monotonic()
        if self._batch is not None and not self._batch.is_written:
            self._history.keep_soon(self._batch)
        else:
            self.close()

    def close(self) -> None:
        """Write what is not written yet; the writer's thread finishes it."""
        self._written_with(self._built)

    def _clear(self) -> None:
        self._moves.clear()
        self._batch = self.reference = self.change = None
        self._left_in_a_row = 0
        self._behind.clear()

    def _written_with(self, built: Valve) -> None:
        if self._unwritten:
            days = self._node.get_parameter("history_days").value
            self._batch = _Batch(self._history.valve, built, tuple(self._unwritten), days)
            self._unwritten.clear()
            self._history.keep_soon(self._batch)


def _actuator(valve: Valve) -> tuple[float | None, float]:
    return valve.diaphragm_area, valve.pressure_reference
