# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Tasks for the workers of a Dask cluster, which may die.

What is sent is the name of a function and what it is given, pickled once more, so that only a
worker opens it: the scheduler needs Dask and nothing of this package.

Answers are taken batch by batch and released, as Dask would do again the work of a dead worker
whose answers are still wanted. What a dead worker had, Dask hands to another one, and gives up
after `allowed-failures` deaths. A batch that is given up hides which of its tasks did it, and it
takes those with it that waited beside it. So all these tasks are tried again one by one, at the
end, with nothing beside them.
"""

import asyncio
import contextlib
import logging
import pickle
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
from queue import Empty, SimpleQueue
from typing import Any, Generic, TypeVar

from valve_friction_ros import __version__
from valve_friction_ros.fleet.processes import DeadWorker

PACKAGE = "valve_friction_ros"


_Task = TypeVar("_Task")
_Answer = TypeVar("_Answer")

_COMPARED = ("numpy", "scipy", "numba", "distributed")
"""Libraries whose version matters: those that calculate, as it may change the last digits."""

_ALONE = threading.Lock()
"""One batch at a time in a process: figures are drawn by a library that is not made for threads."""


class _Call:
    """Becomes the value of a function where it is unpickled."""

    def __init__(self, function: Callable[..., Any], arguments: tuple[object, ...]) -> None:
        self._call = (function, arguments)

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[object, ...]]:
        """Give the call."""
        return self._call


def call(function: Callable[..., Any], *arguments: object) -> bytes:
    """Return bytes from which `pickle.loads` makes the value of a function, where it is called."""
    return pickle.dumps(_Call(function, arguments))


def versions() -> dict[str, str]:
    """Return the versions of this process that matter to results."""
    found = {PACKAGE: __version__}
    for name in _COMPARED:
        with contextlib.suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


@contextlib.contextmanager
def _drafts_of_worker() -> Iterator[None]:
    """Have temporary files in the worker's folder, which Dask clears when the worker was killed."""
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
    """Answer a batch, on a worker of the same version as whoever asks.

    Raises ImportError if it is another one.
    """
    if version != __version__:  # a worker that came after they were compared
        raise ImportError(f"{socket.gethostname()} has {PACKAGE} {__version__}")
    with _ALONE, _drafts_of_worker():
        return [work(task) for task in tasks]


_REMEDY = "run `pip install 'distributed>=2026.8'` (the extra `cluster`)"
NO_WORKER = 30.0
"""How long a worker is waited for while there is none, s."""
_AWAY = 10.0
"""How long a scheduler is waited for, s."""
_CLOSING = 2.0
"""How long the connection may take to close, s."""


class Cluster:
    """A Dask cluster at the other end of a connection.

    Attributes
    ----------
    address : str
        Of its scheduler.
    client : distributed.Client
        The connection.
    """

    def __init__(self, address: str, client: Any) -> None:
        self.address = address
        self.client = client

    def gone(self) -> str:
        """Say that the scheduler has gone."""
        return f"{self.address}: the scheduler has gone: once it is back, the same command goes on"

    def differs(self, cause: str) -> str:
        """Say that a worker cannot do the work."""
        return (
            f"{self.address}: a worker is unlike this machine ({cause}): install {PACKAGE} "
            f"{__version__} with the same extras on all of them"
        )

    def without_workers(self) -> str:
        """Say that there is no worker."""
        return (
            f"{self.address}: no worker has come in {NO_WORKER:g} s: start some by "
            f"`dask worker {self.address} --nthreads 1`"
        )

    def require_scheduler(self) -> None:
        """Refuse to go on without the scheduler."""
        if self.client.status != "running":
            raise ValueError(self.gone())

    def threads(self) -> int:
        """Count the threads of all workers."""
        try:
            return sum(self.client.nthreads().values())
        except (OSError, asyncio.TimeoutError):
            raise ValueError(self.gone()) from None

    def compare(self) -> list[str]:
        """Refuse workers without this package or with another version of it; return other unlikes.

        Raises ValueError if there is no worker.
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
    """Connect and part again: a `Client` that cannot connect leaves threads that may lock up."""
    from distributed import Security  # noqa: PLC0415 - an extra
    from distributed.comm import connect  # noqa: PLC0415

    comm = await connect(address, timeout=_AWAY, **Security().get_connection_args("client"))
    await comm.close()


@contextlib.contextmanager
def cluster_at(address: str) -> Iterator[Cluster]:
    """Connect to the scheduler of a Dask cluster, ``tcp://host:port`` or ``tls://host:port``.

    Certificates and limits of time are those of Dask's own configuration.

    Raises ValueError, one line, if Dask is not installed, or the scheduler does not answer.
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


