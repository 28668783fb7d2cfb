"""Work in processes of its own, each of which may die."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from typing import ParamSpec, TypeVar

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.nodes.plumbing.worker import Worker

__all__ = ["ProcessWorker"]

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


def _begin() -> None:
    """Leave Ctrl-C to the parent, and end with it, however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def follow() -> None:
        if (parent := multiprocessing.parent_process()) is not None:
            parent.join()
        os._exit(0)

    threading.Thread(target=follow, name="parent", daemon=True).start()


class ProcessWorker(Worker):
    """Threads, each of which has its work done by a process of its own.

    The processes are started anew, not forked: a fork would hold the locks of the middleware's
    threads, and not the threads. Each thread has a pool of a single process, because a pool gives
    up the work of all its processes when one of them dies.

    Parameters
    ----------
    name : str
        Name of the threads.
    processes : int
        Number of processes.
    prepare : callable
        What each process does first, a function of a module.
    """

    def __init__(self, name: str, processes: int, prepare: Callable[[], object]) -> None:
        self._own = threading.local()
        super().__init__(name, prepare, threads=processes)

    def submit(
        self,
        work: Callable[_Arguments, _Result],
        /,
        *arguments: _Arguments.args,
        **named: _Arguments.kwargs,
    ) -> Future[_Result]:
        """Do some work, a function of a module, in the first process that is free.

        Its future raises RefusalError if the process dies.
        """
        return super().submit(lambda: self._done_by_process(partial(work, *arguments, **named)))

    def _done_by_process(self, work: Callable[[], _Result]) -> _Result:
        pool: ProcessPoolExecutor | None = getattr(self._own, "pool", None)
        if pool is None:
            context = multiprocessing.get_context("spawn")
            pool = self._own.pool = ProcessPoolExecutor(1, context, _begin)
        try:
            return pool.submit(work).result()
        except BrokenProcessPool:
            self._own.pool = None
            pool.shutdown(wait=False)
            raise RefusalError(
                "the process of the identification has ended before its answer, as the system ends "
                "one when the memory is used up: identify again"
            ) from None
