# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Evidence from the moves in service: collection, storage, display and diagnosis."""

import math
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rclpy.node import Node

from valve_friction_ros import history as database
from valve_friction_ros.evidence.estimate import MOST_MOVES, Evidence, FrictionChange, evidence_of
from valve_friction_ros.evidence.moves import Move, MoveStream, is_clock_reset, stamp_problem
from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.by_evidence import (
    baseline_by_evidence,
    diagnosis_by_evidence,
    reference_by_evidence,
    why_not_compared,
)
from valve_friction_ros.health.diagnosis import Diagnosis
from valve_friction_ros.health.friction_monitor import FrictionMonitor, MonitorSettings
from valve_friction_ros.health.levels import Finding, Level
from valve_friction_ros.health.valve_diagnosis import qualified
from valve_friction_ros.health.valve_numbers import OF_ONE_RESULT
from valve_friction_ros.history import KeptValve
from valve_friction_ros.history.status_values import number_text, ratio_values
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.nodes.identifier.history_writer import HistoryWriter
from valve_friction_ros.nodes.plumbing.worker import InternalError, Worker, bugs_reported, done_in
from valve_friction_ros.streams import Arrivals, utc_second
from valve_friction_ros.wording import Code, said, sentence

if TYPE_CHECKING:
    from valve_friction_ros.history import HistoryFile

_WRITE_EVERY = 5.0
"""Time between two writes, s. If the node is killed, this time and an unfinished move are lost."""

_TOLD = 3
"""Number of successive moves left out that is a problem; a single move may have a stray stamp."""

_SURE = 8
"""Number of successive moves that prove that the clock was ahead before. A clock that is wrong
after a start is set sooner than that."""

_CLOCKS = (
    "check the clocks of the sensors and of this machine; to play a recording, set use_sim_time "
    "and a separate history_file (played in a loop, only its first round is evidence)"
)
"""What to do about stamps that cannot be right."""


@dataclass(eq=False)
class _Batch:
    """Moves to write in the thread of the writer, and whether they are written."""

    valve: KeptValve
    built: Valve
    moves: tuple[Move, ...]
    days: float
    is_written: bool = False

    def __call__(self, file: "HistoryFile") -> None:
        database.keep_moves(file, self.valve, self.built, self.moves, self.days)
        self.is_written = True


