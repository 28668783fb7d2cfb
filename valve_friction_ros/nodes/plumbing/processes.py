# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Work in separate processes, which end when idle and may crash without harm to the node.

Identification and drawing hold more memory than the rest of a node, and are seldom active.
"""

import contextlib
import ctypes
import gc
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable
from importlib import import_module
from typing import Any, TypeVar

from valve_friction_ros.identification.refusal import RefusalError

_Result = TypeVar("_Result")

_Child = subprocess.Popen[bytes]

_KEPT = 10.0
"""Time, s, for which an idle process waits for more work. A process holds up to 280 MB, and its
start takes a second of processor time."""


_MALLOC = {-8: 2, -3: 131_072, -1: 131_072}
"""M_ARENA_MAX, M_MMAP_THRESHOLD (bytes) and M_TRIM_THRESHOLD (bytes) of malloc.h."""


def keep_little_memory() -> None:
    """Make all threads share two arenas of glibc, which return free memory at once.

    With one arena per thread the dashboard took 50 MB more, and served pages kept 10 MB. The price
    is that large arrays cost more time. Without glibc nothing is done.
    """
    with contextlib.suppress(AttributeError, OSError):
        mallopt = ctypes.CDLL(None).mallopt
        for option, value in _MALLOC.items():
            mallopt(option, value)


def give_back_memory() -> None:
    """Return free memory to the system, after rare work that took a lot of it.

    Without glibc nothing is done.
    """
    with contextlib.suppress(AttributeError, OSError):
        ctypes.CDLL(None).malloc_trim(0)


class ElsewhereError(Exception):
    """Cause of an exception raised in another process: its traceback, file and line."""

    file = ""
    line = 0


def imported(module: str, name: str, *arguments: Any) -> Any:
    """Import a module in the process of this call, and call a function of it."""
    return getattr(import_module(module), name)(*arguments)


class Processes:
    """Processes that start on demand and end some seconds after their last job.

    They are spawned, not forked: a fork would keep the locks of the middleware's threads without
    the threads. They end with this process, however it ends.
    """

    def __init__(self) -> None:
        self._free: dict[_Child, threading.Timer] = {}
        self._all: set[_Child] = set()
        self._lock = threading.Lock()

    def done(self, work: Callable[..., _Result], *arguments: Any) -> _Result:
        """Run `work`, a function of a module, in a process while this thread waits.

        Raises the exception of `work`, or RefusalError if the process dies.
        """
        child = self._taken()
        try:
            result, error, told = _done_by(child, work, arguments)
        except (EOFError, OSError, pickle.UnpicklingError):
            self._end(child)
            raise RefusalError(
                "the identification process ended before it answered, possibly because the system "
                "ran out of memory: identify again"
            ) from None
        except BaseException:
            self._end(child)
            raise
        self._give_back(child)
        if error is not None:
            raise error from told
        answer: _Result = result
        return answer

    def end(self) -> None:
        """End all processes, including their present work."""
        for child in [*self._all]:
            self._end(child)

    def _taken(self) -> _Child:
        """Return the idle process that has worked most recently, or a new process."""
        with self._lock:
            if self._free:
                child, end_later = self._free.popitem()
                end_later.cancel()
            else:
                child = _started()
                self._all.add(child)
            return child

    def _give_back(self, child: _Child) -> None:
        end_later = threading.Timer(_KEPT, self._end_if_free, [child])
        end_later.daemon = True
        with self._lock:
            self._free[child] = end_later
        end_later.start()

    def _end_if_free(self, child: _Child) -> None:
        with self._lock:
            is_free = self._free.pop(child, None) is not None
        if is_free:
            self._end(child)

    def _end(self, child: _Child) -> None:
        with self._lock:
            self._all.discard(child)
        child.kill()
        with contextlib.suppress(OSError):  # it ended with output left to read
            child.communicate()


def _started() -> _Child:
    """Start a process that runs one job after the other from its input."""
    return subprocess.Popen(
        [sys.executable, "-m", __name__],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(map(os.path.abspath, sys.path))},
        start_new_session=True,  # Ctrl-C is for the parent
    )


def _done_by(child: _Child, work: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """Return the result of a job in a child, or its exception and where it was raised."""
    assert child.stdin is not None and child.stdout is not None  # noqa: PT018, S101
    pickle.dump(_packed((work, arguments)), child.stdin)
    child.stdin.flush()
    return pickle.loads(pickle.load(child.stdout))  # noqa: S301 - of this package's process


def _packed(what: object) -> bytes:
    return pickle.dumps(what, pickle.HIGHEST_PROTOCOL)


def _answered(wanted: bytes) -> bytes:
    """Run a pickled job; return the result, or the exception and where it was raised."""
    try:
        work, arguments = pickle.loads(wanted)  # noqa: S301 - of the node that started this
        return _packed((work(*arguments), None, None))
    except Exception as error:  # noqa: BLE001 - it is the caller's
        place = traceback.extract_tb(error.__traceback__)[-1]
        told = ElsewhereError("".join(traceback.format_exception(error)))
        told.file, told.line = place.filename, place.lineno or 0
        return _packed((None, error, told))


def serve() -> None:
    """Run the jobs from the input one after the other, until it closes with the parent."""
    for request in (signal.SIGINT, signal.SIGTERM):  # for the parent
        signal.signal(request, signal.SIG_IGN)
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # keeps printed text out of the answers
    wanted: queue.SimpleQueue[bytes] = queue.SimpleQueue()

    def listen() -> None:
        with contextlib.suppress(EOFError, pickle.UnpicklingError):
            while True:
                wanted.put(pickle.load(sys.stdin.buffer))  # noqa: S301 - of the node
        os._exit(0)

    threading.Thread(target=listen, daemon=True).start()
    while True:
        pickle.dump(_answered(wanted.get()), answers)
        answers.flush()
        gc.collect()  # what a report has drawn refers to itself: 40 MB


if __name__ == "__main__":
    # Imported by name, so that its classes are those of the parent.
    import_module("valve_friction_ros.nodes.plumbing.processes").serve()
