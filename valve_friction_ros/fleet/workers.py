# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Tasks for workers, which may die: processes of this machine, or workers of a Dask cluster.

No library pool serves for the processes: `concurrent.futures` gives up all tasks when one process
dies, and Pebble (5.2.3), whose processes share one pipe and one lock, lost up to 287 of 400 tasks
when every fifth killed its process. Here each process has its own pipe.

To a cluster, each message holds the name of a function and its arguments, pickled once more. Only a
worker unpickles it, so the scheduler needs Dask but not this package. Answers are taken and
released batch by batch, since Dask repeats the work of a dead worker whose answers are still
wanted. Dask hands the tasks of a dead worker to another worker, and gives up after
`allowed-failures` deaths. A failed batch does not show which task killed its worker, and the
batches that waited on the same worker fail with it. All these tasks are therefore tried again at
the end, one by one and alone.
"""

import asyncio
import contextlib
import logging
import multiprocessing
import os
import pickle
import signal
import socket
import tempfile
import threading
import time
import uuid
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from importlib import metadata
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from queue import Empty, SimpleQueue
from typing import Any, Generic, TypeVar

from valve_friction_ros import __version__
from valve_friction_ros.wording import numbered

_Task = TypeVar("_Task")
_Answer = TypeVar("_Answer")

_LOOK_UP = 0.1
"""Interval at which a request to stop is checked while the workers are busy, s."""

_ONE_THREAD = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)


@dataclass(frozen=True)
class DeadWorker:
    """Replaces an answer if the process ended before giving it; holds the cause."""

    cause: str

    def __str__(self) -> str:
        return self.cause


def _end_of_process(exit_code: int) -> str:
    """Describe the end of a process; a negative exit code is the signal that ended it."""
    if exit_code >= 0:
        return f"its process ended with exit code {exit_code}"
    number = -exit_code
    name = signal.Signals(number).name if number in set(signal.Signals) else str(number)
    hint = ", perhaps because the system ran out of memory" if number == signal.SIGKILL else ""
    return f"its process was killed by {name}{hint}"


def usable_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0))


def _work(tasks: "Connection[_Answer, _Task]", work: Callable[[_Task], _Answer]) -> None:
    """Answer the tasks one by one, until the other end of the pipe is closed."""
    with contextlib.suppress(EOFError, OSError):
        while True:
            tasks.send(work(tasks.recv()))


@contextlib.contextmanager
def _surroundings(folder: str) -> Iterator[None]:
    """Set what a worker inherits: one thread per library, a temporary folder, Ctrl-C blocked.

    Ctrl-C in a terminal goes to all its processes, but only the parent decides what follows.
    """
    variables = {**_ONE_THREAD, "TMPDIR": folder}
    before = {name: os.environ.get(name) for name in variables}
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


class _Worker(Generic[_Task, _Answer]):
    """A process, this end of its pipe, and its present task."""

    def __init__(self, work: Callable[[_Task], _Answer], folder: str) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, far_end = context.Pipe()
        self.process: SpawnProcess = context.Process(
            target=_work, args=(far_end, work), daemon=True
        )
        # Started by the first process, under the mask of signals, it would undo the mask.
        resource_tracker.ensure_running()
        with _surroundings(folder):
            self.process.start()
        far_end.close()
        self.task: _Task | None = None

    def begin(self, task: _Task) -> None:
        self.task = task
        with contextlib.suppress(OSError):  # a dead worker is detected when its answer is read
            self.pipe.send(task)

    def answer(self) -> _Answer | DeadWorker:
        """Return the answer that has arrived, or how the process died."""
        try:
            answer: _Answer = self.pipe.recv()
        except (EOFError, OSError):
            self.process.join()
            return DeadWorker(_end_of_process(self.process.exitcode or 0))
        return answer

    def end(self) -> None:
        self.pipe.close()
        self.process.kill()
        self.process.join()


def in_processes(
    work: Callable[[_Task], _Answer],
    tasks: Iterable[_Task],
    processes: int,
    stopped: Callable[[], bool],
) -> Iterator[tuple[_Task, _Answer | DeadWorker]]:
    """Yield tasks with their answers, or a `DeadWorker`, as they finish in several processes.

    Each process has one task at a time, so the task that killed a process is known; a new process
    replaces it. Compiled libraries get one thread per process. `work` must be a function of a
    module, since the processes are spawned. Once `stopped` returns True, no more tasks are handed
    out and tasks in progress are given up.
    """
    waiting = iter(tasks)
    drafts = tempfile.TemporaryDirectory()  # also removes what a killed worker leaves behind
    busy: dict[Connection, _Worker[_Task, _Answer]] = {}

    def hand_out(worker: _Worker[_Task, _Answer] | None) -> None:
        """Give the next task to a worker, or to a new worker if None."""
        for task in waiting:
            worker = worker or _Worker(work, drafts.name)
            busy[worker.pipe] = worker
            worker.begin(task)
            return
        if worker is not None:
            worker.end()

    try:
        for _ in range(processes):
            hand_out(None)
        while busy and not stopped():
            for pipe in wait([*busy], _LOOK_UP):
                worker = busy[pipe]  # type: ignore[index]
                task, answer = worker.task, worker.answer()
                if stopped() and isinstance(answer, DeadWorker):
                    return  # the stop may have killed the processes too
                del busy[worker.pipe]
                if isinstance(answer, DeadWorker):
                    worker.end()
                hand_out(None if isinstance(answer, DeadWorker) else worker)
                yield task, answer  # type: ignore[misc]
    finally:
        for worker in busy.values():
            worker.end()
        drafts.cleanup()


# Workers of a Dask cluster

PACKAGE = "valve_friction_ros"

_COMPARED = ("numpy", "scipy", "numba", "distributed")
"""Libraries whose versions are compared, since they may change the last digits of results."""

_ALONE = threading.Lock()
"""One batch at a time per process: the library that draws figures is not thread-safe."""


class _Call:
    """Unpickles to the return value of a function."""

    def __init__(self, function: Callable[..., Any], arguments: tuple[object, ...]) -> None:
        self._call = (function, arguments)

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[object, ...]]:
        return self._call


def call(function: Callable[..., Any], *arguments: object) -> bytes:
    """Return bytes from which `pickle.loads` calls a function and returns its value."""
    return pickle.dumps(_Call(function, arguments))


def versions() -> dict[str, str]:
    """Return the versions in this process that may affect results."""
    found = {PACKAGE: __version__}
    for name in _COMPARED:
        with contextlib.suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


@contextlib.contextmanager
def _drafts_of_worker() -> Iterator[None]:
    """Put temporary files into the worker's folder, which Dask clears if the worker is killed."""
    from distributed import get_worker  # noqa: PLC0415 - an extra

    before = tempfile.tempdir
    tempfile.tempdir = get_worker().local_directory
    try:
        yield
    finally:
        tempfile.tempdir = before


