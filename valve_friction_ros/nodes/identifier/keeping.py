"""What an identifier keeps in the history of its plant, and takes from there when it starts."""

import contextlib
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future as ThreadFuture
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timezone
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeVar

from rclpy.node import Node
from rclpy.parameter import Parameter

from valve_friction_ros.health import Baseline, FrictionMonitor, MonitorSettings
from valve_friction_ros.history import (
    HistoryError,
    HistoryFile,
    KeptBaseline,
    KeptValve,
    Trend,
    current_trend,
    entry_of,
)
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.plumbing.guarded_work import guarded
from valve_friction_ros.nodes.plumbing.parameters import ParameterSpec
from valve_friction_ros.records.data_folder import history_file
from valve_friction_ros.streams import Snapshot

__all__ = ["HISTORY_DAYS", "HISTORY_FILE", "Job", "Keeping"]

HISTORY_FILE = ParameterSpec(
    "history_file",
    str(history_file()),
    "File in which identifications and baselines are kept [-]; empty: nowhere",
    read_only=True,
)
HISTORY_DAYS = ParameterSpec(
    "history_days", 1100.0, "Time for which they are kept [days]; 0: for ever", (0.0, 36525.0)
)

_MOST_WAITING = 1000
"""Changes that wait for a file that cannot be written; then the oldest are given up."""


_T = TypeVar("_T")


def _date(time: int) -> str:
    return f"{datetime.fromtimestamp(time / 1e9, timezone.utc):%Y-%m-%d %H:%M} UTC"


def _told(baseline: Baseline) -> str:
    return f"baseline {baseline.coulomb_friction:.6g} ± {baseline.half_width:.2g} N"


class Job(NamedTuple):
    """What is identified, and how."""

    snapshot: Snapshot
    settings: MonitorSettings


class Keeping:
    """Writes to the history in a thread of its own, so that no slow disk holds up the node.

    What could not be written waits, and is tried again with what comes next.

    Parameters
    ----------
    node : Node
        The identifier, with the parameters above.
    monitor : FrictionMonitor
        What it knows.
    tag : str
        Tag of the valve.
    """

    def __init__(self, node: Node, monitor: FrictionMonitor, tag: str) -> None:
        self._node = node
        self._monitor = monitor
        self._valve = KeptValve(node.get_fully_qualified_name(), tag)
        told = node.get_parameter(HISTORY_FILE.name).value
        self._file = HistoryFile(Path(told).expanduser()) if told else None
        self._writer = ThreadPoolExecutor(max_workers=1, thread_name_prefix="history")
        self._waiting: deque[Callable[[HistoryFile], None]] = deque(maxlen=_MOST_WAITING)
        self._problem: str | None = None
        self._trend: Trend | None = None

    @property
    def valve(self) -> KeptValve:
        """The valve, as the history calls it."""
        return self._valve

    @property
    def problems(self) -> list[str]:
        """Why the latest writing failed; empty if it did not."""
        return [] if self._problem is None else [self._problem]

    @property
    def reservation(self) -> str:
        """What to add to the news that something was kept."""
        return "" if self._problem is None else f", but it is lost with this node: {self._problem}"

    @property
    def trend(self) -> Trend | None:
        """Drift of the Coulomb friction, as of the latest identification."""
        return self._trend

    def begin(self) -> None:
        """Take over the baseline of the history, unless a parameter gives one, and say which."""
        self._tried(HistoryFile.prepare)
        kept = self._tried(lambda file: file.baseline(self._valve.name))
        given, log = self._monitor.baseline, self._node.get_logger()
        if given is not None:
            besides = f"; the history's is not used: {self._set_at(kept)}" if kept else ""
            log.info(f"{_told(given)}, from the parameter baseline_coulomb_friction{besides}")
        elif kept is not None:
            self.put_in_force(kept.baseline)
            log.info(f"{self._set_at(kept)}, from the history {self._path}")
        self._trend = self._tried(self._trend_job())

    def _tried(self, job: Callable[[HistoryFile], _T]) -> _T | None:
        """Do a job on the file, if there is one; of several problems the first is told."""
        if self._file is None:
            return None
        try:
            return job(self._file)
        except HistoryError as error:
            if self._problem is None:
                self._complain(error)
            return None

    @property
    def _path(self) -> str:
        return "" if self._file is None else str(self._file.path)

    @staticmethod
    def _set_at(kept: KeptBaseline) -> str:
        return f"{_told(kept.baseline)}, set {_date(kept.time)}"

    def put_in_force(self, baseline: Baseline) -> None:
        """Compare with a baseline from now on.

        The parameter shows its value; that alone would stand for an exact baseline.
        """
        self._node.set_parameters(
            [Parameter("baseline_coulomb_friction", value=baseline.coulomb_friction)]
        )
        self._monitor.take_baseline(baseline)

    def keep(self, job: Job, then: Callable[[], None]) -> None:
        """Keep the identification that the monitor has just accepted or refused.

        Parameters
        ----------
        job : Job
            What was identified.
        then : callable
            Called in the executor's thread when keeping was tried.
        """
        now = self._node.get_clock().now().nanoseconds
        entry = entry_of(self._monitor, self._valve, *job, time=now)
        days = self._node.get_parameter(HISTORY_DAYS.name).value
        self._submit(lambda file: file.add(entry, days), then)

    def keep_baseline(self, baseline: Baseline, then: Callable[[], None]) -> None:
        """Keep the baseline that was taken from the latest estimate; `then` as in `keep`."""
        now = self._node.get_clock().now().nanoseconds
        since = now if self._monitor.stamp is None else self._monitor.stamp
        kept = KeptBaseline(baseline, now, since)
        self._submit(lambda file: file.set_baseline(self._valve, kept), then)

    def _submit(self, change: Callable[[HistoryFile], None], then: Callable[[], None]) -> None:
        if self._file is None:
            then()
            return
        self._waiting.append(change)
        executor = self._node.executor
        done = self._writer.submit(
            guarded(self._write, HistoryError), self._file, self._trend_job()
        )
        done.add_done_callback(lambda result: executor.create_task(self._take, result, then))

    def _trend_job(self) -> Callable[[HistoryFile], Trend | None]:
        """Return what computes the trend with the baseline and settings of now, in any thread."""
        monitor, name = self._monitor, self._valve.name
        return partial(
            current_trend, valve=name, baseline=monitor.baseline, settings=monitor.settings
        )

    def _write(
        self, file: HistoryFile, trend: Callable[[HistoryFile], Trend | None]
    ) -> Trend | None:
        """Write, in the writer's thread, all that waits."""
        while self._waiting:
            change = self._waiting[0]
            change(file)
            with contextlib.suppress(ValueError):  # given up meanwhile
                self._waiting.remove(change)
        return trend(file)

    def _take(self, result: "ThreadFuture[Trend | None]", then: Callable[[], None]) -> None:
        try:
            self._trend, self._problem = result.result(), None
        except (HistoryError, RefusalError) as error:
            self._complain(error)
        then()

    def _complain(self, error: HistoryError | RefusalError) -> None:
        problem = f"the history is not written: {error}"
        if problem != self._problem:
            self._node.get_logger().warning(problem)
        self._problem = problem
