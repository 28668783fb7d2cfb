# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The threads of an identifier, which the identifiers of one process share."""

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from valve_friction_ros.alerts import AlertSender
from valve_friction_ros.health import DigestDesk
from valve_friction_ros.history import HistoryError
from valve_friction_ros.identification.methods import compile_methods
from valve_friction_ros.model.compiled import find_cache, note_cache
from valve_friction_ros.nodes.plumbing.processes import Processes, ThisProcess
from valve_friction_ros.nodes.plumbing.worker import Worker

_AT_ONCE = 2
"""Identifications at once: a long record of one valve does not keep the others waiting."""

_LONG = 1.0
"""Time, s, from which a writing that has failed was a wait. Chosen: others fail at once."""


class HistoryThread(Worker):
    """The thread that writes the histories of all valves of a process.

    A file that somebody locks is waited for once: what was asked for before the end of the wait
    fails with it, and is tried again with what comes next.
    """

    def __init__(self) -> None:
        super().__init__("history", finishes=True)
        self._waits: dict[Path, tuple[float, HistoryError]] = {}

    @contextlib.contextmanager
    def writing(self, path: Path, asked: float) -> Iterator[None]:
        """Write to a file, as was asked for at a time of the monotonic clock, s.

        Raises HistoryError if a wait for this file has failed since.
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
    """What all valves of a process share.

    Threads that identify, write bags and reports, combine moves, keep, and send alerts; what
    gathers their alarms for one letter a day; and `apart`, which does what holds much memory:
    identifications and pages.
    """

    apart: ThisProcess
    identify: Worker
    files: Worker
    history: HistoryThread
    evidence: Worker
    alerts: AlertSender
    digest: DigestDesk


@contextlib.contextmanager
def running_workers(processes: int = 0) -> Iterator[Workers]:
    """Provide the threads; at the end, tasks that still wait are dropped.

    Parameters
    ----------
    processes : int
        Most processes that identify at once; 0: threads of this one.
    """
    apart = Processes() if processes else ThisProcess()

    def prepare() -> None:
        note_cache(apart.done(find_cache))
        apart.done(compile_methods)

    workers = Workers(
        apart,
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