def answers(
    version: str, work: Callable[[_Task], _Answer], tasks: Sequence[_Task]
) -> list[_Answer]:
    """Answer a batch on a worker with the package version of the caller.

    Raises ImportError if the versions differ.
    """
    if version != __version__:  # the worker joined after the comparison
        raise ImportError(f"{socket.gethostname()} has {PACKAGE} {__version__}")
    with _ALONE, _drafts_of_worker():
        return [work(task) for task in tasks]


_REMEDY = "run `pip install 'distributed>=2026.8'` (the extra `cluster`)"
NO_WORKER = 30.0
"""Longest wait while there is no worker, s."""
_AWAY = 10.0
"""Longest wait for a scheduler, s."""
_CLOSING = 2.0
"""Longest time to close the connection, s."""


class Cluster:
    """A Dask cluster at the other end of a connection.

    Attributes
    ----------
    address : str
        Address of its scheduler.
    client : distributed.Client
        The connection.
    """

    def __init__(self, address: str, client: Any) -> None:
        self.address = address
        self.client = client

    def gone(self) -> str:
        """Return the message that the scheduler has gone."""
        return (
            f"{self.address}: the scheduler has disappeared: once it is back, run the command again"
        )

    def differs(self, cause: str) -> str:
        """Return the message that a worker cannot do the work."""
        return (
            f"{self.address}: a worker differs from this machine ({cause}): install {PACKAGE} "
            f"{__version__} with the same extras on all of them"
        )

    def without_workers(self) -> str:
        """Return the message that there is no worker."""
        return (
            f"{self.address}: no worker has joined within {NO_WORKER:g} s: start one with "
            f"`dask worker {self.address} --nthreads 1`"
        )

    def require_scheduler(self) -> None:
        """Raise ValueError if the scheduler has gone."""
        if self.client.status != "running":
            raise ValueError(self.gone())

    def threads(self) -> int:
        """Count the threads of all workers."""
        try:
            return sum(self.client.nthreads().values())
        except (OSError, asyncio.TimeoutError):
            raise ValueError(self.gone()) from None

    def compare(self) -> list[str]:
        """Refuse workers without this package version; return a note per other difference.

        Raises ValueError if a worker is refused or there is none.
        """
        try:
            self.client.wait_for_workers(1, timeout=NO_WORKER)
            told = self.client.run(pickle.loads, call(versions), on_error="return")
        except (OSError, asyncio.TimeoutError):
            self.require_scheduler()
            raise ValueError(self.without_workers()) from None
        own, notes = versions(), set()
        for worker, theirs in told.items():
            if not isinstance(theirs, dict):
                raise ValueError(self.differs(f"{worker}: {theirs}"))
            if theirs[PACKAGE] != own[PACKAGE]:
                raise ValueError(self.differs(f"{worker} has {PACKAGE} {theirs[PACKAGE]}"))
            notes |= {
                f"workers have {name} {theirs.get(name)}, and this machine has {version}: the last "
                "digits of results may differ"
                for name, version in own.items()
                if theirs.get(name) != version
            }
        return sorted(notes)


