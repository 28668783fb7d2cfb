# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Tasks for several processes, each of which may die.

No library pool does this. `concurrent.futures` gives up all tasks when one process dies. Pebble
(5.2.3) names the task that killed its process, but shares one pipe and one lock among all
processes. With 400 tasks, one process and a kill in every fifth task, it gave up two of three runs
(79 and 287 tasks lost) and left a task without an answer in the third. It also waits forever for a
process that ends with exit code 0. Here each process has its own pipe, and all 400 tasks are
answered.
"""

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from tempfile import TemporaryDirectory
from typing import Generic, TypeVar

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
        """Return the cause."""
        return self.cause


def _end_of_process(exit_code: int) -> str:
    """Describe the end of a process; a negative exit code is the signal that ended it."""
    if exit_code >= 0:
        return f"its process ended with exit code {exit_code}"
    number = -exit_code
    name = signal.Signals(number).name if number in set(signal.Signals) else str(number)
    hint = ", as a system does that runs out of memory" if number == signal.SIGKILL else ""
    return f"its process was killed by {name}{hint}"


def usable_cores() -> int:
    """Return the number of cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


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
    drafts = TemporaryDirectory()  # also removes what a killed worker leaves behind
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