_LOOK_UP, _COUNT = 0.1, 1.0
"""How often the wish to stop is looked at, and the workers are counted, s."""
_LARGEST_BATCH = 16
"""Most tasks handed out together: what handing out costs is then below a millisecond each."""
_BATCHES_A_THREAD = 2
"""Batches that a thread has or waits for: it never waits, and little is lost with it."""
_SHARES = 4
"""Batches get smaller to the end, so that all workers end together: each thread has some left."""


@dataclass(frozen=True)
class _Batch(Generic[_Task]):
    tasks: tuple[_Task, ...]
    future: Any
    is_alone: bool


class _Run(Generic[_Task, _Answer]):
    """The tasks of one call: those that wait, those handed out, and those under suspicion."""

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
        """Count the threads of the workers, now and then; refuse to wait for them without end."""
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
        """Hand out what the workers can hold."""
        self._count_threads()
        while self._waiting and len(self._out) < _BATCHES_A_THREAD * self._threads:
            share = len(self._waiting) // (_SHARES * self._threads)
            size = max(1, min(_LARGEST_BATCH, share))
            self._hand_out([self._waiting.popleft() for _ in range(size)])
        if self._suspects and not self._waiting and not self._out:
            self._hand_out([self._suspects.popleft()], is_alone=True)

    def answered(self) -> Iterator[tuple[_Task, _Answer | DeadWorker]]:
        """Take the next batch that is done, if one is soon."""
        try:
            key = self._ready.get(timeout=_LOOK_UP)
        except Empty:
            self._cluster.require_scheduler()
            return
        batch = self._out[key]
        try:
            found: list[_Answer | DeadWorker] = batch.future.result(timeout=_COUNT)
        except (TimeoutError, asyncio.TimeoutError):  # its worker died with it: it is done again
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
        """Give up what is handed out."""
        with contextlib.suppress(Exception):
            self._cluster.client.cancel([batch.future for batch in self._out.values()], force=True)


def _cause(error: Exception) -> str:
    """Say in one line what became of a task that was tried by itself."""
    from distributed import KilledWorker  # noqa: PLC0415 - an extra

    if isinstance(error, KilledWorker):
        times = error.allowed_failures + 1
        where = error.last_worker.address
        return (
            f"the process of its worker died {times} times, last that of {where}, as it does on a "
            "machine that runs out of memory"
        )
    return " ".join(f"unexpected {type(error).__name__} of its worker: {error}".split())


def in_cluster(
    cluster: Cluster,
    work: Callable[[_Task], _Answer],
    tasks: Iterable[_Task],
    stopped: Callable[[], bool],
) -> Iterator[tuple[_Task, _Answer | DeadWorker]]:
    """Yield tasks with their answers, or a `DeadWorker`, as they finish on a cluster's workers.

    `work` is a function of a module that the workers have too. Once `stopped` returns True nothing
    more is handed out, and what waits is given up; a worker ends the batch that it has.

    Raises ValueError if the scheduler goes, no worker is left, or one cannot do the work.
    """
    run = _Run(cluster, work, tasks)
    try:
        while not run.is_over() and not stopped():
            run.fill()
            yield from run.answered()
    finally:
        run.cancel()