async def _reach(address: str) -> None:
    """Test the connection: a `Client` that fails to connect leaves threads that may lock up."""
    from distributed import Security  # noqa: PLC0415 - an extra
    from distributed.comm import connect  # noqa: PLC0415

    comm = await connect(address, timeout=_AWAY, **Security().get_connection_args("client"))
    await comm.close()


@contextlib.contextmanager
def cluster_at(address: str) -> Iterator[Cluster]:
    """Connect to the scheduler of a Dask cluster, ``tcp://host:port`` or ``tls://host:port``.

    Certificates and timeouts come from the configuration of Dask.

    Raises ValueError, one line, if Dask is not installed or the scheduler does not answer.
    """
    try:
        import dask  # noqa: PLC0415 - an extra, and slow to import
        from distributed import Client  # noqa: PLC0415
    except ImportError as error:
        raise ValueError(f"--scheduler needs Dask distributed ({error}): {_REMEDY}") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # one line is said here
    with contextlib.ExitStack() as stack:
        stack.enter_context(dask.config.set({"distributed.comm.timeouts.connect": _AWAY}))
        try:
            asyncio.run(_reach(address))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # versions are compared by `compare`
                client = Client(address, timeout=_AWAY, set_as_default=False)
        except (OSError, ValueError, TypeError, asyncio.TimeoutError) as error:
            cause = " ".join(str(error).split())[:200]
            raise ValueError(f"{address}: no scheduler answers: {cause}") from None
        stack.callback(client.close, timeout=_CLOSING)
        yield Cluster(address, client)


_COUNT = 1.0
"""Interval at which workers are counted, s."""
_LARGEST_BATCH = 16
"""Most tasks per batch: handing out then costs less than a millisecond per task."""
_BATCHES_A_THREAD = 2
"""Batches assigned to a thread: it never waits, and its death loses little."""
_SHARES = 4
"""Batches per thread into which the remaining tasks are divided: batches shrink towards the end, so
that all workers finish together."""


@dataclass(frozen=True)
class _Batch(Generic[_Task]):
    tasks: tuple[_Task, ...]
    future: Any
    is_alone: bool


