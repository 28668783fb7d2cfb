"""The same tasks on the workers of a Dask cluster, which may die too.

Answers are taken batch by batch and released, as Dask would do again the work of a dead worker
whose answers are still wanted. What a dead worker had, Dask hands to another one, and gives up
after `allowed-failures` deaths. A batch that is given up hides which of its tasks did it, and it
takes those with it that waited beside it. So all these tasks are tried again one by one, at the
end, with nothing beside them.
"""

import asyncio
import contextlib
import pickle
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any, Generic, TypeVar

from valve_friction_ros import __version__
from valve_friction_ros.fleet.sharing.cluster import NO_WORKER, Cluster
from valve_friction_ros.fleet.sharing.processes import DeadWorker
from valve_friction_ros.fleet.sharing.remote_calls import answers, call

__all__ = ["in_cluster"]

_Task = TypeVar("_Task")
_Answer = TypeVar("_Answer")

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
