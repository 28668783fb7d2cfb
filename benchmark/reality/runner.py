"""All cases tried in a pool of processes, each answer on its way as soon as it is there."""

import multiprocessing
import time
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from benchmark.reality.answers import Outcome
from benchmark.reality.records import Case
from benchmark.reality.trial import Trials, failed

__all__ = ["run"]

_PATIENCE = 10.0
_START = 1800.0
"""A process is given up after this multiple of the limit, by the clock, and the time, s, in which
it starts and makes its records on a busy machine."""

_POLL = 1.0

_Group = deque[Case]


def _work(module: str, limit: float, connection: Connection) -> None:
    """Try what comes until nothing more does."""
    trials = Trials(module, limit)
    while (case := connection.recv()) is not None:
        connection.send(trials.tried(case))


@dataclass
class _Worker:
    """A process, and the cases of one motion that it works through.

    Attributes
    ----------
    process : BaseProcess
        The process.
    connection : Connection
        To it.
    group : deque of Case
        What it has still to do, the case that it is busy with first.
    since : float
        When it began with that.
    """

    process: BaseProcess
    connection: Connection
    group: _Group
    since: float = 0.0

    def begin(self) -> None:
        """Send the next case, or the end."""
        self.connection.send(self.group[0] if self.group else None)
        self.since = time.monotonic()

    def end(self) -> None:
        """Stop the process, if it still runs."""
        self.process.terminate()
        self.process.join()
        self.connection.close()


def _started(module: str, limit: float, group: _Group) -> _Worker:
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_work, args=(module, limit, there), daemon=True)
    process.start()
    there.close()
    worker = _Worker(process, here, group)
    worker.begin()
    return worker


def _groups(cases: Sequence[Case]) -> deque[_Group]:
    """Cut the cases where another motion begins, so that one process makes it once."""
    return deque(
        deque(group)
        for _, group in groupby(cases, key=lambda one: (one.packing, one.excitation, one.seed))
    )


def _answer(worker: _Worker) -> Outcome | None:
    """Return the outcome of the case that a worker is busy with; None if it has died."""
    try:
        outcome: Outcome = worker.connection.recv()
    except EOFError:
        return None
    return outcome


def run(cases: Sequence[Case], module: str, processes: int, limit: float) -> Iterator[Outcome]:
    """Try all cases.

    Parameters
    ----------
    cases : sequence of Case
        In an order in which neighbours share their motion.
    module : str
        Name of a module with `identify` and `alarm`; see `answers.Identification`.
    processes : int
        How many at a time.
    limit : float
        Processor time for one identification, s.

    Yields
    ------
    Outcome
        As they come.
    """
    waiting = _groups(cases)
    workers: list[_Worker] = []
    try:
        while waiting or workers:
            while waiting and len(workers) < processes:
                workers.append(_started(module, limit, waiting.popleft()))
            ready = wait([worker.connection for worker in workers], timeout=_POLL)
            for worker in list(workers):
                late = time.monotonic() - worker.since > _PATIENCE * limit + _START
                if worker.connection not in ready and not late:
                    continue
                outcome = None if late else _answer(worker)
                if outcome is None:
                    workers.remove(worker)
                    worker.end()
                    case = worker.group.popleft()
                    yield failed(case, "stuck" if late else "the process died")
                    if worker.group:
                        waiting.appendleft(worker.group)
                    continue
                worker.group.popleft()
                if not worker.group and waiting:
                    worker.group = waiting.popleft()
                worker.begin()
                if not worker.group:
                    workers.remove(worker)
                    worker.process.join()
                yield outcome
    finally:
        for worker in workers:
            worker.end()
