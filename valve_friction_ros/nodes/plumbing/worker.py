"""Threads for work that takes its time: how long it has lasted, and how the process ends."""

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, ParamSpec, TypeVar
from weakref import WeakSet

__all__ = ["Worker", "workers_have_ended"]

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")

_PAUSE = 0.02


class Worker(ThreadPoolExecutor):
    """A thread that does one thing after the other, or some threads that share what is to be done.

    Parameters
    ----------
    name : str
        Name of the thread.
    prepare : callable, optional
        What each thread does first.
    finishes : bool
        Whether the end of the process waits a little for what has been submitted.
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
        wanted = () if prepare is None else (prepare,) * threads
        self._preparations = [self.submit(one) for one in wanted]
        _workers.add(self)

    def submit(
        self,
        work: Callable[_Arguments, _Result],
        /,
        *arguments: _Arguments.args,
        **named: _Arguments.kwargs,
    ) -> Future[_Result]:
        """Do some work when all that was submitted before is done, or begun by other threads."""

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
        """Whether something is being done, or waits to be."""
        return bool(self._unfinished)

    @property
    def is_preparing(self) -> bool:
        """Whether what the threads do first is not done yet."""
        return not all(one.done() for one in self._preparations)

    def busy_for(self) -> float:
        """Return how long the longest work under way has lasted, s; 0 if there is none."""
        begun = [*self._begun.values()]
        return time.monotonic() - min(begun) if begun else 0.0


_workers: WeakSet[Worker] = WeakSet()


def workers_have_ended(patience: float) -> bool:
    """Let the workers that finish their work do so for `patience` seconds; tell if none is busy."""
    deadline = time.monotonic() + patience
    while any(one.finishes and one.is_busy for one in _workers) and time.monotonic() < deadline:
        time.sleep(_PAUSE)
    return not any(one.is_busy for one in _workers)