class _Run(Generic[_Task, _Answer]):
    """The tasks of one call: waiting, handed out, or suspected of killing a worker."""

    def __init__(
        self, cluster: Cluster, work: Callable[[_Task], _Answer], tasks: Iterable[_Task]
    ) -> None:
        self._cluster = cluster
        self._work = work
        self._waiting = deque(tasks)
        self._suspects: deque[_Task] = deque()
        self._out: dict[str, _Batch[_Task]] = {}
        self._ready: SimpleQueue[str] = SimpleQueue()
        self._threads = 0
        self._counted = -_COUNT
        self._last_worker = time.monotonic()

    def is_over(self) -> bool:
        return not (self._waiting or self._suspects or self._out)

    def _count_threads(self) -> None:
        """Count the threads of the workers now and then; give up after too long without any."""
        now = time.monotonic()
        if now - self._counted < _COUNT:
            return
        self._threads = self._cluster.threads()
        self._counted = now
        if self._threads:
            self._last_worker = now
        elif now - self._last_worker > NO_WORKER:
            raise ValueError(self._cluster.without_workers())

    def _hand_out(self, tasks: Sequence[_Task], is_alone: bool = False) -> None:
        payload = call(answers, __version__, self._work, tuple(tasks))
        key = f"identify-{uuid.uuid4()}"
        future = self._cluster.client.submit(pickle.loads, payload, key=key, pure=False)
        self._out[key] = _Batch(tuple(tasks), future, is_alone)
        future.add_done_callback(lambda done: self._ready.put(done.key))

    def fill(self) -> None:
        """Hand out as many batches as the workers can hold."""
        self._count_threads()
        while self._waiting and len(self._out) < _BATCHES_A_THREAD * self._threads:
            share = len(self._waiting) // (_SHARES * self._threads)
            size = max(1, min(_LARGEST_BATCH, share))
            self._hand_out([self._waiting.popleft() for _ in range(size)])
        if self._suspects and not self._waiting and not self._out:
            self._hand_out([self._suspects.popleft()], is_alone=True)

    def answered(self) -> Iterator[tuple[_Task, _Answer | DeadWorker]]:
        """Yield the tasks and answers of the next finished batch; nothing after a short wait."""
        try:
            key = self._ready.get(timeout=_LOOK_UP)
        except Empty:
            self._cluster.require_scheduler()
            return
        batch = self._out[key]
        try:
            found: list[_Answer | DeadWorker] = batch.future.result(timeout=_COUNT)
        except (TimeoutError, asyncio.TimeoutError):  # its worker died, and Dask repeats the batch
            self._ready.put(key)
            return
        except ImportError as error:
            raise ValueError(self._cluster.differs(str(error))) from None
        except Exception as error:  # noqa: BLE001 - whatever becomes of a worker
            self._cluster.require_scheduler()
            if batch.future.status in ("cancelled", "lost"):
                raise ValueError(self._cluster.gone()) from None
            if not batch.is_alone:
                del self._out[key]
                self._suspects.extend(batch.tasks)
                return
            found = [DeadWorker(_cause(error))]
        del self._out[key]
        batch.future.release()
        yield from zip(batch.tasks, found, strict=True)

    def cancel(self) -> None:
        """Cancel the batches that are handed out."""
        with contextlib.suppress(Exception):
            self._cluster.client.cancel([batch.future for batch in self._out.values()], force=True)


def _cause(error: Exception) -> str:
    """Return in one line why a task that was tried alone failed."""
    from distributed import KilledWorker  # noqa: PLC0415 - an extra

    if isinstance(error, KilledWorker):
        times = error.allowed_failures + 1
        where = error.last_worker.address
        return (
            f"its worker process died {numbered(times, 'time')}, last on {where}, perhaps because "
            "the machine ran out of memory"
        )
    return " ".join(f"unexpected {type(error).__name__} of its worker: {error}".split())


def in_cluster(
    cluster: Cluster,
    work: Callable[[_Task], _Answer],
    tasks: Iterable[_Task],
    stopped: Callable[[], bool],
) -> Iterator[tuple[_Task, _Answer | DeadWorker]]:
    """Yield tasks with their answers, or a `DeadWorker`, as they finish on a cluster's workers.

    `work` is a function of a module that the workers can import. Once `stopped` returns True, no
    more tasks are handed out and waiting tasks are given up; a worker finishes its present batch.

    Raises ValueError if the scheduler goes, no worker is left, or a worker cannot do the work.
    """
    run = _Run(cluster, work, tasks)
    try:
        while not run.is_over() and not stopped():
            run.fill()
            yield from run.answered()
    finally:
        run.cancel()
