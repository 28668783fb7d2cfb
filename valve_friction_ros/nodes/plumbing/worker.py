"""Threads for work that takes its time: how long it has lasted, and how the process ends."""

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
    """One thread that does one thing after the other.

    Parameters
    ----------
    name : str
        Name of the thread.
    prepare : callable, optional
        What it does first.
    finishes : bool
        Whether the end of the process waits a little for what has been submitted.
    """

    def __init__(
        self, name: str, prepare: Callable[[], object] | None = None, finishes: bool = False
    ) -> None:
        super().__init__(max_workers=1, thread_name_prefix=name)
        self.finishes = finishes
        self._last: Future[Any] | None = None
        self._begun: float | None = None
        self._preparation = None if prepare is None else self.submit(prepare)
        _workers.add(self)

    def submit(
        self,
        work: Callable[_Arguments, _Result],
        /,
        *arguments: _Arguments.args,
        **named: _Arguments.kwargs,
    ) -> Future[_Result]:
        """Do some work when all that was submitted before is done."""

        def timed() -> _Result:
            self._begun = time.monotonic()
            try:
                return work(*arguments, **named)
            finally:
                self._begun = None

        future = super().submit(timed)
        self._last = future
        return future

    @property
    def is_busy(self) -> bool:
        """Whether something is being done, or waits to be."""
        return self._last is not None and not self._last.done()

    @property
    def is_preparing(self) -> bool:
        """Whether what it does first is not done yet."""
        return self._preparation is not None and not self._preparation.done()

    def busy_for(self) -> float:
        """Return how long the work under way has lasted, s; 0 if there is none."""
        begun = self._begun
        return 0.0 if begun is None else time.monotonic() - begun


_workers: WeakSet[Worker] = WeakSet()


def workers_have_ended(patience: float) -> bool:
    """Let the workers that finish their work do so for `patience` seconds; tell if none is busy."""
    deadline = time.monotonic() + patience
    while any(one.finishes and one.is_busy for one in _workers) and time.monotonic() < deadline:
        time.sleep(_PAUSE)
    return not any(one.is_busy for one in _workers)
