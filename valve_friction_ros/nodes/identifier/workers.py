# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Threads shared by the identifiers of one process, and the identifications in them."""

import contextlib
import time
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.timer import Timer

from valve_friction_ros.alerts import AlertSender
from valve_friction_ros.health.alarms import DigestDesk
from valve_friction_ros.health.friction_monitor import (
    FrictionMonitor,
    IdentificationInput,
    identify_with_numbers,
)
from valve_friction_ros.health.valve_numbers import RefusedRecordError
from valve_friction_ros.history import HistoryError
from valve_friction_ros.identification.methods import compile_methods
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.compiled import find_cache, note_cache
from valve_friction_ros.nodes.identifier.status import NumberTopics
from valve_friction_ros.nodes.plumbing.polled_node import lack_of_time
from valve_friction_ros.nodes.plumbing.processes import Processes
from valve_friction_ros.nodes.plumbing.worker import InternalError, Worker, bugs_reported, done_in

_AT_ONCE = 2
"""Number of parallel identifications: a long record of one valve must not block the others."""

_LONG = 1.0
"""Time, s, from which a failed write has been waiting for a lock. Chosen: others fail at once."""


class HistoryThread(Worker):
    """The thread that writes the histories of all valves of a process.

    The thread waits only once for a locked file: writes requested before the end of this wait fail
    with it, and are retried with the next change.
    """

    def __init__(self) -> None:
        super().__init__("history", finishes=True)
        self._waits: dict[Path, tuple[float, HistoryError]] = {}

    @contextlib.contextmanager
    def writing(self, path: Path, asked: float) -> Iterator[None]:
        """Guard a write to a file, requested at `asked`, s of the monotonic clock.

        Raises HistoryError if a wait for this file has failed since then.
        """
        begun = time.monotonic()
        ended, error = self._waits.get(path, (asked, None))
        if error is not None and asked < ended:
            raise HistoryError(str(error))
        try:
            yield
        except HistoryError as failed:
            now = time.monotonic()
            if now - begun > _LONG:
                self._waits[path] = now, failed
            raise


class Workers(NamedTuple):
    """Resources shared by all valves of a process.

    They are the threads that identify, write bags and reports, combine moves, write the history and
    send alerts; the daily digest of alarms; and `apart`, which calls a function that needs much
    memory, for identifications and pages.
    """

    apart: Callable[..., Any]
    identify: Worker
    files: Worker
    history: HistoryThread
    evidence: Worker
    alerts: AlertSender
    digest: DigestDesk


def _call(work: Callable[..., Any], *arguments: Any) -> Any:
    return work(*arguments)


@contextlib.contextmanager
def running_workers(processes: int = 0) -> Iterator[Workers]:
    """Provide the threads; tasks that still wait at the end are dropped.

    Parameters
    ----------
    processes : int
        Largest number of processes that identify in parallel; 0: threads of this process.
    """
    apart = Processes()
    call = apart.done if processes else _call

    def prepare() -> None:
        note_cache(call(find_cache))
        call(compile_methods)

    workers = Workers(
        call,
        Worker("identify", prepare, threads=processes or _AT_ONCE),
        Worker("files"),
        HistoryThread(),
        Worker("evidence"),
        AlertSender(),
        DigestDesk(),
    )
    try:
        yield workers
    finally:
        workers.alerts.close()
        for worker in (workers.identify, workers.files, workers.evidence):
            worker.shutdown(wait=False, cancel_futures=True)
        apart.end()