class MoveLedger:
    """Moves of one actuator and one packing, oldest first, with their reference and last change.

    The last change of friction remains after the moves before it have been dropped.
    """

    def __init__(self, node: Node, history: HistoryWriter, built: Valve) -> None:
        self._node, self._history, self._built = node, history, built
        moves = history.look_up(database.read_moves, built) or ()
        self._moves = deque(moves, maxlen=MOST_MOVES)
        self._unwritten: deque[Move] = deque(maxlen=MOST_MOVES)
        self._batch: _Batch | None = None
        self._written_at = time.monotonic()
        self.reference = history.look_up(database.read_reference, built)
        self.change = history.look_up(database.read_change, built)
        self.left_out = 0
        self._left_in_a_row = 0
        self._problem = ""
        self._behind: list[Move] = []

    @property
    def moves(self) -> tuple[Move, ...]:
        """The moves, oldest first."""
        return tuple(self._moves)

    @property
    def newest(self) -> int:
        """End of the newest move, ns since 1970 (UTC); 0 without moves."""
        return self._moves[-1].end if self._moves else 0

    def add(self, moves: Iterable[Move]) -> None:
        """Add moves, except those with impossible stamps, which displace no stored moves."""
        clock = self._node.get_clock()
        now = clock.now().nanoseconds
        for move in moves:
            if problem := stamp_problem(move, self.newest or None, now):
                self._leave_out(problem)
                # Stamps of a replayed recording are no evidence about the clock.
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
        """Why all of the latest moves are left out; empty if they are not."""
        if self._left_in_a_row < _TOLD:
            return ""
        return (
            f"the latest {self._left_in_a_row} moves in service are left out of the evidence "
            f"because their time stamps are {self._problem}: {_CLOCKS}"
        )

    def _drop_those_ahead(self) -> None:
        """Drop the stored moves stamped by a clock that was ahead, here and in the file."""
        behind, self._behind = self._behind, []
        begin, count = behind[0].begin, len(self._moves)
        for kept in (self._moves, self._unwritten):
            while kept and kept[-1].end > begin:
                kept.pop()
        self._batch = None
        valve = self._history.valve
        self._history.keep_soon(lambda file: database.forget_moves_after(file, valve, begin))
        self._node.get_logger().warning(
            f"the clock was ahead and has been set back: {count - len(self._moves)} stored moves "
            "in service with time stamps in the future are dropped"
        )
        self.left_out -= len(behind)
        self.add(behind)

    def _leave_out(self, problem: str) -> None:
        self.left_out += 1
        self._left_in_a_row += 1
        self._problem = problem
        if self.left_out == 1:
            self._node.get_logger().warning(
                "a move in service is left out of the evidence because its time stamps are "
                f"{problem} (counted in evidence left_out): {_CLOCKS}"
            )

    def refer(self, evidence: Evidence) -> None:
        """Take the first friction that is known well enough as the reference."""
        if self.reference is not None:
            return
        self.reference = reference_by_evidence(evidence)
        if self.reference is not None:
            self._keep_soon(database.keep_reference, self.reference)

    def note_change(self, change: FrictionChange | None) -> None:
        """Store a change of friction in place of the previous one; None keeps the previous one."""
        if change not in (None, self.change):
            self.change = change
            self._keep_soon(database.keep_change, change)

    def _keep_soon(self, keep: Callable[..., None], what: object) -> None:
        valve, built = self._history.valve, self._built
        self._history.keep_soon(lambda file: keep(file, valve, built, what))

    def use(self, built: Valve) -> None:
        """Follow changes of the valve; another actuator starts a new ledger, as in the file."""
        before, self._built = self._built, built
        if _actuator(before) != _actuator(built):
            self._written_with(before)
            self._clear()

    def renew(self) -> None:
        """Start a new ledger for a new packing; the history does so with `keep_renewal`."""
        self.close()
        self._clear()

    def keep(self) -> None:
        """Periodically write new moves in the thread of the writer, after the previous batch."""
        if time.monotonic() - self._written_at < _WRITE_EVERY:
            return
        self._written_at = time.monotonic()
        if self._batch is not None and not self._batch.is_written:
            self._history.keep_soon(self._batch)
        else:
            self.close()

    def close(self) -> None:
        """Queue unwritten data; the thread of the writer finishes them."""
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


_COMBINE_EVERY = 300_000_000_000
"""Time between two combinations, ns of the stamps: thousands of moves take 0.05 s to combine."""

_SHOWN = ("sliding_friction", "static_friction", "spring_constant", "spring_preload")


