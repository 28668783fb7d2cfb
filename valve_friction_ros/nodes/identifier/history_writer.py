# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The history of the plant, written by the identifier and read at its start."""

import contextlib
import math
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, TypeVar

from rclpy.node import Node

from valve_friction_ros import history as database
from valve_friction_ros.health.alarms import Alarm, AlarmKind
from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.friction_monitor import FrictionMonitor, IdentificationInput
from valve_friction_ros.health.levels import Level
from valve_friction_ros.health.valve_diagnosis import KnownNumbers
from valve_friction_ros.history import (
    AlarmRecording,
    HistoryEntry,
    HistoryError,
    KeptBaseline,
    KeptValve,
    Trend,
    ValveHistory,
    entry_of,
    server_from,
)
from valve_friction_ros.history.place import Claim
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.nodes.identifier.workers import HistoryThread
from valve_friction_ros.nodes.plumbing.worker import InternalError, bugs_reported, done_in
from valve_friction_ros.streams import END_OF_TIME, utc_second
from valve_friction_ros.wording import numbered

if TYPE_CHECKING:
    from valve_friction_ros.history import HistoryFile, Sender

_MOST = 1000

_Change = Callable[["HistoryFile"], None]


class WaitingChanges:
    """A bounded queue of changes, shared by two threads.

    If it overflows, the oldest identification is dropped, because more will follow; without an
    identification it is the oldest change. Dropped changes are counted.

    Parameters
    ----------
    most : int
        Largest number of waiting changes.
    """

    def __init__(self, most: int = _MOST) -> None:
        self._most = most
        self._lock = Lock()
        self._waiting: dict[_Change, bool] = {}
        self._identifications = self._others = 0

    def add(self, change: _Change, identification: bool = False) -> None:
        """Queue a change that is not yet waiting; if there are too many, drop another one."""
        with self._lock:
            self._waiting.setdefault(change, identification)
            if len(self._waiting) > self._most:
                oldest = next(iter(self._waiting))
                goes = next((one for one, is_one in self._waiting.items() if is_one), oldest)
                is_one = self._waiting.pop(goes)
                self._identifications += is_one
                self._others += not is_one

    def first(self) -> _Change | None:
        """Return the oldest change without removing it, or None."""
        with self._lock:
            return next(iter(self._waiting), None)

    def remove(self, change: _Change) -> None:
        """Remove a change that has been made, unless it was dropped meanwhile."""
        with self._lock:
            self._waiting.pop(change, None)

    @property
    def given_up(self) -> str:
        """The numbers of dropped changes, in words; empty without any."""
        counts = (self._identifications, "identification"), (self._others, "other change")
        return " and ".join(numbered(count, what) for count, what in counts if count)

    def forget_given_up(self) -> None:
        """Reset the numbers of dropped changes."""
        with self._lock:
            self._identifications = self._others = 0


_HANDOVER = 10.0
"""Time, s, for which a node that is ending may still hold the history."""
_LONGEST = 60.0
"""Time, s, after which an unfinished write is a problem; a locked file fails sooner."""

_T = TypeVar("_T")


def _file_of(node: Node) -> "HistoryFile | None":
    """Return the history file of the parameter; raises ValueError if its home is unknown."""
    path = node.get_parameter("history_file").value
    try:
        return database.HistoryFile(Path(path).expanduser()) if path else None
    except RuntimeError as error:  # of pathlib
        raise ValueError(
            f"history_file {path}: {error} Set HOME or ROS_HOME, or choose another file"
        ) from None


def _sender_of(node: Node, file: "HistoryFile | None") -> "Sender | None":
    """Return what sends the history to a server, if one is named; raises ValueError."""
    server = server_from(node.get_parameter("history_url").value, "history_url")
    if server is None:
        return None
    if file is None:
        raise ValueError(
            "history_url requires history_file, which holds the rows waiting for the server"
        )
    return database.sender_of(file.path, server)