class Identification:
    """Identifies the buffer of the monitor, and publishes the result.

    The worker gets a copy of the buffer. The callback awaits the result, so only the thread of the
    executor accesses the monitor.
    """

    def __init__(
        self, node: Node, monitor: FrictionMonitor, results: NumberTopics, workers: Workers
    ) -> None:
        self._node, self._monitor, self._results, self._workers = node, monitor, results, workers
        self._is_running = False
        self._until: int | None = None
        self._last_stamps: tuple[int | None, int | None] = (None, None)
        self._came = [0, 0]

    def follow(self) -> None:
        """Record when usable samples of either signal arrived, by the clock of the node.

        Stamps do not give their age: a bag replayed without its clock has stamps of another day.
        """
        now = self._node.get_clock().now().nanoseconds
        last_stamps = self._monitor.buffer.last_stamps
        for signal, (before, last) in enumerate(zip(self._last_stamps, last_stamps, strict=True)):
            if last != before:
                self._came[signal] = now
        self._last_stamps = last_stamps

    def _require_recent(self) -> None:
        """Refuse a record if one of its signals has been silent for longer than permitted."""
        longest = max(
            self._monitor.settings.window, self._node.get_parameter("input_timeout").value
        )
        now = self._node.get_clock().now().nanoseconds
        for name, came, stamp in zip(
            ("actuator_pressure", "stem_state"), self._came, self._last_stamps, strict=True
        ):
            age = (now - came) / 1e9
            if stamp is not None and age > longest:
                raise RefusedRecordError(
                    f"the record is old: its last usable sample of {name} arrived {age:.0f} s "
                    f"ago, but window and input_timeout allow {longest:g} s: check the source of "
                    f"{name}, or set a longer window for a sensor that reports rarely",
                    {},
                )

    @property
    def has_nothing_new(self) -> bool:
        """Whether no sample has arrived since the last identification."""
        newest = self._monitor.buffer.newest_stamp
        return not self._is_running and newest is not None and newest == self._until

    def record(self) -> IdentificationInput:
        """Copy the buffer for an identification.

        Raises RefusalError if an identification is running.
        """
        if self._is_running:
            raise RefusalError("an identification is already running: wait until it finishes")
        self._until = self._monitor.buffer.newest_stamp
        return self._monitor.input()

    async def run(self, record: IdentificationInput) -> None:
        """Identify a record in the worker; adopt and publish the result.

        Raises RefusedRecordError if the record cannot be identified, is old or of a valve that has
        since been changed, RefusalError if there is no time to date the result, and InternalError
        for a bug, which the monitor reports until an identification succeeds. The findings of a
        refused record are adopted too.
        """
        self._require_recent()
        self._is_running = True
        try:
            with bugs_reported(self._node, known=self._monitor.internal_error):
                workers = self._workers
                result, numbers = await done_in(
                    workers.identify,
                    workers.apart,
                    identify_with_numbers,
                    record.snapshot,
                    record.settings,
                )
                if record.settings.valve != self._monitor.settings.valve:
                    raise RefusedRecordError(
                        "the parameters of the valve were changed during the identification: "
                        "identify again once the buffer holds new strokes",
                        {},
                    )
                if problem := lack_of_time(self._node):  # use_sim_time was set meanwhile
                    raise RefusalError(problem)
                now = self._node.get_clock().now().nanoseconds
                self._monitor.accept(result, now, numbers)
                self._results.publish(result, self._monitor)
                message = self._monitor.diagnosis().message
                self._node.get_logger().info(f"identified: {message}")
        except RefusedRecordError as refused:
            if not lack_of_time(self._node):
                self._monitor.learn(refused.numbers, self._node.get_clock().now().nanoseconds)
            raise
        except InternalError as error:
            self._monitor.internal_error = str(error)
            raise
        finally:
            self._is_running = False


class Schedule:
    """Starts identifications by the clock of the node, and remembers why the last was skipped.

    A skip changes neither diagnosis nor level, and is not logged. `group` is reentrant, so that
    other callbacks run while an identification is awaited.
    """

    def __init__(
        self, node: Node, identify: Callable[[], Awaitable[None]], group: CallbackGroup
    ) -> None:
        self._node, self._identify, self._group = node, identify, group
        self._period = 0.0
        self._timer: Timer | None = None
        self._skip: tuple[str, int] | None = None
        self.follow()

    def follow(self) -> None:
        """Follow the parameter `period`."""
        period = self._node.get_parameter("period").value
        if period == self._period:
            return
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
            self._timer = None
        if period > 0:
            self._timer = self._node.create_timer(
                period, self._identify, callback_group=self._group
            )
        self._period, self._skip = period, None

    def skip(self, reason: str) -> None:
        """Remember why an identification was skipped.

        A run that began before the schedule was switched off may end later, and is ignored.
        """
        if self._timer is not None:
            self._skip = reason, self._node.get_clock().now().nanoseconds

    def stall(self) -> None:
        """Remember that there are no new samples, unless there is an older reason for a skip."""
        if self._skip is None:
            self.skip("no new samples since the last identification")

    def succeed(self) -> None:
        """Forget the last skip."""
        self._skip = None

    def values(self) -> dict[str, str]:
        """Return the values of the diagnostic for the last skip, if any."""
        if self._skip is None:
            return {}
        reason, stamp = self._skip
        age = (self._node.get_clock().now().nanoseconds - stamp) / 1e9
        return {"scheduled_skip": reason, "scheduled_skip_age [s]": f"{age:.3f}"}
