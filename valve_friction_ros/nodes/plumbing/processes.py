# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Work in processes of its own, which end when there is none, and each of which may die.

What identifies and what draws holds more memory than all the rest of a node, and seldom works.
"""

import contextlib
import ctypes
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

from valve_friction_ros.identification import RefusalError

_Result = TypeVar("_Result")

_KEPT = 10.0
"""Time, s, for which a process waits for more work. It holds some 240 MB, and its start takes a
second of processor time."""


_MALLOC = {-8: 2, -3: 131_072, -1: 131_072}
"""M_ARENA_MAX, M_MMAP_THRESHOLD (bytes) and M_TRIM_THRESHOLD (bytes) of malloc.h."""


def keep_little_memory() -> None:
    """Let all threads share two arenas of glibc's memory, and give back what is free at once.

    An arena a thread took the dashboard 50 MB more, and kept pages of the browser 10 MB. Large
    arrays cost more time then. Elsewhere than with glibc nothing is done.
    """
    with contextlib.suppress(AttributeError, OSError):
        mallopt = ctypes.CDLL(None).mallopt
        for option, value in _MALLOC.items():
            mallopt(option, value)


def give_back_memory() -> None:
    """Give back what is free now: after work that took much and is seldom done.

    Elsewhere than with glibc nothing is done.
    """
    with contextlib.suppress(AttributeError, OSError):
        ctypes.CDLL(None).malloc_trim(0)


class ElsewhereError(Exception):
    """The cause of an exception that another process has raised: its traceback, file and line."""

    file = ""
    line = 0


def imported(module: str, name: str, *arguments: Any) -> Any:
    """Call a function of a module that is imported where it is called."""
    return getattr(import_module(module), name)(*arguments)


class ThisProcess:
    """Does work where it is called."""

    def done(self, work: Callable[..., _Result], *arguments: Any) -> _Result:
        """Do some work; return what it returns, and raise what it raises."""
        return work(*arguments)

    def end(self) -> None:
        """Do no more work."""


class _Child:
    """A process that does one work after the other, as its input tells it to."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", __name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(map(os.path.abspath, sys.path))},
            start_new_session=True,  # Ctrl-C is the parent's
        )
        self.end_later: threading.Timer | None = None

    def done(self, work: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        """Have some work done; return what it returns, or the exception that it raises, and which.

        Raises EOFError or OSError if the child dies.
        """
        process = self._process
        assert process.stdin is not None and process.stdout is not None  # noqa: PT018, S101
        pickle.dump(_packed((work, arguments)), process.stdin)
        process.stdin.flush()
        return pickle.loads(pickle.load(process.stdout))  # noqa: S301 - of this package's process

    def end(self) -> None:
        self._process.kill()
        with contextlib.suppress(OSError):  # it has ended with something left to read
            self._process.communicate()


class Processes(ThisProcess):
    """Processes that are started when there is work, and end some seconds after the last one.

    They are started anew, not forked: a fork would hold the locks of the middleware's threads, and
    not the threads. They end with this process, however it ends.
    """

    def __init__(self) -> None:
        self._free: list[_Child] = []
        self._all: set[_Child] = set()
        self._lock = threading.Lock()

    def done(self, work: Callable[..., _Result], *arguments: Any) -> _Result:
        """Have some work done, a function of a module, while this thread waits.

        Raises what it raises, and RefusalError if its process dies.
        """
        child = self._taken()
        try:
            result, error, told = child.done(work, arguments)
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
        """End all processes, with what they do."""
        for child in [*self._all]:
            self._end(child)

    def _taken(self) -> _Child:
        """Return the process that has worked last, of those that are free, or a new one."""
        with self._lock:
            while self._free:
                child = self._free.pop()
                assert child.end_later is not None  # noqa: S101 - it waits for its end
                child.end_later.cancel()
                return child
            child = _Child()
            self._all.add(child)
            return child

    def _give_back(self, child: _Child) -> None:
        child.end_later = threading.Timer(_KEPT, self._end_if_free, [child])
        child.end_later.daemon = True
        with self._lock:
            self._free.append(child)
        child.end_later.start()

    def _end_if_free(self, child: _Child) -> None:
        with self._lock:
            if child not in self._free:
                return
            self._free.remove(child)
        self._end(child)

    def _end(self, child: _Child) -> None:
        with self._lock:
            self._all.discard(child)
        child.end()


def _packed(what: object) -> bytes:
    return pickle.dumps(what, pickle.HIGHEST_PROTOCOL)


def _answered(wanted: bytes) -> bytes:
    """Do what is wanted; return the result, or the exception and where it was raised."""
    try:
        work, arguments = pickle.loads(wanted)  # noqa: S301 - of the node that started this
        return _packed((work(*arguments), None, None))
    except Exception as error:  # noqa: BLE001 - it is the caller's
        place = traceback.extract_tb(error.__traceback__)[-1]
        told = ElsewhereError("".join(traceback.format_exception(error)))
        told.file, told.line = place.filename, place.lineno or 0
        return _packed((None, error, told))


def serve() -> None:
    """Do what the input says, one after the other, until it ends with the parent."""
    for request in (signal.SIGINT, signal.SIGTERM):  # they are the parent's
        signal.signal(request, signal.SIG_IGN)
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what the work prints is no answer
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


if __name__ == "__main__":
    # So that its classes are those of the parent.
    import_module("valve_friction_ros.nodes.plumbing.processes").serve()
