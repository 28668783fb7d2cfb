"""The history of the plant, as the identifier writes it, and reads it at the start."""

import contextlib
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from rclpy.node import Node

from valve_friction_ros.evidence import Change, Move
from valve_friction_ros.health import (
    Baseline,
    FrictionMonitor,
    IdentificationInput,
    KnownNumbers,
    Level,
    Reference,
)
from valve_friction_ros.history import (
    AlarmRecording,
    HistoryEntry,
    HistoryError,
    HistoryFile,
    KeptBaseline,
    KeptValve,
    Trend,
    ValveHistory,
    alarm_recordings,
    current_trend,
    entry_of,
    keep_told_level,
    read_answers,
    read_change,
    read_moves,
    read_reference,
    read_told_level,
    read_usage,
    valve_histories,
)
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.identifier.history_guard import HistoryGuard
from valve_friction_ros.nodes.identifier.history_sending import HistorySending
from valve_friction_ros.nodes.identifier.parameters import HISTORY_DAYS, HISTORY_FILE
from valve_friction_ros.nodes.identifier.waiting_changes import WaitingChanges
from valve_friction_ros.nodes.plumbing.background import InternalError, bugs_reported, done_in
from valve_friction_ros.nodes.plumbing.worker import Worker
from valve_friction_ros.response import Move as CommandAnswer
from valve_friction_ros.usage import ValveUsage

__all__ = ["HistoryWriter"]

_LONGEST = 60.0
"""Time, s, after which a writing that has not ended is a problem; a busy file ends it sooner."""
_END_OF_TIME = 2**63 - 1

_T = TypeVar("_T")


