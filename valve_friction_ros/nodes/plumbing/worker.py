# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Threads for long-running work: preparation, duration and end."""

import contextlib
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any, ParamSpec, TypeVar
from weakref import WeakSet

from rclpy.node import Node
from rclpy.task import Future as Awaited

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.compiled import kernels_are_cached
from valve_friction_ros.nodes.plumbing.processes import ElsewhereError

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


class InternalError(Exception):
    """A bug in this package, in one line for the caller; the log has its traceback."""


def _internal_error(bug: Exception) -> InternalError:
    if isinstance(cause := bug.__cause__, ElsewhereError):
        file, line = cause.file, cause.line
    else:
        place = traceback.extract_tb(bug.__traceback__)[-1]
        file, line = place.filename, place.lineno or 0
    words = " ".join(f"{type(bug).__name__}: {bug}".split())
    where = f"{Path(file).name}, line {line}"
    return InternalError(
        f"internal error: {words} ({where}): report it, together with the bag that ~/save writes"
    )


@contextlib.contextmanager
def bugs_reported(
    node: Node, *expected: type[Exception], known: str | None = None
) -> Iterator[None]:
    """Convert a bug to an InternalError, and log its traceback.

    An uncaught exception in a callback would end the node and all valves of its process.
    RefusalError and the `expected` exceptions are not bugs and pass unchanged. An internal error
    equal to `known`, which is already in the log, is not logged again.
    """
    passed: tuple[type[Exception], ...] = (RefusalError, InternalError, *expected)
    try:
        yield
    except passed:
        raise
    except Exception as bug:
        error = _internal_error(bug)
        if str(error) != known:
            node.get_logger().error(f"{error}\n{''.join(traceback.format_exception(bug))}")
        raise error from bug


async def done_in(
    pool: ThreadPoolExecutor,
    work: Callable[_Arguments, _Result],
    *arguments: _Arguments.args,
    **named: _Arguments.kwargs,
) -> _Result:
    """Run `work` in a thread of `pool` while the executor continues.

    It is for coroutine callbacks in a callback group that lets others run meanwhile. It returns the
    result of `work`, or raises its exception, in the thread of the executor.
    """
    finished = Awaited()
    pool.submit(work, *arguments, **named).add_done_callback(finished.set_result)
    result: _Result = (await finished).result()
    return result


_Companion = TypeVar("_Companion", bound="Companion")

_PAUSE = 0.02


class Worker(ThreadPoolExecutor):
    """A thread that runs jobs in order, or several threads that share the jobs.

    Parameters
    ----------
    name : str
        Name of the thread.
    prepare : callable, optional
        The first job; all threads wait for it.
    finishes : bool
        Whether the end of the process waits a little for the submitted jobs.
    threads : int
        Number of threads.
    """

    def __init__(
        self,
        name: str,
        prepare: Callable[[], object] | None = None,
        finishes: bool = False,
        threads: int = 1,
    ) -> None:
        super().__init__(max_workers=threads, thread_name_prefix=name)
        self.finishes = finishes
        self._unfinished: set[Future[Any]] = set()
        self._begun: dict[int, float] = {}
        self._preparation: Future[object] | None = None
        if prepare is not None:
            self._preparation = self.submit(prepare)
            for _ in range(threads - 1):
                super().submit(wait, [self._preparation])
        _workers.add(self)

    def submit(
        self,
        work: Callable[_Arguments, _Result],
        /,
        *arguments: _Arguments.args,
        **named: _Arguments.kwargs,
    ) -> Future[_Result]:
        """Run `work` once all earlier jobs are done, or started by other threads."""

        def timed() -> _Result:
            self._begun[threading.get_ident()] = time.monotonic()
            try:
                return work(*arguments, **named)
            finally:
                del self._begun[threading.get_ident()]

        future = super().submit(timed)
        self._unfinished.add(future)
        future.add_done_callback(self._unfinished.discard)
        return future

    @property
    def is_busy(self) -> bool:
        """Whether a job is running or waiting."""
        return bool(self._unfinished)

    @property
    def is_preparing(self) -> bool:
        """Whether the preparation has not yet finished."""
        return self._preparation is not None and not self._preparation.done()

    def busy_for(self) -> float:
        """Return the time for which the oldest running job has been running, s, or 0."""
        begun = [*self._begun.values()]
        return time.monotonic() - min(begun) if begun else 0.0


_QUICK = 5.0
"""Longest preparation that is not logged, s."""


class Readiness:
    """Monitors the preparation of a node by a worker; logs `ready` when it is finished."""

    def __init__(self, node: Node, worker: Worker, ready: str) -> None:
        self._node, self._worker, self._ready = node, worker, ready
        self._tell_at = time.monotonic() + _QUICK
        self._is_ready = self._has_told = False

    @property
    def problem(self) -> str | None:
        """Message that the node is preparing; None once it is ready."""
        if not self._worker.is_preparing:
            return None
        if kernels_are_cached():
            return "preparing: compiling numeric code, once after installation"
        return (
            "preparing: compiling numeric code at every start, because no cache folder is "
            "writable: set NUMBA_CACHE_DIR to a writable folder"
        )

    @property
    def is_slow(self) -> bool:
        """Whether the preparation takes longer than mere loading, so that it is logged."""
        return self.problem is not None and time.monotonic() > self._tell_at

    def values(self) -> dict[str, str]:
        """Return the value of the diagnostic while the node is preparing."""
        return {} if self.problem is None else {"preparing": self.problem}

    def look(self) -> bool:
        """Return whether the node is ready; log a slow preparation and its end."""
        if self._is_ready:
            return True
        problem, log = self.problem, self._node.get_logger()
        if problem is None:
            self._is_ready = True
            log.info(f"ready: {self._ready}")
        elif not self._has_told and self.is_slow:
            self._has_told = True
            log.info(problem)
        return self._is_ready


class Companion:
    """A daemon thread that runs as long as the context lasts; the exit does not wait for it.

    Parameters
    ----------
    name : str
        Name of the thread.
    """

    def __init__(self, name: str) -> None:
        self.has_ended = threading.Event()
        """Whether the context has ended."""
        self.thread = threading.Thread(target=self.run, name=name, daemon=True)

    def __enter__(self: _Companion) -> _Companion:
        self.begin()
        self.thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.has_ended.set()
        self.end()

    def begin(self) -> None:
        """Set up before the thread starts."""

    def run(self) -> None:
        """Do the work of the thread."""
        raise NotImplementedError

    def end(self) -> None:
        """Clean up when the context ends."""


_workers: WeakSet[Worker] = WeakSet()


def workers_have_ended(patience: float) -> bool:
    """Wait up to `patience` s for workers that finish their jobs; return whether none is busy."""
    deadline = time.monotonic() + patience
    while any(one.finishes and one.is_busy for one in _workers) and time.monotonic() < deadline:
        time.sleep(_PAUSE)
    return not any(one.is_busy for one in _workers)