class EvidenceWatch:
    """Collects the moves of the valve, and compares their friction with the baseline; a `Watch`.

    A thread combines the moves. At the start they are combined immediately, so that no earlier
    alarm ends.

    Attributes
    ----------
    evidence : Evidence
        The evidence of all moves, from the latest combination.
    """

    def __init__(
        self, node: Node, monitor: FrictionMonitor, history: HistoryWriter, worker: Worker
    ) -> None:
        self._node, self._monitor, self._history = node, monitor, history
        self._worker = worker
        self._job: Future[Evidence] | None = None
        self._is_due = False
        self._error = ""
        self._begun = 0
        self._settings = monitor.settings
        self._stream = MoveStream(self._settings.valve)
        self._ledger = MoveLedger(node, history, self._settings.valve)
        self._combined = self._ledger.newest
        self._use(evidence_of(self._ledger.moves, *_combined_by(self._settings)))

    @property
    def diagnosis(self) -> Diagnosis | None:
        """The diagnosis from the moves; None if there is nothing to compare."""
        settings, reference = self._monitor.settings, self._ledger.reference
        valve, factor = settings.valve, self._monitor.common_factor
        found = diagnosis_by_evidence(
            self.evidence, valve, self._monitor.baseline, settings.limits, reference
        )
        return None if found is None else qualified(found, factor, valve)

    @property
    def source(self) -> str:
        """Source of the evidence, in words."""
        return (
            f"from {self.evidence.moves} moves in service since {utc_second(self.evidence.since)}"
        )

    @property
    def problems(self) -> list[str]:
        """Why the evidence cannot follow the valve; empty if it can."""
        return [self._ledger.problem] if self._ledger.problem else []

    @property
    def failures(self) -> list[str]:
        """The bug in the latest combination; empty if there was none."""
        return [self._error] if self._error else []

    async def as_baseline(self) -> Baseline:
        """Return the sliding friction of the moves as baseline; raises RefusalError.

        The baseline includes the latest values of all other known numbers of the valve.
        """
        ledger = self._ledger.moves
        begun, newest, before = self._begun, self._ledger.newest, self._job
        found = await done_in(self._worker, evidence_of, ledger, *_combined_by(self._settings))
        if begun == self._begun:
            if self._job is before:
                self._job, self._combined = None, newest  # the running job has older moves
            self._use(found)
        known = self._monitor.known.numbers
        numbers = {name: one for name, one in known.items() if name not in OF_ONE_RESULT}
        return replace(baseline_by_evidence(self.evidence), numbers=numbers)

    async def outdates(self, time: int) -> bool:
        """Return whether the moves since a time, ns, alone suffice for a baseline."""
        newer = [one for one in self._ledger.moves if one.begin > time]
        found = await done_in(self._worker, evidence_of, newer, *_combined_by(self._settings))
        return reference_by_evidence(found) is not None

    def follow_parameters(self) -> None:
        """Use the present valve and settings; another actuator starts a new ledger."""
        before, self._settings = self._settings, self._monitor.settings
        if self._settings.valve != before.valve:
            self._stream = MoveStream(self._settings.valve)
            self._ledger.use(self._settings.valve)
            if not self._ledger.moves:
                self._begin_anew()
        if _combined_by(self._settings) != _combined_by(before):
            self._combine()

    def forget_samples(self) -> None:
        """Drop the unfinished move, and keep the finished moves."""
        self._stream.forget()

    def renew(self) -> None:
        """Start afresh with a new packing; the stored renewal does this in the file."""
        self._stream.forget()
        self._ledger.renew()
        self._begin_anew()

    def take(self, arrivals: Arrivals) -> None:
        """Take samples, and periodically combine the moves."""
        moves = self._stream.take(arrivals)
        if moves:
            self._ledger.add(moves)
            if abs(self._ledger.newest - self._combined) >= _COMBINE_EVERY:
                self._combine()

    def findings(self) -> Sequence[Finding]:
        """Return a finding if friction has grown or collapsed."""
        self._settle()
        diagnosis = self.diagnosis
        if diagnosis is None or diagnosis.level < Level.WARN:
            return ()
        statement, leads = diagnosis.statement, self._leads(diagnosis)
        if not leads:
            statement = said(Code.UNTIL_BEFORE, of=statement, time=self.evidence.until)
        ratio = math.nan if diagnosis.ratio is None else diagnosis.ratio.value
        return (
            Finding(
                diagnosis.level,
                diagnosis.status_signal,
                statement,
                leads=leads,
                friction_ratio=ratio,
            ),
        )

    def _leads(self, diagnosis: Diagnosis) -> bool:
        """Return whether the moves are newer than the latest identification, or agree with it."""
        identified, now = self._monitor.seen_until, self._monitor.diagnosis().ratio
        if identified is None or now is None or self.evidence.until > identified:
            return True
        ratio = diagnosis.ratio
        return ratio is None or (ratio.low <= now.high and now.low <= ratio.high)

    def values(self) -> Mapping[str, str]:
        """Return the numbers from the moves with their intervals, or why there are none."""
        self._settle()
        self._ledger.keep()
        found = self.evidence
        values = {"evidence moves": str(found.moves)}
        if self._ledger.left_out:
            values["evidence left_out"] = str(self._ledger.left_out)
        if found.moves:
            values["evidence since [time]"] = utc_second(found.since)
            values["evidence until [time]"] = utc_second(found.until)
        if not found.is_known:
            values["evidence reason"] = found.parameters["sliding_friction"].reason
        else:
            values |= self._numbers()
            if reason := why_not_compared(found, self._monitor.baseline):
                values["evidence reason"] = sentence(reason)
        if (reference := self._ledger.reference) is not None:
            values["evidence reference [N]"] = number_text(reference.sliding.value)
            values["evidence reference half width [N]"] = number_text(reference.sliding.half_width)
            values["evidence reference [time]"] = utc_second(reference.time)
        if (change := self._ledger.change) is not None:
            values["evidence change_ratio"] = number_text(change.ratio)
            values["evidence change_ratio low"] = number_text(change.low)
            values["evidence change_ratio high"] = number_text(change.high)
            values["evidence change earliest [time]"] = utc_second(change.earliest)
            values["evidence change latest [time]"] = utc_second(change.latest)
        diagnosis = self.diagnosis
        ratio = None if diagnosis is None else diagnosis.ratio
        return values | ratio_values(ratio, "evidence ")

    def close(self) -> None:
        """Queue unwritten data; the thread of the writer finishes them."""
        self._ledger.close()

    def _numbers(self) -> dict[str, str]:
        values = {}
        for name in _SHOWN:
            one = self.evidence.parameters[name]
            values[f"evidence {name} [{one.unit}]"] = number_text(one.value)
            values[f"evidence {name} half width [{one.unit}]"] = number_text(one.half_width)
            values[f"evidence {name} verdict"] = one.verdict.value
            if one.reason:
                values[f"evidence {name} reason"] = one.reason
        values["evidence sliding_speed [m/s]"] = number_text(self.evidence.sliding_speed)
        band = self.evidence.parameters["dead_band"]
        travel = self._monitor.settings.valve.travel
        scale, unit = (100 / travel, "%") if math.isfinite(travel) else (1e3, "mm")
        values[f"evidence dead_band [{unit}]"] = number_text(scale * band.value)
        values[f"evidence dead_band half width [{unit}]"] = number_text(scale * band.half_width)
        if band.reason:
            values["evidence dead_band reason"] = band.reason
        return values

    def _begin_anew(self) -> None:
        """Start without moves, and discard a running combination."""
        self._job, self._is_due = None, False
        self._begun, self._combined = self._begun + 1, 0
        self._use(evidence_of((), *_combined_by(self._settings)))

    def _combine(self) -> None:
        """Combine the moves in the thread, after any running combination."""
        self._is_due = self._job is not None
        if self._job is None:
            self._combined = self._ledger.newest
            wanted = self._ledger.moves, *_combined_by(self._settings)
            self._job = self._worker.submit(evidence_of, *wanted)

    def _settle(self) -> None:
        if self._job is None or not self._job.done():
            return
        job, self._job = self._job, None
        try:
            with bugs_reported(self._node, known=self._error):
                self._use(job.result())
        except InternalError as error:
            self._error = str(error)
        if self._is_due:
            self._combine()

    def _use(self, evidence: Evidence) -> None:
        self._error = ""
        self.evidence = evidence
        self._ledger.refer(evidence)
        self._ledger.note_change(evidence.change)


def _combined_by(settings: MonitorSettings) -> tuple[Valve, IdentificationSettings]:
    return settings.valve, settings.identification