class HistoryWriter:
    """Writes to the history in a thread of its own, so that no slow disk holds up the node.

    What could not be written waits, and is tried again with what comes next.
    """

    def __init__(self, node: Node, monitor: FrictionMonitor, tag: str) -> None:
        self._node = node
        self._monitor = monitor
        self._valve = KeptValve(node.get_fully_qualified_name(), tag)
        path = node.get_parameter(HISTORY_FILE.name).value
        try:
            self._file = HistoryFile(Path(path).expanduser()) if path else None
        except RuntimeError as error:  # pathlib's
            raise ValueError(
                f"{HISTORY_FILE.name} {path}: {error} Set HOME or ROS_HOME, or name another file"
            ) from None
        self._guard = None
        if self._file is not None:
            self._guard = HistoryGuard(self._file.path, self._valve.name)
        self._sending = HistorySending(node, self.path, self._valve)
        self._writer = Worker("history", finishes=True)
        self._waiting = WaitingChanges()
        self._problem: str | None = None
        self._trend: Trend | None = None
        self._baseline: KeptBaseline | None = None
        self._former: KeptBaseline | None = None
        self._under_way: list[Future[None]] = []

    @property
    def valve(self) -> KeptValve:
        """The valve, as the history calls it."""
        return self._valve

    @property
    def path(self) -> Path | None:
        """The file; None if nothing is kept."""
        return None if self._file is None else self._file.path

    @property
    def problems(self) -> list[str]:
        """Why the latest writing failed, or has not ended; empty if it did not."""
        problem = self._problem
        if (busy := self._writer.busy_for()) > _LONGEST:
            problem = f"{self.path} has not answered for {busy:.0f} s"
        if not problem:
            return []
        lost = self._waiting.given_up
        return [f"the history is not written: {problem}{f'; given up: {lost}' * bool(lost)}"]

    @property
    def conflict(self) -> str | None:
        """That another node keeps the history of this valve, too, if so."""
        return None if self._guard is None else self._guard.conflict

    def close(self) -> None:
        """Leave the history to another node."""
        if self._guard is not None:
            self._guard.release()
        self._sending.close()

    def values(self) -> dict[str, str]:
        """Return what the diagnostics say: that nothing is kept, or how it goes to a server."""
        if self._file is not None:
            return self._sending.values()
        lost = f"none, as {HISTORY_FILE.name} is empty: diagnosis and baseline end with this node"
        return {"history": lost}

    @property
    def reservation(self) -> str:
        """Addition to the answer that something was kept; empty if it is in the file."""
        return "".join(f", but it is lost with this node: {one}" for one in self.problems)

    @property
    def baseline(self) -> KeptBaseline | None:
        """The baseline that was kept last, with its record; another one may be in force.

        None where that was withdrawn.
        """
        return self._baseline

    def read(self) -> ValveHistory | None:
        """Read the history of the valve, in any thread; None without a file or entries.

        Raises HistoryError if the file cannot be read.
        """
        if self._file is None:
            return None
        histories = valve_histories(self._file, (self._valve,), 0, _END_OF_TIME)
        return histories[0] if histories else None

    @property
    def trend(self) -> Trend | None:
        """Drift of the Coulomb friction, as of the latest identification."""
        return self._trend

    def prepare(self) -> HistoryEntry | None:
        """Make the file if it is not there, and read the valve's baseline in it, if any.

        What another machine has kept of the valve since is taken from the server first.
        Returns the last success, if any.
        """
        name = self._valve.name
        self._tried(HistoryFile.prepare)
        if self._guard is not None:
            self._guard.ask()
            self._guard.note()
        self._sending.take()
        self._baseline = last = self._tried(lambda file: file.baseline(name))
        if last is not None:
            self._former = self._tried(lambda file: file.baseline(name, until=last.time))
        return self._tried(lambda file: file.last_success(name))

    def known_numbers(self, earlier: HistoryEntry) -> KnownNumbers | None:
        """Read what is known of the valve since its baseline was set, by the last success, too."""
        name, built, kept = self._valve.name, self._monitor.settings.valve, self._baseline
        since = earlier.time if kept is None else min(kept.time, earlier.time)
        return self._tried(lambda file: file.known_numbers(name, built, since))

    def read_trend(self) -> None:
        """Compute the trend with the baseline and settings of now."""
        self._trend = self._tried(self._trend_job())

    def _tried(self, job: Callable[[HistoryFile], _T]) -> _T | None:
        """Do a job on the file, if there is one; of several problems the first is reported."""
        if self._file is None:
            return None
        try:
            return job(self._file)
        except HistoryError as error:
            if self._problem is None:
                self._complain(error)
            return None

    async def keep(
        self, identified: IdentificationInput, refusal: RefusalError | None = None
    ) -> None:
        """Keep the identification that the monitor has just accepted, or why it was refused."""
        monitor, now = self._monitor, self._node.get_clock().now().nanoseconds
        found = monitor.stamp if refusal is None else None
        days = self._node.get_parameter(HISTORY_DAYS.name).value
        with self._failures_remembered():
            entry = entry_of(monitor, self._valve, *identified, found or now, refusal)
            await self._written(lambda file: file.add(entry, days), identification=True)

    def kept_now(
        self, baseline: Baseline, level: Level, evidence_since: int | None = None
    ) -> KeptBaseline:
        """Describe a baseline that is taken now, at a level of the valve.

        It is of the latest result, or of moves since a time.
        """
        now, monitor = self._node.get_clock().now().nanoseconds, self._monitor
        since, record = now if monitor.stamp is None else monitor.stamp, None
        if evidence_since is not None:
            since = evidence_since
        elif monitor.result is not None:
            record = KeptBaseline.thin(monitor.result.recording)
        replaced = monitor.baseline
        return KeptBaseline(baseline, now, since, record, replaced, level=level)

    def replaced_now(self, last: KeptBaseline, by: str, level: Level) -> KeptBaseline:
        """Describe that what the last baseline has replaced comes back now, for `by`, at a level.

        Where it was kept, it comes back with its record and the beginning of its trend.
        """
        former = self._former
        if former is None or former.baseline != last.replaced:
            former = replace(last, baseline=last.replaced or last.baseline, since=0, record=None)
        return replace(
            former,
            time=self._node.get_clock().now().nanoseconds,
            replaced=last.baseline,
            by=by,
            level=level,
            withdrawn=last.replaced is None,
        )

    async def keep_baseline(self, kept: KeptBaseline) -> None:
        """Keep a baseline that is in force from now on, or none."""
        self._former, self._baseline = self._baseline, None if kept.withdrawn else kept
        with self._failures_remembered():
            await self._written(lambda file: file.set_baseline(self._valve, kept))

    def usage(self) -> ValveUsage | None:
        """Read what the valve has done; None without a file, or where it cannot be read."""
        return self._tried(lambda file: read_usage(file, self._valve.name))

    def told_level(self) -> Level | None:
        """Read the level that was told last, if any."""
        return self._tried(lambda file: read_told_level(file, self._valve.name))

    def keep_told_level(self, level: Level) -> None:
        """Keep the level that was told last, soon."""
        valve = self._valve
        self.keep_soon(lambda file: keep_told_level(file, valve, level))

    def last_alarm(self) -> AlarmRecording | None:
        """Read the latest recording of an alarm, if any.

        Those of a time to come, from before the clock went back, are the latest if all are.
        """
        found = self._tried(lambda file: alarm_recordings(file, self._valve.name)) or ()
        now = self._node.get_clock().now().nanoseconds
        past = [one for one in found if one.time <= now]
        return max(past or found, key=lambda one: one.time, default=None)

    async def keep_change(self, change: Callable[[HistoryFile], None]) -> None:
        """Make a change in the writer's thread, and wait until it is written."""
        with self._failures_remembered():
            await self._written(change)

    def moves(self) -> tuple[Move, ...]:
        """Read the moves of the valve in service; none without a file."""
        built = self._monitor.settings.valve
        return self._tried(lambda file: read_moves(file, self._valve.name, built)) or ()

    def reference(self) -> Reference | None:
        """Read what the moves of the valve said first; None without a file."""
        built = self._monitor.settings.valve
        return self._tried(lambda file: read_reference(file, self._valve.name, built))

    def change(self) -> Change | None:
        """Read the last change of friction that the moves showed; None without a file."""
        built = self._monitor.settings.valve
        return self._tried(lambda file: read_change(file, self._valve.name, built))

    def answers(self) -> tuple[CommandAnswer, ...]:
        """Read the answers of the stem to its command; none without a file."""
        travel = self._monitor.settings.valve.travel
        return self._tried(lambda file: read_answers(file, self._valve.name, travel)) or ()

    def keep_soon(self, change: Callable[[HistoryFile], None]) -> None:
        """Make a change in the writer's thread, and do not wait; `settle` takes its outcome.

        A change that waits already is not made twice.
        """
        if self._file is None:
            return
        self._waiting.add(change)
        # A job that has begun may have looked for the last time.
        if all(one.running() or one.done() for one in self._under_way):
            self._under_way.append(self._writer.submit(self._write_waiting, self._file))

    def settle(self) -> None:
        """Take the outcomes of `keep_soon` that are there, and claim what was not granted."""
        if self._guard is not None:
            self._guard.ask()
        self._sending.follow()
        while self._under_way and self._under_way[0].done():
            with self._failures_remembered():
                self._under_way.pop(0).result()

    def _trend_job(self) -> Callable[[HistoryFile], Trend | None]:
        """Return what computes the trend with the baseline and settings of now, in any thread."""
        monitor, name = self._monitor, self._valve.name
        return partial(
            current_trend, valve=name, baseline=monitor.baseline, settings=monitor.settings
        )

    async def _written(
        self, change: Callable[[HistoryFile], None], identification: bool = False
    ) -> None:
        """Write a change, and what waits since before; then compute the trend."""
        if self._file is None:
            return
        self._waiting.add(change, identification)
        self._trend = await done_in(self._writer, self._write, self._file, self._trend_job())

    @contextlib.contextmanager
    def _failures_remembered(self) -> Iterator[None]:
        try:
            with bugs_reported(self._node, HistoryError, known=self._problem):
                yield
            self._problem = None
            if lost := self._waiting.given_up:
                self._waiting.forget_given_up()
                self._node.get_logger().warning(
                    f"the history is written again, but too much waited: it lacks {lost}"
                )
        except (HistoryError, InternalError) as error:
            self._complain(error)

    def _write(
        self, file: HistoryFile, trend: Callable[[HistoryFile], Trend | None]
    ) -> Trend | None:
        """Write, in the writer's thread, all that waits."""
        self._write_waiting(file)
        return trend(file)

    def _write_waiting(self, file: HistoryFile) -> None:
        if self._guard is None or self._waiting.first() is None:
            return
        if self._guard.is_another:
            self._keep_again(file)
        self._write_all(file)
        self._guard.note()

    def _keep_again(self, file: HistoryFile) -> None:
        """Keep the baseline in force where the file was removed, or another one has none."""
        name, kept = self._valve.name, self._baseline
        told = "its baseline counts after a restart"
        if kept is not None and not (file.path.exists() and file.baselines(name)):
            file.set_baseline(self._valve, kept)
            told = "the baseline in force is kept again"
        self._node.get_logger().warning(
            f"{file.path} was removed or replaced while the node runs: what it held of the valve "
            f"is gone; {told}"
        )

    def _write_all(self, file: HistoryFile) -> None:
        while (change := self._waiting.first()) is not None:
            change(file)
            self._waiting.remove(change)

    def _complain(self, error: HistoryError | InternalError) -> None:
        if str(error) != self._problem:
            self._problem = str(error)
            self._node.get_logger().warning(self.problems[0])