def sender_with_rows(node: Node, tag: str) -> "Sender | None":
    """Take the rows of the valve from the server, if one is named; return what sends the history.

    The caller ends it. Raises ValueError for a wrong parameter, HistoryError for a wrong file.
    """
    file = _file_of(node)
    sender = _sender_of(node, file)
    if file is not None and sender is not None:
        file.prepare()
        sender.take(KeptValve(node.get_fully_qualified_name(), tag))
    return sender


def _identity_of(path: Path) -> tuple[int, int] | None:
    """Return what a file that replaces this one does not share, or None without a file."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


class HistoryWriter:
    """Writes to the history in another thread, so that a slow disk does not delay the node.

    Changes that could not be written wait, and are retried with the next change.
    """

    def __init__(
        self, node: Node, monitor: FrictionMonitor, tag: str, writer: HistoryThread
    ) -> None:
        self._node, self._monitor, self._writer = node, monitor, writer
        self.valve = KeptValve(node.get_fully_qualified_name(), tag)
        self._file = _file_of(node)
        self._claim = None if self._file is None else Claim(self._file.path, self.valve.name)
        self._refused_since = math.inf
        self._known: tuple[int, int] | None = None
        self._sender = _sender_of(node, self._file)
        self._untaken: str | None = None
        self._waiting = WaitingChanges()
        self._problem: str | None = None
        self.trend: Trend | None = None
        """Drift of the Coulomb friction at the latest identification."""
        self.baseline: KeptBaseline | None = None
        """The last stored baseline, with its record; another one may be in force. None if it was
        withdrawn."""
        self._former: KeptBaseline | None = None
        self._under_way: list[Future[None]] = []
        self._look: Future[None] | None = None

    @property
    def path(self) -> Path | None:
        """The history file; None if nothing is stored."""
        return None if self._file is None else self._file.path

    @property
    def problems(self) -> list[str]:
        """Why the latest write failed or has not finished; empty if it succeeded."""
        problem = self._problem
        if (busy := self._writer.busy_for()) > _LONGEST:
            problem = f"{self.path} has not responded for {busy:.0f} s"
        if not problem:
            return []
        lost = self._waiting.given_up
        return [f"the history is not being written: {problem}{f'; lost: {lost}' * bool(lost)}"]

    @property
    def conflict(self) -> str | None:
        """That another node keeps the history of this valve, too, if so."""
        if time.monotonic() - self._refused_since < _HANDOVER:
            return None
        return (
            f"another node writes the history of {self.valve.name} to {self.path}: stop one of "
            "them, or use another history_file or namespace"
        )

    def close(self) -> None:
        """Release the history for another node, and stop sending it."""
        if self._claim is not None:
            self._claim.release()
        if self._sender is not None:
            self._writer.submit(self._sender.end)  # it waits a little for the server
            self._sender = None

    def values(self) -> dict[str, str]:
        """Return the values of the diagnostics: nothing is stored, or the state of the sending."""
        if self._file is None:
            lost = (
                "none, because history_file is empty: diagnosis and baseline are lost when this "
                "node stops"
            )
            return {"history": lost}
        if self._sender is None:
            return {}
        state = self._sender.state
        values = {
            "history_server": str(self._sender.server),
            "history_server waiting": str(state.count.waiting),
            "history_server problem": state.problem or "",
        }
        if state.count.waiting and state.count.since is not None:
            values["history_server waiting since [time]"] = utc_second(state.count.since * 10**9)
        if state.count.refused:
            values["history_server refused"] = str(state.count.refused)
        if self._untaken is not None:
            values["history_server not taken"] = self._untaken
        return values

    @property
    def reservation(self) -> str:
        """Warning to add to a success message; empty if the change is in the file."""
        return "".join(f", but it is lost when this node stops: {one}" for one in self.problems)

    def read(self) -> ValveHistory | None:
        """Read the history of the valve, in any thread; None without a file or entries.

        Raises HistoryError if the file cannot be read.
        """
        if self._file is None:
            return None
        histories = database.valve_histories(self._file, (self.valve,), 0, END_OF_TIME)
        return histories[0] if histories else None

    def prepare(self) -> HistoryEntry | None:
        """Create the file if missing, read the baseline of the valve, and return the last success.

        Rows of the valve that another machine has stored since are first fetched from the server.
        """
        self.look_up(lambda file, _: file.prepare())
        self._ask()
        self._note_file()
        if self._sender is not None:
            self._untaken = self._sender.take(self.valve)
        if self._untaken is not None:
            self._node.get_logger().warning(
                "data that another machine may have stored for this valve was not read from the "
                f"server; the node tries again at its next start: {self._untaken}"
            )
        self.baseline = last = self.look_up(lambda file, name: file.baseline(name))
        if last is not None:
            self._former = self.look_up(lambda file, name: file.baseline(name, until=last.time))
        return self.look_up(lambda file, name: file.last_success(name))

    def known_numbers(self, earlier: HistoryEntry) -> KnownNumbers | None:
        """Read the known numbers of the valve since its baseline, including the last success."""
        built, kept = self._monitor.settings.valve, self.baseline
        since = earlier.time if kept is None else min(kept.time, earlier.time)
        return self.look_up(lambda file, name: file.known_numbers(name, built, since))

    def read_trend(self) -> None:
        """Compute the trend with the present baseline and settings."""
        self.trend = self.look_up(self._trend_job())

    def look_up(self, read: Callable[..., _T], *arguments: object) -> _T | None:
        """Return what `read` finds on the valve, given the file and the name of the valve.

        None without a readable file. Only the first of several problems is reported.
        """
        if self._file is None:
            return None
        try:
            return read(self._file, self.valve.name, *arguments)
        except HistoryError as error:
            if self._problem is None:
                self._complain(error)
            return None

    async def keep(
        self, identified: IdentificationInput, refusal: RefusalError | None = None
    ) -> None:
        """Store the identification that the monitor has just accepted, or the cause of refusal.

        A refusal while simulated time has not started has no date, and is not stored.
        """
        monitor, now = self._monitor, self._node.get_clock().now().nanoseconds
        stamp = now if refusal is not None or monitor.stamp is None else monitor.stamp
        if not stamp:
            return
        days = self._node.get_parameter("history_days").value
        with self._failures_remembered():
            entry = entry_of(monitor, self.valve, *identified, stamp, refusal)
            await self._written(lambda file: file.add(entry, days), identification=True)

    def kept_now(
        self, baseline: Baseline, level: Level, evidence_since: int | None = None
    ) -> KeptBaseline:
        """Return a new baseline for the history, set now, at a level of the valve.

        It is from the latest result, or from the moves since a time.
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
        """Return the predecessor of the last baseline for the history, restored now by `by`.

        If it was stored, it has its record and the start of its trend.
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
        """Store a baseline that is in force from now on, or its withdrawal."""
        self._former, self.baseline = self.baseline, None if kept.withdrawn else kept
        with self._failures_remembered():
            await self._written(lambda file: file.set_baseline(self.valve, kept))

    def alarm_news(self) -> dict[AlarmKind, Alarm]:
        """Return the alarms of the valve changed in the file, also by another process."""
        if self._file is None:
            return {}
        feed = database.alarm_feed(self._file.path)
        if self._look is not None and self._look.done():
            with contextlib.suppress(HistoryError):  # a write reports the problem
                self._look.result()
            self._look = None
        if self._look is None and feed.is_due(time.monotonic()):
            self._look = self._writer.submit(feed.look)
        return feed.take(self.valve.name)

    def last_alarm(self) -> AlarmRecording | None:
        """Read the latest recording of an alarm, or None.

        Recordings with a future time, from before a clock was set back, are used only if all are.
        """
        found = self.look_up(database.alarm_recordings) or ()
        now = self._node.get_clock().now().nanoseconds
        past = [one for one in found if one.time <= now]
        return max(past or found, key=lambda one: one.time, default=None)

    async def keep_change(self, change: _Change) -> None:
        """Make a change that leaves the trend as it is, and wait until it is written."""
        if self._file is None:
            return
        self._waiting.add(change)
        with self._failures_remembered():
            await done_in(self._writer, self._write_waiting, self._file, time.monotonic())

    def keep_soon(self, change: _Change) -> None:
        """Queue a change for the thread of the writer; `settle` processes the outcome.

        A change that is already waiting is not made twice.
        """
        if self._file is None:
            return
        self._waiting.add(change)
        # A running job may already have checked the queue for the last time.
        if all(one.running() or one.done() for one in self._under_way):
            job = self._writer.submit(self._write_waiting, self._file, time.monotonic())
            self._under_way.append(job)

    def settle(self) -> None:
        """Process finished outcomes of `keep_soon`, and retry a claim that was refused."""
        self._ask()
        if self._sender is not None and (news := self._sender.news()) is not None:
            self._node.get_logger().warning(news)
        while self._under_way and self._under_way[0].done():
            with self._failures_remembered():
                self._under_way.pop(0).result()

    def _trend_job(self) -> Callable[["HistoryFile", str], Trend | None]:
        """Return a job for any thread: the trend with the present baseline and settings."""
        baseline, settings = self._monitor.baseline, self._monitor.settings
        return lambda file, name: database.current_trend(file, name, baseline, settings)

    async def _written(self, change: _Change, identification: bool = False) -> None:
        if self._file is None:
            return
        self._waiting.add(change, identification)
        file, asked, trend = self._file, time.monotonic(), self._trend_job()

        def write() -> Trend | None:
            self._write_waiting(file, asked)
            return trend(file, self.valve.name)

        self.trend = await done_in(self._writer, write)

    @contextlib.contextmanager
    def _failures_remembered(self) -> Iterator[None]:
        try:
            with bugs_reported(self._node, HistoryError, known=self._problem):
                yield
            self._problem = None
            if lost := self._waiting.given_up:
                self._waiting.forget_given_up()
                self._node.get_logger().warning(
                    f"the history is being written again, but the queue overflowed: {lost} are "
                    "missing"
                )
        except (HistoryError, InternalError) as error:
            self._complain(error)

    def _write_waiting(self, file: "HistoryFile", asked: float) -> None:
        """Write all waiting changes, requested at `asked`, s of a monotonic clock."""
        if self._waiting.first() is None:
            return
        with self._writer.writing(file.path, asked):
            if self._known is not None and _identity_of(file.path) != self._known:
                self._keep_again(file)
            while (change := self._waiting.first()) is not None:
                change(file)
                self._waiting.remove(change)
        self._note_file()

    def _ask(self) -> None:
        """Claim the rows of the valve, and remember since when another node has them."""
        if self._claim is not None:
            is_granted, now = self._claim.ask(), time.monotonic()
            self._refused_since = math.inf if is_granted else min(self._refused_since, now)

    def _note_file(self) -> None:
        if self.path is not None:
            self._known = _identity_of(self.path) or self._known

    def _keep_again(self, file: "HistoryFile") -> None:
        """Store the baseline again if the file was removed, or replaced by one without it."""
        name, kept = self.valve.name, self.baseline
        told = "its baseline applies after a restart"
        if kept is not None and not (file.path.exists() and file.baselines(name)):
            file.set_baseline(self.valve, kept)
            told = "the baseline in force is stored again"
        self._node.get_logger().warning(
            f"{file.path} was removed or replaced while the node was running: its data on the "
            f"valve is lost; {told}"
        )

    def _complain(self, error: HistoryError | InternalError) -> None:
        if str(error) != self._problem:
            self._problem = str(error)
            self._node.get_logger().warning(self.problems[0])
